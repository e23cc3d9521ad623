"""Measures of a drive's speeds, stops and clearance, and of its control cycles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.doctor.drive_signals import (
    NEAR_GOAL_M,
    moved_at,
    pieces,
    turning_points,
)
from drake_navbench.studies.doctor.drives import STANDS_MPS, STANDS_RADPS, Drive

# What a task that was given up for want of a command counts as, s.
REFUSED_S = 8.0
# Who stops and turns by this much has stopped to turn, rad.
WANTED_TURN_RAD = 0.5
# A slow-down, and a speeding-up after it, by this share of the speed that is asked for is seen. A
# bend and an obstacle are reasons for WANTED_SURGES of them.
SURGE, WANTED_SURGES = 0.3, 2


def touches(d: Drive) -> float:
    """Whether the robot touched something; who walks into a robot that stands is not touched."""
    has_touched = d.outcome is Outcome.COLLIDED or bool((d.clearance_m <= 0.0).any())
    last = d.time_s > d.time_s[-1] - 0.5
    moved = (np.abs(d.v_mps) > STANDS_MPS) | (np.abs(d.w_radps) > STANDS_RADPS)
    return float(has_touched and bool(moved[last].any()))


def shortfall(d: Drive) -> float:
    """The clearance missing from 5 cm while the robot drives, m."""
    moves = np.abs(d.v_mps) > STANDS_MPS
    near = d.clearance_m[moves & np.isfinite(d.clearance_m)]
    return max(0.0, 0.05 - float(near.min())) if len(near) else 0.0


def _standing(d: Drive, where: NDArray[np.bool_]) -> float:
    still = (np.abs(d.v_mps) < STANDS_MPS) & (np.abs(d.w_radps) < STANDS_RADPS)
    return float((still & where).sum()) * d.step_s


def does_not_start(d: Drive) -> float:
    """The time until the robot moves or turns, s; 20 s if it never does."""
    if d.is_impossible:
        return 0.0
    index = moved_at(d)
    return float(d.time_s[index] - d.time_s[0]) if index < len(d.time_s) else 20.0


def stands_before_goal(d: Drive) -> float:
    """The time that the robot creeps or stands within 1.2 m of the goal, before it is there, s."""
    if d.is_impossible:
        return 0.0
    creeps = (np.abs(d.v_mps) < 0.1 * max(d.asked_mps, 0.1)) & (np.abs(d.w_radps) < STANDS_RADPS)
    near = (d.to_goal_m < 1.2) & (d.to_goal_m > d.tolerance_m)
    return float((creeps & near).sum()) * d.step_s


def stands_on_the_way(d: Drive) -> float:
    """The time that the robot stands away from the goal, s; all if it refuses every command."""
    if d.is_impossible:
        return 0.0
    if d.is_refused:
        return REFUSED_S
    began = np.arange(len(d.time_s)) > moved_at(d)
    return _standing(d, began & (d.to_goal_m > 1.0))


def stops(d: Drive) -> float:
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


def surges(d: Drive) -> float:
    """Slow-downs on the way that a speeding-up follows, beyond those that are wanted."""
    away = (d.to_goal_m > NEAR_GOAL_M) & (np.arange(len(d.time_s)) >= moved_at(d))
    least, count = SURGE * max(d.asked_mps, 0.1), 0
    for piece in pieces(away):
        # A low is a turning point only after a speeding-up.
        count += int((np.diff(turning_points(d.v_mps[piece], least)) < -least).sum())
    return float(max(count - WANTED_SURGES, 0)) if not d.is_impossible else 0.0


def spin(d: Drive) -> float:
    """Turns on the spot beyond one whole turn, rad."""
    turning = np.abs(d.v_mps) < 2 * STANDS_MPS
    turned = float(np.abs(np.diff(d.yaw_rad, prepend=d.yaw_rad[0]))[turning].sum())
    return max(0.0, turned - 1.2 * math.pi)


def slowness(d: Drive) -> float:
    """The asked speed, in a slow zone what it allows, over the median speed with nothing near."""
    free = ~(d.clearance_m < 0.6)
    way = (d.to_goal_m > 1.0) & free & (np.arange(len(d.time_s)) > moved_at(d) + 20)
    if not d.has_goal:
        # Who drove, and where to, is not known: only driving that was asked for counts.
        is_known = np.isfinite(d.command_v_mps)
        asks = np.where(is_known, d.command_v_mps > 0.5 * d.asked_mps, d.v_mps > 3 * STANDS_MPS)
        way &= asks
    driving = d.v_mps[way & (np.abs(d.w_radps) < 0.3)]
    if len(driving) * d.step_s < 2.0 or d.is_impossible:
        return 0.0
    return min(d.zone_share * d.asked_mps / max(float(np.median(driving)), 0.01), 10.0)


def backward(d: Drive) -> float:
    """Backward way over the whole, without a reason near."""
    free = ~(d.clearance_m < 0.4)
    back = -np.minimum(d.v_mps, 0.0)[free].sum() * d.step_s
    return float(back)


def late(d: Drive) -> float:
    """The share of control cycles that take longer than the control period."""
    known = d.cycle_ms[np.isfinite(d.cycle_ms)]
    return float((known > d.period_ms).mean()) if len(known) else 0.0
