"""By how much a parameter's value in the file speaks for changing it in one direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.suspects import ranges
from drake_navbench.studies.doctor.usual import unusual_value

# The factors of a suspect whose value lies beyond the usual range on the side of the fault, within
# it, and on the other side, once slightly and once far; and of one that the controller lacks.
BEYOND, WITHIN, OPPOSITE, FAR_OPPOSITE, ABSENT = 2.2, 1.0, 0.75, 0.35, 0.45
FAR_TIMES = 2.0
# The factor of a parameter that somebody changed from its default towards the fault.
CHANGED = 1.25
# A limit by place, and the place of what it limits: where it exceeds that, raising it does nothing.
LIMITS = {
    "local_costmap.raytrace_max_range": "local_costmap.obstacle_max_range",
    "global_costmap.raytrace_max_range": "global_costmap.obstacle_max_range",
    "controller.max_speed_xy": "controller.max_vel_x",
}
# nav2_bringup's limits of the velocity smoother, and from which ratio on others are unusual.
OF_SMOOTHER = {
    "velocity_smoother.max_accel": (2.5, 0.0, 3.2),
    "velocity_smoother.max_decel": (-2.5, 0.0, -3.2),
}
SMOOTHER_FAR = 2.0


def value_factor(facts: Facts, cause: Cause) -> float:
    """Returns the factor by which a parameter's value raises or lowers a cause's weight."""
    if cause.is_outside or cause.direction in (Direction.ADD, Direction.SET):
        return 1.0
    told = facts.told.get(cause.place)
    if told in ("low", "high"):
        is_suspicious = (told == "low") == (cause.direction is Direction.UP)
        return BEYOND if is_suspicious else OPPOSITE
    values = [facts[place] for place in facts.matching(cause.place)]
    value = next((v for v in values if v is not None), None)
    if value is None:
        return ABSENT if facts.is_whole else WITHIN
    if cause.key == ("velocity_smoother.max_velocity", Direction.UP) and facts.is_whole:
        lets_by = facts.axis(cause.place, 0) or 0.0
        return 1.0 if lets_by < facts.speed_mps else OPPOSITE
    if cause.place in OF_SMOOTHER and isinstance(value, list | tuple):
        return _of_smoother(cause, value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return 1.0
    is_raised = facts.is_whole and cause.direction is Direction.UP
    limited = facts[LIMITS.get(cause.place, "")] if is_raised else None
    if isinstance(limited, int | float) and value >= limited:
        return FAR_OPPOSITE
    return _side(facts, cause, float(value))


def _of_smoother(cause: Cause, value: Sequence[float]) -> float:
    """Returns the factor of a velocity smoother's list by its axis farthest from nav2_bringup's."""
    usual = OF_SMOOTHER[cause.place]
    ratios = [abs(v / u) for v, u in zip(value, usual, strict=False) if u and v]
    far = max(ratios, key=lambda ratio: abs(math.log(ratio)), default=1.0)
    is_more = (cause.direction is Direction.UP) == (usual[0] > 0.0)
    if 1.0 / SMOOTHER_FAR < far < SMOOTHER_FAR:
        return WITHIN
    return BEYOND if (far < 1.0) == is_more else OPPOSITE


def _side(facts: Facts, cause: Cause, value: float) -> float:
    low, high = ranges().get(cause.place) or _range_of_the_other_costmap(cause.place)
    is_up = cause.direction is Direction.UP
    below = low is not None and value < low - 1e-9
    above = high is not None and value > high + 1e-9
    if below or above:
        if below == is_up:
            # Nav2's own default is nothing that somebody got wrong.
            return BEYOND if cause.place in facts.given else CHANGED if facts.is_whole else WITHIN
        bound = low if below else high
        return FAR_OPPOSITE if _are_far(value, bound or 0.0) else OPPOSITE
    far = unusual_value(facts, cause.place) if low is None and high is None else None
    if far is not None:
        return BEYOND if far.back is cause.direction else OPPOSITE
    default = facts.defaults.get(cause.place)
    if isinstance(default, int | float) and not isinstance(default, bool) and value != default:
        return CHANGED if (value < default) == is_up else 1.0 / CHANGED
    return WITHIN


def _are_far(value: float, bound: float) -> bool:
    """Tells whether one of two numbers is more than twice the other."""
    small, large = sorted((abs(value), abs(bound)))
    return large > FAR_TIMES * small


def _range_of_the_other_costmap(place: str) -> tuple[float | None, float | None]:
    """Returns the range of the local costmap's parameter for the global one's."""
    return ranges().get(place.replace("global_costmap.", "local_costmap."), (None, None))
