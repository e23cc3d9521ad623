"""Cuts of triangles by level planes, as areas."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from drake_navbench.kernels.arrays import Array

# A surface without volume still stops a beam: it counts as thick, by this to either side, m.
HALF_THICKNESS_M = 0.005
# Corners within this of a straight edge are left out, m.
TOLERANCE_M = 0.003
# Ends of segments nearer to each other than this are one point, m.
GRID_M = 1e-4
MIN_AREA_M2 = 1e-5
# No robot fits into a smaller area, m^2.
ROOM_M2 = 0.05


def crossing_segments(corners: Array, height_m: float) -> Array:
    """Returns the segments (N, 2, 2) m where triangles (T, 3, 3) cross a level plane."""
    # A corner in the plane would count twice or not at all.
    above = corners[:, :, 2] - height_m
    above = np.where(above == 0.0, 1e-9, above)
    crossed = np.flatnonzero(np.abs((above > 0.0).sum(axis=1) - 1.5) < 1.0)
    if not len(crossed):
        return np.empty((0, 2, 2))
    corners, above = corners[crossed], above[crossed]
    ends = np.empty((len(crossed), 3, 2))
    meets = np.empty((len(crossed), 3), dtype=bool)
    for edge in range(3):
        a, b = edge, (edge + 1) % 3
        meets[:, edge] = (above[:, a] > 0.0) != (above[:, b] > 0.0)
        span = above[:, a] - above[:, b]
        share = above[:, a] / np.where(span == 0.0, 1.0, span)
        ends[:, edge] = corners[:, a, :2] + share[:, None] * (corners[:, b, :2] - corners[:, a, :2])
    return ends[meets].reshape(-1, 2, 2)


def cut_area(corners: Array, height_m: float) -> BaseGeometry:
    """Returns the area that triangles (T, 3, 3) enclose in a level plane.

    A point is inside if a line from it crosses an odd number of surfaces, unless it is in a room
    with a floor and no ceiling. Surfaces that enclose nothing count with a small thickness.
    """
    segments = np.round(crossing_segments(corners, height_m) / GRID_M) * GRID_M
    # The two sides of a surface meet the plane in one segment, from either end.
    (x0, y0), (x1, y1) = segments[:, 0].T, segments[:, 1].T
    is_reversed = (x0 > x1) | ((x0 == x1) & (y0 > y1))
    ordered = np.where(is_reversed[:, None, None], segments[:, ::-1], segments)
    ordered = np.unique(ordered.reshape(-1, 4), axis=0).reshape(-1, 2, 2)
    ordered = ordered[(ordered[:, 0] != ordered[:, 1]).any(axis=1)]
    if not len(ordered):
        return shapely.Polygon()
    lines = shapely.multilinestrings(shapely.linestrings(ordered))
    # Joining a few long lines takes a tenth of the time of many short ones.
    long_lines = shapely.line_merge(lines)
    walls = shapely.buffer(long_lines, HALF_THICKNESS_M, quad_segs=1, cap_style="flat")
    noded = shapely.node(lines)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    solid = [face for face in faces if _is_inside(face, ordered)]
    solid = [face for face in solid if face.area < ROOM_M2 or not _is_room(face, corners, height_m)]
    return shapely.union_all([*solid, walls])


def _is_inside(face: shapely.Polygon, segments: Array) -> bool:
    """Tells whether a beam along x from within a face crosses an odd number of segments."""
    x, y = shapely.get_coordinates(shapely.point_on_surface(face))[0]
    first, second = segments[:, 0], segments[:, 1]
    spans = (first[:, 1] > y) != (second[:, 1] > y)
    first, second = first[spans], second[spans]
    meets = first[:, 0] + (y - first[:, 1]) / (second[:, 1] - first[:, 1]) * (
        second[:, 0] - first[:, 0]
    )
    return bool((meets > x).sum() % 2)


def _is_room(face: shapely.Polygon, corners: Array, height_m: float) -> bool:
    """Tells whether a face has triangles (T, 3, 3) below a point in it and none above.

    Walls of one sheet around a floor are a building. A closed surface is a solid thing, and so is
    an upright one without top and bottom.
    """
    point = shapely.get_coordinates(shapely.point_on_surface(face))[0]
    is_near = (corners[:, :, :2].min(axis=1) <= point) & (corners[:, :, :2].max(axis=1) >= point)
    first, second, third = (corners[is_near.all(axis=1), corner] for corner in range(3))
    along, across, away = (second - first), (third - first), point - first[:, :2]
    area = _cross(along, across)
    level = area != 0.0
    area = np.where(level, area, 1.0)
    one, other = _cross(away, across) / area, _cross(along, away) / area
    hits = level & (one >= 0.0) & (other >= 0.0) & (one + other <= 1.0)
    heights = (first[:, 2] + one * along[:, 2] + other * across[:, 2])[hits]
    return bool((heights < height_m).any() and not (heights > height_m).any())


def _cross(first: Array, second: Array) -> Array:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def rings_of(area: BaseGeometry) -> list[dict[str, Any]]:
    """Returns the parts of an area as plain data: a shell and its holes, corners (K, 2) m each."""
    area = shapely.simplify(area, TOLERANCE_M)
    return [
        {
            "shell": shapely.get_coordinates(part.exterior)[:-1].tolist(),
            "holes": [shapely.get_coordinates(hole)[:-1].tolist() for hole in part.interiors],
        }
        for part in shapely.get_parts(area)
        if isinstance(part, shapely.Polygon) and part.area > MIN_AREA_M2
    ]


def area_of(rings: list[dict[str, Any]]) -> BaseGeometry:
    """Returns the area that rings, as plain data from `rings_of`, enclose."""
    polygons = [shapely.Polygon(part["shell"], part["holes"]) for part in rings]
    return shapely.union_all([shapely.make_valid(polygon) for polygon in polygons])


def cut(corners: Array, heights_m: list[float]) -> list[dict[str, Any]]:
    """Returns the union of the areas that triangles (T, 3, 3) cover at these heights, as rings.

    `rings_of` defines the form of the result.
    """
    areas = [cut_area(corners, height) for height in heights_m]
    return rings_of(shapely.union_all(areas)) if areas else []
