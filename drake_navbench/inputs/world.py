"""The obstacles of a world: typed shapes, which a lidar sees as segments and a map as cells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field, model_validator
from shapely.geometry.base import BaseGeometry

from drake_navbench.inputs.moving_obstacles import NOTHING_MOVES, MovingObstacles
from drake_navbench.inputs.people import NOBODY, WalkingPeople
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.depth_casting import Solids
from drake_navbench.typed_files.quantities import (
    MIN_SIZE_M,
    Length,
    Point,
    Size,
)
from drake_navbench.typed_files.typed_yaml import QuietModel

# The polygon's radius is within 0.1% of the true circle's.
CIRCLE_QUADRANT_SEGMENTS = 24
# The number of corners of the polygon about a pillar that people walk round.
ROUND_CORNERS = 16


class _Shape(QuietModel):
    quiet: ClassVar = frozenset({"material", "bottom_m"})

    known_to_planner: bool = Field(
        True, description="Show the obstacle on the global planner's map, whatever the lidar sees."
    )
    height_m: Size = Field(
        1.0,
        description="Height of the upper edge above the floor [m]; a lidar that scans higher "
        "does not see it.",
    )
    bottom_m: Length = Field(
        0.0,
        ge=0.0,
        description="Height of the lower edge above the floor [m]; a lidar that scans lower "
        "does not see it. The robot touches it at any height.",
    )
    material: Literal["solid", "glass"] = Field(
        "solid", description="Glass: the lidar's beams pass through the obstacle."
    )

    @property
    def region(self) -> BaseGeometry:
        """The floor area that the shape covers."""
        return shapely.Polygon(self.outline)

    @property
    def outline(self) -> Array:
        """(K, 2) corners in the world frame, m, counter-clockwise."""
        raise NotImplementedError


class Box(_Shape):
    """A rectangle along the axes."""

    type: Literal["box"]
    min: Point = Field(description="Lower left corner of the box [m].")
    max: Point = Field(description="Upper right corner of the box [m].")

    @model_validator(mode="after")
    def _check(self) -> Box:
        if not all(high - low >= MIN_SIZE_M for low, high in zip(self.min, self.max, strict=True)):
            raise ValueError(
                f"min {list(self.min)} must lie below and left of max {list(self.max)}, by at "
                f"least {MIN_SIZE_M:g} m"
            )
        return self

    @property
    def outline(self) -> Array:
        (x0, y0), (x1, y1) = self.min, self.max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


class Wall(_Shape):
    """A straight wall of some thickness."""

    type: Literal["wall"]
    start: Point = Field(description="One end of the wall's centre line [m].")
    end: Point = Field(description="Other end of the wall's centre line [m].")
    thickness_m: Size = Field(0.1, description="Full thickness of the wall [m].")

    @model_validator(mode="after")
    def _check(self) -> Wall:
        if math.dist(self.start, self.end) < MIN_SIZE_M:
            raise ValueError(
                f"start and end coincide at {list(self.start)}; expected a length of at least "
                f"{MIN_SIZE_M:g} m"
            )
        return self

    @property
    def outline(self) -> Array:
        start, end = np.array(self.start), np.array(self.end)
        along = (end - start) / np.hypot(*(end - start))
        left = 0.5 * self.thickness_m * np.array([-along[1], along[0]])
        return np.array([start - left, end - left, end + left, start + left])


class Polygon(_Shape):
    """Any simple polygon."""

    type: Literal["polygon"]
    vertices: list[Point] = Field(min_length=3, description="Corners of the polygon in order [m].")

    @model_validator(mode="after")
    def _check(self) -> Polygon:
        polygon = shapely.Polygon(self.vertices)
        if not polygon.is_valid or polygon.area < MIN_SIZE_M**2:
            raise ValueError("vertices must form a polygon with an area that does not cross itself")
        return self

    @property
    def outline(self) -> Array:
        ring = shapely.Polygon(self.vertices).exterior
        corners = np.array(ring.coords[:-1])
        return corners if ring.is_ccw else corners[::-1].copy()


class Cylinder(_Shape):
    """A round pillar."""

    type: Literal["cylinder"]
    centre: Point = Field(description="Centre of the disc [m].")
    radius_m: Size = Field(description="Radius of the disc [m].")

    @property
    def region(self) -> BaseGeometry:
        return shapely.Point(self.centre).buffer(self.radius_m, CIRCLE_QUADRANT_SEGMENTS)

    @property
    def outline(self) -> Array:
        return shapely.get_coordinates(self.region)[:-1][::-1].copy()


Obstacle = Annotated[Box | Wall | Polygon | Cylinder, Field(discriminator="type")]


@dataclass(frozen=True)
class World:
    """The world of a scenario: obstacles, the map's walls as small boxes, and moving bodies."""

    obstacles: tuple[Box | Wall | Polygon | Cylinder, ...]
    walls: tuple[Box, ...] = ()
    moving: MovingObstacles = NOTHING_MOVES
    people: WalkingPeople | RecordedPeople = NOBODY

    @property
    def moving_count(self) -> int:
        """Number of moving bodies: moving obstacles, then people."""
        return len(self.moving) + len(self.people)

    @property
    def shapes(self) -> tuple[Box | Wall | Polygon | Cylinder, ...]:
        """The standing shapes: obstacles and walls."""
        return (*self.obstacles, *self.walls)

    @cached_property
    def segments(self) -> Array:
        """(N, 4) straight edges x0, y0, x1, y1 of everything but cylinders, m."""
        return _edges([o for o in self.shapes if not isinstance(o, Cylinder)])

    @cached_property
    def circles(self) -> Array:
        """(M, 3) cylinders x, y, radius, m."""
        rows = [[*o.centre, o.radius_m] for o in self.obstacles if isinstance(o, Cylinder)]
        return np.array(rows, dtype=float).reshape(-1, 3)

    @cached_property
    def solids(self) -> Solids:
        """The same edges and cylinders with their heights."""
        edged = [o for o in self.shapes if not isinstance(o, Cylinder)]
        round_ones = [o for o in self.obstacles if isinstance(o, Cylinder)]
        runs = [len(o.outline) for o in edged]
        return Solids(
            self.segments,
            np.cumsum([0, *runs]),
            np.array([o.bottom_m for o in edged], dtype=float),
            np.array([o.height_m for o in edged], dtype=float),
            self.circles,
            np.array([o.bottom_m for o in round_ones], dtype=float),
            np.array([o.height_m for o in round_ones], dtype=float),
        )

    @cached_property
    def regions(self) -> NDArray[np.object_]:
        """(N,) the floor area that each shape covers."""
        return np.array([o.region for o in self.shapes], dtype=object)

    @cached_property
    def free_rings(self) -> list[Array]:
        """The borders (K, 2) m of the free floor, each with the solid side to its left."""
        covered = shapely.unary_union([_few_corners(one) for one in self.shapes])
        rings = []
        for part in shapely.get_parts(covered):
            oriented = shapely.geometry.polygon.orient(part)
            rings += [oriented.exterior, *oriented.interiors]
        return [np.array(ring.coords[:-1]) for ring in rings]

    @property
    def opaque(self) -> World:
        """The world without glass and without people."""
        return World(
            tuple(one for one in self.obstacles if one.material == "solid"),
            self.walls,
            self.moving,
        )

    def visible_from(self, height_m: float) -> World:
        """Returns the obstacles and walls that a lidar sees at a height over the floor, m."""
        return World(
            tuple(
                one
                for one in self.obstacles
                if one.material == "solid" and one.bottom_m <= height_m <= one.height_m
            ),
            self.walls,
            self.moving,
        )

    def intersects(self, geometry: BaseGeometry) -> bool:
        """Returns whether a point or an area touches any shape."""
        return bool(shapely.intersects(self.regions, geometry).any())

    def bounds(
        self, points: Sequence[Sequence[float]], margin_m: float
    ) -> tuple[float, float, float, float]:
        """Returns (min_x, min_y, max_x, max_y) around all obstacles and `points`, with a margin."""
        corners = [np.asarray(points, dtype=float)[:, :2]] + [o.outline for o in self.obstacles]
        stacked = np.vstack(corners)
        low, high = stacked.min(axis=0) - margin_m, stacked.max(axis=0) + margin_m
        return (*low, *high)


def _few_corners(shape: _Shape) -> BaseGeometry:
    """Returns the floor area of a shape, a cylinder's as that of a polygon round about it."""
    if not isinstance(shape, Cylinder):
        return shape.region
    out_m = shape.radius_m / math.cos(math.pi / ROUND_CORNERS)
    turns = np.linspace(0.0, 2.0 * math.pi, ROUND_CORNERS, endpoint=False)
    corners = np.column_stack([np.cos(turns), np.sin(turns)])
    return shapely.Polygon(np.array(shape.centre) + out_m * corners)


def _edges(shapes: Sequence[_Shape]) -> Array:
    edges = [np.hstack([s.outline, np.roll(s.outline, -1, axis=0)]) for s in shapes]
    return np.ascontiguousarray(np.vstack(edges)) if edges else np.empty((0, 4))
