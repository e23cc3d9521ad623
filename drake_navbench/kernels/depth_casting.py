"""The distances that a depth camera or a multi-layer lidar measures to upright shapes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array


class Solids(NamedTuple):
    """Upright shapes with flat tops and undersides, all in one frame.

    segments: (N, 4) edges x0, y0, x1, y1 m, those of a shape in one run, counter-clockwise.
    starts: (S + 1,) int first row of each shape; the last is N. bottoms, heights: (S,) m over the
    floor. circles: (M, 3) x, y, radius m, with circle_bottoms and circle_heights: (M,) m.
    """

    segments: Array
    starts: NDArray[np.int64]
    bottoms: Array
    heights: Array
    circles: Array
    circle_bottoms: Array
    circle_heights: Array

    def joined(self, other: Solids) -> Solids:
        """Returns these shapes, followed by the other ones."""
        return Solids(
            np.vstack([self.segments, other.segments]),
            np.concatenate([self.starts, self.starts[-1] + other.starts[1:]]),
            np.concatenate([self.bottoms, other.bottoms]),
            np.concatenate([self.heights, other.heights]),
            np.vstack([self.circles, other.circles]),
            np.concatenate([self.circle_bottoms, other.circle_bottoms]),
            np.concatenate([self.circle_heights, other.circle_heights]),
        )

    def within(self, bounds: tuple[float, float, float, float]) -> Solids:
        """Returns the shapes that are in a rectangle min_x, min_y, max_x, max_y m.

        The place of a shape is the first corner of its outline, that of a circle its centre.
        """
        chosen = are_within(self.segments[self.starts[:-1], :2], bounds)
        lengths = np.diff(self.starts)
        round_ones = are_within(self.circles[:, :2], bounds)
        return Solids(
            self.segments[np.repeat(chosen, lengths)],
            np.cumsum([0, *lengths[chosen]]),
            self.bottoms[chosen],
            self.heights[chosen],
            self.circles[round_ones],
            self.circle_bottoms[round_ones],
            self.circle_heights[round_ones],
        )


def are_within(points: Array, bounds: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Returns (N,) which of the points (N, 2) are in a rectangle min_x, min_y, max_x, max_y m."""
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))


def cast_cone(
    origin: Array, headings: Array, slopes: Array, solids: Solids, *, sees_floor: bool = False
) -> Array:
    """Returns the horizontal distance at which each ray meets something, (A, E) m.

    origin: (3,) m, the start of all rays. headings: (A,) rad. slopes: (A, E), the rise of the E
    rays of a heading, m a metre. The distance is inf where a ray meets nothing; the floor at height
    0 only counts where `sees_floor`. Rays meet the sides of a shape, from above its top, and from
    below its underside. A shape around the origin is not seen from within.
    """
    distances = np.full(slopes.shape, np.inf)
    cosines, sines = np.cos(headings), np.sin(headings)
    x, y, z = (float(value) for value in origin)
    if sees_floor and z > 0.0:
        _meet_floor(distances, slopes, z)
    _meet_prisms(distances, cosines, sines, slopes, x, y, z, solids)
    _meet_cylinders(distances, cosines, sines, slopes, x, y, z, solids)
    return distances


@njit(cache=True)
def _meet_floor(distances, slopes, z):
    for a in range(slopes.shape[0]):
        for e in range(slopes.shape[1]):
            if slopes[a, e] < 0.0:
                distances[a, e] = z / -slopes[a, e]


@njit(cache=True)
def _meet_side(distances, slopes, a, z, bottom, height, distance):
    """Lowers the distances of the rays of heading `a` that meet a wall at a distance."""
    for e in range(slopes.shape[1]):
        hit = z + distance * slopes[a, e]
        if bottom <= hit <= height and distance < distances[a, e]:
            distances[a, e] = distance


@njit(cache=True)
def _level(slope, z, bottom, height):
    """Returns the horizontal distance at which a ray comes down to a top or up to a bottom, m."""
    if z < bottom:
        return (bottom - z) / slope if slope > 0.0 else math.inf
    return (height - z) / slope if slope < 0.0 else math.inf


@njit(cache=True, error_model="numpy")
def _meet_prisms(distances, cosines, sines, slopes, x, y, z, solids):
    """Lowers `distances` to where a ray enters a side, or comes down or up within the edges.

    Seen from the origin a ray is within where it has entered once more than it has left.
    """
    inside = np.zeros(slopes.shape[1], dtype=np.int64)
    for shape in range(solids.heights.shape[0]):
        bottom, height = solids.bottoms[shape], solids.heights[shape]
        for a in range(slopes.shape[0]):
            inside[:] = 0
            is_met = False
            for n in range(solids.starts[shape], solids.starts[shape + 1]):
                x0, y0 = solids.segments[n, 0] - x, solids.segments[n, 1] - y
                x1, y1 = solids.segments[n, 2] - x, solids.segments[n, 3] - y
                side_0 = cosines[a] * y0 - sines[a] * x0
                side_1 = cosines[a] * y1 - sines[a] * x1
                # An end on the ray itself belongs to one of its two edges alone.
                if (side_0 > 0.0) == (side_1 > 0.0):
                    continue
                distance = (x0 * y1 - y0 * x1) / (side_1 - side_0)
                if distance < 0.0:
                    continue
                is_met = True
                enters = side_1 < side_0
                if enters:
                    _meet_side(distances, slopes, a, z, bottom, height, distance)
                for e in range(slopes.shape[1]):
                    if distance < _level(slopes[a, e], z, bottom, height):
                        inside[e] += 1 if enters else -1
            if is_met and (z > height or z < bottom):
                for e in range(slopes.shape[1]):
                    level = _level(slopes[a, e], z, bottom, height)
                    if inside[e] > 0 and level < distances[a, e]:
                        distances[a, e] = level


@njit(cache=True)
def _meet_cylinders(distances, cosines, sines, slopes, x, y, z, solids):
    """Lowers `distances` to where a ray meets sides, tops or undersides of cylinders."""
    for m in range(solids.circles.shape[0]):
        centre_x, centre_y = solids.circles[m, 0] - x, solids.circles[m, 1] - y
        radius = solids.circles[m, 2]
        bottom, height = solids.circle_bottoms[m], solids.circle_heights[m]
        for a in range(slopes.shape[0]):
            beside = cosines[a] * centre_y - sines[a] * centre_x
            half_chord_squared = radius * radius - beside * beside
            if half_chord_squared < 0.0:
                continue
            ahead = cosines[a] * centre_x + sines[a] * centre_y
            half_chord = math.sqrt(half_chord_squared)
            first, last = ahead - half_chord, ahead + half_chord
            if first < 0.0:
                continue
            _meet_side(distances, slopes, a, z, bottom, height, first)
            if z <= height and z >= bottom:
                continue
            for e in range(slopes.shape[1]):
                level = _level(slopes[a, e], z, bottom, height)
                if first < level < last and level < distances[a, e]:
                    distances[a, e] = level
