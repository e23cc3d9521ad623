"""Tunes a preset: `drake-navbench tune PRESET`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

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
    exit_status_of,
    listed_names,
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
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_subject(parser)
    _add_budget(parser)
    _add_running(parser)
    return parser


def _add_subject(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the search: preset, parameters, scenarios, objectives."""
    add = parser.add_argument
    add(
        "preset",
        metavar="PRESET",
        nargs="?",
        default="",
        help="preset to beat, such as rpp, or a variant of it",
    )
    add(
        "--nav2",
        type=Path,
        metavar="FILE",
        help="whole Nav2 file to beat, instead of PRESET; the result is a patch of it",
    )
    add("--plugin", metavar="NAME", help="controller of the file (its only one)")
    add("--scenarios", type=listed_names, default=(), metavar="LIST", help="scenarios to search in")
    add(
        "--map",
        type=Path,
        metavar="FILE",
        help="with --nav2: map to search on, with --goals; --fresh other tasks are held out",
    )
    add(
        "--goals",
        type=positive_number,
        default=0,
        metavar="N",
        help="number of tasks to draw on the map",
    )
    add(
        "--objectives",
        type=listed_names,
        default=("time", "clearance", "jerk"),
        metavar="LIST",
        help="objectives: some of time, clearance, jerk, turning_jerk, path_error, "
        "length (time,clearance,jerk)",
    )
    add(
        "--held-out",
        type=listed_names,
        default=(),
        metavar="LIST",
        help="scenarios in which the front is judged once, at the end",
    )
    add(
        "--parameter",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="parameter to search with its values, LOW:HIGH, LOW:HIGH:log or A,B,C, "
        "instead of the controller's own list; for a Nav2 file also parameters of "
        "other nodes, such as local_costmap.PARAMETER",
    )


def _add_budget(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the budget."""
    add = parser.add_argument
    add(
        "--quick",
        action="store_true",
        help="search of minutes, not hours: 16 configurations, 8 pairs, 16 fresh trials, a front "
        "of 2, unless given below",
    )
    add(
        "--configurations",
        type=positive_number,
        metavar="N",
        help="number of configurations to drive (200)",
    )
    add(
        "--pairs",
        type=positive_number,
        metavar="N",
        help="largest number of trials of a configuration (32)",
    )
    add(
        "--fresh",
        type=partial(whole_number, least=2),
        metavar="N",
        help="trials in each scenario, or other tasks on the map, in which the front is judged "
        "(32); more where so few can show nothing",
    )
    add(
        "--front",
        type=positive_number,
        metavar="N",
        help="largest number of points of the front that are judged (8)",
    )


def _add_running(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the run: sampler, processes, output folder."""
    add = parser.add_argument
    add("--seed", type=whole_number, default=0, help="seed of the whole tuning (0)")
    add(
        "--sampler",
        choices=("tpe", "nsga2", "random"),
        default="tpe",
        help="sampler that proposes configurations (tpe)",
    )
    add("--robot", default="wheelchair", help="robot by name, or a YAML file (wheelchair)")
    add(
        "--jobs",
        type=positive_number,
        default=None,
        metavar="N",
        help="parallel workers (all cores)",
    )
    add(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder of the study; further processes with the same command join it",
    )
    add(
        "--search-only",
        action="store_true",
        help="join the search as a further process, without the judgement at the end",
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
        plugin=arguments.plugin,
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


if __name__ == "__main__":
    sys.exit(main())
