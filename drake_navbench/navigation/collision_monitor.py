"""Nav2's collision monitor: slows or stops a command if points lie in shapes around the robot.

Pure functions of an immutable state. Points are (N, 2) m in the base frame, commands (3,) v m/s,
w rad/s, vy m/s. Source: nav2_collision_monitor, branches humble to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.points_inside import NO_COLLISION, count_inside, time_to_collision
from drake_navbench.navigation.monitor_shapes import (
    CollisionMonitorParameters,
    Command,
    MonitorCircle,
    MonitorPolygon,
    MonitorShape,
    VelocityPolygon,
)
from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.quantities import Point

INVALID_SOURCE = "invalid source"
WHOLE = ""
NO_VERTICES = np.empty((0, 2))


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
        self, state: MonitorState, command: Array, points: Mapping[str, Array] | None
    ) -> tuple[MonitorState, Array]:
        """Returns the state for the next command, and the command (3,) that is let through.

        points: (N, 2) m of each source, base frame; None where a source is missing or too old,
        which stops the robot.
        """
        if points is None:
            return MonitorState(state.shapes, "stop", INVALID_SOURCE), np.zeros(3)
        of_all = _together(points.values())
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
            sources = shape.sources_names
            seen = of_all
            if sources is not None:
                seen = _together(points[source] for source in sources if source in points)
            shapes[name], candidate = self._look_at(name, before, wanted, seen)
            if candidate is None:
                continue
            if shape.action_type == "stop" or _speed(candidate) < _speed(chosen):
                chosen, action, polygon = candidate, shape.action_type, name
        return MonitorState(shapes, action, polygon), np.array(chosen)

    def _look_at(
        self, name: str, state: ShapeState, command: Command, points: Array
    ) -> tuple[ShapeState, Command | None]:
        """Returns the shape's state, and the command that it allows; None: as it came."""
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


def _together(points: Iterable[Array]) -> Array:
    """Returns the points (N, 2) of several sources as one array."""
    return np.ascontiguousarray(np.vstack([np.empty((0, 2)), *points]))


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
