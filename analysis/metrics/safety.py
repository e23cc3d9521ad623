"""Safety of a trial: clearances, touches, and time to collision."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import TypeAdapter

from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.collision_time import times_to_collision
from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.metrics.signals import (
    column,
    hold_durations,
    is_carried,
    lateral_velocity,
    require,
    times,
)
from drake_navbench.inputs.world import Obstacle, World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.least_gap import NearObstacles, least_gap
from drake_navbench.kernels.outline_distance import outline_to_circles
from drake_navbench.kernels.swept_contact import clearance_at, pose_within_step
from drake_navbench.logs.log import TrialLog

# A hand's breadth and a bit on each side of a chair: a passenger feels this as "close".
DANGER_DISTANCE_M = 0.25
COLLISION_TIME_STEP_S = 0.1
# A touch later than this does not count.
COLLISION_TIME_HORIZON_S = 10.0
COLLISION_TIME_PARTS = 16
# Distances to obstacles farther away than this are not measured, as in a trial.
MAX_CLEARANCE_M = 5.0
# Times that differ by less count as equal: rounding.
ROUNDING_S = 1e-9


@metric(unit="m", better="higher", title="Smallest clearance", relevant=0.01)
def min_clearance_m(log: TrialLog) -> float:
    """Smallest distance between the robot's footprint and an obstacle.

    Formula: minimum over the trial, to 0.1 mm, of the distance in the plane, up to 5 m, also
    between samples (on the cubic through poses and velocities; not of a recording without
    obstacles); 0 in a trial that ended at a touch.
    """
    return least_clearance_m(log, _clearances_m(log).min())


@metric(unit="m", better="higher", title="Smallest distance to a cell's centre")
def min_cell_centre_distance_m(log: TrialLog) -> float:
    """Smallest distance from the reference point to the centre of a lethal cell.

    Formula: minimum over the samples of the log. Unlike the published distance, it does not depend
    on the side on which the obstacle stands.
    """
    distances = column(log, "obstacle_cell_distance_m")
    seen = distances[np.isfinite(distances)]
    if len(seen) == 0:
        raise Undefined("no obstacle came into the local costmap")
    return seen.min()


@metric(unit="m", better="higher", title="Smallest clearance by the scan")
def min_scan_clearance_m(log: TrialLog) -> float:
    """Smallest distance between footprint and a point that the lidar hit, for recordings too.

    Formula: minimum over all hits but those on the robot itself of the distance in the plane, up to
    5 m.
    """
    require(log, "scan")
    if not log.scans:
        raise Undefined("the log has no scans")
    nearest_m = nearest_hit_m(log)
    if math.isinf(nearest_m):
        raise Undefined("no obstacle was hit within 5 m")
    return nearest_m


@metric(unit="m", better="higher", title="Smallest clearance by the map")
def min_map_clearance_m(log: TrialLog) -> float:
    """Smallest distance between footprint and obstacles on the map, for recordings too.

    Formula: minimum, every 0.1 s, of the distance in the plane, up to 5 m, at the localized pose.
    """
    require(log, "map")
    world = World(tuple(shape for shape in shapes_of(log) if shape.known_to_planner))
    if not world.shapes:
        raise Undefined("the map shows nothing")
    names = ("estimated_x_m", "estimated_y_m", "estimated_yaw_rad")
    poses = np.column_stack([column(log, name) for name in names])[_rows_apart(log)]
    low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
    outline = np.ascontiguousarray(outline_of(log))
    reach_m = MAX_CLEARANCE_M + np.hypot(*outline.T).max()
    edges = edges_within(world.segments, low - reach_m, high + reach_m)
    nearest_m = min(
        clearance_at(outline, x, y, yaw, edges, world.circles, MAX_CLEARANCE_M)
        for x, y, yaw in poses
    )
    if math.isinf(nearest_m):
        raise Undefined("nothing on the map came within 5 m")
    return nearest_m


@metric(unit="m", better="higher", title="Clearance kept for 95% of the time")
def clearance_p05_m(log: TrialLog) -> float:
    """Clearance that was kept for 95% of the time with an obstacle within 5 m.

    Formula: 5th percentile of the clearance, one sample every 0.05 s.
    """
    return np.percentile(_clearances_m(log), 5)


@metric(unit="", better="lower", title="Share of the time near an obstacle")
def danger_time_ratio(log: TrialLog) -> float:
    """Share of the time with less than 0.25 m between footprint and obstacle.

    Formula: time with clearance < 0.25 m / duration, one sample every 0.05 s.
    Source: MRPB 1.0, p_o.
    """
    return danger_share(times(log), column(log, "clearance_m"))


@metric(unit="s", better="higher", title="Shortest time to collision")
def time_to_collision_min_s(log: TrialLog) -> float:
    """Shortest time to a touch of an obstacle at constant v and w.

    Formula: minimum, every 0.1 s, of the time until the footprint touches an obstacle; up to 10 s.
    """
    edges = obstacle_edges(log)
    if len(edges) == 0:
        raise Undefined("there is no obstacle")
    shortest_s = shortest_collision_time_s(log, edges)
    if math.isinf(shortest_s):
        raise Undefined("no course met an obstacle within 10 s")
    return shortest_s


def danger_share(time_s: Array, clearance_m: Array) -> float:
    """Returns the share of time with less than DANGER_DISTANCE_M; samples hold until the next."""
    held_s = hold_durations(time_s)
    if held_s.sum() == 0.0:
        raise Undefined("the trial has no duration")
    return float(held_s[clearance_m < DANGER_DISTANCE_M].sum() / held_s.sum())


def shortest_collision_time_s(log: TrialLog, edges: Array) -> float:
    """Returns the shortest time to collision over samples 0.1 s apart; inf if all exceed 10 s."""
    rows = _rows_apart(log)
    poses = np.column_stack([column(log, name)[rows] for name in ("x_m", "y_m", "yaw_rad")])
    forward, turning = (column(log, name)[rows] for name in ("v_mps", "w_radps"))
    twists = np.column_stack([forward, turning, lateral_velocity(log)[rows]])
    outline = outline_of(log)
    shortest_s = COLLISION_TIME_HORIZON_S
    is_met = False
    # Each part takes every 16th sample: the first part soon finds a short time, which limits the
    # search in all others.
    for part in range(COLLISION_TIME_PARTS):
        chosen = slice(part, None, COLLISION_TIME_PARTS)
        moments_s = times_to_collision(
            poses[chosen], twists[chosen], outline, edges, horizon_s=shortest_s
        )
        found_s = moments_s.min(initial=math.inf)
        if found_s <= shortest_s:
            shortest_s, is_met = float(found_s), True
    return shortest_s if is_met else math.inf


def nearest_hit_m(log: TrialLog) -> float:
    """Returns the distance from the outline to the nearest hit of any scan, m; inf beyond 5 m."""
    outline = np.ascontiguousarray(outline_of(log))
    body = shapely.Polygon(outline)
    path = [column(log, name) for name in ("x_m", "y_m", "yaw_rad")]
    time_s = times(log)
    nearest_m = math.inf
    for scan in log.scans:
        x, y, yaw = (float(np.interp(scan.time_s, time_s, values)) for values in path)
        offset = scan.hits - [x, y]
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        hits = np.zeros((len(offset), 3))
        hits[:, 0] = cos_yaw * offset[:, 0] + sin_yaw * offset[:, 1]
        hits[:, 1] = cos_yaw * offset[:, 1] - sin_yaw * offset[:, 0]
        # Hits within the outline are left out: the robot saw a part of itself.
        apart = hits[~shapely.contains_xy(body, hits[:, 0], hits[:, 1])]
        nearest_m = min(nearest_m, outline_to_circles(outline, apart, MAX_CLEARANCE_M))
    return nearest_m


def obstacle_outlines(log: TrialLog) -> list[Array]:
    """Returns the corners of every obstacle in the world frame, (K, 2) m each."""
    return [obstacle.outline for obstacle in shapes_of(log)]


def obstacle_edges(log: TrialLog) -> Array:
    """Returns the edges of all obstacles, (E, 4) x0, y0, x1, y1 m.

    Raises Undefined for a recording, which does not contain the positions of all obstacles.
    """
    require(log, "obstacles")
    edges = [np.hstack([o, np.roll(o, -1, axis=0)]) for o in obstacle_outlines(log)]
    return np.vstack(edges) if edges else np.empty((0, 4))


def _rows_apart(log: TrialLog) -> NDArray[np.int64]:
    """Returns the samples that are at least 0.1 s apart."""
    time_s = times(log)
    grid = np.arange(time_s[0], time_s[-1] + 1e-9, COLLISION_TIME_STEP_S)
    return np.unique(np.searchsorted(time_s, grid + 1e-9, side="right") - 1)


def _clearances_m(log: TrialLog) -> Array:
    clearance = column(log, "clearance_m")
    near = clearance[np.isfinite(clearance)]
    if len(near) == 0:
        raise Undefined("no obstacle came within 5 m")
    return near


def least_clearance_m(log: TrialLog, sampled_m: float) -> float:
    """Returns the least distance between footprint and obstacle over a trial, m.

    sampled_m: the least clearance at the samples; between samples it may be smaller. It is the
    result for a recording that does not contain the obstacles.
    """
    if "obstacles" in log.missing:
        return sampled_m
    time_s, states = _motion_of(log)
    outline = np.ascontiguousarray(outline_of(log))
    is_step = ~is_carried(log)[: len(time_s) - 1]
    around = _surroundings(log, states, reach_m=sampled_m + np.hypot(*outline.T).max())
    return float(least_gap(outline, time_s, states, is_step, around, sampled_m))


def _motion_of(log: TrialLog) -> tuple[Array, Array]:
    """Returns times (T,) s and states (T, 6) up to the end of the trial; the log goes on after it.

    A state is x m, y m, yaw rad, v m/s, w rad/s, vy m/s.
    """
    time_s, end_s = times(log), log.end_time_s
    names = ("x_m", "y_m", "yaw_rad", "v_mps", "w_radps")
    states = np.column_stack([*(column(log, name) for name in names), lateral_velocity(log)])
    count = max(int(np.searchsorted(time_s, end_s + ROUNDING_S, side="right")), 1)
    last, after = count - 1, min(count, len(time_s) - 1)
    if after == last or time_s[last] >= end_s - ROUNDING_S:
        # A copy: for the log's read-only times the kernel would be compiled once more.
        return time_s[:count].copy(), states[:count]
    duration_s = time_s[after] - time_s[last]
    share = (end_s - time_s[last]) / duration_s
    end = (1.0 - share) * states[last] + share * states[after]
    end[:3] = pose_within_step(states[last], states[after], duration_s, share)
    return np.append(time_s[:count], end_s), np.vstack([states[:count], end])


def _surroundings(log: TrialLog, states: Array, *, reach_m: float) -> NearObstacles:
    """Returns the obstacles within reach of the trial's positions, and everything that moves."""
    world, movers = World(tuple(shapes_of(log))), movers_of(log)
    low, high = states[:, :2].min(axis=0), states[:, :2].max(axis=0)
    return NearObstacles(
        edges_within(world.segments, low - reach_m, high + reach_m),
        world.circles,
        movers.bodies.edges,
        movers.bodies.discs,
        movers.tracks.knots,
        movers.tracks.firsts,
        movers.tracks.periods_s,
        movers.top_speed_mps,
    )


def shapes_of(log: TrialLog) -> list[Obstacle]:
    """Returns the obstacles of a log, the walls of a map among them."""
    return TypeAdapter(list[Obstacle]).validate_python(log.obstacles)


def edges_within(edges: Array, low: Array, high: Array) -> Array:
    """Returns the edges (N, 4) whose bounding box overlaps a rectangle."""
    x, y = edges[:, [0, 2]], edges[:, [1, 3]]
    reaches = (x.max(axis=1) >= low[0]) & (x.min(axis=1) <= high[0])
    reaches &= (y.max(axis=1) >= low[1]) & (y.min(axis=1) <= high[1])
    return np.ascontiguousarray(edges[reaches])
