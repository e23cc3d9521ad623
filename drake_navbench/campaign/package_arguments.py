"""The options of a run that a robot's repository gives: `--package`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.package_files import (
    GOALS,
    MAP,
    NAV2,
    ROBOT,
    WORLD,
    read_picks,
)
from drake_navbench.inputs.package_search import find_package_files, readable_world
from drake_navbench.nav2.driven_file import driven_file

DEFAULT_GOALS = 5
# The scenario for a robot whose packages hold neither a map nor a world.
ELSEWHERE = "static_obstacles"


def with_package(
    arguments: argparse.Namespace, default_robot: str
) -> tuple[argparse.Namespace, list[str]]:
    """Returns the arguments completed from the packages, and lines on the files that were taken.

    Options of the command line prevail. Raises InputError where no robot is found.
    """
    found = find_package_files(arguments.package)
    picks = read_picks(arguments.pick)
    taken = found.picked(arguments.pick)
    if arguments.robot != default_robot:
        taken[ROBOT] = None
    if arguments.nav2 or arguments.params or arguments.controllers:
        taken[NAV2] = taken[NAV2] if NAV2 in picks else None
    has_place = arguments.map is not None or bool(arguments.scenarios) or arguments.barn is not None
    if has_place or (taken[MAP] is not None and WORLD not in picks):
        taken[WORLD] = None
    if has_place or (taken[WORLD] is not None and MAP not in picks):
        taken[MAP] = None
    if arguments.goal is not None or arguments.goals is not None:
        taken[GOALS] = None
    left_out: list[str] = []
    nav2 = taken[NAV2]
    if nav2 is not None and NAV2 not in picks:
        fitting = found.not_of_others(NAV2, taken[ROBOT])
        files = [nav2, *(file for file in fitting if file != nav2)]
        taken[NAV2], left_out = driven_file(files)
    first = taken[WORLD]
    if first is not None and WORLD not in picks:
        worlds = [first, *(world for world in found.files[WORLD] if world != first)]
        taken[WORLD], unread = readable_world(worlds, found.roots)
        left_out += unread
    goals = arguments.goals or taken[GOALS]
    values = vars(arguments) | {"goals": goals} | found.options(taken, nav2="nav2")
    values["packages"] = [*arguments.packages, *arguments.package]
    own = [] if taken[NAV2] is None else values["nav2"]
    values["found_nav2"] = dict.fromkeys(own, len(found.files[NAV2]))
    if taken[WORLD] is not None:
        values["scenarios"] = [str(taken[WORLD])]
    found.require_robot(values["robot"], default_robot)
    lines = [*found.lines(taken), *left_out]
    if taken[MAP] is None and taken[WORLD] is None and not has_place:
        values["scenarios"] = [ELSEWHERE]
        lines.append(f"neither map nor world: drives in the built-in scenario {ELSEWHERE}")
        if goals is not None:
            values["goals"] = None
            lines.append(f"--goals is not used: {ELSEWHERE} has its own start and goal")
    has_task = arguments.goal is not None or goals is not None
    if not has_task and (taken[MAP] is not None or taken[WORLD] is not None):
        values["goals"] = DEFAULT_GOALS
    return argparse.Namespace(**values), [printable(line) for line in lines]


@contextmanager
def advising_on_found_files(
    arguments: argparse.Namespace,
    alone: str = "--pick nav2=none goes on without it",
    other: str = ", nav2=N with another of the list",
) -> Iterator[None]:
    """Adds to an error about a Nav2 file that `--package` has found how to go on.

    other: added if `--package` has found several.
    """
    try:
        yield
    except InputError as error:
        for file, count in getattr(arguments, "found_nav2", {}).items():
            if str(error).startswith((f"{file}:", f"{file},")):
                raise InputError(f"{error}; {alone}{other if count > 1 else ''}") from error
        raise
