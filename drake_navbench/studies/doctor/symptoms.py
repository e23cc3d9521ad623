"""Classes of symptoms: their names, what each looks like, and the words that users have for it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import StrEnum

from drake_navbench.errors import InputError


class Symptom(StrEnum):
    """A class of symptoms."""

    WOBBLE_STRAIGHT = "wobble_straight"
    STOP_START_JERK = "stop_start_jerk"
    LATE_CYCLES = "late_cycles"
    TOO_SLOW = "too_slow"
    NO_START = "no_start"
    NO_TURNING = "no_turning"
    SPINS = "spins"
    REVERSE_FAILURE = "reverse_failure"
    CORNER_CUTTING = "corner_cutting"
    NEAR_MISS = "near_miss"
    COLLISION = "collision"
    IGNORES_OBSTACLES = "ignores_obstacles"
    GHOST_OBSTACLES = "ghost_obstacles"
    DOOR_STOP = "door_stop"
    STALL_BEFORE_GOAL = "stall_before_goal"
    GOAL_OVERSHOOT = "goal_overshoot"
    GOAL_OSCILLATION = "goal_oscillation"
    GOAL_NOT_REACHED = "goal_not_reached"
    FALSE_ABORT = "false_abort"
    GIVES_UP_LATE = "gives_up_late"
    NO_RECOVERY = "no_recovery"
    PLANNER_FAILS = "planner_fails"
    LOCALIZATION_JUMPS = "localization_jumps"


LOOKS_LIKE: Mapping[Symptom, str] = {
    Symptom.WOBBLE_STRAIGHT: "weaves or swings on a straight way",
    Symptom.STOP_START_JERK: "stops and starts, or jerks",
    Symptom.LATE_CYCLES: "misses the rate of its control loop",
    Symptom.TOO_SLOW: "drives or turns slower than the file asks",
    Symptom.NO_START: "does not begin to move",
    Symptom.NO_TURNING: "does not turn to a path behind or beside it",
    Symptom.SPINS: "spins or circles",
    Symptom.REVERSE_FAILURE: "drives backward where it should not, or cannot where it should",
    Symptom.CORNER_CUTTING: "leaves the path in bends and cuts corners",
    Symptom.NEAR_MISS: "passes obstacles too closely",
    Symptom.COLLISION: "touches something",
    Symptom.IGNORES_OBSTACLES: "does not see an obstacle that is there",
    Symptom.GHOST_OBSTACLES: "sees obstacles that are not there, or have gone",
    Symptom.DOOR_STOP: "stops, or moves to and fro, in doors and narrow passages",
    Symptom.STALL_BEFORE_GOAL: "creeps or stands before the goal",
    Symptom.GOAL_OVERSHOOT: "drives or turns past the goal",
    Symptom.GOAL_OSCILLATION: "moves to and fro at the goal",
    Symptom.GOAL_NOT_REACHED: "never counts as arrived at the goal",
    Symptom.FALSE_ABORT: "gives up although it could go on",
    Symptom.GIVES_UP_LATE: "goes on although it is stuck",
    Symptom.NO_RECOVERY: "gets stuck and does not get free",
    Symptom.PLANNER_FAILS: "gets no plan from the planner",
    Symptom.LOCALIZATION_JUMPS: "loses its pose, or its estimated pose jumps",
}

# Other words for the same; the first pattern that is found in a user's words counts.
SYNONYMS: tuple[tuple[str, Symptom], ...] = (
    (r"goal.*(oscillat|hunt|swing|back and forth)|(oscillat|hunt).*goal", Symptom.GOAL_OSCILLATION),
    (r"overshoot|past the goal|overrun|pass(es)? the (goal|heading)", Symptom.GOAL_OVERSHOOT),
    (r"corner|cuts|leaves the path|path_deviation|off.?path", Symptom.CORNER_CUTTING),
    (r"wobb|weav|zig.?zag|swing|oscillat|snak|shak|s.curve", Symptom.WOBBLE_STRAIGHT),
    (r"late.?cycle|miss(es|ed)? (its |the )?rate|loop rate|cpu|overrun", Symptom.LATE_CYCLES),
    (
        r"jerk|stutter|stop.?(and|&)?.?(start|go)|jump(s|y) command|not smooth",
        Symptom.STOP_START_JERK,
    ),
    (r"door|narrow|passage|gap|corridor", Symptom.DOOR_STOP),
    (r"near.?miss|too close|hug|clearance", Symptom.NEAR_MISS),
    (r"ghost|phantom|not clear|stale|never clears", Symptom.GHOST_OBSTACLES),
    (r"ignor|not see|blind|does not avoid", Symptom.IGNORES_OBSTACLES),
    (r"collid|collision|touch|hits?\b|clip|crash|bump|unsafe", Symptom.COLLISION),
    (r"reverse|backward", Symptom.REVERSE_FAILURE),
    (r"recover|stuck|back.?up fails|does not back", Symptom.NO_RECOVERY),
    (r"abort|fail(s|ed) to make progress|gives? up (too )?(early|soon)", Symptom.FALSE_ABORT),
    (r"gives? up (too )?late|never aborts|for ?ever", Symptom.GIVES_UP_LATE),
    (r"stall|creep|stops? (short|before)|inch", Symptom.STALL_BEFORE_GOAL),
    (r"not reach|never arriv|never reach|no_arrival|goal_missed", Symptom.GOAL_NOT_REACHED),
    (r"no.?plan|planner|planning|start occupied|no valid path", Symptom.PLANNER_FAILS),
    (r"locali[sz]|amcl|pose jump|lost", Symptom.LOCALIZATION_JUMPS),
    (r"spin|circl|twirl|rotates? (endless|in place)", Symptom.SPINS),
    (r"not turn|no.?turn|no_rotation|turns? wide", Symptom.NO_TURNING),
    (
        r"not (start|move)|no.?start|no.?motion|stands still|never leaves|stationary",
        Symptom.NO_START,
    ),
    (r"slow", Symptom.TOO_SLOW),
)


def symptom_called(text: str) -> Symptom:
    """Returns the class that a user's words name; raises InputError with all classes."""
    name = re.sub(r"[\s-]+", "_", text.strip().lower())
    if name in list(Symptom):
        return Symptom(name)
    plain = text.strip().lower().replace("_", " ")
    for pattern, symptom in SYNONYMS:
        if re.search(pattern, plain):
            return symptom
    raise InputError(
        f"--symptom {text!r}: unknown class of symptoms; expected one of {', '.join(Symptom)}"
    )
