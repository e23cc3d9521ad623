"""How close the robot came to harm."""

from __future__ import annotations

import numpy as np
import shapely
from pydantic import TypeAdapter

from drake_navbench.analysis.metrics.collision_time import times_to_collision
from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.signals import Array, column, hold_durations, positions, times
from drake_navbench.kernels.footprint import circle_footprint
from drake_navbench.log import TrialLog
from drake_navbench.world import Obstacle

# A hand's breadth and a bit on each side of a chair: what a passenger reads as "close".
DANGER_DISTANCE_M = 0.25
COLLISION_TIME_STEP_S = 0.1
# A course that meets an obstacle later than this is not counted as one that meets it.
COLLISION_TIME_HORIZON_S = 10.0


@metric(unit="m", better="higher")
def min_clearance_m(log: TrialLog) -> float:
    """Smallest distance between footprint and obstacle: the true form of the published one.

    Formula: minimum of SceneGraph's signed distance; negative where they overlap.
    """
    return _clearances_m(log).min()


@metric(unit="m", better="higher")
def clearance_p05_m(log: TrialLog) -> float:
    """Clearance that the robot kept for 95% of the time that an obstacle was within 5 m.

    Formula: 5th percentile over the samples of footprint clearance.
    """
    return np.percentile(_clearances_m(log), 5)


@metric(unit="", better="lower")
def danger_time_ratio(log: TrialLog) -> float:
    """Share of the time with less than 0.25 m between footprint and obstacle.

    Formula: time with clearance < 0.25 m / duration; every sample counts until the next one.
    Source: MRPB 1.0, p_o.
    """
    return danger_share(times(log), column(log, "clearance_m"))


@metric(unit="s", better="higher")
def time_to_collision_min_s(log: TrialLog) -> float:
    """Shortest time in which the footprint would have touched an obstacle at its current twist.

    Formula: minimum over the trial, every 0.1 s, of the exact time to contact of the footprint on
    its circle or line, up to 10 s.
    """
    edges = obstacle_edges(log)
    if len(edges) == 0:
        raise Undefined("there is no obstacle")
    moments = collision_times_s(log, _edges_in_reach(log, edges))
    if moments.min() > COLLISION_TIME_HORIZON_S:
        raise Undefined("no course met an obstacle within 10 s")
    return moments.min()


def danger_share(
    time_s: Array, clearance_m: Array, *, distance_m: float = DANGER_DISTANCE_M
) -> float:
    """Returns the share of time with a clearance below a distance; samples hold until the next."""
    held_s = hold_durations(time_s)
    if held_s.sum() == 0.0:
        raise Undefined("the trial has no duration")
    return float(held_s[clearance_m < distance_m].sum() / held_s.sum())


def collision_times_s(log: TrialLog, edges: Array) -> Array:
    """Returns the time to collision every 0.1 s, (N,) s, inf where the course is free."""
    time_s = times(log)
    grid = np.arange(time_s[0], time_s[-1] + 1e-9, COLLISION_TIME_STEP_S)
    rows = np.searchsorted(time_s, grid + 1e-9, side="right") - 1
    poses = np.column_stack([column(log, name)[rows] for name in ("x_m", "y_m", "yaw_rad")])
    twists = np.column_stack([column(log, name)[rows] for name in ("v_mps", "w_radps")])
    return times_to_collision(poses, twists, robot_outline(log), edges)


def robot_outline(log: TrialLog) -> Array:
    """Returns the corners of the robot in the base frame, (K, 2) m."""
    robot = log.info["robot"]
    if robot["footprint"] is None:
        return circle_footprint(robot["robot_radius"])
    return np.array(robot["footprint"])


def obstacle_outlines(log: TrialLog) -> list[Array]:
    """Returns the corners of every obstacle in the world frame, (K, 2) m each."""
    obstacles = TypeAdapter(list[Obstacle]).validate_python(log.obstacles)
    return [obstacle.outline for obstacle in obstacles]


def obstacle_edges(log: TrialLog) -> Array:
    """Returns the edges of all obstacles, (E, 4) x0, y0, x1, y1 m."""
    edges = [np.hstack([o, np.roll(o, -1, axis=0)]) for o in obstacle_outlines(log)]
    return np.vstack(edges) if edges else np.empty((0, 4))


def _edges_in_reach(log: TrialLog, edges: Array) -> Array:
    """Returns the edges that the robot could have met within the horizon: few of a whole map."""
    speed_mps = np.abs(column(log, "v_mps")).max()
    radius_m = np.hypot(*robot_outline(log).T).max()
    reach_m = radius_m + speed_mps * COLLISION_TIME_HORIZON_S
    path = shapely.MultiPoint(positions(log)).convex_hull
    near = shapely.dwithin(shapely.linestrings(edges.reshape(-1, 2, 2)), path, reach_m)
    return edges[near]


def _clearances_m(log: TrialLog) -> Array:
    clearance = column(log, "clearance_m")
    near = clearance[np.isfinite(clearance)]
    if len(near) == 0:
        raise Undefined("no obstacle came within 5 m")
    return near
