"""Flat meshes on the floor: WebGL draws lines one pixel wide, so paths and circles are ribbons."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.kernels.arrays import Array

# Keeps the corners of a circle within 1% of its radius.
CIRCLE_CORNER_COUNT = 48


class FlatMesh(NamedTuple):
    """A triangle mesh in the plane.

    vertices: (3, V) m, as Meshcat takes them. faces: (3, F) indices, counter-clockwise from above.
    """

    vertices: Array
    faces: NDArray[np.int32]


def thinned(points: ArrayLike, spacing_m: float) -> Array:
    """Returns the first point, every point `spacing_m` away from the last kept one, and the last.

    points: (N, 2) m. Points on one spot shrink to one row.
    """
    points = np.asarray(points, dtype=float)
    kept = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) >= spacing_m:
            kept.append(point)
    if np.hypot(*(points[-1] - kept[-1])) > 0.0:
        kept.append(points[-1])
    return np.array(kept)


def ribbon(points: Array, *, width_m: float, height_m: float) -> FlatMesh:
    """Returns a band of a given width along (N, 2) points, m; N of 1 gives an empty mesh."""
    return bands(points[:-1], points[1:], width_m=width_m, height_m=height_m)


def dashes(points: Array, *, dash_m: float, width_m: float, height_m: float) -> FlatMesh:
    """Returns a dashed band along (N, 2) points, m; dashes and gaps are equally long."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    starts = np.arange(0.0, along[-1], 2.0 * dash_m)
    ends = np.minimum(starts + dash_m, along[-1])

    def at(distance: Array) -> Array:
        return np.column_stack([np.interp(distance, along, column) for column in points.T])

    return bands(at(starts), at(ends), width_m=width_m, height_m=height_m)


def ring(centre: ArrayLike, *, radius_m: float, width_m: float, height_m: float) -> FlatMesh:
    """Returns a circle of a given width around `centre` (2,), m."""
    angles = np.linspace(0.0, 2.0 * np.pi, CIRCLE_CORNER_COUNT + 1)
    points = np.asarray(centre) + radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    return ribbon(points, width_m=width_m, height_m=height_m)


def arrow(pose: ArrayLike, *, length_m: float, width_m: float, height_m: float) -> FlatMesh:
    """Returns an arrowhead at `pose` (3,), x m, y m, yaw rad, pointing along its yaw."""
    x, y, yaw = np.asarray(pose)
    forward = np.array([np.cos(yaw), np.sin(yaw)])
    left = np.array([-forward[1], forward[0]])
    tail = np.array([x, y])
    notch = tail + length_m / 4 * forward
    tip = tail + length_m * forward
    wings = [tail + width_m / 2 * left, tail - width_m / 2 * left]
    corners = np.array([tip, wings[0], notch, wings[1]])
    vertices = np.column_stack([corners, np.full(len(corners), height_m)]).T
    return FlatMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32).T)


def bands(starts: Array, ends: Array, *, width_m: float, height_m: float) -> FlatMesh:
    """Returns one rectangle for each row, from `starts` (N, 2) to `ends` (N, 2), m.

    The rectangles do not share corners: at a cusp, where a path turns back on itself, shared ones
    would pinch it.
    """
    along = ends - starts
    lengths = np.hypot(*along.T)
    starts, ends, along = starts[lengths > 0], ends[lengths > 0], along[lengths > 0]
    left = 0.5 * width_m * np.column_stack([-along[:, 1], along[:, 0]])
    left /= lengths[lengths > 0, None]
    corners = np.stack([starts - left, ends - left, ends + left, starts + left], axis=1)
    flat = corners.reshape(-1, 2)
    vertices = np.column_stack([flat, np.full(len(flat), height_m)]).T
    first = 4 * np.arange(len(starts), dtype=np.int32)[:, None, None]
    faces = (first + np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)).reshape(-1, 3).T
    return FlatMesh(vertices, faces)
