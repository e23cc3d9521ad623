"""Rotation Shim: turns in place towards the plan, and hands over to the primary controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from drake_navbench.controller import (
    ControllerError,
    ControllerSetup,
    Decision,
    Observation,
)
from drake_navbench.controllers.rotation_shim.kernels import (
    Settings,
    heading_of_plan,
    turn_by,
)
from drake_navbench.controllers.rotation_shim.memory import ShimMemory
from drake_navbench.controllers.rotation_shim.parameters import (
    NAV2_PLUGIN,
    RotationShimParameters,
)
from drake_navbench.controllers.rotation_shim.releases import RELEASES, Release
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.kernels.read_only import read_only

TURNS_TO_PATH = "rotate_to_path"
TURNS_TO_GOAL = "rotate_to_goal"


class RotationShim:
    """Nav2's Rotation Shim over any registered controller, branches humble to lyrical.

    Before Lyrical the original sees the whole plan; here it sees what the path handler leaves of
    it, which begins at the robot. Its `in_rotation_`, which it keeps from one goal to the next,
    begins anew with each goal here. Cancelled it stops at once, whatever its primary controller
    would do, as in Nav2.
    """

    Parameters: ClassVar[type[RotationShimParameters]] = RotationShimParameters
    nav2_plugin: ClassVar[str] = NAV2_PLUGIN

    def __init__(self, parameters: RotationShimParameters, setup: ControllerSetup) -> None:
        primary = parameters.primary_controller
        self._primary = primary.controller_class(primary.parameters, setup)
        self._parameters = parameters
        self._release = RELEASES[parameters.nav2_release]
        self._settings = _kernel_settings(parameters, setup, self._release)
        self._is_once = parameters.rotate_to_heading_once and self._release.has_once
        self._is_closed_loop = parameters.closed_loop or not self._release.has_open_loop
        self._footprint = read_only(setup.footprint)

    def initial_memory(self) -> ShimMemory:
        """Returns the memory at the start of a goal: at rest."""
        return ShimMemory(self._primary.initial_memory())

    def step(self, observation: Observation, memory: ShimMemory) -> Decision:
        """Returns the command of one cycle: a turn, or the primary controller's.

        Raises what the primary controller raises. A turn that would collide is left to it, too.
        """
        memory = self._with_plan(observation, memory)
        if self._parameters.rotate_to_goal_heading and memory.goal_xy_reached:
            angle = wrap(float(observation.goal[2]) - float(observation.pose[2]))
            w = self._turn(observation, angle, memory.last_w)
            if w is not None:
                return self._turning(TURNS_TO_GOAL, angle, w, memory)
        if memory.looks_at_plan:
            angle = self._angle_to_turn(observation, is_turning=memory.is_turning)
            w = None if angle is None else self._turn(observation, angle, memory.last_w)
            if angle is not None and w is not None:
                return self._turning(TURNS_TO_PATH, angle, w, memory._replace(is_turning=True))
        return self._let_primary_drive(observation, memory)

    def _with_plan(self, observation: Observation, memory: ShimMemory) -> ShimMemory:
        """Returns the memory with what a new plan, and the way to the goal, change in it."""
        goal = tuple(observation.goal.tolist())
        looks_at_plan, reached = memory.looks_at_plan, memory.goal_xy_reached
        if self._release.looks_always:
            looks_at_plan = True
        elif observation.plan_id != memory.plan_id:
            looks_at_plan = not self._is_once or memory.is_turning or memory.goal != goal
            reached = False
        if self._release.asks_goal_checker:
            reached = observation.goal_xy_reached
        else:
            delta_x = float(observation.pose[0]) - goal[0]
            delta_y = float(observation.pose[1]) - goal[1]
            is_there = delta_x**2 + delta_y**2 <= observation.goal_xy_tolerance_m**2
            reached = is_there or (reached and self._release.keeps_position)
        return memory._replace(
            plan_id=observation.plan_id,
            goal=goal,
            looks_at_plan=looks_at_plan,
            goal_xy_reached=reached,
        )

    def _angle_to_turn(self, observation: Observation, *, is_turning: bool) -> float | None:
        """Returns the angle to the plan, rad, None where it is small enough to drive."""
        x, y, yaw = observation.pose.tolist()
        heading = heading_of_plan(self._settings, read_only(observation.plan), x, y, yaw)
        threshold = (
            self._parameters.angular_disengage_threshold
            if is_turning
            else self._parameters.angular_dist_threshold
        )
        return heading.angle if heading.is_known and abs(heading.angle) > threshold else None

    def _turn(self, observation: Observation, angle: float, last_w: float) -> float | None:
        """Returns the rate of a turn, rad/s, None where it would collide."""
        x, y, yaw = observation.pose.tolist()
        turn = turn_by(
            self._settings,
            angle,
            float(observation.twist[-1]) if self._is_closed_loop else last_w,
            x,
            y,
            yaw,
            observation.costmap.grid,
            observation.costmap.tracks_unknown,
            self._footprint,
        )
        return None if turn.is_blocked else turn.w

    @staticmethod
    def _turning(branch: str, angle: float, w: float, memory: ShimMemory) -> Decision:
        command = np.array([0.0, w])
        command.flags.writeable = False
        return Decision(
            command,
            memory._replace(last_w=w),
            {"branch": branch, "heading_error_rad": angle, "shim_is_turning": True},
        )

    def _let_primary_drive(self, observation: Observation, memory: ShimMemory) -> Decision:
        memory = memory._replace(is_turning=False, looks_at_plan=False)
        try:
            decision = self._primary.step(observation, memory.primary)
        except ControllerError as error:
            if error.memory is not None:
                memory = memory._replace(primary=error.memory)
            error.memory = memory
            raise
        diagnostics: Mapping[str, Any] = {**decision.diagnostics, "shim_is_turning": False}
        return Decision(
            decision.command,
            memory._replace(primary=decision.memory, last_w=float(decision.command[-1])),
            diagnostics,
        )


def _kernel_settings(
    parameters: RotationShimParameters, setup: ControllerSetup, release: Release
) -> Settings:
    """Returns what the kernels read; what the release does not read is at its default."""
    return Settings(
        control_period_s=setup.control_period_s,
        angular_dist_threshold=parameters.angular_dist_threshold,
        forward_sampling_distance=parameters.forward_sampling_distance,
        rotate_to_heading_angular_vel=parameters.rotate_to_heading_angular_vel,
        max_angular_accel=parameters.max_angular_accel,
        max_cost_threshold=(
            parameters.max_cost_threshold if release.has_cost_threshold else float(LETHAL)
        ),
        simulate_ahead_time=parameters.simulate_ahead_time,
        use_path_orientations=(parameters.use_path_orientations and release.has_path_orientations),
        takes_last_pose=release.takes_last_pose,
        stops_in_time=release.stops_in_time,
    )
