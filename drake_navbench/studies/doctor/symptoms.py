"""Classes of symptoms: their names, what each looks like, and the words that users have for it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum


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


# What is treated where the probes do not show the symptom that was complained of, but this one.
MILDER: Mapping[Symptom, Symptom] = {Symptom.COLLISION: Symptom.NEAR_MISS}

# Symptoms by their weight, the heaviest first: a touch, a near miss, a robot that does not come to
# its goal, one that is slow; all others are lighter.
HEAVIEST_FIRST: tuple[frozenset[Symptom], ...] = (
    frozenset({Symptom.COLLISION}),
    frozenset({Symptom.NEAR_MISS}),
    frozenset(
        {Symptom.NO_START, Symptom.FALSE_ABORT, Symptom.NO_RECOVERY, Symptom.GOAL_NOT_REACHED}
    ),
    frozenset({Symptom.TOO_SLOW, Symptom.DOOR_STOP, Symptom.STALL_BEFORE_GOAL}),
)


def is_lighter(one: Symptom, other: Symptom) -> bool:
    """Tells whether a symptom weighs less than another one."""
    return _rank(one) > _rank(other)


def _rank(symptom: Symptom) -> int:
    ranks = (rank for rank, those in enumerate(HEAVIEST_FIRST) if symptom in those)
    return next(ranks, len(HEAVIEST_FIRST))


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

# Other words for the same.
OTHER_WORDS: Mapping[Symptom, str] = {
    Symptom.WOBBLE_STRAIGHT: "wobbles, zigzags, snakes, shakes, S-curve",
    Symptom.STOP_START_JERK: "stutters, stop and go, jumpy commands, not smooth",
    Symptom.LATE_CYCLES: "missed its desired rate, loop rate, overrun, CPU",
    Symptom.TOO_SLOW: "slow",
    Symptom.NO_START: "does not move or start, stands still, never leaves, stationary",
    Symptom.NO_TURNING: "no rotation, turns wide",
    Symptom.SPINS: "twirls, rotates in place endlessly",
    Symptom.REVERSE_FAILURE: "reverses",
    Symptom.CORNER_CUTTING: "off path",
    Symptom.NEAR_MISS: "hugs walls, clearance",
    Symptom.COLLISION: "collides, hits, clips, crashes into or bumps into walls and obstacles",
    Symptom.IGNORES_OBSTACLES: "ignores obstacles, is blind, does not avoid",
    Symptom.GHOST_OBSTACLES: "phantom or stale obstacles, costmap not cleared",
    Symptom.DOOR_STOP: "gap, corridor",
    Symptom.STALL_BEFORE_GOAL: "stalls, stops short of the goal, inches forward",
    Symptom.GOAL_OVERSHOOT: "overshoots, overruns the goal",
    Symptom.GOAL_OSCILLATION: "hunts, oscillates, back and forth at the goal",
    Symptom.GOAL_NOT_REACHED: "never arrives, goal not reached",
    Symptom.FALSE_ABORT: "aborts, failed to make progress, gives up too early",
    Symptom.GIVES_UP_LATE: "never aborts, gives up too late",
    Symptom.NO_RECOVERY: "recovery, stuck, fails to back up",
    Symptom.PLANNER_FAILS: "no valid path, planning fails, start occupied",
    Symptom.LOCALIZATION_JUMPS: "AMCL, lost, localization",
}
