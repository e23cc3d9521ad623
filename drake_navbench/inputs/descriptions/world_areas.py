"""The parts of a world that a robot can touch or its lidar can see: areas with heights.

A lidar sees one level, a body touches all levels up to its top. So shapes are cut at three bands of
heights: the lidar's, the one below it, and the one above it up to the body's top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError
from shapely.geometry.base import BaseGeometry

from drake_navbench.inputs.descriptions.body import shape_points
from drake_navbench.inputs.descriptions.mesh_slices import area_of, cut_area
from drake_navbench.inputs.descriptions.meshes import mesh_sections
from drake_navbench.inputs.descriptions.model import Model, Shape
from drake_navbench.inputs.descriptions.world import WorldSource
from drake_navbench.kernels.arrays import Array

# The distance between two heights at which a body is cut, m.
STEP_M = 0.1
# Shapes lower than this stop no wheel: floors, carpets, markings, m.
LEAST_HEIGHT_M = 0.03
# The range of heights of a floor's surface, and its least width, m.
HIGHEST_FLOOR_M, FLOOR_WIDTH_M = 0.3, 3.0
# Slivers thinner than twice this come of rounding, m.
SLIVER_M = 0.005
BALL_RINGS = 16


class Levels(NamedTuple):
    """Heights over the floor: of the lidar and of the body's top, m."""

    lidar_m: float
    top_m: float

    def bands(self, floor_m: float) -> list[list[float]]:
        """Returns the heights of the three bands in the world's frame: lidar, below, above."""
        every = np.arange(LEAST_HEIGHT_M + 0.01, self.top_m, STEP_M)
        below = [float(h) for h in every if h < self.lidar_m - 0.01]
        above = [float(h) for h in every if h > self.lidar_m + 0.01]
        return [[h + floor_m for h in band] for band in ([self.lidar_m], below, above)]


class Area(NamedTuple):
    """An area over the floor; bottom_m, top_m: heights over the floor. is_seen: by the lidar."""

    name: str
    region: BaseGeometry
    bottom_m: float
    top_m: float
    is_seen: bool


class _Cut(NamedTuple):
    """A shape cut at the three bands: an area for each, and its lowest and highest point, m."""

    areas: tuple[BaseGeometry, ...]
    low_m: float
    high_m: float


def world_areas(source: WorldSource, levels: Levels, floor_m: float = 0.0) -> list[Area]:
    """Returns the areas of all models; unreadable shapes become remarks of the source."""
    bands = levels.bands(floor_m)
    shapes = [_standing(model) for model in source.models]
    meshes = [s for group in shapes for s in group if s.kind == "mesh" and s.mesh is not None]
    answers = dict(zip(map(id, meshes), mesh_sections(meshes, bands), strict=True))
    areas: list[Area] = []
    for model, group in zip(source.models, shapes, strict=True):
        cuts = []
        for shape in group:
            if shape.kind == "mesh":
                found = _mesh_cut(shape, answers.get(id(shape)), source)
            else:
                found = _plain_cut(shape, bands)
            if found is not None:
                cuts.append(found)
        areas += _joined(model.name, cuts, levels, floor_m)
    return areas


def floor_under(source: WorldSource, point: tuple[float, float]) -> float:
    """Returns the height of the floor at a point, m: the top of a wide, low box, else 0."""
    tops = [0.0]
    for shape in (s for model in source.models for s in _standing(model)):
        if shape.kind != "box":
            continue
        points = shape_points(shape) @ shape.pose[:3, :3].T + shape.pose[:3, 3]
        low, high = points.min(axis=0), points.max(axis=0)
        is_wide = bool((high[:2] - low[:2] >= FLOOR_WIDTH_M).all())
        is_here = bool((low[:2] <= point).all() and (point <= high[:2]).all())
        if is_wide and is_here and abs(high[2]) <= HIGHEST_FLOOR_M:
            tops.append(float(high[2]))
    return max(tops)


def _standing(model: Model) -> list[Shape]:
    """Returns the shapes of a model that can be touched."""
    return [s for link in model.links.values() for s in link.collisions if s.kind != "plane"]


