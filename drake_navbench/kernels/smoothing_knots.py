"""Knots of a path for the constrained smoother, and the path through smoothed knots.

A signed path is a pair: points (N, 2) m and signs (N,), +1 where the robot drives forward after the
point and -1 where it drives backwards. A cusp is a point where the sign changes.
Source: nav2_constrained_smoother (ConstrainedSmoother::smooth, Smoother::buildProblem,
Smoother::upsampleAndPopulate).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.constrained_smoothing import tangent

# The least length of the previous spacing where it is divided by the next spacing.
MIN_SPACING_M = 1e-4
# The inner control points of a cubic Bezier curve lie this part of its chord from its ends.
BEZIER_HANDLE_RATIO = 0.4


class Knots(NamedTuple):
    """The points of a path that are smoothed.

    indices: (K,) into the path. is_fixed: (K,) those that stay.
    spacing_ratios, is_reversing, cusp_shares: (K - 2,) of the inner knots: spacing before over
        spacing after, negative at a cusp; whether the robot drives backwards after the knot; 1 at a
        cusp, falling to 0 at the end of the cusp zone.
    """

    indices: NDArray[np.int64]
    is_fixed: NDArray[np.bool_]
    spacing_ratios: Array
    is_reversing: NDArray[np.bool_]
    cusp_shares: Array


def driving_signs(path: Array, *, reversing_enabled: bool, keep_start_orientation: bool) -> Array:
    """Returns (N,) +1 or -1: whether each pose's heading agrees with the step to the next pose.

    The last pose takes the sign of the pose before it; the first one takes that of the next pose
    unless its heading is kept. All +1 unless `reversing_enabled`.
    """
    signs = np.ones(len(path))
    if reversing_enabled:
        steps = np.diff(path[:, :2], axis=0)
        along = np.cos(path[:-1, 2]) * steps[:, 0] + np.sin(path[:-1, 2]) * steps[:, 1]
        signs[:-1][along < 0.0] = -1.0
    signs[-1] = signs[-2]
    if not keep_start_orientation and len(path) > 2:
        signs[0] = signs[1]
    return signs


def select_knots(
    points: Array,
    signs: Array,
    *,
    downsampling_factor: int,
    keep_start_orientation: bool,
    keep_goal_orientation: bool,
    cusp_zone_length: float,
) -> Knots:
    """Chooses the knots of a signed path: every n-th point, all cusps, ends and their neighbours.

    A neighbour of an end is a knot (a fixed one) where that end's orientation is kept. A ratio is
    infinite where a knot coincides with the next one. cusp_zone_length: m.
    """
    last = len(points) - 1
    is_cusp = np.zeros(last + 1, dtype=bool)
    is_cusp[1:last] = signs[1:last] * signs[: last - 1] < 0.0
    holders = {0, last}
    if keep_start_orientation:
        holders.add(1)
    if keep_goal_orientation:
        holders.add(last - 1)
    chosen = [0]
    for i in range(1, last + 1):
        if i in holders or is_cusp[i] or i - chosen[-1] >= downsampling_factor:
            chosen.append(i)
    indices = np.array(chosen)
    steps = np.diff(points[indices], axis=0)
    spacing = np.hypot(steps[:, 0], steps[:, 1])
    inner_cusps = is_cusp[indices[1:-1]]
    before, after = np.maximum(spacing[:-1], MIN_SPACING_M), spacing[1:]
    ratios = np.divide(before, after, out=np.full(len(after), np.inf), where=after > 0.0)
    return Knots(
        indices,
        np.isin(indices, list(holders)),
        np.where(inner_cusps, -ratios, ratios),
        signs[indices[1:-1]] < 0.0,
        _cusp_shares(spacing, inner_cusps, cusp_zone_length),
    )


def _cusp_shares(spacings: Array, inner_cusps: NDArray[np.bool_], zone_length: float) -> Array:
    """Returns (K - 2,) the part that the cusp's weight has at each inner knot.

    spacings: (K - 1,) distances between neighbouring knots, m. A share falls linearly from 1 to 0
    over half the zone. As in Nav2, the distance counts from the knot before the cusp onwards, and
    up to the cusp from the knot after the one that asks; and how far back a cusp reaches is summed
    up from the path's start or the last cusp (`backlog`), so that a share near the rim may be lost.
    """
    half_length = 0.5 * zone_length
    shares = np.zeros(len(inner_cusps))
    if half_length == 0.0:
        return shares
    stations = np.concatenate([[0.0], np.cumsum(spacings)])
    oldest = 1
    backlog = 0.0
    since_cusp = math.inf
    for knot, spacing in enumerate(spacings, start=1):
        backlog += spacing
        while oldest <= knot - 2 and backlog > half_length:
            backlog -= spacings[oldest]
            oldest += 1
        if knot <= len(inner_cusps) and inner_cusps[knot - 1]:
            reached = np.arange(oldest, knot - 1)
            to_cusp = stations[knot] - stations[reached + 1]
            shares[reached - 1] = np.maximum(shares[reached - 1], 1.0 - to_cusp / half_length)
            oldest, backlog, since_cusp = knot - 1, 0.0, 0.0
        if knot >= 2:
            shares[knot - 2] = max(0.0, 1.0 - since_cusp / half_length)
        since_cusp += spacing
    return shares


def _unit_along(direction: tuple[float, float], ahead: Array) -> Array:
    """Returns the unit vector of a direction, turned round where it points away from `ahead`."""
    vector = np.array(direction)
    if vector @ ahead < 0.0:
        vector = -vector
    return vector / math.hypot(*vector)


def _knot_directions(
    knots: Array, signs: Array, start_yaw: float | None, goal_yaw: float | None
) -> Array:
    """Returns (K, 2) unit vectors of the robot's heading at the knots; see `path_through_knots`."""
    steps = np.diff(knots, axis=0)
    directions = np.empty_like(knots)
    if start_yaw is None:
        directions[0] = _unit_along(tuple(steps[0]), steps[0] * signs[0])
    else:
        directions[0] = math.cos(start_yaw), math.sin(start_yaw)
    for k in range(1, len(knots) - 1):
        after = -steps[k] if signs[k - 1] * signs[k] < 0.0 else steps[k]
        along = tangent(steps[k - 1, 0], steps[k - 1, 1], after[0], after[1])
        directions[k] = _unit_along(along, steps[k] * signs[k])
    if goal_yaw is None:
        directions[-1] = _unit_along(tuple(steps[-1]), steps[-1] * signs[-1])
    else:
        directions[-1] = math.cos(goal_yaw), math.sin(goal_yaw)
    return directions


