"""Imports recordings of real robots: `drake-navbench import-bag BAG... --robot FILE`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, Options, command
from drake_navbench.errors import as_line
from drake_navbench.typed_files.assignments import assignments

if TYPE_CHECKING:
    from drake_navbench.ros2.recordings.simulation_gap import SimulationGap


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench import-bag",
        usage="%(prog)s BAG [BAG ...] --out DIR [OPTIONS]",
        description="Converts recordings (MCAP, rosbag2, ROS 1) of a real or simulated robot "
        "into trials, one for each goal that the robot was given, and measures "
        "them like any others.",
        epilog="exit status: 0 done, 1 a worker was ended from outside, 2 wrong input",
    )
    option = Options(parser)
    option("bags", "recording: a file, or a rosbag2 folder", Path, nargs="+", metavar="BAG")
    option(
        "--out DIR",
        "results folder to write into: a new one, or one with trials of the same task",
        Path,
        required=True,
    )
    option("--robot NAME|FILE", "robot with the outline and limits of the recorded one")
    option("--map FILE", "map of the place (the recording's /map)", Path)
    option(
        "--scenario NAME",
        "scenario to file the trials under (the bag's name; for a bag that `export` wrote: its "
        "scenario)",
        default="",
    )
    option(
        "--controller NAME",
        "column to file the trials under (recording; for a bag that `export` wrote: its "
        "column's name and -recording)",
        default="",
    )
    option(
        "--topics ROLE=TOPIC",
        "topic of a role: odom, truth, tf, tf_static, command, scan, plan, costmap, goal, map, "
        "status; an empty topic leaves the role out",
        default=[],
        nargs="+",
        action="extend",
    )
    option("--namespace NAME", "namespace of one robot of several")
    for name in ("start", "end"):
        help_text = f"{name} of one task cut by hand, seconds from the beginning of the recording"
        option(f"--{name} S", help_text, float)
    option("--fit-drive", "also estimate lag, acceleration limits and deadband of the drive")
    option("--no-report", "do not write report.html now; the report command writes it later")
    return parser


def _import(arguments: argparse.Namespace) -> None:
    from drake_navbench.logs.results import ResultsFolder
    from drake_navbench.ros2.recordings.import_bags import (
        ImportRequest,
        fit_path,
        import_recordings,
    )

    request = ImportRequest(
        robot=arguments.robot,
        map_file=arguments.map,
        topics=topics_of(arguments.topics),
        namespace=arguments.namespace,
        scenario=arguments.scenario,
        controller=arguments.controller,
        start_s=arguments.start,
        end_s=arguments.end,
        fits_drive=arguments.fit_drive,
    )
    folder = ResultsFolder(arguments.out)
    imported = import_recordings(arguments.bags, request, folder)
    for entry in imported:
        for loss in entry.losses:
            print(f"warning: {loss}", file=sys.stderr)
        for log in entry.logs:
            info = log.info
            told = f"{folder.path_of(log)}: {log.outcome}, {log.end_time_s:.1f} s: {info['reason']}"
            # Names of frames, and the header of an exported bag, may contain anything.
            print(as_line(told))
            for what, reason in info["missing"].items():
                print(as_line(f"  without {what}: {reason}"))
        _print_gaps(entry.gaps)
        if entry.fit is not None:
            path = fit_path(folder, entry)
            print(f"{path}:\n{path.read_text(encoding='utf-8')}", end="")
    if not arguments.no_report:
        from drake_navbench.analysis.report import build_report

        print(build_report(folder.path).path)


def _print_gaps(gaps: Sequence[SimulationGap | None]) -> None:
    for gap in gaps:
        if gap is not None and gap.poses:
            last = gap.poses[-1]
            print(
                f"  the model is off by {last.position_median_m:.3f} m and "
                f"{last.heading_median_deg:.1f} deg {last.horizon_s:g} s after a start (median of "
                f"{last.start_count}), by {gap.v_rms_mps:.3f} m/s and {gap.w_rms_radps:.3f} rad/s"
            )


def topics_of(texts: Sequence[str]) -> dict[str, str]:
    """Returns role -> topic for texts such as odom=/odom; raises InputError for other texts."""
    form = "ROLE=TOPIC, such as odom=/robot/odom"
    return assignments(texts, "--topics", form, may_be_empty=True)


main = command(build_parser, _import)
