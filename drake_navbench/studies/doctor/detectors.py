"""Symptoms as numbers: what a trial's log shows of each, against a threshold with its reason.

A number is the severity: what was measured over the threshold; above 1 the symptom is there. Of two
numbers for one symptom the larger one counts.
All detectors take any log of a drive; those that need a plan or a goal are silent without one.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.logs.log import Outcome, TrialLog
from drake_navbench.studies.doctor.drives import (
    STANDS_MPS,
    STANDS_RADPS,
    Array,
    Drive,
    drive_of,
)
from drake_navbench.studies.doctor.symptoms import Symptom


class Detector(NamedTuple):
    """A symptom's number. threshold: in `unit`. reason: why it is where it is."""

    symptom: Symptom
    measure: Callable[[Drive], float]
    threshold: float
    unit: str
    reason: str


# What a task that was given up for want of a command counts as, s.
REFUSED_S = 8.0
# A task that ends because every command was refused is a weak sign of a robot that gives up or gets
# stuck: where no recovery was tried, all of it may be a stop before a door.
REFUSAL = 0.4
# A swing of the heading so small nobody sees, rad.
SEEN_RAD = 0.05
# A straight piece that is shorter says nothing, s; and fewer reversals are a correction.
LEAST_PIECE_S, LEAST_SWINGS = 1.0, 3
# A plan that begins more than this beside the robot's heading begins with a turn, rad.
BEGINS_BEHIND_RAD = 1.2
# Points of a plan to either side that its heading is taken over: half a metre.
TANGENT_POINTS = 10
# A plan that turns by less within a metre is straight, rad.
STRAIGHT_RAD = 0.15
# Who stops and turns by this much has stopped to turn, rad.
WANTED_TURN_RAD = 0.5
# Who comes nearer to its goal by this share of the speed that is asked for, in the last seconds of
# a drive, is under way, and only the time was short.
UNDER_WAY, LAST_S = 0.5, 3.0
# What counts as at the goal beyond its tolerance, m.
NEAR_GOAL_M = 0.6
# A plan is no more exact than a cell of its costmap, and the probes' corridor leaves 0.4 m on each
# side of a robot, however wide it is.
LEAST_WIDTH_M, MOST_WIDTH_M = 0.05, 0.35
# A slow-down, and a speeding-up after it, by this share of the speed that is asked for is seen. A
# bend and an obstacle are reasons for WANTED_SURGES of them.
SURGE, WANTED_SURGES = 0.3, 2


def _touches(d: Drive) -> float:
    """Whether the robot touched something; who walks into a robot that stands is not touched."""
    has_touched = d.outcome is Outcome.COLLIDED or bool((d.clearance_m <= 0.0).any())
    last = d.time_s > d.time_s[-1] - 0.5
    moved = (np.abs(d.v_mps) > STANDS_MPS) | (np.abs(d.w_radps) > STANDS_RADPS)
    return float(has_touched and bool(moved[last].any()))


def _shortfall(d: Drive) -> float:
    """The clearance missing from 5 cm while the robot drives, m."""
    moves = np.abs(d.v_mps) > STANDS_MPS
    near = d.clearance_m[moves & np.isfinite(d.clearance_m)]
    return max(0.0, 0.05 - float(near.min())) if len(near) else 0.0


def _swings(d: Drive) -> float:
    """Reversals of the heading on straight pieces, each of at least 3 degrees, per 10 s."""
    moves = (np.abs(d.v_mps) > 3 * STANDS_MPS) & (d.to_goal_m > NEAR_GOAL_M)
    moves &= np.arange(len(d.time_s)) > _moved_at(d) + round(1.0 / d.step_s)
    if len(d.plan_m) > 2 * TANGENT_POINTS:
        moves &= _is_straight(d)
    error, count, time_s = _heading_error(d), 0, 0.0
    for piece in _pieces(moves):
        if len(piece) * d.step_s >= LEAST_PIECE_S:
            count += max(len(_turning_points(error[piece])) - 2, 0)
            time_s += len(piece) * d.step_s
    return 10.0 * count / time_s if count >= LEAST_SWINGS else 0.0