def path_through_knots(
    knots: Array,
    indices: NDArray[np.int64],
    signs: Array,
    *,
    upsampling_factor: int,
    start_yaw: float | None,
    goal_yaw: float | None,
) -> Array:
    """Returns the path (M, 3) through smoothed knots, with poses between them.

    knots: (K, 2) m. indices: (K,) of the knots in the signed path with signs (K,) at the knots.
    upsampling_factor: poses per point of that path: (gap in indices) x factor - 1 poses are put
        between two knots, on a cubic Bezier curve along their headings; 0 puts none.
    start_yaw, goal_yaw: headings of the end poses, rad; None takes that of the adjacent segment.
    The headings of all others are arc tangents, pointing as the signs say.
    """
    directions = _knot_directions(knots, signs, start_yaw, goal_yaw)
    pieces = [np.array([[*knots[0], math.atan2(directions[0, 1], directions[0, 0])]])]
    for k in range(len(knots) - 1):
        count = max(0, int(indices[k + 1] - indices[k]) * upsampling_factor - 1)
        piece = np.empty((count + 1, 3))
        piece[:, :2] = _bezier(
            knots[k], knots[k + 1], directions[k] * signs[k], directions[k + 1] * signs[k], count
        )
        piece[-1, 2] = math.atan2(directions[k + 1, 1], directions[k + 1, 0])
        line = np.vstack([pieces[-1][-1, :2], piece[:, :2]])
        steps = np.diff(line, axis=0)
        for j in range(count):
            along = tangent(*steps[j], *steps[j + 1])
            heading = _unit_along(along, steps[j + 1] * signs[k])
            piece[j, 2] = math.atan2(heading[1], heading[0])
        pieces.append(piece)
    return np.vstack(pieces)


def _bezier(start: Array, end: Array, leaving: Array, arriving: Array, count: int) -> Array:
    """Returns (count + 1, 2) points after `start` up to `end` on a cubic Bezier curve.

    leaving, arriving: (2,) unit vectors of travel at its ends.
    """
    handle = BEZIER_HANDLE_RATIO * math.hypot(*(end - start))
    t = (np.arange(1, count + 2) / (count + 1))[:, None]
    points = (
        (1.0 - t) ** 3 * start
        + 3.0 * (1.0 - t) ** 2 * t * (start + handle * leaving)
        + 3.0 * (1.0 - t) * t**2 * (end - handle * arriving)
        + t**3 * end
    )
    points[-1] = end
    return points
