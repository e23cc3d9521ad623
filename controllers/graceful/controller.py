"""Graceful Controller: drives along smooth curves to a pose on the plan that it can reach."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from drake_navbench.controller import (
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
)
from drake_navbench.controllers.graceful.control_law import Law
from drake_navbench.controllers.graceful.cycle import (
    BLOCKED,
    FOLLOW,
    ROTATE_TO_GOAL,
    Cycle,
    run_cycle,
)
from drake_navbench.controllers.graceful.memory import GracefulMemory
from drake_navbench.controllers.graceful.parameters import GracefulParameters
from drake_navbench.controllers.graceful.simulation import Scene, Settings
from drake_navbench.kernels.grid import MAX_NON_OBSTACLE
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.settings_record import settings_record
from drake_navbench.kernels.speed_limit import NO_SPEED_LIMIT, limited_speed, speed_limit_ratio

BRANCH_NAMES = {FOLLOW: "follow", ROTATE_TO_GOAL: "rotate_to_goal"}


class Graceful:
    """Nav2's Graceful Controller, branch lyrical, number for number.

    Without `use_collision_detection` Nav2 crashes where it approaches the goal with
    `prefer_final_rotation`; this reads the costs along the approach all the same.
    """

    Parameters: ClassVar[type[GracefulParameters]] = GracefulParameters
    nav2_plugin: ClassVar[str] = "nav2_graceful_controller::GracefulController"

    def __init__(self, parameters: GracefulParameters, setup: ControllerSetup) -> None:
        margin = parameters.obstacle_cost_margin
        if setup.footprint_is_circle and margin > MAX_NON_OBSTACLE:
            raise ValueError(
                f"obstacle_cost_margin: got {margin}, expected at most {MAX_NON_OBSTACLE} for a "
                "robot given by robot_radius"
            )
        self._parameters = parameters
        self._settings = _kernel_settings(parameters, setup)
        self._settings_record = settings_record(self._settings)
        self._wants_diagnostics = setup.wants_diagnostics
        self._footprint = read_only(setup.footprint)

    def initial_memory(self) -> GracefulMemory:
        """Returns the memory at the start of a goal."""
        return GracefulMemory()

    def step(self, observation: Observation, memory: GracefulMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for a plan without poses; NoValidControl where no target on the plan can
        be reached, or the only one left is where the robot stands.
        """
        if len(observation.plan) == 0:
            raise InvalidPath("plan: got no poses, expected at least one")
        if observation.plan_id != memory.plan_id:
            memory = GracefulMemory(observation.plan_id)
        cycle = run_cycle(
            self._settings_record,
            self._scene(observation),
            read_only(observation.plan),
            observation.goal_xy_reached,
            memory.may_turn_first,
            math.nan if memory.safe_angle is None else memory.safe_angle,
        )
        memory = GracefulMemory(
            observation.plan_id,
            cycle.may_turn_first,
            None if math.isnan(cycle.safe_angle) else cycle.safe_angle,
        )
        if cycle.branch == BLOCKED:
            raise NoValidControl("collision on the way to every target", memory=memory)
        if not (math.isfinite(cycle.v) and math.isfinite(cycle.w)):
            # Nav2 divides by the distance to the target and sends what comes of it.
            raise NoValidControl("the only free target is where the robot stands", memory=memory)
        command = np.array([cycle.v, cycle.w])
        command.flags.writeable = False
        return Decision(command, memory, self._diagnostics(cycle, observation))

    def _scene(self, observation: Observation) -> Scene:
        parameters, limit = self._parameters, observation.speed_limit
        max_v = limited_speed(parameters.v_linear_max, limit)
        if limit is not None and limit.value != NO_SPEED_LIMIT:
            max_v = max(max_v, parameters.v_linear_min)
        ratio = speed_limit_ratio(parameters.v_linear_max, limit)
        x, y, yaw = observation.pose.tolist()
        return Scene(
            Law(
                parameters.k_phi,
                parameters.k_delta,
                parameters.beta,
                parameters.lambda_,
                parameters.slowdown_radius,
                parameters.deceleration_max,
                parameters.v_linear_min,
                parameters.v_angular_max * ratio,
            ),
            max_v,
            x,
            y,
            yaw,
            observation.costmap.grid,
            observation.costmap.tracks_unknown,
            self._footprint,
        )

    def _diagnostics(self, cycle: Cycle, observation: Observation) -> dict[str, Any]:
        diagnostics: dict[str, Any] = {
            "branch": BRANCH_NAMES[cycle.branch],
            "target_distance_m": math.hypot(cycle.target_x, cycle.target_y),
            "target_yaw_rad": cycle.target_yaw,
        }
        if self._wants_diagnostics:
            pose = observation.pose
            target = (cycle.target_x, cycle.target_y, cycle.target_yaw)
            diagnostics["carrot"] = compose(pose, target)[:2]
            diagnostics["predicted_trajectory"] = np.array(
                [compose(pose, point) for point in cycle.trajectory]
            )
        return diagnostics


def _kernel_settings(parameters: GracefulParameters, setup: ControllerSetup) -> Settings:
    values = {
        name: value for name, value in parameters.model_dump().items() if name in Settings._fields
    }
    values["allow_backward"] = parameters.drives_backward
    return Settings(is_circle=setup.footprint_is_circle, **values)
