"""Paths from straights, arcs and polylines; their length; sampling by arc length.

A path is (N, 3) float64: x m, y m, yaw rad along the tangent. Lengths are in m, angles in rad
unless a name says degrees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array

# A last interval shorter than this part of the spacing is rounding: it gets no pose of its own.
NEGLIGIBLE_INTERVAL_RATIO = 1e-9

STRAIGHT_FIELDS = {"s"}
ARC_FIELDS = {"arc", "r"}


def _positive(value: float, name: str) -> float:
    """Returns `value` as a float; raises ValueError unless it is finite and above zero."""
    number = float(value)
    if not (math.isfinite(number) and number > 0.0):
        raise ValueError(f"{name}: got {value!r}, expected a finite number above 0")
    return number


def _sample_stations(length_m: float, spacing_m: float) -> Array:
    """Returns the arc lengths 0, spacing, 2 spacing, ... and the whole length."""
    spacing_m = _positive(spacing_m, "spacing_m")
    count = math.ceil(length_m / spacing_m - NEGLIGIBLE_INTERVAL_RATIO)
    stations = spacing_m * np.arange(count + 1, dtype=np.float64)
    stations[-1] = length_m
    return stations


def _wrapped(angles: Array) -> Array:
    """Returns angles wrapped one by one into (-pi, pi]."""
    return np.array([wrap(angle) for angle in angles])


def _element_shape(element: Mapping[str, float], index: int) -> tuple[float, float]:
    """Returns (length m, curvature 1/m) of one element of a path; see `path_from_elements`."""
    where = f"path element {index}"
    fields = set(element)
    if fields == STRAIGHT_FIELDS:
        return _positive(element["s"], f"{where}, s"), 0.0
    if fields == ARC_FIELDS:
        radius = _positive(element["r"], f"{where}, r")
        angle = math.radians(float(element["arc"]))
        length = _positive(radius * abs(angle), f"{where}, arc (as a length)")
        return length, math.copysign(1.0 / radius, angle)
    raise ValueError(
        f"{where}: got fields {sorted(fields)}, expected 's' for a straight or 'arc' and 'r'"
    )


def _advance(pose: Array, curvature: float, distance: ArrayLike) -> Array:
    """Returns the poses (..., 3) at `distance` m along a circle or straight that starts in `pose`.

    Headings are not wrapped.
    """
    distance = np.asarray(distance, dtype=np.float64)
    turn = curvature * distance
    # The chord of an arc of length d and turn t has length d sin(t/2) / (t/2), at half the turn.
    chord = distance * np.sinc(turn / (2.0 * math.pi))
    direction = pose[2] + 0.5 * turn
    return np.stack(
        [
            pose[0] + chord * np.cos(direction),
            pose[1] + chord * np.sin(direction),
            pose[2] + turn,
        ],
        axis=-1,
    )


def path_from_elements(
    start_pose: ArrayLike, elements: Sequence[Mapping[str, float]], spacing_m: float
) -> Array:
    """Samples a path of straights and arcs at equal arc length.

    start_pose: (3,) x m, y m, yaw rad.
    elements: `{s: length m}` is a straight, `{arc: angle in degrees, r: radius m}` an arc, to the
        left for a positive angle; each starts where the one before ends, with its heading.
    spacing_m: arc length between poses; only the last interval may be shorter.
    Returns (N, 3), both end points included. Raises ValueError on a wrong element or spacing.
    """
    if not elements:
        raise ValueError("path elements: got none, expected at least one straight or arc")
    shapes = [_element_shape(element, index) for index, element in enumerate(elements)]
    ends = np.cumsum([length for length, _ in shapes])
    stations = _sample_stations(float(ends[-1]), spacing_m)
    owner = np.minimum(np.searchsorted(ends, stations, side="right"), len(shapes) - 1)
    path = np.empty((len(stations), 3))
    pose = np.array(start_pose, dtype=np.float64)
    for index, (length, curvature) in enumerate(shapes):
        mine = owner == index
        path[mine] = _advance(pose, curvature, stations[mine] - (ends[index] - length))
        pose = _advance(pose, curvature, length)
    path[:, 2] = _wrapped(path[:, 2])
    return path


def _stations_of_points(points: Array) -> Array:
    """Returns (N,) the arc length at which each point of a polyline lies."""
    steps = np.diff(points[:, :2], axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])


def path_length(path: ArrayLike) -> float:
    """Returns the length of a path or polyline (N, 2 or more), m; 0 for fewer than two points.

    numpy adds the segments up in pairs. `path_pruning.arc_length` adds them one after the other as
    Nav2's calculate_path_length, since comparisons with a tolerance depend on its last bit.
    """
    points = np.asarray(path, dtype=np.float64)
    return float(np.hypot(*np.diff(points[:, :2], axis=0).T).sum())


def path_from_polyline(points: ArrayLike, spacing_m: float) -> Array:
    """Samples a polyline at equal arc length.

    points: (M, 2) m, M >= 2; repeated points are dropped. spacing_m: as in `path_from_elements`.
    Returns (N, 3): headings along the segment, at a corner along the segment that starts there.
    Raises ValueError for fewer than two distinct points or a wrong spacing.
    """
    corners = np.asarray(points, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 2 or not np.all(np.isfinite(corners)):
        raise ValueError(
            f"polyline: got an array of shape {corners.shape}, expected finite points (M, 2)"
        )
    is_new = np.concatenate([[True], np.any(np.diff(corners, axis=0) != 0.0, axis=1)])
    corners = corners[is_new]
    if len(corners) < 2:
        raise ValueError(f"polyline: got {len(corners)} distinct points, expected at least 2")
    at_corner = _stations_of_points(corners)
    stations = _sample_stations(float(at_corner[-1]), spacing_m)
    segment = np.searchsorted(at_corner, stations, side="right") - 1
    segment = np.minimum(segment, len(corners) - 2)
    steps = np.diff(corners, axis=0)
    yaws = np.arctan2(steps[:, 1], steps[:, 0])
    ratio = (stations - at_corner[segment]) / np.diff(at_corner)[segment]
    path = np.empty((len(stations), 3))
    path[:, :2] = corners[segment] + ratio[:, None] * steps[segment]
    path[:, 2] = yaws[segment]
    path[-1, :2] = corners[-1]
    return path
