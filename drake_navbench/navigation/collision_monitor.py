"""Nav2's collision monitor: slows or stops a command if points lie in shapes around the robot.

Pure functions of an immutable state. Points are (N, 2) m in the base frame, commands (3,) v m/s,
w rad/s, vy m/s. Source: nav2_collision_monitor, branches humble to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.points_inside import NO_COLLISION, count_inside, time_to_collision
from drake_navbench.navigation.monitor_sources import THE_SCAN, MonitorSource
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.quantities import (
    Angle,
    AngularSpeed,
    Count,
    Duration,
    Period,
    Point,
    Size,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel, QuietModel

# v m/s, w rad/s, vy m/s.
Command = tuple[float, float, float]
Corners = Annotated[tuple[Point, ...], Field(min_length=4)]

INVALID_SOURCE = "invalid source"
WHOLE = ""
NO_VERTICES = np.empty((0, 2))


class _Shape(FrozenModel):
    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "min_points": since(Release.IRON),
        "linear_limit": since(Release.IRON),
        "angular_limit": since(Release.IRON),
        "trigger_consecutive_points": since(Release.LYRICAL),
        "release_consecutive_points": since(Release.LYRICAL),
    }

    action_type: Literal["stop", "slowdown", "limit", "approach", "none"] = Field(
        "approach", description="Action when at least min_points points are inside the shape."
    )
    min_points: Count = Field(4, ge=1, description="Number of points from which the shape acts.")
    slowdown_ratio: float = Field(
        0.5, ge=0.0, le=1.0, description="Factor on the command while slowing down."
    )
    linear_limit: Speed = Field(0.5, ge=0.0, description="Largest speed while limiting [m/s].")
    angular_limit: AngularSpeed = Field(
        0.5, ge=0.0, description="Largest turn rate while limiting [rad/s]."
    )
    time_before_collision: Duration = Field(
        2.0, gt=0.0, description="Time before a collision that an approach keeps [s]."
    )
    simulation_time_step: Period = Field(
        0.1, description="Time step in which an approach simulates the motion [s]."
    )
    trigger_consecutive_points: Count = Field(
        1, ge=1, description="Number of cycles after which the shape begins to act."
    )
    release_consecutive_points: Count = Field(
        1, ge=1, description="Number of cycles after which the shape ceases to act."
    )
    enabled: bool = Field(True, description="Use this shape.")


class MonitorPolygon(_Shape):
    """A polygon; without points, an approach takes the robot's padded footprint."""

    type: Literal["polygon"]
    points: Corners | None = Field(
        None, description="Corners of the polygon in the base frame [m]."
    )

    @model_validator(mode="after")
    def _check(self) -> MonitorPolygon:
        if self.points is None and self.action_type != "approach":
            raise ValueError(f"points: missing, but required for action_type {self.action_type!r}")
        return self


class MonitorCircle(_Shape):
    """A circle about the base origin."""

    type: Literal["circle"]
    radius: Size = Field(description="Radius of the circle around the base origin [m].")


class SubPolygon(FrozenModel):
    """The polygon for a range of commands."""

    points: Corners = Field(description="Corners of the polygon in the base frame [m].")
    linear_min: Speed = Field(
        description="Lowest v, or speed of a holonomic base, at which the polygon applies [m/s]."
    )
    linear_max: Speed = Field(
        description="Highest v, or speed of a holonomic base, at which the polygon applies [m/s]."
    )
    theta_min: AngularSpeed = Field(description="Lowest w at which the polygon applies [rad/s].")
    theta_max: AngularSpeed = Field(description="Highest w at which the polygon applies [rad/s].")

    direction_start_angle: Angle = Field(
        -math.pi,
        description="Holonomic base: first direction of motion at which the polygon applies, "
        "counter-clockwise [rad].",
    )
    direction_end_angle: Angle = Field(
        math.pi,
        description="Holonomic base: last direction of motion at which the polygon applies [rad].",
    )

    def covers(self, command: Command, *, holonomic: bool, release: Release) -> bool:
        """Tells whether the sub-polygon applies to a command, bounds included.

        A holonomic base at rest moves in the direction 0. In Kilted v alone, not the speed, must
        lie between linear_min and linear_max, whatever the base.
        """
        v, w, vy = command
        speed = math.hypot(v, vy)
        is_by_speed = holonomic and release is not Release.KILTED
        is_in_range = self.linear_min <= (speed if is_by_speed else v) <= self.linear_max
        if not (is_in_range and self.theta_min <= w <= self.theta_max):
            return False
        if not holonomic:
            return True
        direction = 0.0 if is_by_speed and speed == 0.0 else math.atan2(vy, v)
        start, end = self.direction_start_angle, self.direction_end_angle
        is_after_start, is_before_end = direction >= start, direction <= end
        # A range of directions may contain the direction straight back.
        if start > end:
            return is_after_start or is_before_end
        return is_after_start and is_before_end


