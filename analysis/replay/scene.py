"""Draws the fixed parts of a replay: floor, obstacles and task; places the camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import Box, Meshcat, Rgba
from pydrake.math import RigidTransform

from drake_navbench.analysis.replay.flat_meshes import arrow, ring
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import OBSTACLE_COLOR, obstacle_shapes
from drake_navbench.kernels.arrays import Array

FLOOR_COLOR = Rgba(0.93, 0.94, 0.95, 1.0)
# Lidar hits and paths behind an obstacle stay visible.
OBSTACLE_OPACITY = 0.55
GRID_COLOR = Rgba(0.62, 0.65, 0.69, 1.0)
MARKER_COLOR = Rgba(0.15, 0.16, 0.20, 1.0)
# Meshcat's own lamps hang over the origin; the far end of a course of 15 m would be dark.
NEARBY_LIGHTS = ("SpotLight", "PointLightNegativeX", "PointLightPositiveX")
AMBIENT_INTENSITY, SUN_INTENSITY = 1.1, 2.0
# Direction to the light in three.js's frame: x right, y up, z towards the viewer.
SUN_DIRECTION_YUP = [-3.0, 8.0, 4.0]
BACKGROUND_TOP = [0.80, 0.85, 0.92]
BACKGROUND_BOTTOM = [0.96, 0.97, 0.98]

# Heights above the floor, a few millimetres apart, so that flat objects do not flicker.
FLOOR_THICKNESS_M = 0.01
FLOOR_TOP_M = -0.004
PATH_HEIGHT_M = 0.004
MARKER_HEIGHT_M = 0.025

MARKER_WIDTH_M = 0.04
START_RADIUS_M = 0.10
ARROW_SIZE_M = 0.35
POINT_SPACING_M = 0.05

FLOOR_MARGIN_M = 2.0
COURSE_MARGIN_M = 0.1
# A slanted view from the south: x runs to the right and y away from the viewer, as on a map.
CAMERA_ELEVATION_RAD = np.deg2rad(52.0)
CAMERA_FOV_DEG = 35.0
# In windows narrower than this the sides are cut off.
CAMERA_ASPECT = 1.5
# The share of the picture's width and height that the course may fill; the player covers the
# bottom.
CAMERA_FILL_X, CAMERA_FILL_Y = 0.94, 0.84
# The nearer the near plane, the coarser the depth buffer at the floor.
CAMERA_NEAR_M, CAMERA_FAR_M = 0.2, 400.0
OBSTACLE_TOP_M = 1.0


@dataclass(frozen=True)
class Bounds:
    """A rectangle on the floor, m."""

    low: Array
    high: Array

    @classmethod
    def around(cls, points: Array, margin_m: float) -> Bounds:
        """Returns the rectangle around (N, 2) points with a margin."""
        return cls(points.min(axis=0) - margin_m, points.max(axis=0) + margin_m)

    @property
    def corners(self) -> Array:
        """(4, 2) m."""
        (x0, y0), (x1, y1) = self.low, self.high
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def add_scene(stage: Stage, world: World, *, course: Bounds) -> None:
    """Draws floor and obstacles, and points the camera so that it shows the whole course."""
    outlines = [obstacle.outline for obstacle in world.obstacles]
    outlines += [thing.knots[:, 1:3] for thing in world.moving.things]
    floor = Bounds.around(np.vstack([course.corners, *outlines]), FLOOR_MARGIN_M)
    _replace_defaults(stage.meshcat)
    _draw_floor(stage.meshcat, floor)
    _draw_obstacles(stage.meshcat, world)
    _aim_camera(stage.meshcat, course)


def goal_tolerance_m(checker: Mapping[str, Any]) -> float | None:
    """Returns the radius around the goal within which the goal counts as reached, m.

    None where the goal checker has no such radius.

    checker: the goal checker's settings.
    """
    return checker.get("xy_goal_tolerance", checker.get("coarse_xy_goal_tolerance"))


def add_task(
    stage: Stage,
    start: Array,
    goals: Array,
    goal_tolerance_m: float | None,
    *,
    is_through_poses: bool = False,
) -> None:
    """Draws the start, and waypoints and goal with the circle that the goal checker accepts.

    start: (3,), goals: (G, 3), the waypoints and then the goal, x m, y m, yaw rad.
    goal_tolerance_m: the circle's radius, None where the checker accepts no circle.
    is_through_poses: the checker looks at the goal alone; waypoints have no circle.
    """
    *waypoints, goal = goals
    at_waypoint_m = None if is_through_poses else goal_tolerance_m
    for name, pose, radius_m in (
        ("start", start, START_RADIUS_M),
        *((f"waypoint/{i}", pose, at_waypoint_m) for i, pose in enumerate(waypoints)),
        ("goal", goal, goal_tolerance_m),
    ):
        if radius_m is not None:
            circle = ring(
                pose[:2], radius_m=radius_m, width_m=MARKER_WIDTH_M, height_m=MARKER_HEIGHT_M
            )
            stage.flat_mesh(f"/{name}/circle", circle, MARKER_COLOR)
        head = arrow(pose, length_m=ARROW_SIZE_M, width_m=ARROW_SIZE_M, height_m=MARKER_HEIGHT_M)
        stage.flat_mesh(f"/{name}/heading", head, MARKER_COLOR)


def _replace_defaults(meshcat: Meshcat) -> None:
    for path in ("/Grid", "/Axes", *(f"/Lights/{name}" for name in NEARBY_LIGHTS)):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", AMBIENT_INTENSITY)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", SUN_INTENSITY)
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", SUN_DIRECTION_YUP)
    meshcat.SetProperty("/Background", "top_color", BACKGROUND_TOP)
    meshcat.SetProperty("/Background", "bottom_color", BACKGROUND_BOTTOM)


def _draw_floor(meshcat: Meshcat, bounds: Bounds) -> None:
    low, high = np.floor(bounds.low), np.ceil(bounds.high)
    size, centre = high - low, 0.5 * (low + high)
    meshcat.SetObject("/floor/slab", Box(*size, FLOOR_THICKNESS_M), FLOOR_COLOR)
    slab_height_m = FLOOR_TOP_M - 0.5 * FLOOR_THICKNESS_M
    meshcat.SetTransform("/floor/slab", RigidTransform([*centre, slab_height_m]))
    starts = [[x, low[1], 0.0] for x in np.arange(low[0], high[0] + 0.5)]
    ends = [[x, high[1], 0.0] for x in np.arange(low[0], high[0] + 0.5)]
    starts += [[low[0], y, 0.0] for y in np.arange(low[1], high[1] + 0.5)]
    ends += [[high[0], y, 0.0] for y in np.arange(low[1], high[1] + 0.5)]
    meshcat.SetLineSegments(
        "/floor/metre_grid", np.array(starts).T, np.array(ends).T, rgba=GRID_COLOR
    )


def _draw_obstacles(meshcat: Meshcat, world: World) -> None:
    for index, obstacle in enumerate(world.obstacles):
        for piece, (pose, shape) in enumerate(obstacle_shapes(obstacle)):
            path = f"/obstacles/{index}/{piece}"
            meshcat.SetObject(path, shape, Rgba(*OBSTACLE_COLOR[:3], OBSTACLE_OPACITY))
            meshcat.SetTransform(path, pose)


def camera_view(course: Bounds) -> tuple[Array, Array]:
    """Returns position and target (3,) m of the nearest camera that shows the whole course."""
    toward_camera = np.array([0.0, -np.cos(CAMERA_ELEVATION_RAD), np.sin(CAMERA_ELEVATION_RAD)])
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(toward_camera, right)
    slope = np.tan(np.deg2rad(CAMERA_FOV_DEG) / 2)
    half_width, half_height = CAMERA_FILL_X * CAMERA_ASPECT * slope, CAMERA_FILL_Y * slope
    target = np.array([*0.5 * (course.low + course.high), 0.0])
    corners = np.array([[*c, z] for c in course.corners for z in (0.0, OBSTACLE_TOP_M)]) - target
    # A point p is in the picture where |p . right| <= (distance - p . toward) * half_width, and
    # likewise for up; so each point asks for a distance, and the largest one serves all.
    distances = corners @ toward_camera + np.maximum(
        np.abs(corners @ right) / half_width, np.abs(corners @ up) / half_height
    )
    return target + distances.max() * toward_camera, target


def _aim_camera(meshcat: Meshcat, course: Bounds) -> None:
    meshcat.SetCamera(
        Meshcat.PerspectiveCamera(
            fov=CAMERA_FOV_DEG, aspect=CAMERA_ASPECT, near=CAMERA_NEAR_M, far=CAMERA_FAR_M
        )
    )
    meshcat.SetCameraPose(*camera_view(course))
