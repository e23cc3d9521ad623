"""The arguments of a visit that a robot's repository gives: `doctor --package`."""

from __future__ import annotations

import argparse

from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.package_files import (
    GOALS,
    MAP,
    NAV2,
    ROBOT,
    WORLD,
    read_picks,
)
from drake_navbench.inputs.package_search import find_package_files


def with_package(arguments: argparse.Namespace) -> tuple[argparse.Namespace, list[str]]:
    """Returns the arguments completed from the repository, and lines on the files found there.

    Files and robot of the command line prevail. The map is taken for --goals alone. Raises
    InputError where robot, Nav2 file or the map for --goals is missing.
    """
    root = arguments.package
    if WORLD in read_picks(arguments.pick):
        raise InputError("--pick world: is of no use here; the doctor drives in its probes")
    if arguments.read_only and GOALS in read_picks(arguments.pick):
        raise InputError("--pick goals: is of no use with --read-only, which drives nothing")
    found = find_package_files([root])
    taken = found.picked(arguments.pick)
    del taken[WORLD]
    if arguments.goals:
        taken[GOALS] = None
    if arguments.robot is not None:
        taken[ROBOT] = None
    if arguments.files:
        taken[NAV2] = None
    goals = arguments.goals or taken[GOALS] or 0
    if arguments.map is not None or not goals:
        taken[MAP] = None
    values = vars(arguments) | {"goals": goals} | found.options(taken, nav2="files")
    values["packages"] = [*arguments.packages, root]
    if taken[NAV2] is not None:
        values["found_nav2"] = dict.fromkeys(values["files"], len(found.files[NAV2]))
    found.require_robot(values["robot"], default=None)
    if not values["files"]:
        raise InputError(f"--package {root}: no Nav2 file; expected one, or FILE")
    if goals and values["map"] is None:
        raise InputError(f"--package {root}: no map; expected one for --goals, or --map")
    return argparse.Namespace(**values), [printable(line) for line in found.lines(taken)]