class VelocityPolygon(_Shape):
    """A polygon that depends on the command: the first sub-polygon that applies.

    Where no sub-polygon applies, the last one stays.
    """

    type: Literal["velocity_polygon"]
    holonomic: bool = Field(
        False, description="Choose sub-polygons by speed and direction of motion, not by v."
    )
    velocity_polygons: dict[str, SubPolygon] = Field(
        min_length=1, description="Sub-polygons; the first one that applies to the command is used."
    )


MonitorShape = Annotated[
    MonitorPolygon | MonitorCircle | VelocityPolygon, Field(discriminator="type")
]


class CollisionMonitorParameters(QuietModel):
    """Parameters of nav2_collision_monitor."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {"enabled": since(Release.LYRICAL)}

    quiet: ClassVar = frozenset({"observation_sources", "nav2_release"})

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Iron a source without current data is "
        "left out and stops nothing; Humble's approach stops at one point less inside the shape; "
        "Iron limits v and w separately; Kilted chooses sub-polygons of a holonomic base by v; "
        "Lyrical drops a range that is not finite, so that the one before counts on.",
    )

    polygons: dict[str, MonitorShape] = Field(
        min_length=1, description="Shapes by name, in the order in which they are tested."
    )
    enabled: bool = Field(
        True,
        description="Use the shapes; a source without current data stops the robot in any case.",
    )
    source_timeout: Duration = Field(
        2.0,
        ge=0.0,
        description="Age of a source's data above which the robot is stopped [s]; 0: never.",
    )
    base_shift_correction: bool = Field(
        True, description="Correct the scan by the robot's motion since it was taken."
    )
    observation_sources: dict[str, MonitorSource] = Field(
        default_factory=lambda: dict(THE_SCAN),
        min_length=1,
        description="Names of the observation sources, in order.",
    )


class ShapeState(NamedTuple):
    """hits, misses: cycles in a row. is_triggered. sub_polygon: name of the last one chosen."""

    hits: int = 0
    misses: int = 0
    is_triggered: bool = False
    sub_polygon: str | None = None


class MonitorState(NamedTuple):
    """The state of a monitor: that of each shape, and the last action.

    action: action on the last command, 'none', 'stop', 'slowdown', 'limit' or 'approach'.
    polygon: the shape's name, INVALID_SOURCE where there was no scan, '' where nothing acted.
    """

    shapes: Mapping[str, ShapeState] = {}
    action: str = "none"
    polygon: str = ""


class CollisionMonitor:
    """Looks at the shapes in order; the slowest candidate wins, and a stop ends the search.

    A candidate replaces the command only where v^2 + vy^2 + w^2 becomes strictly smaller. An
    approach ends one step of the look-ahead early, so a collision within the first step stops the
    robot.

    footprint: (K, 2) padded, m.
    """

    def __init__(self, parameters: CollisionMonitorParameters, footprint: Array) -> None:
        self._parameters = parameters
        self._footprint = np.ascontiguousarray(footprint)
        self._vertices: dict[tuple[str, str | None], Array] = {
            (name, part): np.ascontiguousarray(points, dtype=float)
            for name, shape in parameters.polygons.items()
            for part, points in _corners(shape).items()
        }

    def step(
        self, state: MonitorState, command: Array, points: Array | None
    ) -> tuple[MonitorState, Array]:
        """Returns the state for the next command, and the command (3,) that is let through.

        points: None where a source is missing or too old, which stops the robot.
        """
        if points is None:
            return MonitorState(state.shapes, "stop", INVALID_SOURCE), np.zeros(3)
        v, w, vy = command.tolist()
        wanted: Command = (v, w, vy)
        chosen, action, polygon = wanted, "none", ""
        shapes = dict(state.shapes)
        for name, shape in self._parameters.polygons.items():
            if not (shape.enabled and self._parameters.enabled):
                continue
            if action == "stop":
                break
            before = shapes.get(name, ShapeState())
            shapes[name], candidate = self._look_at(name, before, wanted, points)
            if candidate is None:
                continue
            if shape.action_type == "stop" or _speed(candidate) < _speed(chosen):
                chosen, action, polygon = candidate, shape.action_type, name
        return MonitorState(shapes, action, polygon), np.array(chosen)

    def _look_at(
        self, name: str, state: ShapeState, command: Command, points: Array
    ) -> tuple[ShapeState, Command | None]:
        """Returns the shape's state, and what it lets pass of a command; None: all of it."""
        shape = self._parameters.polygons[name]
        state, vertices, radius = self._geometry(name, state, command)
        if shape.action_type == "none" or (not len(vertices) and radius == 0.0):
            return state, None
        count = count_inside(points, vertices, radius)
        if shape.action_type == "approach":
            if count >= self._enough_to_stop(shape):
                return state, _scaled(command, 0.0)
            time_s = time_to_collision(
                points,
                vertices,
                radius,
                shape.min_points,
                command,
                shape.time_before_collision,
                shape.simulation_time_step,
            )
            if time_s == NO_COLLISION:
                return state, None
            return state, _scaled(command, time_s / shape.time_before_collision)
        state = _counted(shape, state, count >= shape.min_points)
        if not state.is_triggered:
            return state, None
        if shape.action_type == "stop":
            return state, _scaled(command, 0.0)
        if shape.action_type == "slowdown":
            return state, _scaled(command, shape.slowdown_ratio)
        if self._parameters.nav2_release is Release.IRON:
            return state, _limited_separately(shape, command)
        return state, _scaled(command, _limit_ratio(shape, command))

    def _enough_to_stop(self, shape: MonitorShape) -> int:
        """Returns the least number of points in the shape of an approach that stops the robot.

        In Humble as many as `max_points`, while on the way more than these count.
        """
        is_humble = self._parameters.nav2_release is Release.HUMBLE
        return shape.min_points - 1 if is_humble else shape.min_points

    def _geometry(
        self, name: str, state: ShapeState, command: Command
    ) -> tuple[ShapeState, Array, float]:
        """Returns the state, and the shape: (K, 2) m vertices, or, without any, a radius, m."""
        shape = self._parameters.polygons[name]
        if isinstance(shape, MonitorCircle):
            return state, NO_VERTICES, shape.radius
        if isinstance(shape, MonitorPolygon):
            return state, self._vertices.get((name, WHOLE), self._footprint), 0.0
        for part, polygon in shape.velocity_polygons.items():
            if polygon.covers(
                command, holonomic=shape.holonomic, release=self._parameters.nav2_release
            ):
                state = state._replace(sub_polygon=part)
                break
        return state, self._vertices.get((name, state.sub_polygon), NO_VERTICES), 0.0


