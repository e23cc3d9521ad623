"""A trial drawn while it runs: the scene, the layers and the legend of a replay."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.replay.actors import HIT_HEIGHT_M, HIT_SIZE_M, PATH_WIDTH_M, draw_robot
from drake_navbench.analysis.replay.costmaps import COSTMAP_COLOR
from drake_navbench.analysis.replay.flat_meshes import ribbon, thinned
from drake_navbench.analysis.replay.global_plans import PLAN_COLOR, PLAN_PATH, draw_plan
from drake_navbench.analysis.replay.ground_texture import textured_square
from drake_navbench.analysis.replay.intentions import PREDICTED_COLOR, draw_prediction
from drake_navbench.analysis.replay.moving_shapes import draw_moving, on_floor
from drake_navbench.analysis.replay.odometry_frame import placed_points
from drake_navbench.analysis.replay.page import LegendRow, assemble
from drake_navbench.analysis.replay.paths import (
    LAYER_COLOR,
    MOVING_PATH,
    RobotPaths,
    css_color,
    rgba_of,
)
from drake_navbench.analysis.replay.people import draw_person
from drake_navbench.analysis.replay.robot_model import load_model
from drake_navbench.analysis.replay.scene import (
    CAMERA_ASPECT,
    PATH_HEIGHT_M,
    POINT_SPACING_M,
    Bounds,
    add_scene,
    add_task,
)
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.inputs.world import World
from drake_navbench.kernels.poses import inverse
from drake_navbench.logs.moment import Moment

COSTMAP_PATH, PREDICTION_PATH = "/local_costmap", "/prediction"
# A browser asks for a costmap by an address of its own, which Meshcat forgets with the object. The
# last ones stay here, unseen: 2 s for a browser that is slow.
KEPT_PATH, KEPT_COSTMAPS = "/kept_costmaps", 8
# Objects that must be drawn anew as a whole are updated less often than the robot's pose.
SLOW_PERIOD_S = 0.25
MARGIN_M = 2.0
# The paths of all objects of a scene, which are deleted before the next scene.
DRAWN = (
    "/controllers",
    "/floor",
    "/goal",
    "/obstacles",
    "/start",
    "/waypoint",
    COSTMAP_PATH,
    KEPT_PATH,
    MOVING_PATH,
    PLAN_PATH,
    PREDICTION_PATH,
)


class Course(NamedTuple):
    """The fixed parts of a live scene: the world, the task, and the robot's shape.

    start: (3,) and goals: (G, 3), each x m, y m, yaw rad, world frame. goal_tolerance_m: None where
    the goal checker has no radius. outline: (K, 2) m, base frame. model: the robot's SDF file; None
    draws the robot as a prism over its outline. is_through_poses: whether the robot passes the
    goals but the last.
    """

    scenario: str
    world: World
    start: NDArray[np.float64]
    goals: NDArray[np.float64]
    goal_tolerance_m: float | None
    outline: NDArray[np.float64]
    model: Path | None
    is_through_poses: bool = False


class LiveScene:
    """Draws one trial into a Meshcat that serves it to browsers.

    has_controls: Meshcat has buttons and sliders, and the page shows them unfolded. page: the HTML
    for the browser: Meshcat's own page without a scene, with the replay's legend and cameras around
    it; the scene comes from Meshcat's server.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        course: Course,
        controller: str,
        *,
        subtitle: str,
        has_controls: bool = False,
    ) -> None:
        self._has_controls = has_controls
        for path in DRAWN:
            meshcat.Delete(path)
        self._stage = Stage(meshcat)
        self._paths = RobotPaths(controller)
        self._rgba = rgba_of(controller_color(controller))
        ends = np.vstack([course.start, course.goals])[:, :2]
        bounds = Bounds.around(ends, MARGIN_M)
        self.page = self._page(course.scenario, controller, subtitle, bounds)
        add_scene(self._stage, course.world, course=bounds)
        add_task(
            self._stage,
            course.start,
            course.goals,
            course.goal_tolerance_m,
            is_through_poses=course.is_through_poses,
        )
        self._moving = draw_moving(self._stage, course.world.moving)
        for index in range(len(course.world.people)):
            self._moving.append(f"{self._paths.people}/{index}")
            draw_person(self._stage, self._moving[-1], self._rgba)
        model = load_model(course.model, course.outline)
        draw_robot(self._stage, self._paths.robot, model, outline=course.outline, rgba=self._rgba)
        for link, pose in model.rest_poses().items():
            self._stage.pose(f"{self._paths.robot}/{link}", pose)
        self._driven: list[NDArray[np.float64]] = []
        self._plan: NDArray[np.float64] | None = None
        self._slow_s = -np.inf
        self._costmap_count = 0
        meshcat.SetProperty(KEPT_PATH, "visible", False)

    def show(self, moment: Moment) -> None:
        """Draws the scene as it is at the time of `moment`."""
        x, y, yaw = moment.state[:3]
        self._stage.pose(
            self._paths.robot, RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0])
        )
        for path, pose in zip(self._moving, moment.moving_poses, strict=True):
            self._stage.pose(path, on_floor(pose))
        self._driven.append(moment.state[:2].copy())
        if moment.plan is not None and moment.plan is not self._plan:
            self._plan = moment.plan
            draw_plan(self._stage, PLAN_PATH, moment.plan)
        if moment.time_s - self._slow_s >= SLOW_PERIOD_S:
            self._slow_s = moment.time_s
            self._show_slow_layers(moment)

    def _show_slow_layers(self, moment: Moment) -> None:
        points = thinned(np.array(self._driven), POINT_SPACING_M)
        path = ribbon(points, width_m=PATH_WIDTH_M, height_m=PATH_HEIGHT_M)
        self._stage.flat_mesh(self._paths.driven, path, self._rgba)
        if moment.scan is not None:
            self._stage.points(
                self._paths.scan,
                moment.scan.hits,
                height_m=HIT_HEIGHT_M,
                size_m=HIT_SIZE_M,
                rgba=self._rgba,
            )
        frame = moment.odometry_from_world
        place = np.zeros(3) if frame is None else inverse(frame)
        if moment.costmap is not None:
            meshcat, square = self._stage.meshcat, textured_square(moment.costmap)
            meshcat.SetObject(COSTMAP_PATH, square)
            self._costmap_count += 1
            meshcat.SetObject(f"{KEPT_PATH}/{self._costmap_count % KEPT_COSTMAPS}", square)
            self._stage.pose(COSTMAP_PATH, on_floor(place))
        predicted = moment.diagnostics.get("predicted_trajectory", ())
        if len(predicted):
            predicted = placed_points(predicted, place)
            draw_prediction(self._stage, PREDICTION_PATH, predicted)

    def _page(self, scenario: str, controller: str, subtitle: str, course: Bounds) -> str:
        color = controller_color(controller)
        paths = self._paths
        layers = [
            LegendRow("driven path", color, [paths.driven]),
            LegendRow("global plan", css_color(PLAN_COLOR), [PLAN_PATH]),
            LegendRow("lidar hits", LAYER_COLOR, [paths.scan]),
            LegendRow("local costmap", css_color(COSTMAP_COLOR), [COSTMAP_PATH]),
            LegendRow("prediction", css_color(PREDICTED_COLOR), [PREDICTION_PATH]),
        ]
        x, y = zip(course.low.tolist(), course.high.tolist(), strict=True)
        robot = {"name": controller, "color": color, "group": paths.group, "robot": paths.robot}
        return assemble(
            self._stage.meshcat.StaticHtml(),
            title=f"{scenario}: {controller}",
            subtitle=subtitle,
            sections=[[LegendRow(controller, color, [paths.robot])], layers],
            data={
                "bounds": [*x, *y],
                "aspect": CAMERA_ASPECT,
                "robots": [robot],
                "live": self._stage.meshcat.ws_url(),
                "controls": self._has_controls,
            },
        )
