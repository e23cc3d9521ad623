"""The surroundings of a robot, to scale: its sensors' fields, a column's lengths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from drake_navbench.analysis.figures.views import AroundView, Shape
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.arrays import Array

# The number of corners of a circle, and of an arc of it.
ROUND, ARC = 90, 40
# A horizon is drawn up to this turn to either side: a quarter.
MOST_TURN_RAD = 0.5 * math.pi
# Nav2's cost at the inscribed radius, and the number of steps in which inflation is drawn.
INSCRIBED_COST, STEPS = 253, 24
# The fields of an observation source with ranges, in Nav2's layers and in the spatio-temporal one.
RANGES = {
    "marks": ("obstacle_max_range", "obstacle_range"),
    "clears": ("raytrace_max_range",),
}
# Near a robot means within so many of its circumscribed radii.
NEAR_RADII = 2.5


def robot_view(robot: Robot, name: str) -> AroundView:
    """Returns a robot's outline with the fields of its lidar, depth and range sensors."""
    shapes = list(_outlines(robot))
    lidar = robot.lidar
    for number, pose in enumerate((lidar.pose, *lidar.further_poses), start=1):
        begin, span = lidar.angle_min_rad, lidar.angle_span_rad
        which = f" {number}" if lidar.further_poses else ""
        label = (
            f"lidar{which}: {lidar.range_min_m:g} to {lidar.range_max_m:g} m, "
            f"{math.degrees(span):.0f}\N{DEGREE SIGN}, {lidar.beam_count} beams, "
            f"{lidar.height_m:g} m high"
        )
        shapes.append(Shape(label, _sector(pose, lidar.range_max_m, begin, span), is_filled=True))
    for called, depth in robot.depth_sensors.items():
        fov = depth.horizontal_fov_rad
        label = (
            f"{called}: {depth.range_min_m:g} to {depth.range_max_m:g} m, "
            f"{math.degrees(fov):.0f}\N{DEGREE SIGN}, {depth.height_m:g} m high"
        )
        corners = _sector(depth.pose, depth.range_max_m, -0.5 * fov, fov)
        shapes.append(Shape(label, corners, is_filled=True))
    for called, sonar in robot.range_sensors.items():
        fov = sonar.field_of_view_rad
        label = f"{called}: {sonar.range_min_m:g} to {sonar.range_max_m:g} m"
        corners = _sector(sonar.pose, sonar.range_max_m, -0.5 * fov, fov)
        shapes.append(Shape(label, corners, is_filled=True))
    near_m = NEAR_RADII * float(np.hypot(*robot.outline.T).max())
    return AroundView(f"Robot {name}", robot.outline, shapes, [], near_m)


def column_view(preset: Preset, robot: Robot) -> AroundView:
    """Returns a robot with the lengths around it that a column's parameters set."""
    driven = preset.robot(robot)
    fitted = preset.for_robot(driven)
    local = driven.navigation.local_costmap
    shapes = list(_outlines(driven))
    checker = driven.navigation.goal_checker
    if (tolerance := getattr(checker, "xy_goal_tolerance", None)) is not None:
        shapes.append(Shape(f"goal tolerance {tolerance:g} m", _circle(tolerance)))
    near_m = NEAR_RADII * driven.radii[1]
    graded: list[tuple[float, int]] = []
    for block in _layers(local):
        if (reach_m := getattr(block, "inflation_radius", None)) is None:
            continue
        scaling = block.cost_scaling_factor
        label = f"inflation {reach_m:g} m, cost_scaling_factor {scaling:g}"
        shapes.append(Shape(label, _circle(reach_m)))
        graded = _graded(reach_m, scaling, driven.radii[0])
        near_m = max(near_m, 1.1 * reach_m)
    shapes += _monitor(driven)
    shapes += _distances(fitted.parameters)
    prune_m = driven.navigation.path_handler.prune_distance
    shapes.append(_ahead("plan ahead: prune_distance", prune_m))
    shapes += _ranges(local)
    half = 0.5 * np.array([local.width, local.height])
    window = half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    label = f"local costmap {local.width:g} x {local.height:g} m, cells {local.resolution:g} m"
    shapes.append(Shape(label, window))
    title = f"{preset.name}: {preset.controller}"
    return AroundView(title, driven.outline, shapes, graded, near_m)


def _outlines(robot: Robot) -> Iterator[Shape]:
    inscribed, circumscribed = robot.radii
    label = f"footprint in costmaps; radii {inscribed:.3g} inside, {circumscribed:.3g} m around"
    yield Shape(label, robot.padded_outline)


def _layers(local: Any) -> Iterator[Any]:
    """Yields the settings of the active layers of a costmap."""
    for name in local.plugins:
        if local.is_active(name):
            yield local.block(name)


def _graded(reach_m: float, scaling: float, inscribed_m: float) -> list[tuple[float, int]]:
    """Returns radii, m, from the largest on with Nav2's cost there."""
    radii = np.linspace(reach_m, min(inscribed_m, reach_m), STEPS)
    costs = (INSCRIBED_COST - 1) * np.exp(-scaling * np.maximum(radii - inscribed_m, 0.0))
    return [(float(r), max(int(c), 1)) for r, c in zip(radii, costs, strict=True)] + [
        (min(inscribed_m, reach_m), INSCRIBED_COST)
    ]


