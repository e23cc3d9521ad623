"""Which causes a file can have: the node is there, the parameter in effect, not cured yet."""

from __future__ import annotations

from fnmatch import fnmatchcase

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.facts import CONTROLLER, Facts
from drake_navbench.studies.doctor.in_effect import is_in_effect

# Plugins that Foxy and Galactic lack (Humble has this one from 1.1.7 on).
SINCE_HUMBLE = ("nav2_controller::PoseProgressChecker",)
# Parameters that are looked for in files of all releases, and the first release that reads them.
NEWER = {
    "controller.rotate_to_goal_heading": Release.JAZZY,
    "controller_server.enable_stamped_cmd_vel": Release.JAZZY,
}
# Parameters that may be negative, so that 0 can still be lowered.
BELOW_ZERO = ("min_vel*", "*_min", "min_velocity", "*obstacle_height", "origin_z", "*decel*")


def is_there(facts: Facts, cause: Cause) -> bool:
    """Tells whether a cause may be one: its node is in the file, and it is not cured already."""
    first = cause.place.partition(".")[0]
    is_missing = facts.is_whole and not facts.has_node(first)
    if cause.direction is Direction.ADD:
        # Only a node, or a plugin before the controller, can be added.
        return is_missing if first != CONTROLLER else not facts.is_kind("shim")
    if first in ("velocity_smoother", "collision_monitor", "amcl") and is_missing:
        return False
    if cause.place in facts.unreadable or not is_in_effect(facts, cause.place):
        return False
    if facts.release < NEWER.get(cause.place, facts.release):
        return False
    if cause.to in SINCE_HUMBLE and facts.told.get("release") == "old":
        return False
    is_in_block = first == CONTROLLER and cause.place.count(".") > 1
    if is_in_block and facts.is_whole and facts[cause.place] is None:
        # The block of a critic that is not listed.
        return False
    if "*" in cause.place and facts.is_whole and not facts.matching(cause.place):
        return False
    if cause.direction is Direction.DOWN and _is_zero(facts, cause.place):
        return False
    return not (cause.direction is Direction.SET and cause.to is not None and _has(facts, cause))


def _is_zero(facts: Facts, place: str) -> bool:
    """Tells whether a parameter, or all its axes, are 0 and cannot be lower."""
    value, name = facts[place], place.rpartition(".")[2]
    if isinstance(value, bool) or any(fnmatchcase(name, pattern) for pattern in BELOW_ZERO):
        return False
    if isinstance(value, list | tuple):
        return bool(value) and not any(value)
    return bool(value == 0.0)


def _has(facts: Facts, cause: Cause) -> bool:
    """Tells whether everything that a cause names has the value of the cure already."""
    values = [facts[place] for place in facts.matching(cause.place)]
    if not values:
        return False
    return all(
        cause.to in value if isinstance(value, list | tuple) else value == cause.to
        for value in values
    )
