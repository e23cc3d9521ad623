"""The options of `drake-navbench doctor`, and which of them go together."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import NoReturn

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    number_or_file,
    positive_number,
    whole_number,
)
from drake_navbench.errors import InputError
from drake_navbench.plugins.releases import Release

EPILOG = """\
examples:
  drake-navbench doctor nav2_params.yaml --robot turtlebot4 --read-only
  drake-navbench doctor nav2_params.yaml --robot turtlebot4 --out doctor/ \\
      --symptom wobble_straight --told "swings on the way to the goal"
  drake-navbench doctor nav2_params.yaml --robot turtlebot4 --out doctor/ \\
      --symptom collision --try FollowPath.CostCritic.consider_footprint=true
  drake-navbench doctor nav2_params.yaml --robot turtlebot4 --out doctor/ \\
      --symptom "it creeps the last half metre" --like k56wt
  drake-navbench doctor --package my_robot_ws/src --read-only
  drake-navbench doctor --score cases.yaml --files cases/ --page score.md

exit status: 0 done, 2 wrong input or a full disk, 130 interrupted (the results
so far are written; the same command goes on)
"""

# The robot that lends its base and lidar where the user names none.
LENT_ROBOT = "wheelchair"
OF_THE_FILE = (
    *("files", "robot", "packages", "controller", "nav2_release", "set", "package", "pick"),
)
# The options that each use of the command reads; a visit reads all others.
USED = {
    "score": ("files", "case_files", "page"),
    "log": ("files",),
    "measure_board": OF_THE_FILE,
    "read_only": (*OF_THE_FILE, "symptom", "told", "like", "bag", "topics"),
}


class _DoctorParser(CommandParser):
    """The parser of `doctor`; its error on words behind the options names --symptom."""

    def error(self, message: str) -> NoReturn:
        """Prints one line, and exits."""
        if message.startswith("unrecognized arguments"):
            message += "; files go before the options, a complaint in words goes with --symptom"
        super().error(message)


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = _DoctorParser(
        prog="drake-navbench doctor",
        usage="drake-navbench doctor FILE [FILE ...] --out DIR [options]\n"
        "       drake-navbench doctor FILE [FILE ...] --read-only [options]\n"
        "       drake-navbench doctor --log LOG\n"
        "       drake-navbench doctor FILE [FILE ...] --measure-board BOARD [options]\n"
        "       drake-navbench doctor --score CASES [--files DIR] [--page FILE]",
        description="Finds why a robot with this Nav2 file misbehaves. Checks the file by the\n"
        "rules of its release, drives short probes made for the robot, tries the\n"
        "possible causes of a symptom one by one, and writes the smallest change to the\n"
        "file that removes the symptom and makes nothing else worse.",
        epilog=EPILOG,
    )
    _add_file(parser)
    _add_visit(parser)
    _add_robot(parser)
    _add_score(parser)
    return parser


def _add_file(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the file, the robot and the symptom."""
    option = Options(parser)
    option(
        "files",
        "whole Nav2 file, or its parts: files are merged, later ones override; a change is made in "
        "the file that has the parameter",
        Path,
        nargs="*",
        metavar="FILE",
    )
    option(
        "--robot NAME|FILE",
        f"robot that lends what no Nav2 file has: mass, drive, lidar ({LENT_ROBOT})",
    )
    option(
        "--packages DIR ...",
        "folders in which ROS packages are searched that the robot's model names, besides the "
        "repository around it",
        Path,
    )
    option(
        "--package DIR",
        "repository of the robot: its model and its Nav2 file are found and used, and its map with "
        "--goals",
        Path,
    )
    option(
        "--pick KIND=N ...",
        "use another robot, nav2 or map of the list that --package prints, or none, or its goals",
    )
    option("--controller NAME", "controller of the file to examine (the first one)")
    option("--symptom CLASS", "class of the symptom, or your own words for it")
    option(
        "--told TEXT",
        "symptom and robot in your own words",
        default="",
    )
    option(
        "--like NAME ...",
        "known complaint that is most like yours, by its name in the list that the doctor prints "
        "for your words; its cures come first",
    )
    option(
        "--nav2-release",
        "Nav2 release that the file is written for (found by its parameters)",
        choices=tuple(Release),
    )
    option("--set NAME=VALUE ...", "value for $(var NAME) or <NAME> in the file")


