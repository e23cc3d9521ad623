"""Exports trials to other tools: `python -m drake_navbench export LOG|DIR --mcap`.

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


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m drake_navbench export",
        description="Writes trials as bags for Foxglove, Lichtblick, PlotJuggler, RViz and "
        "`ros2 bag play`, as tables, or as trajectories for evo.",
        epilog="exit status: 0 done, 1 a worker was ended from outside, 2 wrong input",
    )
    add = parser.add_argument
    add("source", type=Path, metavar="LOG|DIR", help="a trial's log, or a results folder: all")
    add("--mcap", action="store_true", help="a rosbag2 folder a trial (MCAP), and viewer layouts")
    add("--csv", action="store_true", help="the samples as comma-separated values")
    add("--tum", action="store_true", help="the true and the estimated trajectory")
    add("--out", type=Path, metavar="DIR", help="where to (DIR/export, or beside the log)")
    add("--jobs", type=_positive, default=2, metavar="N", help="parallel processes (2)")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    arguments = build_parser().parse_args(argv)
    from drake_navbench.recordings.export import Formats, export

    formats = Formats(mcap=arguments.mcap, csv=arguments.csv, tum=arguments.tum)
    try:
        written = export(arguments.source, formats, arguments.out, jobs=arguments.jobs)
    except NavbenchError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_WRONG_INPUT if isinstance(error, InputError) else EXIT_FAILED
    for path in written:
        print(path)
    return EXIT_DONE


def _positive(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a whole number of at least 1")
    return number


if __name__ == "__main__":
    sys.exit(main())
