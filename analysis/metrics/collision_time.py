"""Exact time to collision of a turning polygon with resting polygons.

The robot keeps its twist (v, w), so every point of it moves on a circle around one centre, or on
a straight line. Two polygons first touch where a corner of one meets an edge of the other; both
cases are a circle (or a line) against a segment, which has a closed form. The obstacles' corners
are taken into the robot's frame, where they move on circles the other way round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Slower turning bends the path by less than 1e-5 m over 10 m.
STRAIGHT_BELOW_RADPS = 1e-6
TWO_PI = 2.0 * np.pi


def time_to_collision(
    pose: Array, twist: tuple[float, float], footprint: Array, edges: Array
) -> float:
    """Returns when the footprint first touches an edge if the twist is kept, s; inf if never.

    pose: (3,) x m, y m, yaw rad. twist: v m/s, w rad/s. footprint: (K, 2) corners in the base
    frame, m. edges: (E, 4) x0, y0, x1, y1 of the obstacles' outlines in the world frame, m. The
    footprint must not touch an edge to begin with.
    """
    v, w = twist
    if len(edges) == 0 or (v == 0.0 and w == 0.0):
        return np.inf
    local = _to_base_frame(edges.reshape(-1, 2), pose).reshape(-1, 4)
    outline = np.hstack([footprint, np.roll(footprint, -1, axis=0)])
    own_corners = _first_meeting(footprint, local, v, w)
    # Seen from the robot the world moves the other way.
    their_corners = _first_meeting(local[:, :2], outline, -v, -w)
    return float(min(own_corners, their_corners))


def _to_base_frame(points: Array, pose: Array) -> Array:
    cos_yaw, sin_yaw = np.cos(pose[2]), np.sin(pose[2])
    return (points - pose[:2]) @ np.array([[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]])


def _first_meeting(points: Array, edges: Array, v: float, w: float) -> float:
    """Returns when a point (P, 2) carried by the twist about the base origin meets an edge, s."""
    start, along = edges[None, :, :2], (edges[:, 2:] - edges[:, :2])[None, :, :]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if abs(w) < STRAIGHT_BELOW_RADPS:
            moments = _line_meets_edges(points[:, None, :], start, along, v)
        else:
            centre = np.array([0.0, v / w])
            moments = _circle_meets_edges(
                points[:, None, :] - centre, start - centre, along, rate_radps=w
            )
    # Comparisons with NaN are false: parallel lines and circles out of reach drop out.
    return float(np.min(np.where(moments >= 0.0, moments, np.inf), initial=np.inf))


def _line_meets_edges(point: Array, start: Array, along: Array, v: float) -> Array:
    """Solves point + v t e_x = start + s along for t, with s in [0, 1]; NaN where there is none."""
    share = (point[..., 1] - start[..., 1]) / along[..., 1]
    moment = (start[..., 0] + share * along[..., 0] - point[..., 0]) / v
    return np.where((share >= 0.0) & (share <= 1.0), moment, np.nan)


def _circle_meets_edges(arm: Array, start: Array, along: Array, *, rate_radps: float) -> Array:
    """Solves |start + s along| = |arm| for s in [0, 1]; returns when the arm points there."""
    a = (along**2).sum(-1)
    half_b = (start * along).sum(-1)
    c = (start**2).sum(-1) - (arm**2).sum(-1)
    root = np.sqrt(half_b**2 - a * c)
    bearing = np.arctan2(arm[..., 1], arm[..., 0])
    moments = []
    for share in ((-half_b - root) / a, (-half_b + root) / a):
        met = start + share[..., None] * along
        turn = np.sign(rate_radps) * (np.arctan2(met[..., 1], met[..., 0]) - bearing)
        moment = np.mod(turn, TWO_PI) / abs(rate_radps)
        moments.append(np.where((share >= 0.0) & (share <= 1.0), moment, np.nan))
    return np.stack(moments)
