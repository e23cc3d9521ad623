"""The command `import-world`: a world of Gazebo as a scenario file, with a picture of it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import CommandParser, Options, command, print_text
from drake_navbench.errors import InputError, printable

if TYPE_CHECKING:
    from drake_navbench.inputs.scenario import Scenario

EPILOG = """\
conversion:
  boxes, cylinders, spheres, polylines and meshes are cut at the height of the
  robot's lidar, below it, and above it up to the robot's top. The map shows the
  parts that the lidar sees; the robot can touch the other parts as well. An
  <actor> with a trajectory becomes a person.

example:
  drake-navbench import-world house.world --start 0 0 0 --goal 5 2 0

exit status: 0 done, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench import-world",
        description="Converts a Gazebo world into a scenario file, with a picture beside it.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option("world", "world: a .world or .sdf file", Path, metavar="WORLD")
    for name in ("start", "goal"):
        option(f"--{name} X Y YAW", f"{name} pose in the world, m, m, rad", float, required=True)
    option("--robot NAME|FILE", "robot that drives (wheelchair)", default="wheelchair")
    option("--packages DIR ...", "folders with ROS packages and Gazebo models", Path)
    option("--out FILE", "scenario file to write (WORLD's name.yaml)", Path)
    return parser


def _import(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.figures.choice import PNG
    from drake_navbench.analysis.figures.style import figure_style, write_figure
    from drake_navbench.analysis.figures.views import scene_figure
    from drake_navbench.campaign.scene_views import scene_view
    from drake_navbench.inputs.gazebo_world import load_gazebo_world, scenario_in_world
    from drake_navbench.inputs.robot import body_top_m, load_robot
    from drake_navbench.typed_files.output_file import write_text

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
    view, told = scene_view([scenario], robot)
    with figure_style():
        (picture,) = write_figure(scene_figure(view), out.with_suffix(""), (PNG,))
    # Last and whole: where the disk is full, the same command may be given again.
    write_text(out, scenario_file(scenario))
    for line in told:
        print_text(f"{printable(line)}\n")
    print_text(f"{printable(world.summary)}\n{out} and {picture} written\n")


def scenario_file(scenario: Scenario) -> str:
    """Returns a scenario as the text of a scenario file."""
    from drake_navbench.typed_files.yaml_loader import dump_yaml

    data = scenario.model_dump(mode="json", exclude_unset=True)
    data.pop("name", None)
    return dump_yaml(
        {name: value for name, value in data.items() if value is not None}, sort_keys=False
    )


main = command(build_parser, _import)
