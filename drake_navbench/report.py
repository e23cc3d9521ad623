"""The command line: `python -m drake_navbench.report DIR`.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_navbench.errors import InputError, NavbenchError

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_WRONG_INPUT = 2
PERCENT = 100.0


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m drake_navbench.report",
        description="Makes tables, figures and report.html of a results folder again, from its "
        "logs, without simulating.",
        epilog="exit status: 0 done, 1 a worker was ended from outside, 2 wrong input",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="a results folder")
    parser.add_argument(
        "--figures",
        choices=("none", "key", "all"),
        default="key",
        help="key: those that compare the controllers of a scenario; all: also the motion of each "
        "controller, and every figure as PNG (key)",
    )
    parser.add_argument("--jobs", type=_positive, default=2, help="parallel processes (2)")
    parser.add_argument(
        "--difference",
        type=_share,
        default=5.0,
        metavar="PERCENT",
        help="tell how many trials would show a difference of this size (5)",
    )
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    arguments = build_parser().parse_args(argv)
    from drake_navbench.analysis.figures.album import FigureChoice
    from drake_navbench.analysis.report import build_report
    from drake_navbench.inputs.presets import resolved_parameters

    try:
        result = build_report(
            arguments.folder,
            figures=FigureChoice(arguments.figures),
            jobs=arguments.jobs,
            difference=arguments.difference / PERCENT,
            parameters_of=resolved_parameters,
        )
    except NavbenchError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_WRONG_INPUT if isinstance(error, InputError) else EXIT_FAILED
    for entry in result.left_out:
        print(f"left out: {entry.path}: {entry.reason}", file=sys.stderr)
    print(f"{result.path}: {result.trial_count} trial{'s' if result.trial_count > 1 else ''}")
    return EXIT_DONE


def _positive(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number of at least 1")
    return number


def _share(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a percentage above 0")
    return number


if __name__ == "__main__":
    sys.exit(main())
