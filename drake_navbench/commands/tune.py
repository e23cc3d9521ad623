"""Tunes a preset: `drake-navbench tune PRESET`."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    exit_status_of,
    listed_names,
    number_or_file,
    positive_number,
    whole_number,
)

EPILOG = """\
examples:
  drake-navbench tune rpp --scenarios doorway,one_obstacle \\
      --held-out static_obstacles --objectives time,clearance,jerk \\
      --out tuning/rpp
  drake-navbench tune --nav2 nav2_params.yaml --map map.yaml --goals 10 \\
      --parameter local_costmap.inflation_layer.inflation_radius=0.3:1.0 \\
      --quick --out tuning/mine

exit status: 0 done, 1 a trial ended in an error, 2 wrong input or a full disk,
130 interrupted (the same command goes on after a full disk or an interruption)
"""


class Size(NamedTuple):
    """Sizes of a search where no option gives them; see `_add_budget`."""

    configurations: int
    pairs: int
    fresh: int
    front: int


WHOLE, QUICK = Size(200, 32, 32, 8), Size(16, 8, 16, 2)


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench tune",
        description="Searches for parameters that beat a preset in several objectives at once,\n"
        "then judges them on fresh seeds and in scenarios that the search has not seen.\n"
        "A set that touches anything is dropped: to find such sets, every search also\n"
        "drives a closed corridor and random worlds.",
        epilog=EPILOG,
    )
    _add_subject(parser)
    _add_budget(parser)
    _add_running(parser)
    return parser


def _add_subject(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the search: preset, parameters, scenarios, objectives."""
    option = Options(parser)
    option(
        "preset",
        "preset to beat, such as rpp, or a variant of it",
        default="",
        metavar="PRESET",
        nargs="?",
    )
    option(
        "--nav2 FILE",
        "whole Nav2 file to beat, instead of PRESET; the result is a patch of it",
        Path,
    )
    option("--controller NAME", "controller of the file to tune (its only one)")
    option("--scenarios LIST", "scenarios to search in", listed_names, ())
    option(
        "--map FILE",
        "map to search on, with --nav2 and --goals; as many other tasks as --fresh says are "
        "held out",
        Path,
    )
    option(
        "--goals N|FILE",
        "number of tasks to draw on the map, or a file of places between which the search drives; "
        "the held-out tasks are drawn in both cases",
        number_or_file,
        0,
    )
    option(
        "--objectives LIST",
        "objectives: some of time, clearance, jerk, turning_jerk, path_error, length "
        "(time,clearance,jerk)",
        listed_names,
        ("time", "clearance", "jerk"),
    )
    option(
        "--held-out LIST",
        "scenarios in which the front is judged once, at the end",
        listed_names,
        (),
    )
    option(
        "--parameter NAME=VALUES ...",
        "parameter to search with its values, LOW:HIGH, LOW:HIGH:log or A,B,C, instead of the "
        "controller's own list; for a Nav2 file also parameters of other nodes, such as "
        "local_costmap.PARAMETER",
    )


def _add_budget(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the budget."""
    option = Options(parser)
    option(
        "--quick",
        "search of minutes, not hours: 16 configurations, 8 pairs, 16 fresh trials, a front of 2, "
        "unless given below",
    )
    option("--configurations N", "number of configurations to drive (200)", positive_number)
    option("--pairs N", "largest number of trials of a configuration (32)", positive_number)
    option(
        "--fresh N",
        "trials in each scenario, or other tasks on the map, in which the front is judged (32); "
        "more where so few can show nothing",
        partial(whole_number, least=2),
    )
    option(
        "--front N", "largest number of points of the front that are judged (8)", positive_number
    )


def _add_running(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the run: sampler, processes, output folder."""
    option = Options(parser)
    option("--seed SEED", "seed of the whole tuning (0)", whole_number, 0)
    option(
        "--sampler",
        "sampler that proposes configurations (tpe)",
        default="tpe",
        choices=("tpe", "nsga2", "random"),
    )
    option("--robot NAME|FILE", "robot that drives (wheelchair)", default="wheelchair")
    option("--jobs N", "parallel workers (all cores)", positive_number)
    option(
        "--out DIR",
        "folder of the study; further processes with the same command join it",
        Path,
        required=True,
    )
    option(
        "--search-only", "join the search as a further process, without the judgement at the end"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    given = list(sys.argv[2:] if argv is None else argv)
    arguments = build_parser().parse_args(given)
    command = shlex.join(["drake-navbench", "tune", *given])
    return exit_status_of(
        lambda: _tune(arguments, command), interrupted="interrupted; the same command goes on"
    )


def _tune(arguments: argparse.Namespace, command: str) -> None:
    from drake_navbench.processes.machine import available_cores
    from drake_navbench.studies.tuning.request import TuningRequest
    from drake_navbench.studies.tuning.tune import tune

    size = _size_of(arguments)
    request = TuningRequest(
        preset=arguments.preset,
        scenarios=arguments.scenarios,
        objectives=arguments.objectives,
        held_out=arguments.held_out,
        parameters=tuple(arguments.parameter),
        configurations=size.configurations,
        most_pairs=size.pairs,
        most_front_points=size.front,
        fresh=size.fresh,
        seed=arguments.seed,
        robot=arguments.robot,
        sampler=arguments.sampler,
        jobs=arguments.jobs or available_cores(),
        out=arguments.out.absolute(),
        command=command,
        nav2=arguments.nav2,
        plugin=arguments.controller,
        map_file=arguments.map,
        goals=arguments.goals,
        search_only=arguments.search_only,
    )
    tune(request, partial(print, flush=True))


def _size_of(arguments: argparse.Namespace) -> Size:
    """Returns the given sizes, completed by those of --quick or of a whole search."""
    given = {name: getattr(arguments, name) for name in Size._fields}
    size = QUICK if arguments.quick else WHOLE
    return size._replace(**{name: value for name, value in given.items() if value is not None})