def _mesh_cut(shape: Shape, answer: dict | None, source: WorldSource) -> _Cut | None:  # type: ignore[type-arg]
    fault = "no such file or package" if answer is None else answer.get("fault")
    if answer is None or fault:
        remark = f"left out {shape.uri}: {fault}"
        if remark not in source.remarks:
            source.remarks.append(remark)
        return None
    areas = tuple(area_of(rings) for rings in answer["bands"])
    return _Cut(areas, answer["low"], answer["high"])


def _plain_cut(shape: Shape, bands: Sequence[Sequence[float]]) -> _Cut | None:
    """Returns the cut of a shape that is convex, or upright over a polygon; None for others."""
    if shape.kind == "polyline" and shape.corners is not None and len(shape.corners) >= 3:
        base = shapely.make_valid(shapely.Polygon(shape.corners))
        x, y = shape.pose[0, :2].tolist(), shape.pose[1, :2].tolist()
        region = shapely.transform(
            base, lambda p: p @ np.array([x, y]).T + np.asarray(shape.pose[:2, 3])
        )
        low = float(shape.pose[2, 3])
        high = low + shape.size[0]
        areas = tuple(
            region if any(low <= h <= high for h in heights) else shapely.Polygon()
            for heights in bands
        )
        return _Cut(areas, low, high)
    points = _ball(shape) if shape.kind in ("sphere", "ellipsoid") else shape_points(shape)
    placed = points @ shape.pose[:3, :3].T + shape.pose[:3, 3]
    low, high = float(placed[:, 2].min()), float(placed[:, 2].max())
    if not any(low <= h <= high for heights in bands for h in heights):
        return None
    if _is_upright(shape):
        hull = shapely.MultiPoint(placed[:, :2]).convex_hull
        areas = tuple(
            hull if any(low <= h <= high for h in heights) else shapely.Polygon()
            for heights in bands
        )
        return _Cut(areas, low, high)
    try:
        corners = placed[ConvexHull(placed).simplices]
    except (QhullError, ValueError):
        return None
    return _Cut(
        tuple(
            shapely.union_all([cut_area(corners, h).convex_hull for h in heights])
            for heights in bands
        ),
        low,
        high,
    )


def _is_upright(shape: Shape) -> bool:
    return shape.kind in ("box", "cylinder") and abs(shape.pose[2, 2]) > 0.9999


def _ball(shape: Shape) -> Array:
    """Returns points (N, 3) m on a ball or ellipsoid, ring by ring."""
    half = np.array(shape.size if shape.kind == "ellipsoid" else [shape.size[0]] * 3)
    turns = 2.0 * np.pi * np.arange(2 * BALL_RINGS) / (2 * BALL_RINGS)
    rings = [np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])]
    for tilt in np.pi * (np.arange(BALL_RINGS) + 0.5) / BALL_RINGS:
        flat = np.sin(tilt)
        height = np.full_like(turns, np.cos(tilt))
        rings.append(np.column_stack([flat * np.cos(turns), flat * np.sin(turns), height]))
    return np.vstack(rings) * half


def _joined(name: str, cuts: Sequence[_Cut], levels: Levels, floor_m: float) -> Iterator[Area]:
    """Yields one model's areas: those that the lidar sees, then those hidden below and above."""
    if not cuts:
        return
    seen, low, high = (shapely.union_all([cut.areas[band] for cut in cuts]) for band in range(3))
    top_m = max(cut.high_m for cut in cuts) - floor_m
    bottom_m = min(cut.low_m for cut in cuts) - floor_m
    yield from _area(name, seen, 0.0, max(top_m, levels.lidar_m), is_seen=True)
    below = shapely.difference(low, seen)
    lidar_m = levels.lidar_m
    yield from _area(name, below, 0.0, min(top_m, 0.99 * lidar_m), is_seen=False)
    above = shapely.difference(high, shapely.union(seen, low))
    hangs_m = max(bottom_m, 1.01 * lidar_m)
    yield from _area(name, above, hangs_m, max(top_m, hangs_m), is_seen=False)


def _area(
    name: str, region: BaseGeometry, bottom_m: float, top_m: float, *, is_seen: bool
) -> Iterator[Area]:
    if not is_seen:
        # The difference of two bands along a slanted side is not worth a shape.
        opened = shapely.buffer(region, -SLIVER_M, join_style="mitre")
        region = shapely.buffer(opened, SLIVER_M, join_style="mitre")
    if not region.is_empty and top_m > 0.0:
        yield Area(name, region, bottom_m, top_m, is_seen)
