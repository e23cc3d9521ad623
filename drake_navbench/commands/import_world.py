"""The command `import-world`: a world of Gazebo as a scenario file, with a picture of it.

Only the standard library is imported before the arguments are read, so that --help is quick.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, exit_status_of, print_text
from drake_navbench.errors import CannotBeWritten, InputError, printable

if TYPE_CHECKING:
    from drake_navbench.inputs.gazebo_world import GazeboWorld
    from drake_navbench.inputs.robot import Robot
    from drake_navbench.inputs.scenario import Scenario

EPILOG = """\
conversion:
  boxes, cylinders, spheres, polylines and meshes are cut at the height of the
  robot's lidar, below it, and above it up to the robot's top. The map shows the
  parts that the lidar sees; the robot can touch the other parts as well. An
  <actor> with a trajectory becomes a person.

example:
  drake-navbench import-world house.world --start 0 0 0 --goal 5 2 0
"""
SEEN, BELOW, ABOVE, ROBOT = "#444444", "#4a90c2", "#d06a5a", "#2e8b57"


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench import-world",
        description="Converts a Gazebo world into a scenario file, with a picture beside it.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("world", type=Path, metavar="WORLD", help="world: a .world or .sdf file")
    for name in ("start", "goal"):
        add(
            f"--{name}",
            type=float,
            nargs=3,
            required=True,
            metavar=("X", "Y", "YAW"),
            help=f"{name} pose in the world, m, m, rad",
        )
    add("--robot", default="wheelchair", metavar="NAME|FILE", help="robot that drives (wheelchair)")
    add(
        "--packages",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="folders with ROS packages and Gazebo models",
    )
    add("--out", type=Path, metavar="FILE", help="scenario file to write (WORLD's name.yaml)")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    arguments = build_parser().parse_args(argv)
    return exit_status_of(lambda: _import(arguments))


def _import(arguments: argparse.Namespace) -> None:
    from drake_navbench.inputs.gazebo_world import load_gazebo_world, scenario_in_world
    from drake_navbench.inputs.robot import body_top_m, load_robot

    out = arguments.out or Path(f"{arguments.world.name.partition('.')[0]}.yaml")
    if out.exists():
        raise InputError(f"--out {out}: exists; expected a new file")
    robot = load_robot(arguments.robot, packages=arguments.packages)
    world = load_gazebo_world(
        arguments.world,
        lidar_m=robot.lidar.height_m,
        top_m=body_top_m(robot),
        around=(arguments.start, arguments.goal),
        folders=arguments.packages,
    )
    start, goal = tuple(arguments.start), tuple(arguments.goal)
    scenario = scenario_in_world(world, start, goal, name=out.stem)
    picture = out.with_suffix(".png")
    try:
        out.write_text(scenario_file(scenario), encoding="utf-8")
        draw_world(world, robot, scenario, picture)
    except OSError as error:
        raise CannotBeWritten(f"{out}: cannot be written: {error.strerror}") from error
    print_text(f"{printable(world.summary)}\n{out} and {picture} written\n")


def scenario_file(scenario: Scenario) -> str:
    """Returns a scenario as the text of a scenario file."""
    import yaml

    data = scenario.model_dump(mode="json", exclude_unset=True)
    data.pop("name", None)
    return yaml.safe_dump(
        {name: value for name, value in data.items() if value is not None}, sort_keys=False
    )


def draw_world(world: GazeboWorld, robot: Robot, scenario: Scenario, file: Path) -> None:
    """Draws a world from above, with the robot at the start and the goal."""
    import numpy as np
    from matplotlib.figure import Figure

    from drake_navbench.kernels.poses import place_outline

    figure = Figure(figsize=(7.0, 7.0), layout="constrained")
    axes = figure.add_subplot()
    for obstacle in world.obstacles:
        is_high = obstacle.get("bottom_m", 0.0) > 0.0
        hidden = ABOVE if is_high else BELOW
        colour = SEEN if obstacle["known_to_planner"] else hidden
        axes.fill(*zip(*obstacle["vertices"], strict=True), color=colour, linewidth=0)
    for person in world.persons:
        axes.plot(*zip(person["start"], *person["goals"], strict=True), color="#b8860b")
    for pose in (scenario.start, scenario.goal):
        axes.fill(*place_outline(robot.outline, np.array(pose)).T, color=ROBOT, alpha=0.8)
    axes.plot(*scenario.goal[:2], "*", color="white")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(
        "grey: seen by the lidar, blue: below it, red: above it, green: robot", fontsize=9
    )
    figure.savefig(file, dpi=120, bbox_inches="tight")