def _corners(shape: MonitorShape) -> Mapping[str, tuple[Point, ...]]:
    """Returns the given corners of a shape, by the name of the part."""
    if isinstance(shape, VelocityPolygon):
        return {part: polygon.points for part, polygon in shape.velocity_polygons.items()}
    if isinstance(shape, MonitorPolygon) and shape.points is not None:
        return {WHOLE: shape.points}
    return {}


def _counted(shape: MonitorShape, state: ShapeState, is_hit: bool) -> ShapeState:
    """Returns the state after a cycle with or without enough points."""
    if is_hit:
        hits = state.hits + 1
        is_triggered = state.is_triggered or hits >= shape.trigger_consecutive_points
        return state._replace(hits=hits, misses=0, is_triggered=is_triggered)
    misses = state.misses + 1
    is_triggered = state.is_triggered and misses < shape.release_consecutive_points
    return state._replace(hits=0, misses=misses, is_triggered=is_triggered)


def _scaled(command: Command, ratio: float) -> Command:
    v, w, vy = command
    return ratio * v, ratio * w, ratio * vy


def _limited_separately(shape: MonitorShape, command: Command) -> Command:
    """Returns a command whose speed and whose turn rate each keep their limit."""
    v, w, vy = command
    speed, limit = math.hypot(v, vy), shape.angular_limit
    ratio = 1.0 if speed == 0.0 else min(shape.linear_limit / speed, 1.0)
    return ratio * v, min(max(w, -limit), limit), ratio * vy


def _limit_ratio(shape: MonitorShape, command: Command) -> float:
    """Returns the share of a command that keeps both limits and the curvature."""
    ratio = 1.0
    v, w, vy = command
    speed = math.hypot(v, vy)
    if speed != 0.0:
        ratio = min(ratio, shape.linear_limit / speed)
    if w != 0.0:
        ratio = min(ratio, shape.angular_limit / abs(w))
    return ratio


def _speed(command: Command) -> float:
    """Returns Nav2's measure for ordering commands: a squared sum of unlike units."""
    v, w, vy = command
    return v**2 + vy**2 + w**2
