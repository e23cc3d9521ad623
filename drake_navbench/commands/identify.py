"""Identifies layout and settings from tables: `python -m drake_navbench identify`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from drake_navbench.command_line import (
    CommandParser,
    exit_status_of,
    listed_names,
    positive_number,
)

EPILOG = """\
examples:
  drake-navbench identify --budget 4h --out identification
  drake-navbench identify --budget 2h --seed 0,1 --out identification
  drake-navbench identify --controllers rpp,dwb --budget 200 \\
      --out identification

exit status: 0 done, 1 a trial came to no end, 2 wrong input, 130 interrupted
(the same command goes on)
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="python -m drake_navbench identify",
        usage="%(prog)s [OPTIONS] --budget N|TIME --out DIR",
        description="Searches the layouts and settings that the publication does not print for\n"
        "those that come nearest to a part of its tables, and tells how well they\n"
        "predict the part held out: each scenario and each controller in turn.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add(
        "--budget",
        required=True,
        metavar="N|TIME",
        help="of the search of a seed: evaluations (200), or time (40min, 4h)",
    )
    add("--scenarios", type=listed_names, default=(), metavar="LIST", help="of the tables (all)")
    add("--controllers", type=listed_names, default=(), metavar="LIST", help="of the tables (all)")
    add(
        "--leave-out",
        action="append",
        default=[],
        metavar="SCENARIO/METRIC/CONTROLLER",
        help="cells that nothing is fitted to, each part may be *; may be given again",
    )
    add("--tables", type=Path, metavar="FILE", help="CSV in place of the published tables")
    add("--unknowns", type=Path, metavar="FILE", help="what is searched (the shipped list)")
    add(
        "--trials",
        type=positive_number,
        default=4,
        metavar="N",
        help="trials of each prediction (4)",
    )
    add(
        "--rounds",
        type=positive_number,
        default=6,
        metavar="N",
        help="in which each fit has settings of its own driven, after those that all share (6)",
    )
    add(
        "--seed",
        default="0",
        metavar="N[,N...]",
        help="of searches and trials (0); with several all is done once with each, as if alone, "
        "and the page holds them side by side",
    )
    add("--robot", default="wheelchair", help="robot by name, or a YAML file (wheelchair)")
    add("--jobs", type=positive_number, default=None, metavar="N", help="workers (all cores)")
    add("--out", type=Path, required=True, metavar="DIR", help="where logs and page go")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    given = list(sys.argv[2:] if argv is None else argv)
    arguments = build_parser().parse_args(given)
    command = shlex.join(["python", "-m", "drake_navbench", "identify", *given])
    return exit_status_of(
        lambda: _identify(arguments, command),
        interrupted="interrupted; the same command goes on",
    )


def _identify(arguments: argparse.Namespace, command: str) -> None:
    from drake_navbench.identification.identify import IdentificationRequest, identify
    from drake_navbench.processes.machine import available_cores

    request = IdentificationRequest(
        tables=arguments.tables,
        unknowns=arguments.unknowns,
        scenarios=arguments.scenarios,
        controllers=arguments.controllers,
        leave_out=tuple(arguments.leave_out),
        budget=arguments.budget,
        trials=arguments.trials,
        rounds=arguments.rounds,
        seeds=arguments.seed,
        robot=arguments.robot,
        jobs=arguments.jobs or available_cores(),
        out=arguments.out.absolute(),
        command=command,
    )
    identify(request, partial(print, flush=True))


if __name__ == "__main__":
    sys.exit(main())
