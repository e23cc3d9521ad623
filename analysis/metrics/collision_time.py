"""Exact time to collision of a turning polygon with resting polygons.

The robot keeps its twist (v, w, vy), so every point of it moves on a circle around one centre, or
on a straight line. Two polygons first touch where a corner of one meets an edge of the other; both
cases are a circle (or a line) against a segment, which has a closed form. The obstacles' corners
are taken into the robot's frame, where they move on circles the other way round.
"""

from __future__ import annotations

import math

import numpy as np

from drake_navbench.kernels.arrays import Array

# Turning more slowly than this bends a path of 10 m by less than 1e-5 m.
STRAIGHT_BELOW_RADPS = 1e-6
TWO_PI = 2.0 * np.pi
# A generous upper bound of the relative rounding error of a distance.
ROUNDING_RATIO = 1e-9
# The number of pairs of a corner and an edge that are handled at once: about 20 MB.
BATCH_PAIRS = 200_000


def times_to_collision(
    poses: Array, twists: Array, footprint: Array, edges: Array, *, horizon_s: float = math.inf
) -> Array:
    """Returns the time until the footprint touches an edge at a constant twist, (T,) s; inf: never.

    poses: (T, 3) x m, y m, yaw rad. twists: (T, 3) v m/s, w rad/s, vy m/s. footprint: (K, 2)
    corners in the base frame, m. edges: (E, 4) x0, y0, x1, y1 of the obstacles' closed outlines in
    the world frame, m. horizon_s: later touches may be missed: edges out of reach are not
    examined. At the start the footprint must not touch an edge.
    """
    result = np.full(len(poses), np.inf)
    moving = np.flatnonzero(np.any(twists != 0.0, axis=1))
    if len(edges) == 0 or len(moving) == 0:
        return result
    reach_m = _reach_m(twists[moving], footprint, horizon_s)
    near = _distances_m(poses[moving, :2], edges) <= reach_m[:, None]
    outline = np.hstack([footprint, np.roll(footprint, -1, axis=0)])[None]
    pose_rows, edge_rows = np.nonzero(near)
    pose_rows = moving[pose_rows]
    size = max(BATCH_PAIRS // len(footprint), 1)
    for first in range(0, len(pose_rows), size):
        rows = pose_rows[first : first + size]
        local = _to_base_frame(edges[edge_rows[first : first + size]], poses[rows])
        own_corners = _first_meeting(footprint[None], local, twists[rows])
        # In the robot's frame the world moves the other way.
        their_corners = _first_meeting(local[..., :2], outline, -twists[rows])
        np.minimum.at(result, rows, np.minimum(own_corners, their_corners))
    return result


def _reach_m(twists: Array, footprint: Array, horizon_s: float) -> Array:
    """Returns the radius of a disc that holds the footprint's motion within the horizon, (T,) m.

    The disc is centred at the present reference point.
    """
    v, w = np.hypot(twists[:, 0], twists[:, 2]), np.abs(twists[:, 1])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        diameter_m = np.where(w < STRAIGHT_BELOW_RADPS, np.inf, 2.0 * v / w)
        driven_m = np.where(v == 0.0, 0.0, v * horizon_s)
    reach_m = np.hypot(*footprint.T).max() + np.minimum(driven_m, diameter_m)
    return reach_m * (1.0 + ROUNDING_RATIO)


def _distances_m(points: Array, edges: Array) -> Array:
    """Returns the distance of every point (T, 2) from every edge (E, 4), (T, E) m."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    squared_m2 = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    offset = points[:, None, :] - start
    share = np.clip((offset * along).sum(axis=2) / squared_m2, 0.0, 1.0)
    return np.hypot(*np.moveaxis(offset - share[..., None] * along, -1, 0))


def _to_base_frame(edges: Array, poses: Array) -> Array:
    """Returns every edge (P, 4) as seen from the pose (P, 3) of the same row: (P, 1, 4)."""
    cos_yaw, sin_yaw = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    rotations = np.array([[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]]).transpose(2, 0, 1)
    ends = edges.reshape(-1, 2, 2) - poses[:, None, :2]
    return (ends @ rotations).reshape(-1, 1, 4)


def _first_meeting(points: Array, edges: Array, twists: Array) -> Array:
    """Returns when points that move with twists (T, 3) about the base meet an edge, (T,) s.

    points: (T or 1, P, 2). edges: (T or 1, E, 4).
    """
    point = points[:, :, None, :]
    start = edges[:, None, :, :2]
    along = edges[:, None, :, 2:] - start
    v, w, vy = (twists[:, i, None, None] for i in range(3))
    # Comparisons with NaN are false: parallel lines and circles out of reach drop out.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        centre = np.stack([-vy / w, v / w], axis=-1)
        turning = _circle_meets_edges(point - centre, start - centre, along, rate_radps=w)
        straight = _line_meets_edges(point, start, along, v, vy)
        moments = np.where(np.abs(w) < STRAIGHT_BELOW_RADPS, straight, turning)
    moments = np.where(moments >= 0.0, moments, np.inf)
    return moments.min(axis=(1, 2))


def _line_meets_edges(point: Array, start: Array, along: Array, v: Array, vy: Array) -> Array:
    """Solves point + (v, vy) t = start + s along for t, s in [0, 1]; NaN without a solution."""
    offset = point - start
    # Most motions are straight ahead: solve them without the rounding of a cross product.
    ahead = offset[..., 1] / along[..., 1]
    crossing = v * along[..., 1] - vy * along[..., 0]
    share = np.where(vy == 0.0, ahead, (v * offset[..., 1] - vy * offset[..., 0]) / crossing)
    forward = (start[..., 0] + share * along[..., 0] - point[..., 0]) / v
    sideways = (start[..., 1] + share * along[..., 1] - point[..., 1]) / vy
    moment = np.where(np.abs(v) >= np.abs(vy), forward, sideways)
    return np.where((share >= 0.0) & (share <= 1.0), moment, np.nan)


def _circle_meets_edges(arm: Array, start: Array, along: Array, *, rate_radps: Array) -> Array:
    """Solves |start + s along| = |arm| for s in [0, 1]; returns the arm's time to get there."""
    a = (along**2).sum(-1)
    half_b = (start * along).sum(-1)
    c = (start**2).sum(-1) - (arm**2).sum(-1)
    root = np.sqrt(half_b**2 - a * c)
    bearing = np.arctan2(arm[..., 1], arm[..., 0])
    first: Array = np.array(np.inf)
    for share in ((-half_b - root) / a, (-half_b + root) / a):
        met = start + share[..., None] * along
        turn = np.sign(rate_radps) * (np.arctan2(met[..., 1], met[..., 0]) - bearing)
        moment = np.mod(turn, TWO_PI) / np.abs(rate_radps)
        first = np.minimum(first, np.where((share >= 0.0) & (share <= 1.0), moment, np.inf))
    return first