def _pieces(where: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Returns the indices of each run of samples without a gap."""
    index = np.flatnonzero(where)
    return np.split(index, np.flatnonzero(np.diff(index) > 1) + 1) if len(index) else []


def _headings(d: Drive) -> Array:
    """Returns the plan's heading at each of its points, over half a metre to both sides, rad."""
    index = np.arange(len(d.plan_m))
    ahead = np.minimum(index + TANGENT_POINTS, len(index) - 1)
    behind = np.maximum(index - TANGENT_POINTS, 0)
    along = d.plan_m[ahead] - d.plan_m[behind]
    return np.asarray(np.unwrap(np.arctan2(along[:, 1], along[:, 0])))


def _is_straight(d: Drive) -> NDArray[np.bool_]:
    """Tells at each sample whether the plan hardly bends within a metre."""
    headings, nearest = _headings(d), _nearest(d)
    ahead = np.minimum(nearest + TANGENT_POINTS, len(headings) - 1)
    behind = np.maximum(nearest - TANGENT_POINTS, 0)
    return np.asarray(np.abs(headings[ahead] - headings[behind]) < STRAIGHT_RAD)


def _heading_error(d: Drive) -> Array:
    if len(d.plan_m) < 2:
        return d.yaw_rad - d.yaw_rad.mean()
    return np.asarray(np.unwrap(d.yaw_rad - _headings(d)[_nearest(d)]))


def _nearest(d: Drive) -> NDArray[np.int64]:
    gaps = np.hypot(*(d.xy_m[:, None, :] - d.plan_m[None, :, :]).transpose(2, 0, 1))
    return np.asarray(gaps.argmin(axis=1))


def _turning_points(values: Array, least: float = SEEN_RAD) -> list[float]:
    """Returns the extremes of a signal that differ by more than `least`, one after another."""
    if len(values) == 0:
        return []
    extremes, low, high, rising = [float(values[0])], values[0], values[0], 0
    for value in values[1:]:
        low, high = min(low, value), max(high, value)
        if rising <= 0 and value - low > least:
            extremes.append(float(low))
            rising, high = 1, value
        elif rising >= 0 and high - value > least:
            extremes.append(float(high))
            rising, low = -1, value
        if rising > 0:
            low = high
        elif rising < 0:
            high = low
    return extremes


def _off_path(d: Drive) -> float:
    """The largest distance from the plan over the robot's half width, which counts as LEAST_WIDTH_M
    at least and MOST_WIDTH_M at most; of a plan that begins behind the robot 0.

    Who turns by an arc has left such a plan and cut no corner.
    """
    if len(d.plan_m) < 2 or abs(math.remainder(_heading_error(d)[0], math.tau)) > BEGINS_BEHIND_RAD:
        return 0.0
    width_m = min(max(d.half_width_m, LEAST_WIDTH_M), MOST_WIDTH_M)
    off_m = float(np.hypot(*(d.xy_m - d.plan_m[_nearest(d)]).T).max())
    return off_m / (MOST_WIDTH_M if math.isnan(d.half_width_m) else width_m)


def _beyond_goal(d: Drive) -> float:
    """The distance beyond the tolerance that the robot leaves the goal again, m."""
    inside = np.flatnonzero(d.to_goal_m < d.tolerance_m)
    if not len(inside):
        return 0.0
    return max(0.0, float(d.to_goal_m[inside[0] :].max()) - d.tolerance_m)


def _hunting(d: Drive) -> float:
    """Number of reversals near the goal, of driving or of turning."""
    near = d.to_goal_m < max(NEAR_GOAL_M, 2.0 * d.tolerance_m)
    count = 0
    for signal, least in ((d.v_mps, 2 * STANDS_MPS), (d.w_radps, 2 * STANDS_RADPS)):
        signs = np.sign(signal[near & (np.abs(signal) > least)])
        count += int((np.diff(signs) != 0).sum())
    return float(count)


def _standing(d: Drive, where: NDArray[np.bool_]) -> float:
    still = (np.abs(d.v_mps) < STANDS_MPS) & (np.abs(d.w_radps) < STANDS_RADPS)
    return float((still & where).sum()) * d.step_s


def _moved_at(d: Drive) -> int:
    moved = np.hypot(*(d.xy_m - d.xy_m[0]).T) > 0.1
    turned = np.abs(d.yaw_rad - d.yaw_rad[0]) > 0.25
    found = np.flatnonzero(moved | turned)
    return int(found[0]) if len(found) else len(d.time_s)


def _does_not_start(d: Drive) -> float:
    if d.is_impossible:
        return 0.0
    index = _moved_at(d)
    return float(d.time_s[index] - d.time_s[0]) if index < len(d.time_s) else 20.0


def _stands_before_goal(d: Drive) -> float:
    if d.is_impossible:
        return 0.0
    creeps = (np.abs(d.v_mps) < 0.1 * max(d.asked_mps, 0.1)) & (np.abs(d.w_radps) < STANDS_RADPS)
    near = (d.to_goal_m < 1.2) & (d.to_goal_m > d.tolerance_m)
    return float((creeps & near).sum()) * d.step_s


def _stands_on_the_way(d: Drive) -> float:
    """The time that the robot stands away from the goal, s; all if it refuses every command."""
    if d.is_impossible:
        return 0.0
    if d.is_refused:
        return REFUSED_S
    began = np.arange(len(d.time_s)) > _moved_at(d)
    return _standing(d, began & (d.to_goal_m > 1.0))


def _stops(d: Drive) -> float:
    """Stops on the way from more than a third of the speed that is asked for, and starts again.

    A stop for a turn on the spot does not count: it is wanted.
    """
    fast = 0.35 * max(d.asked_mps, 0.1)
    count, is_fast, stopped_at = 0, False, -1
    for index, (v, away) in enumerate(zip(d.v_mps, d.to_goal_m > NEAR_GOAL_M, strict=True)):
        if stopped_at >= 0 and abs(v) > 2 * STANDS_MPS:
            count += abs(d.yaw_rad[index] - d.yaw_rad[stopped_at]) < WANTED_TURN_RAD
            stopped_at = -1
        if away and v > fast:
            is_fast = True
        elif is_fast and abs(v) < STANDS_MPS:
            is_fast, stopped_at = False, index
    return float(count) if not d.is_impossible else 0.0


def _surges(d: Drive) -> float:
    """Slow-downs on the way that a speeding-up follows, beyond those that are wanted."""
    away = (d.to_goal_m > NEAR_GOAL_M) & (np.arange(len(d.time_s)) >= _moved_at(d))
    least, count = SURGE * max(d.asked_mps, 0.1), 0
    for piece in _pieces(away):
        # A low is a turning point only after a speeding-up.
        count += int((np.diff(_turning_points(d.v_mps[piece], least)) < -least).sum())
    return float(max(count - WANTED_SURGES, 0)) if not d.is_impossible else 0.0


def _spin(d: Drive) -> float:
    """Turns on the spot beyond one whole turn, rad."""
    turning = np.abs(d.v_mps) < 2 * STANDS_MPS
    turned = float(np.abs(np.diff(d.yaw_rad, prepend=d.yaw_rad[0]))[turning].sum())
    return max(0.0, turned - 1.2 * math.pi)


def _slowness(d: Drive) -> float:
    """The asked speed, in a slow zone what it allows, over the median speed with nothing near."""
    free = ~(d.clearance_m < 0.6)
    way = (d.to_goal_m > 1.0) & free & (np.arange(len(d.time_s)) > _moved_at(d) + 20)
    if not d.has_goal:
        # Who drove, and where to, is not known: only driving that was asked for counts.
        is_known = np.isfinite(d.command_v_mps)
        asks = np.where(is_known, d.command_v_mps > 0.5 * d.asked_mps, d.v_mps > 3 * STANDS_MPS)
        way &= asks
    driving = d.v_mps[way & (np.abs(d.w_radps) < 0.3)]
    if len(driving) * d.step_s < 2.0 or d.is_impossible:
        return 0.0
    return min(d.zone_share * d.asked_mps / max(float(np.median(driving)), 0.01), 10.0)


def _backward(d: Drive) -> float:
    """Backward way over the whole, without a reason near."""
    free = ~(d.clearance_m < 0.4)
    back = -np.minimum(d.v_mps, 0.0)[free].sum() * d.step_s
    return float(back)


def _turning_late(d: Drive) -> float:
    """The time with the plan more than 70 degrees beside the robot's heading, s."""
    if len(d.plan_m) < 2 or d.is_impossible:
        return 0.0
    error = np.abs(np.angle(np.exp(1j * _heading_error(d))))
    return float(((error > 1.2) & (d.to_goal_m > NEAR_GOAL_M)).sum()) * d.step_s


def _gave_up(d: Drive) -> float:
    if d.outcome is not Outcome.ABORTED or d.is_impossible:
        return 0.0
    return REFUSAL if d.is_refused else 1.0


def _goes_on(d: Drive) -> float:
    return float(d.outcome is Outcome.TIMED_OUT and d.is_impossible)


def _is_under_way(d: Drive) -> bool:
    count = round(LAST_S / d.step_s)
    if len(d.to_goal_m) <= count:
        return False
    nearer_m = float(d.to_goal_m[-1 - count] - d.to_goal_m[-1])
    return nearer_m >= UNDER_WAY * LAST_S * max(d.asked_mps, 0.1)


def _not_there(d: Drive) -> float:
    if d.is_impossible or d.outcome is not Outcome.TIMED_OUT or _is_under_way(d):
        return 0.0
    return float(d.to_goal_m[-1] < max(1.0, 2.0 * d.tolerance_m))


def _stuck(d: Drive) -> float:
    if d.is_impossible or d.to_goal_m[-1] < max(1.0, 2.0 * d.tolerance_m):
        return 0.0
    if d.outcome is Outcome.TIMED_OUT:
        return float(not _is_under_way(d))
    return float(d.recovers or REFUSAL) if d.is_refused else 0.0


def _late(d: Drive) -> float:
    known = d.cycle_ms[np.isfinite(d.cycle_ms)]
    return float((known > d.period_ms).mean()) if len(known) else 0.0


DETECTORS: tuple[Detector, ...] = (
    Detector(Symptom.COLLISION, _touches, 0.5, "touches", "a drive must be free of touches"),
    Detector(
        Symptom.NEAR_MISS,
        _shortfall,
        0.03,
        "m below 0.05 m",
        "the other 0.02 m are the error of a pose estimate",
    ),
    Detector(
        Symptom.WOBBLE_STRAIGHT,
        _swings,
        4.0,
        "swings per 10 s",
        "a person who watches sees one swing in 2.5 s",
    ),
    Detector(
        Symptom.CORNER_CUTTING,
        _off_path,
        1.0,
        "half widths of the robot off the plan",
        "the plan no longer runs below the robot",
    ),
    Detector(
        Symptom.GOAL_OVERSHOOT,
        _beyond_goal,
        0.1,
        "m beyond the tolerance",
        "two cells of a costmap of 0.05 m",
    ),
    Detector(
        Symptom.GOAL_OSCILLATION,
        _hunting,
        4.5,
        "reversals",
        "two corrections in driving and two in turning are normal",
    ),
    Detector(
        Symptom.STALL_BEFORE_GOAL,
        _stands_before_goal,
        4.0,
        "s",
        "a quarter turn at the goal takes up to 3 s",
    ),
    Detector(
        Symptom.DOOR_STOP,
        _stands_on_the_way,
        4.0,
        "s",
        "a new plan takes 1 s, a turn 3 s, the behaviour Wait 5 s",
    ),
    Detector(Symptom.NO_START, _does_not_start, 4.0, "s", "a plan takes 1 s, a turn 3 s"),
    Detector(
        Symptom.STOP_START_JERK, _stops, 1.5, "stops", "the robot may stop once for an obstacle"
    ),
    Detector(
        Symptom.STOP_START_JERK,
        _surges,
        1.5,
        "slow-downs beyond two",
        "a bend and an obstacle are reasons for two",
    ),
    Detector(
        Symptom.SPINS, _spin, 3.0, "rad beyond a turn", "half a turn more than any goal needs"
    ),
    Detector(
        Symptom.TOO_SLOW,
        _slowness,
        1.6,
        "times slower",
        "slowing down in bends costs a third of the speed",
    ),
    Detector(
        Symptom.REVERSE_FAILURE,
        _backward,
        0.5,
        "m backward",
        "the default behaviour tree backs up by 0.3 m, once",
    ),
    Detector(
        Symptom.NO_TURNING,
        _turning_late,
        8.0,
        "s",
        "half a turn at 0.8 rad/s takes 4 s; this is twice as long",
    ),
    Detector(
        Symptom.FALSE_ABORT, _gave_up, 0.5, "aborts", "the task can be done, but the robot gives up"
    ),
    Detector(
        Symptom.GIVES_UP_LATE,
        _goes_on,
        0.5,
        "trials",
        "the robot stands for 20 s before a closed way and does not give up",
    ),
    Detector(
        Symptom.GOAL_NOT_REACHED,
        _not_there,
        0.5,
        "trials",
        "the robot ends near the goal but does not count as arrived",
    ),
    Detector(
        Symptom.NO_RECOVERY,
        _stuck,
        0.5,
        "trials",
        "the robot ends far from the goal and still tries",
    ),
    Detector(Symptom.LATE_CYCLES, _late, 0.1, "share", "one control cycle in ten may be late"),
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
    sources = [Path(__file__), Path(__file__).with_name("drives.py")]
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