def _distances(parameters: Any) -> Iterator[Shape]:
    """Yields lookahead distances and horizons of a controller, by the parameters that it has."""

    def value(name: str) -> Any:
        return getattr(parameters, name, None)

    if value("lookahead_dist") is not None:
        if value("use_velocity_scaled_lookahead_dist"):
            for name in ("min_lookahead_dist", "max_lookahead_dist"):
                yield _ahead(name, value(name))
        else:
            yield _ahead("lookahead_dist", value("lookahead_dist"))
    for name in ("min_lookahead", "max_lookahead", "forward_sampling_distance"):
        if value(name) is not None:
            yield _ahead(name, value(name))
    if value("max_global_plan_lookahead_dist") is not None:
        yield _ahead("max_global_plan_lookahead_dist", value("max_global_plan_lookahead_dist"))
    if value("time_steps") is not None and value("model_dt") is not None:
        yield _horizon(value("time_steps") * value("model_dt"), value("vx_max"), value("wz_max"))
    elif value("sim_time") is not None and value("max_vel_x") is not None:
        yield _horizon(value("sim_time"), value("max_vel_x"), value("max_vel_theta"))
    primary = value("primary_controller")
    if primary is not None:
        yield from _distances(primary.parameters)


def _horizon(time_s: float, speed_mps: float, turn_radps: float | None) -> Shape:
    """Returns the area that a robot reaches at full speed, from its sharpest left to right turn."""
    most = min((turn_radps or 0.0) * time_s, MOST_TURN_RAD)
    length_m = time_s * speed_mps
    label = f"horizon {time_s:g} s at {speed_mps:g} m/s = {length_m:.3g} m"
    ends = np.array([_arc(length_m, turn)[-1] for turn in np.linspace(most, -most, ARC)])
    sides = _arc(length_m, most), _arc(length_m, -most)[::-1]
    return Shape(label, np.vstack([sides[0], ends, sides[1]]), is_filled=True)


def _arc(length_m: float, turn_rad: float) -> Array:
    """Returns (ARC, 2) points of an arc that begins ahead of the origin and turns by `turn_rad`."""
    along = np.linspace(0.0, length_m, ARC)
    if abs(turn_rad) < 1e-9:
        return np.column_stack([along, np.zeros(ARC)])
    radius = length_m / turn_rad
    return np.column_stack([radius * np.sin(along / radius), radius * (1 - np.cos(along / radius))])


def _ranges(local: Any) -> Iterator[Shape]:
    """Yields the ranges in which a local costmap's sensors mark and clear; equal ones once."""
    reaches: dict[tuple[str, float], list[str]] = {}
    for block in _layers(local):
        sources = getattr(block, "observation_sources", None)
        named: Mapping[str, Any] = sources if isinstance(sources, Mapping) and sources else {}
        if not named and hasattr(block, RANGES["marks"][0]):
            named = {"scan": block}
        for name, source in named.items():
            for word, fields in RANGES.items():
                reach_m = next((getattr(source, f) for f in fields if hasattr(source, f)), 0.0)
                if reach_m > 0.0:
                    reaches.setdefault((word, reach_m), []).append(name)
    for (word, reach_m), names in reaches.items():
        told = ", ".join(dict.fromkeys(names))
        yield Shape(f"{told}: {word} up to {reach_m:g} m", _circle(reach_m))


def _monitor(robot: Robot) -> Iterator[Shape]:
    monitor = robot.navigation.collision_monitor
    for name, shape in ({} if monitor is None else monitor.polygons).items():
        label = f"collision monitor: {name}, {shape.action_type}"
        if shape.type == "circle":
            yield Shape(label, _circle(shape.radius))
        elif shape.type == "velocity_polygon":
            for part, polygon in shape.velocity_polygons.items():
                yield Shape(f"{label}, {part}", np.array(polygon.points))
        elif shape.points is not None:
            yield Shape(label, np.array(shape.points))


def _circle(radius_m: float) -> Array:
    return _sector((0.0, 0.0, 0.0), radius_m, -math.pi, 2.0 * math.pi)


def _ahead(name: str, radius_m: float) -> Shape:
    """Returns a distance along a plan: half a circle ahead."""
    turns = np.linspace(-0.5 * math.pi, 0.5 * math.pi, ROUND)
    arc = radius_m * np.column_stack([np.cos(turns), np.sin(turns)])
    return Shape(f"{name} {radius_m:g} m", arc, is_open=True)


def _sector(
    pose: tuple[float, float, float], radius_m: float, begin_rad: float, span_rad: float
) -> Array:
    """Returns the field of a sensor at a pose (x m, y m, yaw rad) in the robot's frame."""
    x, y, yaw = pose
    turns = yaw + np.linspace(begin_rad, begin_rad + span_rad, ROUND)
    arc = np.array([x, y]) + radius_m * np.column_stack([np.cos(turns), np.sin(turns)])
    is_round = math.isclose(span_rad, 2.0 * math.pi)
    return arc if is_round else np.vstack([[[x, y]], arc])
