"""The command `live`: a scenario as a simulator for a running ROS 2 stack."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_FAILED,
    CommandParser,
    Options,
    command,
    whole_number,
)
from drake_navbench.errors import InputError
from drake_navbench.typed_files.assignments import assignments

if TYPE_CHECKING:
    from drake_navbench.inputs.scenario import Scenario

FRAMES = ("map", "odom", "base", "scan")
DEFAULT_DURATION_S = 1800.0
EPILOG = """\
examples:
  drake-navbench live empty --robot turtlebot3_waffle
  drake-navbench live --map map.yaml --start 1.0 2.0 0.0 --robot turtlebot4
  drake-navbench live doorway --goal --rate max --no-page

The stack: ROS_DOMAIN_ID of --domain, ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST,
and use_sim_time:=True; docs/live.md has the launch lines.

exit status: 0 done, 1 it ended in an error, such as no stack, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench live",
        usage="%(prog)s [SCENARIO | --map FILE --start X Y YAW] [OPTIONS]",
        description="Simulates world and robot for a ROS 2 stack that runs beside it.",
        epilog=EPILOG,
    )
    _add_what(parser)
    _add_ros(parser)
    _add_how(parser)
    return parser


def _add_what(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("world and robot"))
    option("scenario", "scenario: a name or a YAML file (empty)", nargs="?", metavar="SCENARIO")
    option("--map FILE", "map as the world, with --start", Path)
    option("--start X Y YAW", "start pose on the map, m, m, rad", float)
    option("--robot NAME|FILE", "robot (wheelchair)", default="wheelchair")
    option(
        "--goal",
        "send the scenario's goal to the stack, and end when the stack reports that it was "
        "reached, aborted or cancelled",
    )


def _add_ros(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("ROS 2"))
    option("--domain N", "domain of DDS, as ROS_DOMAIN_ID (0)", whole_number, 0)
    option("--peer ADDRESS ...", "machine to speak to; without it nothing leaves this one")
    option(
        "--allow-listeners", "begin although others listen to /cmd_vel; none of them may be a robot"
    )
    option("--namespace NAME", "namespace of all topics but /clock, such as /robot1", default="")
    option("--topic NAME=TOPIC ...", "another name for a topic, such as scan=/front/scan")
    option(
        "--frame NAME=FRAME ...",
        "another name for the frame map, odom, base or scan, such as base=base_footprint",
    )
    option(
        "--localization",
        "who sends the transform from map to odometry (auto: the stack if it listens to "
        "/initialpose)",
        default="auto",
        choices=("auto", "benchmark", "stack"),
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    option = Options(parser.add_argument_group("pace and output"))
    option(
        "--rate RATE|max",
        "simulated seconds per second; max: as fast as the stack sends commands (1.0)",
        default="1.0",
    )
    option(
        "--duration S",
        f"end after this many simulated seconds ({DEFAULT_DURATION_S:g}; with --goal the "
        "scenario's time)",
        float,
    )
    option("--seed SEED", "seed of the noise (0)", whole_number, 0)
    option("--out DIR", "new folder for the log (results/<time>)", Path)
    option("--no-page", "show no page in a browser")
    option("--quiet", "print errors only")


def _live(arguments: argparse.Namespace) -> int:
    from drake_navbench.campaign.console import terminal
    from drake_navbench.campaign.live_simulator import simulate_for_stack
    from drake_navbench.campaign.run_command import default_results_path
    from drake_navbench.logs.results import ResultsFolder
    from drake_navbench.ros2.live.live_extra import require_live_libraries

    require_live_libraries()
    console = terminal(quiet=arguments.quiet)
    ended_badly = simulate_for_stack(
        _scenario(arguments),
        _parameters(arguments),
        robot=arguments.robot,
        seed=arguments.seed,
        folder=ResultsFolder((arguments.out or default_results_path()).absolute()),
        shows_page=not arguments.no_page,
        console=console,
    )
    return EXIT_FAILED if ended_badly else EXIT_DONE


def _scenario(arguments: argparse.Namespace) -> Scenario:
    """Returns the scenario that is asked for; raises InputError."""
    from drake_navbench.inputs.scenario import load_scenario, scenario_on_map

    if (arguments.map is None) != (arguments.start is None):
        raise InputError("--map and --start: expected both or none")
    if arguments.map is not None and (arguments.scenario or arguments.goal):
        raise InputError("--map: expected --start alone beside it, no SCENARIO and no --goal")
    if arguments.map is not None:
        start = tuple(arguments.start)
        scenario = scenario_on_map(arguments.map, start, start)
    else:
        scenario = load_scenario(arguments.scenario or "empty")
    duration_s = arguments.duration
    if duration_s is None and not arguments.goal:
        duration_s = DEFAULT_DURATION_S
    if duration_s is None:
        return scenario
    if duration_s <= 0.0:
        raise InputError(f"--duration {duration_s:g}: expected more than 0 s")
    return scenario.model_copy(update={"timeout_s": duration_s})


def _parameters(arguments: argparse.Namespace) -> dict[str, Any]:
    """Returns the parameters of the column `live`; raises InputError for an unknown frame."""
    frames = assignments(arguments.frame, "--frame")
    for name in frames:
        if name not in FRAMES:
            raise InputError(f"--frame {name}: expected one of {', '.join(FRAMES)}")
    try:
        rate = "max" if arguments.rate == "max" else float(arguments.rate)
    except ValueError:
        raise InputError(f"--rate {arguments.rate!r}: expected max or a number") from None
    return {
        "domain": arguments.domain,
        "peers": tuple(arguments.peer),
        "allows_listeners": arguments.allow_listeners,
        "namespace": arguments.namespace,
        "topics": assignments(arguments.topic, "--topic"),
        **{f"{name}_frame": frame for name, frame in frames.items()},
        "localization": arguments.localization,
        "rate": rate,
        "sends_goal": arguments.goal,
    }


main = command(build_parser, _live)
