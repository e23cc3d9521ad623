"""Two or more faults that share a class of symptoms, told apart by a user's words.

An obstacle that is not there was never there (the floor, the robot's own body), or has gone: Nav2
marks and clears with different parameters. A task that ends too early had no progress, a late
transform, a late server or no valid command. A goal is never reached, or counts as reached too
early. The causes of the fault that the words tell gain, those of the other faults lose.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.symptoms import Symptom

# The factor of a cause of the fault that the words tell, of a cause of another one, and of a change
# that would make the fault worse.
OF_THE_TOLD, OF_ANOTHER, WORSE = 1.6, 0.6, 0.2
TURNED = {Direction.UP: Direction.DOWN, Direction.DOWN: Direction.UP}


class _Family(NamedTuple):
    """One fault of a class. told: words for it; causes: `place direction`, both as patterns."""

    told: re.Pattern[str]
    causes: re.Pattern[str]


def _family(told: str, causes: str) -> _Family:
    return _Family(re.compile(told, re.IGNORECASE), re.compile(causes))


# Nav2's ObservationBuffer and ObstacleLayer: marking and clearing.
_HAS_GONE = _family(
    r"\b(gone|stale|remain\w*|trails?|linger\w*|persist\w*|stays?|stayed|left behind|removed"
    r"|moved (away|on)|old (marks?|obstacles?)|memory|clear(s|ed|ing)? (too )?(late|slow)\w*"
    r"|(never|not|don't|doesn't|isn't) (get )?(clear|remov|disappear)\w*)\b",
    r"(raytrace_max_range|z_voxels|z_resolution|update_frequency) up$|(clearing|inf_is_valid"
    r"|always_send_full_costmap|combination_method|global_costmap\.plugins) set$"
    r"|(observation_persistence|voxel_decay|raytrace_min_range) down$",
)
_NEVER_THERE = _family(
    r"\b(floor|ground|carpet|ramps?|ceiling|overhead|own (body|wheels?|legs?|arm|chassis)|itself"
    r"|not there|nothing there|empty|noise|noisy|speckles?|dust|reflections?|mirrors?)\b",
    r"(min_obstacle_height|obstacle_min_range|mark_threshold|voxel_min_points) up$"
    r"|(max_obstacle_height|obstacle_max_range) down$"
    r"|(local_costmap\.plugins|footprint_clearing_enabled|outside\.sensor_frame"
    r"|observation_sources) set$",
)
# Nav2's controller server: what ends a task, by its messages.
_NO_PROGRESS = _family(
    r"make progress|no progress|progress checker|required movement",
    r"^progress_checker\.|max_accel up$|deadband",
)
_LATE_TRANSFORM = _family(
    r"extrapolat|\btransforms?\b|\btf\b|too old|lookup",
    r"transform_tolerance up$|outside\.(clock|frames) set$|use_sim_time",
)
_LATE_SERVER = _family(
    r"timed? ?out|timeout|acknowledge|action server|tick rate|not respond",
    r"(default_server_timeout|bt_loop_duration|wait_for_service_timeout|costmap_update_timeout) up$"
    r"|outside\.compute",
)
# Nav2's goal checkers: a tolerance that cannot be met, and one that is met too early.
_TOO_EARLY = _family(
    r"(?<!until it )(?<!before it )\b(count|report|declar|accept|consider|regard|treat)\w*"
    r"( as| it)?( to be| the goal as)? ?(reached|arrived|success|done|succeed)"
    r"|(goal|it) (still )?(passes|succeeds|succeeded)"
    r"|still pass(es|ed)|(beside|off) the goal|too (early|far) from the goal|facing the wrong way"
    r"|inaccura|imprecis|not (precise|accurate|exact)|wrong (heading|orientation|direction)"
    r"|precision|accuracy",
    r"(goal_checker\.(xy|yaw)_goal_tolerance|planner\.tolerance) down$",
)
_NEVER_MET = _family(
    r"(never|not|n't) (count|consider|report|declar|accept|regard|arriv|reach|finish|stop)\w*"
    r"|keeps? (trying|turning|correct|moving|adjust)\w*|\b(forever|endless\w*|again and again)\b",
    r"^(?!.*tolerance down$)",
)
FAMILIES: Mapping[Symptom, tuple[_Family, ...]] = {
    Symptom.GHOST_OBSTACLES: (_HAS_GONE, _NEVER_THERE),
    Symptom.FALSE_ABORT: (_NO_PROGRESS, _LATE_TRANSFORM, _LATE_SERVER),
    Symptom.GOAL_NOT_REACHED: (_TOO_EARLY, _NEVER_MET),
    Symptom.STALL_BEFORE_GOAL: (_TOO_EARLY, _NEVER_MET),
}


def family_factor(symptom: Symptom, words: str, cause: Cause) -> float:
    """Returns the factor of a cause by the fault that a user's words tell; 1 if they tell none."""
    families = FAMILIES.get(symptom, ())
    told = [family for family in families if family.told.search(words)]
    if not told or len(told) == len(families):
        return 1.0
    text = f"{cause.place} {cause.direction}"
    if any(family.causes.search(text) for family in told):
        return OF_THE_TOLD
    turned = f"{cause.place} {TURNED.get(cause.direction, '')}"
    if any(family.causes.search(turned) for family in told):
        return WORSE
    return OF_ANOTHER if any(family.causes.search(text) for family in families) else 1.0
