"""Exact distances along the beams of a planar range finder."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array


def cast_rays(
    origin_xy: Array, angles: Array, segments: Array, circles: Array, range_max: float
) -> Array:
    """Returns the distance to the first thing each beam meets, (K,) m; inf where there is none.

    origin_xy: (2,) m, where all beams start. angles: (K,) rad, any order and spacing.
    segments: (N, 4) straight edges x0, y0, x1, y1 m. circles: (M, 3) x, y, radius m.
    All in one frame. Things farther than range_max m are not seen.

    Outlines have no inside: a beam that starts within a polygon or a circle meets its far boundary.
    Two edges that share a corner leave no gap. A beam that runs along an edge does not meet that
    edge, but its neighbours at the corner.
    """
    x, y = float(origin_xy[0]), float(origin_xy[1])
    return _cast_rays(x, y, angles, segments, circles, float(range_max))


@njit(cache=True)
def _cast_rays(x, y, angles, segments, circles, range_max):
    cosines, sines = np.cos(angles), np.sin(angles)
    ranges = np.full(angles.shape, np.inf)
    _meet_segments(ranges, cosines, sines, x, y, segments, range_max)
    _meet_circles(ranges, cosines, sines, x, y, circles)
    for k in range(ranges.shape[0]):
        if ranges[k] > range_max:
            ranges[k] = np.inf
    return ranges


# Dividing by zero gives inf or NaN, as in numpy, so that the inner loop stays free of branches.
@register_jitable(error_model="numpy")
def _meet_segments(ranges, cosines, sines, origin_x, origin_y, segments, range_max):
    """Lowers `ranges`, in place, to the distance of the segments that a beam meets.

    Which side of a beam an end lies on is the cross product of the two; a beam meets the segment
    where the ends lie on different sides. Edges that share an end agree on its side bit for bit.
    """
    for n in range(segments.shape[0]):
        x0, y0 = segments[n, 0] - origin_x, segments[n, 1] - origin_y
        x1, y1 = segments[n, 2] - origin_x, segments[n, 3] - origin_y
        area = x0 * y1 - y0 * x1
        if _is_out_of_range(x0, y0, x1, y1, area, range_max):
            continue
        for k in range(ranges.shape[0]):
            side_0 = cosines[k] * y0 - sines[k] * x0
            side_1 = cosines[k] * y1 - sines[k] * x1
            distance = area / (side_1 - side_0)
            # Signs, not their product: that of two tiny numbers is 0.
            is_across = ((side_0 <= 0.0) & (side_1 >= 0.0)) | ((side_0 >= 0.0) & (side_1 <= 0.0))
            if is_across & (distance >= 0.0) & (distance < ranges[k]):
                ranges[k] = distance


@register_jitable
def _is_out_of_range(x0, y0, x1, y1, area, range_max):
    """Returns whether all of a segment is farther than range_max from the origin."""
    edge_x, edge_y = x1 - x0, y1 - y0
    length_squared = edge_x * edge_x + edge_y * edge_y
    along = -(x0 * edge_x + y0 * edge_y)
    if along <= 0.0:
        nearest_squared = x0 * x0 + y0 * y0
    elif along >= length_squared:
        nearest_squared = x1 * x1 + y1 * y1
    else:
        nearest_squared = area * area / length_squared
    return nearest_squared > range_max * range_max


@register_jitable
def _meet_circles(ranges, cosines, sines, origin_x, origin_y, circles):
    """Lowers `ranges`, in place, to the distance of the circles that a beam meets."""
    for m in range(circles.shape[0]):
        x, y, radius = circles[m, 0] - origin_x, circles[m, 1] - origin_y, circles[m, 2]
        for k in range(ranges.shape[0]):
            beside = cosines[k] * y - sines[k] * x
            half_chord_squared = radius * radius - beside * beside
            if half_chord_squared < 0.0:
                continue
            ahead = cosines[k] * x + sines[k] * y
            half_chord = math.sqrt(half_chord_squared)
            distance = ahead - half_chord
            if distance < 0.0:
                distance = ahead + half_chord
            if 0.0 <= distance < ranges[k]:
                ranges[k] = distance


@njit(cache=True)
def reported_ranges(ranges, range_min, range_max):
    """Returns measured ranges (K,) m as a scanner reports them, float32.

    -inf is nearer than the least range, +inf farther than the greatest one. (REP 117)
    """
    reported = np.empty(ranges.shape, np.float32)
    for k in range(ranges.shape[0]):
        reported[k] = ranges[k]
        if ranges[k] < range_min:
            reported[k] = -np.inf
        elif ranges[k] > range_max:
            reported[k] = np.inf
    return reported


def burst_dropouts(
    uniform: NDArray[np.float64], share: float, burst_beams: int
) -> NDArray[np.bool_]:
    """Returns (B,) which beams drop out, in bursts of neighbours, `share` of all in the mean.

    uniform: (B,) drawn evenly from 0 to 1, one a beam, counter-clockwise; the last beam's neighbour
    is the first. A burst begins at each beam with the probability q. It is chosen such that no
    burst reaches a beam with the probability (1 - q)^burst_beams = 1 - share.
    """
    length = min(burst_beams, uniform.size)
    begins = uniform < 1.0 - (1.0 - share) ** (1.0 / length)
    counted = np.cumsum(np.concatenate([[False], begins[uniform.size - length + 1 :], begins]))
    return np.asarray(counted[length:] > counted[:-length])


def stuck_ranges(
    generator: np.random.Generator, beam_count: int, share: float, range_max_m: float
) -> NDArray[np.float64]:
    """Returns (B,) the constant range of each stuck beam, m; NaN for a beam that works."""
    is_stuck = generator.random(beam_count) < share
    ranges = range_max_m * generator.random(beam_count)
    return np.where(is_stuck, ranges, np.nan)
