"""The options of `drake-navbench run`, some of which other commands take, too."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    listed_names,
    number,
    number_or_file,
    positive_number,
    whole_number,
)
from drake_navbench.plugins.releases import Release

MAX_PORT = 65535
DEFAULT_ROBOT = "wheelchair"

EPILOG = """\
examples (python -m drake_navbench.run is the same):
  drake-navbench run                            the published benchmark
  drake-navbench run empty --controllers rpp    one scenario, one controller
  drake-navbench run mine.yaml --controllers rpp,rpp:lookahead_dist=0.9
  drake-navbench run --params nav2_params.yaml  the controllers of a Nav2 file
  drake-navbench run --nav2 nav2_params.yaml    the whole of a Nav2 file
  drake-navbench run --nav2 a.yaml --against b.yaml --map map.yaml --goals 20
  drake-navbench run doorway --controllers rpp \\
      --sweep rpp.lookahead_dist=0.3:0.9:4      one parameter, four values
  drake-navbench run --map map.yaml --goals 10 --controllers rpp,dwb

exit status: 0 every trial ran (an abort is a result), 1 some trial ended in an
error, 2 wrong input, 130 interrupted
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench run",
        usage="%(prog)s [SCENARIO ...] [OPTIONS]",
        description="Drives mobile-robot controllers through scenarios in Drake and compares them.",
        epilog=EPILOG,
    )
    add_what_drives(parser)
    add_where(parser)
    add_nav2_files(parser)
    _add_sweeps(parser)
    _add_how(parser)
    _add_results(parser)
    return parser


def add_what_drives(parser: argparse.ArgumentParser, *, has_defaults: bool = True) -> None:
    """Adds the options of controllers and robot.

    has_defaults: whether the command drives the default controllers where none is named.
    """
    default = " (default: dwb, rpp, teb, teb_upstream, mppi, mppi_nav2)" if has_defaults else ""
    option = Options(parser.add_argument_group("robot and controllers"))
    option(
        "--controllers LIST",
        "presets, comma-separated; name:param=value[:param=value] is a variant, "
        f"path/to/file.py:Class a controller of yours{default}",
    )
    option(
        "--original BUILD",
        "also drive each column's controller in its original C++, from a build of nav2-build",
    )
    option(
        "--robot NAME|FILE",
        "robot: a name, a robot file, or a model in URDF, SDF or xacro (wheelchair)",
        default=DEFAULT_ROBOT,
    )
    option(
        "--package DIR ...",
        "repository of a robot: its model, its Nav2 file, and its map or world are found and "
        "used; drives --goals 5",
        Path,
    )
    option(
        "--pick KIND=N ...",
        "use number N, or none, of the list that --package prints; KIND: robot, nav2, map, world, "
        "goals",
    )
    option(
        "--packages DIR ...",
        "folders in which ROS packages and Gazebo models are searched, besides the repository "
        "around a file that names them",
        Path,
    )


