"""Exports trials to other tools: `drake-navbench export LOG|DIR --mcap`."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    positive_number,
)


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench export",
        description="Writes trials as bags for Foxglove, Lichtblick, PlotJuggler, RViz and "
        "`ros2 bag play`, as tables, or as trajectories for evo.",
        epilog="exit status: 0 done, 1 a worker was ended from outside, 2 wrong input",
    )
    option = Options(parser)
    option(
        "source",
        "log of a trial, or a results folder for all of its trials",
        Path,
        metavar="LOG|DIR",
    )
    option("--mcap", "write each trial as a rosbag2 folder (MCAP), with layouts for viewers")
    option("--csv", "write the samples of each log as a table")
    option("--tum", "write the true and the estimated trajectory")
    option("--out DIR", "folder to write into (DIR/export, or beside the log)", Path)
    option("--jobs N", "parallel processes (2)", positive_number, 2)
    return parser


def _export(arguments: argparse.Namespace) -> None:
    from drake_navbench.ros2.recordings.export import Formats, export

    formats = Formats(mcap=arguments.mcap, csv=arguments.csv, tum=arguments.tum)
    for path in export(arguments.source, formats, arguments.out, jobs=arguments.jobs):
        print(path)


main = command(build_parser, _export)
