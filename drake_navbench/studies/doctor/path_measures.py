"""Measures of a drive against its plan: swings, corners cut, turns that begin late."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drake_navbench.studies.doctor.drive_signals import (
    NEAR_GOAL_M,
    moved_at,
    pieces,
    turning_points,
)
from drake_navbench.studies.doctor.drives import STANDS_MPS, Array, Drive

# A straight piece that is shorter says nothing, s; and fewer reversals are a correction.
LEAST_PIECE_S, LEAST_SWINGS = 1.0, 3
# A plan that begins more than this beside the robot's heading begins with a turn, rad.
BEGINS_BEHIND_RAD = 1.2
# Points of a plan to either side that its heading is taken over: half a metre.
TANGENT_POINTS = 10
# A plan that turns by less within a metre is straight, rad.
STRAIGHT_RAD = 0.15
# A plan is no more exact than a cell of its costmap, and the probes' corridor leaves 0.4 m on each
# side of a robot, however wide it is.
LEAST_WIDTH_M, MOST_WIDTH_M = 0.05, 0.35


def swings(d: Drive) -> float:
    """Reversals of the heading on straight pieces, each of at least 3 degrees, per 10 s."""
    moves = (np.abs(d.v_mps) > 3 * STANDS_MPS) & (d.to_goal_m > NEAR_GOAL_M)
    moves &= np.arange(len(d.time_s)) > moved_at(d) + round(1.0 / d.step_s)
    if len(d.plan_m) > 2 * TANGENT_POINTS:
        moves &= _is_straight(d)
    error, count, time_s = _heading_error(d), 0, 0.0
    for piece in pieces(moves):
        if len(piece) * d.step_s >= LEAST_PIECE_S:
            count += max(len(turning_points(error[piece])) - 2, 0)
            time_s += len(piece) * d.step_s
    return 10.0 * count / time_s if count >= LEAST_SWINGS else 0.0


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


def off_path(d: Drive) -> float:
    """The largest distance from the plan over the robot's half width, which counts as LEAST_WIDTH_M
    at least and MOST_WIDTH_M at most; of a plan that begins behind the robot 0.

    Who turns by an arc has left such a plan and cut no corner.
    """
    if len(d.plan_m) < 2 or abs(math.remainder(_heading_error(d)[0], math.tau)) > BEGINS_BEHIND_RAD:
        return 0.0
    width_m = min(max(d.half_width_m, LEAST_WIDTH_M), MOST_WIDTH_M)
    off_m = float(np.hypot(*(d.xy_m - d.plan_m[_nearest(d)]).T).max())
    return off_m / (MOST_WIDTH_M if math.isnan(d.half_width_m) else width_m)


def turning_late(d: Drive) -> float:
    """The time with the plan more than 70 degrees beside the robot's heading, s."""
    if len(d.plan_m) < 2 or d.is_impossible:
        return 0.0
    error = np.abs(np.angle(np.exp(1j * _heading_error(d))))
    return float(((error > 1.2) & (d.to_goal_m > NEAR_GOAL_M)).sum()) * d.step_s