class _Once(argparse.Action):
    """Refuses an option that is given twice: the later value would silently replace the first."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        if getattr(namespace, self.dest) != self.default:
            parser.error(f"{option_string} is given twice; expected once")
        setattr(namespace, self.dest, values)


def add_where(parser: argparse.ArgumentParser, *, has_defaults: bool = True) -> None:
    """Adds scenarios, and the options of maps and worlds.

    has_defaults: whether the command takes the published scenarios where none is named.
    """
    default = " (default: the published five)" if has_defaults else ""
    option = Options(parser.add_argument_group("scenarios and maps"))
    option(
        "scenarios",
        "scenarios: names, YAML files, or Gazebo worlds with --start and --goal or with --goals"
        f"{default}",
        default=[],
        nargs="*",
        metavar="SCENARIO",
    )
    option(
        "--map FILE",
        "map to navigate on, in the format of Nav2's map server or MovingAI, with --start and "
        "--goal or with --goals; beside a Gazebo world: the map of it that the robot has",
        Path,
        action=_Once,
    )
    for name in ("start", "goal"):
        option(f"--{name} X Y YAW", f"{name} pose on the map or in the world, m, m, rad", float)
    option(
        "--goals N|FILE",
        "draw N tasks on the map or in the world: a goal each, and a start unless --start is "
        "given; or drive from place to place of a file of waypoints, goals or a route graph",
        number_or_file,
    )
    option("--barn DIR", "folder of BARN worlds: world_N.world and path_files/", Path)
    option("--worlds LIST", "numbers of the BARN worlds, such as 3,10-20,100-299:50 (all)")


def add_nav2_files(parser: argparse.ArgumentParser, *, checks: bool = True) -> None:
    """Adds the options of preset files and Nav2 files.

    checks: whether --help shows --check; a command without it refuses the option itself.
    """
    option = Options(parser.add_argument_group("parameter files and Nav2"))
    option(
        "--params FILE ...",
        "preset file, or Nav2 parameter file of which only the controllers are used",
        Path,
    )
    option(
        "--nav2 FILE ...",
        "whole Nav2 parameter file: controllers, costmaps, planner, checkers and so on; several "
        "files are merged, later ones override. To compare two files, use --against",
        Path,
    )
    option(
        "--against FILE ...",
        "Nav2 parameter file to compare with that of --nav2; each file's columns drive with its "
        "own costmaps, planner and so on",
        Path,
    )
    option(
        "--name ALIAS=FILE ...",
        "alias that begins the names of a Nav2 file's columns if there are several files (the "
        "part in which their paths differ)",
    )
    option(
        "--set NAME=VALUE ...",
        "value for $(var NAME) or <NAME> in the Nav2 files, or for an argument of the "
        "robot's xacro file",
    )
    option(
        "--nav2-release",
        "Nav2 release that the files of --nav2 and --params are written for (found by their "
        "parameters)",
        choices=tuple(Release),
    )
    option(
        "--check",
        "print how each parameter of the Nav2 files and each part of the robot's model is used, "
        "and drive nothing"
        if checks
        else argparse.SUPPRESS,
    )


def _add_sweeps(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("sweeps"))
    option(
        "--sweep FIELD=VALUES ...",
        "drive with each of these values of one field: of a controller (rpp.lookahead_dist), of "
        "the robot (localization.xy_std_m) or of the scenario. Values: 1,2,5 or "
        "LOW:HIGH:COUNT[:log]; several --sweep form a grid",
    )
    option(
        "--samples N",
        "draw N points of a Latin hypercube over the --sweep fields instead of the grid",
        positive_number,
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("number of trials, workers"))
    option("--trials N", "number of trials per scenario and controller (4)", positive_number, 4)
    option("--seed SEED", "seed of the whole run (0)", whole_number, 0)
    option("--jobs N|auto", "parallel workers (auto)", _jobs)
    option(
        "--cluster ADDRESS|local:N",
        "drive on the workers of a dask scheduler, tls://HOST:PORT, or local:N: of one with N "
        "workers on this machine",
    )
    option(
        "--cluster-tls DIR",
        "ca.pem, cert.pem and key.pem with which a tls:// cluster and this run recognise each "
        "other",
        Path,
    )
    option(
        "--trust-network",
        "accept a tcp:// cluster, where whoever reaches its machines may run code as you",
    )
    option(
        "--live",
        "show each trial in a browser, in real time, one after another, with buttons and sliders; "
        "without --out no log is kept",
    )
    option("--live-port N", "port of the page of --live on this machine (a free one)", _port)
    option(
        "--live-wait SECONDS",
        "time that --live waits for a browser, at the beginning and when it was closed (120)",
        _seconds,
    )
    option("--resume DIR", "continue an interrupted run", Path)


def _add_results(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("results and output"))
    option("--out DIR", "new folder for the results (results/<time>)", Path)
    option(
        "--replay", "replays to write (race; for a sweep none)", choices=("race", "each", "none")
    )
    option(
        "--figures",
        "figures of the report. key: those that compare the controllers of a scenario; all: also "
        "the motion of each controller, and every figure as PNG (key; for a sweep none)",
        choices=("none", "key", "all"),
    )
    option("--metric FILE.py:NAME ...", "add a metric: a function of yours, decorated with @metric")
    option(
        "--columns LIST",
        "metrics that the terminal shows beside how trials ended (time_to_goal_s, min_clearance_m, "
        "driven_length_m, cross_track_error_mean_m, jerk_rms_mps3)",
        listed_names,
        (),
    )
    option(
        "--no-costmaps",
        "leave the local costmaps out of the logs, which makes logs smaller and replays poorer",
    )
    option("--list", "list scenarios, controllers and robots")
    option("--quiet", "print errors only")


def _jobs(text: str) -> int | None:
    return None if text == "auto" else positive_number(text)


def _port(text: str) -> int:
    number = positive_number(text)
    if number > MAX_PORT:
        raise argparse.ArgumentTypeError(f"got {text!r}, expected a port of at most {MAX_PORT}")
    return number


def _seconds(text: str) -> float:
    return number(text, "seconds above 0", lambda seconds: seconds > 0.0)
