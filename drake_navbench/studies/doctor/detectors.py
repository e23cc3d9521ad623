"""Symptoms as numbers: what a trial's log shows of each, against a threshold with its reason.

A number is the severity: what was measured over the threshold; above 1 the symptom is there. Of two
numbers for one symptom the larger one counts.
All detectors take any log of a drive; those that need a plan or a goal are silent without one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.logs.log import TrialLog
from drake_navbench.studies.doctor.drives import Drive, drive_of
from drake_navbench.studies.doctor.ending_measures import (
    beyond_goal,
    gave_up,
    goes_on,
    hunting,
    not_there,
    stuck,
)
from drake_navbench.studies.doctor.motion_measures import (
    backward,
    does_not_start,
    late,
    shortfall,
    slowness,
    spin,
    stands_before_goal,
    stands_on_the_way,
    stops,
    surges,
    touches,
)
from drake_navbench.studies.doctor.path_measures import off_path, swings, turning_late
from drake_navbench.studies.doctor.symptoms import Symptom

# The modules, besides this one, on which a number depends.
MEASURES = ("drives", "drive_signals", "path_measures", "motion_measures", "ending_measures")


class Detector(NamedTuple):
    """A symptom's number. threshold: in `unit`. reason: why it is where it is."""

    symptom: Symptom
    measure: Callable[[Drive], float]
    threshold: float
    unit: str
    reason: str


DETECTORS: tuple[Detector, ...] = (
    Detector(Symptom.COLLISION, touches, 0.5, "touches", "a drive must be free of touches"),
    Detector(
        Symptom.NEAR_MISS,
        shortfall,
        0.03,
        "m below 0.05 m",
        "the other 0.02 m are the error of a pose estimate",
    ),
    Detector(
        Symptom.WOBBLE_STRAIGHT,
        swings,
        4.0,
        "swings per 10 s",
        "a person who watches sees one swing in 2.5 s",
    ),
    Detector(
        Symptom.CORNER_CUTTING,
        off_path,
        1.0,
        "half widths of the robot off the plan",
        "the plan no longer runs below the robot",
    ),
    Detector(
        Symptom.GOAL_OVERSHOOT,
        beyond_goal,
        0.1,
        "m beyond the tolerance",
        "two cells of a costmap of 0.05 m",
    ),
    Detector(
        Symptom.GOAL_OSCILLATION,
        hunting,
        4.5,
        "reversals",
        "two corrections in driving and two in turning are normal",
    ),
    Detector(
        Symptom.STALL_BEFORE_GOAL,
        stands_before_goal,
        4.0,
        "s",
        "a quarter turn at the goal takes up to 3 s",
    ),
    Detector(
        Symptom.DOOR_STOP,
        stands_on_the_way,
        4.0,
        "s",
        "a new plan takes 1 s, a turn 3 s, the behaviour Wait 5 s",
    ),
    Detector(Symptom.NO_START, does_not_start, 4.0, "s", "a plan takes 1 s, a turn 3 s"),
    Detector(
        Symptom.STOP_START_JERK, stops, 1.5, "stops", "the robot may stop once for an obstacle"
    ),
    Detector(
        Symptom.STOP_START_JERK,
        surges,
        1.5,
        "slow-downs beyond two",
        "a bend and an obstacle are reasons for two",
    ),
    Detector(Symptom.SPINS, spin, 3.0, "rad beyond a turn", "half a turn more than any goal needs"),
    Detector(
        Symptom.TOO_SLOW,
        slowness,
        1.6,
        "times slower",
        "slowing down in bends costs a third of the speed",
    ),
    Detector(
        Symptom.REVERSE_FAILURE,
        backward,
        0.5,
        "m backward",
        "the default behaviour tree backs up by 0.3 m, once",
    ),
    Detector(
        Symptom.NO_TURNING,
        turning_late,
        8.0,
        "s",
        "half a turn at 0.8 rad/s takes 4 s; this is twice as long",
    ),
    Detector(
        Symptom.FALSE_ABORT, gave_up, 0.5, "aborts", "the task can be done, but the robot gives up"
    ),
    Detector(
        Symptom.GIVES_UP_LATE,
        goes_on,
        0.5,
        "trials",
        "the robot stands for 20 s before a closed way and does not give up",
    ),
    Detector(
        Symptom.GOAL_NOT_REACHED,
        not_there,
        0.5,
        "trials",
        "the robot ends near the goal but does not count as arrived",
    ),
    Detector(
        Symptom.NO_RECOVERY,
        stuck,
        0.5,
        "trials",
        "the robot ends far from the goal and still tries",
    ),
    Detector(Symptom.LATE_CYCLES, late, 0.1, "share", "one control cycle in ten may be late"),
)


def severities(log: TrialLog) -> dict[str, float]:
    """Returns each symptom's severity in a log; the log shows a symptom whose severity exceeds 1.

    Late cycles count only if control cycles take time in the simulation: otherwise they tell of the
    load of the computer that drove the trial.
    """
    drive = drive_of(log)
    if len(drive.time_s) < 3:
        return {}
    takes_time = log.info.get("robot", {}).get("timing", {}).get("compute_time", 0.0) != 0.0
    found: dict[str, float] = {}
    for symptom, measure, threshold, *_ in DETECTORS:
        if takes_time or symptom is not Symptom.LATE_CYCLES:
            value = round(float(measure(drive)) / threshold, 4)
            found[symptom.value] = max(value, found.get(symptom.value, 0.0))
    return found


@cache
def detectors_digest() -> str:
    """Returns a digest of the detectors, by which rows of other versions are told apart."""
    sources = [Path(__file__), *(Path(__file__).with_name(f"{name}.py") for name in MEASURES)]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:12]


def doctor_row(log: TrialLog) -> dict[str, Any]:
    """Returns a trial's row: scenario, controller, seed, how and where it ended, severities."""
    return {
        "scenario": log.info["scenario"]["name"],
        "controller": log.info["controller"],
        "seed": log.info["seed"],
        "outcome": str(log.outcome),
        "reason": log.info["reason"],
        "end": [float(v) for v in log.samples[["time_s", "x_m", "y_m", "yaw_rad"]].iloc[-1]]
        if len(log.samples)
        else [],
        "severity": severities(log),
    }
