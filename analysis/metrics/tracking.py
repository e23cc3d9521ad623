"""How closely the robot followed the plan."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.signals import (
    Array,
    column,
    polyline_length,
    positions,
    time_mean,
    times,
)
from drake_navbench.kernels.angles import wrap
from drake_navbench.log import Outcome, TrialLog

# Less is no progress: the edge of a usual costmap's cell.
STALL_DISTANCE_M = 0.05


class Projection(NamedTuple):
    """The nearest point of a polyline for each of N query points.

    distance_m: (N,) to it. arc_m: (N,) its place along the polyline. tangent_rad: (N,) direction
    of the polyline there.
    """

    distance_m: Array
    arc_m: Array
    tangent_rad: Array


def project_on_polyline(points: Array, polyline: Array) -> Projection:
    """Returns the nearest points of a polyline (M, 2) m to query points (N, 2) m, M >= 2."""
    start, step = polyline[:-1], np.diff(polyline, axis=0)
    length = np.hypot(*step.T)
    kept = length > 0.0
    start, step, length = start[kept], step[kept], length[kept]
    if len(step) == 0:
        raise Undefined("the plan has no length")
    tree = shapely.STRtree(shapely.linestrings(np.stack([start, start + step], axis=1)))
    query, segment = tree.query_nearest(shapely.points(points), all_matches=False)
    segment = segment[np.argsort(query)]
    offset = points - start[segment]
    along = np.einsum("ni,ni->n", offset, step[segment]) / length[segment] ** 2
    along = np.clip(along, 0.0, 1.0)
    arc_at_start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    return Projection(
        distance_m=np.hypot(*(offset - along[:, None] * step[segment]).T),
        arc_m=arc_at_start[segment] + along * length[segment],
        tangent_rad=np.arctan2(step[segment, 1], step[segment, 0]),
    )


@metric(unit="m", better="lower")
def cross_track_error_mean_m(log: TrialLog) -> float:
    """Mean over time of the distance from the true position to the plan's line.

    Formula: integral d dt / duration, d to the nearest point of the plan as a polyline.
    """
    return time_mean(times(log), _projection(log).distance_m)


@metric(unit="m", better="lower")
def cross_track_error_rms_m(log: TrialLog) -> float:
    """Root mean square over time of the distance from the true position to the plan's line.

    Formula: sqrt(integral d^2 dt / duration).
    """
    return float(np.sqrt(time_mean(times(log), _projection(log).distance_m ** 2)))


@metric(unit="m", better="lower")
def cross_track_error_max_m(log: TrialLog) -> float:
    """Largest distance from the true position to the plan's line.

    Formula: max d.
    """
    return _projection(log).distance_m.max()


@metric(unit="deg", better="lower")
def heading_error_mean_deg(log: TrialLog) -> float:
    """Mean over time of the angle between heading and plan: the wrapped form of the published one.

    Formula: mean |wrap(yaw - tangent of the plan at the nearest point)|.
    """
    return time_mean(times(log), np.abs(_heading_errors_deg(log)))


@metric(unit="deg", better="lower")
def heading_error_max_deg(log: TrialLog) -> float:
    """Largest angle between heading and plan.

    Formula: max |wrap(yaw - tangent of the plan at the nearest point)|.
    """
    return np.abs(_heading_errors_deg(log)).max()


@metric(unit="", better="higher")
def plan_progress_ratio(log: TrialLog) -> float:
    """Share of the plan that lies behind the robot at the end, whatever the outcome.

    Formula: arc length of the plan's point nearest to the last position / length of the plan.
    """
    last = positions(log)[-1:]
    plan = _plan_xy(log)
    return project_on_polyline(last, plan).arc_m[0] / polyline_length(plan)


@metric(unit="s", better="lower")
def stall_time_s(log: TrialLog) -> float:
    """How long a trial that failed went on without getting farther along the plan.

    Formula: end - the first time at which the plan's nearest point lay within 0.05 m (a cell of a
    map) of the farthest one that was reached. The published abort_time starts at the very lowest
    command, which the noise of two commands near a standstill decides.
    """
    if log.outcome is Outcome.SUCCEEDED:
        raise Undefined("the trial reached its goal")
    arc_m = _projection(log).arc_m
    return log.end_time_s - times(log)[(arc_m >= arc_m.max() - STALL_DISTANCE_M).argmax()]


@metric(unit="m", better="lower")
def goal_position_error_m(log: TrialLog) -> float:
    """Distance to the goal at the end, whatever the outcome.

    Formula: |p(end) - goal|.
    """
    return np.hypot(*(positions(log)[-1] - log.info["scenario"]["goal"][:2]))


@metric(unit="deg", better="lower")
def goal_heading_error_deg(log: TrialLog) -> float:
    """Angle to the goal's heading at the end, whatever the outcome.

    Formula: |wrap(yaw(end) - yaw goal)|.
    """
    yaw = column(log, "yaw_rad")[-1]
    return abs(np.degrees(wrap(yaw - log.info["scenario"]["goal"][2])))


def _plan_xy(log: TrialLog) -> Array:
    if len(log.plan) < 2:
        raise Undefined("there is no plan")
    return log.plan[:, :2]


# One log is measured at a time, by several metrics in turn; a log does not change.
@lru_cache(maxsize=1)
def _projection(log: TrialLog) -> Projection:
    return project_on_polyline(positions(log), _plan_xy(log))


def _heading_errors_deg(log: TrialLog) -> Array:
    difference = column(log, "yaw_rad") - _projection(log).tangent_rad
    return np.degrees([wrap(angle) for angle in difference])
