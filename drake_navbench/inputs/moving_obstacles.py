"""The moving obstacles of a world: typed shapes on timed waypoints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field, model_validator
from shapely.geometry.base import BaseGeometry

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import Tracks, place_discs, place_edges
from drake_navbench.kernels.poses import place_outline
from drake_navbench.typed_files.quantities import Angle, Duration, Length, Size
from drake_navbench.typed_files.typed_yaml import FrozenModel, QuietModel

# Nothing on a floor moves faster; a larger number is a wrong unit.
MAX_SPEED_MPS, MAX_TURN_RATE_RADPS = 20.0, 20.0
MIN_STEP_S = 1e-3
MAX_WAYPOINTS, MAX_MOVING = 10_000, 200
# The step in which the floor that a turning box sweeps is computed.
SWEEP_STEP_M, SWEEP_STEP_RAD = 0.1, 0.1
CIRCLE_QUADRANT_SEGMENTS = 24


class TimedPose(FrozenModel):
    """A moving obstacle's pose at a time; between two of them it moves at constant velocity."""

    time_s: Duration = Field(ge=0.0, description="Time since the start of the trial [s].")
    position: tuple[Length, Length] = Field(description="Position of the object's centre [m].")
    yaw_rad: Angle = Field(
        0.0,
        description="Heading at the waypoint, unwrapped: between waypoints it changes "
        "linearly [rad].",
    )


class _Moving(QuietModel):
    quiet: ClassVar = frozenset({"material"})

    name: str = Field("", description="Name of the object in reports and replays.")
    height_m: Size = Field(
        1.0,
        description="Height above the floor [m]; a lidar that scans higher does not see the "
        "object.",
    )
    material: Literal["solid", "glass"] = Field(
        "solid", description="Glass: the lidar's beams pass through the object."
    )
    waypoints: list[TimedPose] = Field(
        min_length=1,
        max_length=MAX_WAYPOINTS,
        description="Timed waypoints; the object stands at the first one before its time and "
        "at the last one after its time.",
    )
    repeats: bool = Field(
        False, description="Start over after the last waypoint, which must equal the first."
    )

    @model_validator(mode="after")
    def _check_way(self) -> _Moving:
        for index, (here, there) in enumerate(pairwise(self.waypoints)):
            duration_s = there.time_s - here.time_s
            place = f"waypoints[{index + 1}]"
            if duration_s < MIN_STEP_S:
                raise ValueError(
                    f"{place}.time_s: expected at least {MIN_STEP_S:g} s after the waypoint "
                    f"before, at {here.time_s:g} s, got {there.time_s:g}"
                )
            speed_mps = math.dist(here.position, there.position) / duration_s
            rate_radps = abs(there.yaw_rad - here.yaw_rad) / duration_s
            if speed_mps > MAX_SPEED_MPS or rate_radps > MAX_TURN_RATE_RADPS:
                raise ValueError(
                    f"{place}: expected at most {MAX_SPEED_MPS:g} m/s and "
                    f"{MAX_TURN_RATE_RADPS:g} rad/s on the way there, got {speed_mps:.3g} m/s and "
                    f"{rate_radps:.3g} rad/s"
                )
        first, last = self.waypoints[0], self.waypoints[-1]
        if self.repeats and (
            len(self.waypoints) < 3
            or first.position != last.position
            or (first.yaw_rad - last.yaw_rad) % (2.0 * math.pi) != 0.0
        ):
            raise ValueError(
                "repeats: expected three waypoints or more, the last of them at the pose of the "
                "first"
            )
        return self

    @property
    def knots(self) -> Array:
        """(K, 4) time s, x m, y m, yaw rad of the waypoints."""
        return np.array([[w.time_s, *w.position, w.yaw_rad] for w in self.waypoints])

    @property
    def period_s(self) -> float:
        """The period of a motion that repeats, s; 0 for a motion that does not."""
        return self.waypoints[-1].time_s - self.waypoints[0].time_s if self.repeats else 0.0

    def pose_at(self, time_s: float) -> Array:
        """Returns the pose at a time: (3,) x m, y m, yaw rad."""
        return Tracks.of([self.knots], [self.period_s]).poses_at(time_s)[0]

    @property
    def outline(self) -> Array:
        """(K, 2) corners in its own frame, m, counter-clockwise."""
        raise NotImplementedError

    @property
    def reach_m(self) -> float:
        """The largest distance of the outline from the centre, m."""
        return float(np.hypot(*self.outline.T).max())

    @property
    def top_speed_mps(self) -> float:
        """An upper bound of the speed of any of its points, m/s."""
        steps = np.diff(self.knots, axis=0)
        speeds = np.hypot(steps[:, 1], steps[:, 2]) + self.reach_m * np.abs(steps[:, 3])
        return float((speeds / steps[:, 0]).max(initial=0.0))

    def swept_floor(self) -> Iterator[tuple[int, BaseGeometry]]:
        """Yields, for each waypoint but the first, the floor covered on the way there.

        For an obstacle that never moves, yields the floor under it, as that of waypoint 0.
        """
        if len(self.waypoints) == 1:
            yield 0, self._covered(self.knots[:1, 1:])
        for index, (here, there) in enumerate(pairwise(self.knots[:, 1:]), start=1):
            length_m, turn_rad = math.dist(here[:2], there[:2]), abs(there[2] - here[2])
            steps = 1 + math.ceil(max(length_m / SWEEP_STEP_M, turn_rad / SWEEP_STEP_RAD))
            yield index, self._covered(np.linspace(here, there, steps + 1))

    def _covered(self, poses: Array) -> BaseGeometry:
        """Returns the floor that the obstacle covers on the way along poses (N, 3)."""
        bodies = [shapely.Polygon(place_outline(self.outline, pose)) for pose in poses]
        if len(bodies) == 1:
            return bodies[0]
        return shapely.union_all([shapely.union(a, b).convex_hull for a, b in pairwise(bodies)])


