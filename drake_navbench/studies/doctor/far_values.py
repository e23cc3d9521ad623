"""Findings about values that are far from Nav2's default and from nav2_bringup's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from functools import cache

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.in_effect import is_in_effect
from drake_navbench.studies.doctor.rules.rule import Finding, Rule
from drake_navbench.studies.doctor.suspects import all_suspects, ranges
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.usual import Unusual, unusual_value

# The names of these findings begin so.
FAR = "far-"
# At most this many findings; more far values show another kind of robot, not a slip.
MOST = 3
# A symptom is named if the way back to the usual value is its cure with at least this weight.
LEAST_WEIGHT = 0.2
# Parameters that depend on the robot, its sensors or its floor, so no value is unusual: speeds,
# radii, ranges, heights, samples of a sideways drive; and numbers that name a choice. "*" stands
# for any text.
OF_THE_ROBOT = (
    "*vel", "*vel_[xy]", "*vel_theta", "*speed*", "v[xy]_m*", "wz_m*", "v_linear*", "v_angular*",
    "max_accel", "max_decel", "robot_radius", "*range", "*obstacle_height", "wheelbase",
    "*turning*", "vy_*", "*velocity_threshold", "weight_acc_lim*", "footprint*",
    "combination_method",
)  # fmt: skip
ELSEWHERE = ("amcl.", "global_costmap.width", "global_costmap.height")
# Low values of these may be those of a weak base; high ones are unusual for any robot.
ACCELERATIONS = ("acc_lim*", "decel_lim*", "ax_*", "ay_*", "az_*", "*_accel", "*_decel",
    "*_acc_lim")  # fmt: skip
# From this tolerance on the heading at the goal does not matter.
NO_HEADING_RAD = 1.2
SOURCE = "Nav2's code and nav2_bringup/params/nav2_params.yaml"


def far_values(facts: Facts, fired: Sequence[Finding]) -> list[Finding]:
    """Returns findings about the values farthest from the usual ones, the farthest first.

    Only parameters count that the file gives, on which a drive depends, and that no other finding
    names.
    """
    told = {p for f in fired for cause in f.cures for p in facts.matching(cause.place)}
    seen = " ".join(finding.seen for finding in fired)
    found = []
    for place in sorted(facts.given - told - facts.unreadable):
        is_told = place.partition(".")[2] in seen
        is_drives = place in _known() and is_in_effect(facts, place)
        far = unusual_value(facts, place) if is_drives and not is_told else None
        if far is not None and not is_robots_own(far) and not _is_in_range(far):
            found.append(far)
    found.sort(key=lambda far: (-abs(math.log(far.ratio)), far.place))
    return [_finding(far, facts) for far in found[:MOST]]


def is_robots_own(far: Unusual) -> bool:
    """Tells whether a value depends on the robot, so that no value is unusual."""
    name = far.place.rpartition(".")[2]
    # A value of 0 mostly switches a function off.
    if (
        far.value == 0.0
        or far.place.startswith(ELSEWHERE)
        or any(fnmatchcase(name, p) for p in OF_THE_ROBOT)
    ):
        return True
    is_acceleration = any(fnmatchcase(name, pattern) for pattern in ACCELERATIONS)
    is_free = name == "yaw_goal_tolerance" and far.value >= NO_HEADING_RAD
    return is_free or (is_acceleration and far.ratio < 1.0)


def _is_in_range(far: Unusual) -> bool:
    """Tells whether a value is in the range of working robots."""
    local = far.place.replace("global_costmap.", "local_costmap.")
    low, high = ranges().get(far.place) or ranges().get(local, (None, None))
    is_known = low is not None or high is not None
    is_above = low is None or far.value >= low
    return is_known and is_above and (high is None or far.value <= high)


def _finding(far: Unusual, facts: Facts) -> Finding:
    name = far.place.removeprefix("controller.")
    seen = (
        f"{name} is {far.value:g}, {_plain(far.ratio)} times the usual {far.nearest:g} (Nav2's "
        "default or nav2_bringup's value); keep it if you chose it on purpose"
    )
    # A whole number stays one: Nav2 refuses a number of another type.
    is_whole = isinstance(facts[far.place], int)
    to = round(far.nearest) if is_whole else far.nearest
    cause = Cause(far.place, far.back, to, seen, SOURCE)
    rule = Rule(
        f"{FAR}{far.place.rpartition('.')[2]}", lambda facts: True, lambda facts: seen,
        _symptoms(far.place, far.back, facts.kinds), (cause,), SOURCE,
    )  # fmt: skip
    return Finding(rule, seen, (cause,))


def _symptoms(place: str, back: Direction, kinds: tuple[str, ...]) -> dict[Symptom, float]:
    """Returns the symptoms that the suspects expect the way back to cure."""
    wanted = {"any", *kinds}
    return {
        s.symptom: s.weight
        for s in all_suspects()
        if (s.cause.place, s.cause.direction) == (place, back)
        and wanted & {*s.kinds}
        and s.weight >= LEAST_WEIGHT
    }


@cache
def _known() -> frozenset[str]:
    """Returns the places on which a drive depends: those in the knowledge."""
    own = {s.cause.place for s in all_suspects()} | {*ranges()}
    others = {place.replace("local_costmap.", "global_costmap.") for place in own}
    return frozenset(own | others)


def _plain(ratio: float) -> str:
    """Returns a ratio with two figures: '0.25', '4.8', '110'."""
    return f"{float(f'{ratio:.2g}'):g}"
