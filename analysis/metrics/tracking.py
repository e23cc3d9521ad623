"""Distance and heading of the robot relative to the plan.

At each time the plan is the latest one that the controller server was given. Times before the first
plan, and times whose plan has no length, are left out.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.mission import (
    ended_on_other_floor,
    floor_of_leg,
    goals,
    leg_lengths_m,
    plans_of_legs,
    present_leg,
)
from drake_navbench.analysis.metrics.signals import column, positions, require, time_mean, times
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

# A smaller gain along the plan is no progress; a usual costmap's cell is as large.
STALL_DISTANCE_M = 0.05


class Projection(NamedTuple):
    """The nearest point of a polyline for each of N query points.

    distance_m: (N,) to that point. arc_m: (N,) arc length from the polyline's start to it.
    tangent_rad: (N,) direction of the polyline at it.
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
    lines = np.asarray(shapely.linestrings(np.stack([start, start + step], axis=1)))
    tree = shapely.STRtree(lines)
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


@metric(unit="m", better="lower", title="Distance from the plan, mean", relevant=0.005)
def cross_track_error_mean_m(log: TrialLog) -> float:
    """Mean over time of the distance from the true position to the plan's line.

    Formula: integral d dt / duration, d the distance to the nearest point of the plan in force, a
    polyline.
    """
    return _mean_while_planned(log, projection_on_plans(log).distance_m)


@metric(unit="m", better="lower", title="Distance from the plan, r.m.s.")
def cross_track_error_rms_m(log: TrialLog) -> float:
    """Root mean square over time of the distance from the true position to the plan's line.

    Formula: sqrt(integral d^2 dt / duration), d as in cross_track_error_mean_m.
    """
    return float(np.sqrt(_mean_while_planned(log, projection_on_plans(log).distance_m ** 2)))


@metric(unit="m", better="lower", title="Distance from the plan, largest")
def cross_track_error_max_m(log: TrialLog) -> float:
    """Largest distance from the true position to the plan's line.

    Formula: max d, d as before.
    """
    return np.nanmax(projection_on_plans(log).distance_m)


@metric(unit="deg", better="lower", title="Heading error, mean", relevant=0.5)
def heading_error_mean_deg(log: TrialLog) -> float:
    """Mean over time of the angle between the robot's heading and the plan.

    Formula: mean |wrap(yaw - tangent of the plan in force at its point nearest to the robot)|,
    wrapped to (-180, 180] deg.
    """
    return _mean_while_planned(log, np.abs(_heading_errors_deg(log)))


@metric(unit="deg", better="lower", title="Heading error, largest")
def heading_error_max_deg(log: TrialLog) -> float:
    """Largest angle between heading and plan.

    Formula: maximum of the angle of heading_error_mean_deg.
    """
    return np.nanmax(np.abs(_heading_errors_deg(log)))


@metric(unit="", better="higher", title="Share of the plan done")
def plan_progress_ratio(log: TrialLog) -> float:
    """Share of the plan that lies behind the robot at the end, whatever the outcome.

    Formula: arc length of the first plan up to its point nearest to the last position / length of
    the first plan. With waypoints legs before the present one count as driven; a leg without a plan
    counts as straight.
    """
    leg, lengths_m = present_leg(log), leg_lengths_m(log)
    if not log.first_plans:
        raise Undefined("there is no plan")
    if not lengths_m.any():
        raise Undefined("the plan has no length")
    done_m = lengths_m[:leg].sum()
    for plan in plans_of_legs(log):
        if plan.leg == leg and len(plan.poses) > 1:
            done_m += project_on_polyline(positions(log)[-1:], plan.poses[:, :2]).arc_m[0]
    return done_m / lengths_m.sum()


@metric(unit="s", better="lower", title="Time without progress")
def stall_time_s(log: TrialLog) -> float:
    """Time that a failed trial went on without progress along the plan.

    Formula: end - first time at which the progress was within 0.05 m (one map cell) of its maximum;
    progress is the arc length of the first plan (with waypoints of the last leg's) up to its point
    nearest to the robot.
    """
    if log.outcome is Outcome.SUCCEEDED:
        raise Undefined("the trial reached its goal")
    leg = present_leg(log)
    plan = next((plan for plan in plans_of_legs(log) if plan.leg == leg), None)
    if plan is None:
        raise Undefined("there is no plan")
    in_leg = times(log) >= plan.time_s
    arc_m = project_on_polyline(positions(log)[in_leg], plan.poses[:, :2]).arc_m
    reached = (arc_m >= arc_m.max() - STALL_DISTANCE_M).argmax()
    return log.end_time_s - times(log)[in_leg][reached]


@metric(unit="m", better="lower", title="Distance to the goal at the end")
def goal_position_error_m(log: TrialLog) -> float:
    """Distance to the goal at the end, whatever the outcome.

    Formula: |p(end) - goal|, the last goal.
    """
    require(log, "goal")
    if ended_on_other_floor(log):
        raise Undefined("the trial ended on another floor")
    return np.hypot(*(positions(log)[-1] - goals(log)[-1, :2]))


@metric(unit="deg", better="lower", title="Heading error at the end")
def goal_heading_error_deg(log: TrialLog) -> float:
    """Angle to the goal's heading at the end, whatever the outcome.

    Formula: |wrap(yaw(end) - yaw goal)|, of the last goal.
    """
    require(log, "goal")
    if ended_on_other_floor(log):
        raise Undefined("the trial ended on another floor")
    yaw = column(log, "yaw_rad")[-1]
    return abs(np.degrees(wrap(yaw - goals(log)[-1, 2])))


# Several metrics measure one log in turn, and a log does not change: the last result is kept.
@lru_cache(maxsize=1)
def projection_on_plans(log: TrialLog) -> Projection:
    """Returns each sample's nearest point on the plan in force, NaN without a plan."""
    if not log.plans:
        raise Undefined("there is no plan")
    path = positions(log)
    in_force = np.searchsorted([plan.time_s for plan in log.plans], times(log), side="right") - 1
    found = Projection(*np.full((3, len(path)), np.nan))
    if "floor" in log.samples.columns:
        # After a ride in a lift the plan in force lies on the old floor until there is a new plan.
        plan_floors = np.array([floor_of_leg(log, plan.leg) for plan in log.plans])
        in_force = np.where(plan_floors[in_force] == column(log, "floor"), in_force, -1)
    for index in np.unique(in_force[in_force >= 0]):
        line = log.plans[index].poses[:, :2]
        if path_length(line) > 0.0:
            rows = in_force == index
            for values, part in zip(found, project_on_polyline(path[rows], line), strict=True):
                values[rows] = part
    if np.isnan(found.distance_m).all():
        raise Undefined("the plan has no length")
    return found


def _mean_while_planned(log: TrialLog, values: Array) -> float:
    """Returns the mean over the time between neighbouring samples that both have a value."""
    known = ~np.isnan(values)
    if known.all():
        return time_mean(times(log), values)
    between = known[1:] & known[:-1]
    steps_s = np.diff(times(log))[between]
    if len(steps_s) == 0:
        return float(values[known].mean())
    return float((0.5 * (values[1:] + values[:-1])[between] * steps_s).sum() / steps_s.sum())


def _heading_errors_deg(log: TrialLog) -> Array:
    difference = column(log, "yaw_rad") - projection_on_plans(log).tangent_rad
    return np.degrees([wrap(angle) for angle in difference])