class MovingCylinder(_Moving):
    """Something round that moves, such as a pillar on a trolley."""

    type: Literal["cylinder"]
    radius_m: Size = Field(description="Radius [m].")

    @property
    def outline(self) -> Array:
        return circle(self.radius_m)


class MovingBox(_Moving):
    """Something rectangular that moves, such as a bed or a cart; yaw turns it about its centre."""

    type: Literal["box"]
    size_m: tuple[Size, Size] = Field(description="Length along the object's own x, and width [m].")

    @property
    def outline(self) -> Array:
        half = 0.5 * np.array(self.size_m)
        return half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


MovingObstacle = Annotated[MovingCylinder | MovingBox, Field(discriminator="type")]


@dataclass(frozen=True)
class Bodies:
    """Outlines in frames of their own; see `kernels.moving_bodies` for the columns.

    edges: (E, 5). discs: (D, 4). count: number of bodies.
    """

    edges: Array
    discs: Array
    count: int

    def without_first(self, count: int) -> Bodies:
        """Returns the same numbering with the parts of the first `count` bodies left out."""
        if not count:
            return self
        edges, discs = (part[part[:, 0] >= count] for part in (self.edges, self.discs))
        return Bodies(edges, discs, self.count)

    def only(self, wanted: NDArray[np.bool_]) -> Bodies:
        """Returns the same numbering with the bodies left out that are not wanted (B,)."""
        edges, discs = (part[wanted[part[:, 0].astype(int)]] for part in (self.edges, self.discs))
        return Bodies(edges, discs, self.count)

    def placed(self, poses: Array) -> tuple[Array, Array]:
        """Returns edges (E, 4) and circles (D, 3) in the world frame with bodies at (B, 3), m."""
        return place_edges(self.edges, poses), place_discs(self.discs, poses)


@dataclass(frozen=True)
class MovingObstacles:
    """The moving obstacles of a scenario, in the order of its file."""

    things: tuple[MovingCylinder | MovingBox, ...] = ()

    def __len__(self) -> int:
        return len(self.things)

    @cached_property
    def tracks(self) -> Tracks:
        """The tracks of the obstacles."""
        periods_s = [thing.period_s for thing in self.things]
        return Tracks.of([thing.knots for thing in self.things], periods_s)

    @cached_property
    def bodies(self) -> Bodies:
        """The outlines of the obstacles: discs exactly, boxes as edges."""
        return bodies_of(self.things)

    @cached_property
    def heights_m(self) -> Array:
        """(B,) the heights of the obstacles above the floor, m."""
        return np.array([thing.height_m for thing in self.things], dtype=float)

    def seen_at(self, height_m: float) -> Bodies:
        """Returns the outlines of the obstacles that a lidar at a height over the floor sees."""
        is_solid = np.array([thing.material == "solid" for thing in self.things], dtype=bool)
        return self.bodies.only(is_solid & (self.heights_m >= height_m))

    @property
    def names(self) -> list[str]:
        """The obstacles' names: the given one, else the place in the file."""
        return [
            thing.name or f"moving_obstacles[{index}]" for index, thing in enumerate(self.things)
        ]

    @property
    def top_speed_mps(self) -> float:
        """An upper bound of the speed of any point of the obstacles, m/s."""
        return max((thing.top_speed_mps for thing in self.things), default=0.0)


NOTHING_MOVES = MovingObstacles()


def circle(radius_m: float) -> Array:
    """Returns (K, 2) corners of a circle about the origin, m, counter-clockwise."""
    ring = shapely.Point(0.0, 0.0).buffer(radius_m, CIRCLE_QUADRANT_SEGMENTS)
    return shapely.get_coordinates(ring)[:-1][::-1].copy()


def with_people(bodies: Bodies, radii_m: Array) -> Bodies:
    """Returns bodies, followed by the discs (P,) that stand for people."""
    discs = np.zeros((len(radii_m), 4))
    discs[:, 0] = bodies.count + np.arange(len(radii_m))
    discs[:, 3] = radii_m
    return Bodies(bodies.edges, np.vstack([bodies.discs, discs]), bodies.count + len(radii_m))


def bodies_of(things: Sequence[MovingCylinder | MovingBox]) -> Bodies:
    """Returns the outlines of things."""
    edges, discs = [np.empty((0, 5))], [np.empty((0, 4))]
    for index, thing in enumerate(things):
        if isinstance(thing, MovingCylinder):
            discs.append(np.array([[index, 0.0, 0.0, thing.radius_m]]))
        else:
            corners = thing.outline
            rows = np.hstack([corners, np.roll(corners, -1, axis=0)])
            edges.append(np.insert(rows, 0, index, axis=1))
    return Bodies(np.vstack(edges), np.vstack(discs), len(things))