def _add_visit(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the drives."""
    option = Options(parser.add_argument_group("visit"))
    option("--read-only", "read the file and drive nothing")
    option("--out DIR", "folder for page, patch and journal", Path)
    option(
        "--budget TIME",
        "time after which the visit ends and answers, such as 10m or 300s (10m)",
        _duration,
        600.0,
    )
    option(
        "--try PARAMETER=VALUE ...",
        "changes that you propose, such as FollowPath.lookahead_dist=0.8 or "
        "local_costmap.width=4: tried before all others, each gets a verdict",
        dest="proposals",
    )
    option("--seed SEED", "seed of the whole visit (0)", whole_number, 0)
    option("--jobs N", "parallel workers (all cores)", positive_number)
    option(
        "--log LOG",
        "only search for symptoms in the log of a trial or of an imported recording",
        Path,
    )


def _add_robot(parser: argparse.ArgumentParser) -> None:
    """Adds the options that tell about the robot and its surroundings."""
    option = Options(parser.add_argument_group("the robot and its place"))
    option("--map FILE", "your map; --goals tasks on it are probes, too", Path)
    option(
        "--goals N|FILE",
        "tasks to draw on the map, or a file of places between which the tasks lead",
        number_or_file,
        0,
    )
    option(
        "--bag BAG",
        "a recording of the robot: it is looked at for symptoms, and the base is fitted to it",
        Path,
    )
    option(
        "--topics ROLE=TOPIC",
        "topic of a signal in --bag, as import-bag takes it: odom=/robot/odom",
        default=[],
        nargs="+",
        action="extend",
    )
    option(
        "--measure-board BOARD",
        "write how long this file's control cycles take on this computer, nothing else",
        Path,
    )
    option(
        "--board BOARD",
        "drive with the cycle times that --measure-board wrote on the robot's computer",
        Path,
    )


def _add_score(parser: argparse.ArgumentParser) -> None:
    """Adds the options of the score on known cases."""
    option = Options(parser.add_argument_group("score the doctor on known cases"))
    option("--score CASES", "YAML file of the cases, each of which the doctor examines", Path)
    option(
        "--files DIR",
        "folder of the cases' whole Nav2 files: ID.yaml, or ID_1.yaml and ID_2.yaml, which are "
        "merged",
        Path,
        dest="case_files",
    )
    option("--page FILE", "file for the page of the score", Path)


def _duration(text: str) -> float:
    """Returns a time such as 10m, 90s or 1h in s; raises ArgumentTypeError."""
    found = re.fullmatch(r"(\d+\.?\d*)\s*(h|m|s|min)?", text)
    if found is None or float(found[1]) <= 0.0:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a time such as 10m or 300s")
    return float(found[1]) * {"h": 3600.0, "m": 60.0, "min": 60.0}.get(found[2] or "s", 1.0)


def require_options_that_are_used(arguments: argparse.Namespace) -> None:
    """Raises InputError if an option is given that this use of the command does not read."""
    defaults = vars(build_parser().parse_args([]))
    given = {name for name, value in vars(arguments).items() if value != defaults[name]}
    for use, used in USED.items():
        unused = sorted(given - {use, *used}) if use in given else []
        if unused:
            option = option_of(unused[0])
            raise InputError(
                f"{option}: is of no use with {option_of(use)}; leave out one of the two"
            )


def option_of(name: str) -> str:
    """Returns the option that sets an argument: '--files' for 'case_files'."""
    called = {"case_files": "--files", "proposals": "--try"}
    return called.get(name, f"--{name.replace('_', '-')}")
