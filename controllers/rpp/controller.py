"""Regulated Pure Pursuit: follows the plan along circles, slower in curves and near obstacles."""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np

from drake_navbench.controller import (
    CollisionAhead,
    ControllerError,
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
)
from drake_navbench.controllers.circle_cut import CircleCut
from drake_navbench.controllers.rpp.cycle import (
    CENTRE_OFF_MAP,
    NO_COLLISION,
    ROTATE_TO_GOAL,
    ROTATE_TO_PATH,
    TRACK,
    Cycle,
    run_cycle,
)
from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.reasons import CycleFacts, explained
from drake_navbench.controllers.rpp.releases import RULES
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.command_arc import project_arc
from drake_navbench.kernels.grid import cost_at
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import limited_speed
from drake_navbench.plugins.releases import Release

BRANCH_NAMES = {
    TRACK: "track",
    ROTATE_TO_GOAL: "rotate_to_goal",
    ROTATE_TO_PATH: "rotate_to_path",
}


class RppMemory(NamedTuple):
    """The memory of the controller: the last command, and the progress of cancelling.

    last_v m/s, last_w rad/s: the command of the last cycle that had one; the dynamic window starts
    there. is_cancelling: asked to stop, with `use_cancel_deceleration`. has_stopped: came to rest.
    plan_id, plan_begin, was_near_end: up to Kilted, the plan of the last cycle, the index at which
    its rest begins, and whether the robot was near its end.
    """

    last_v: float = 0.0
    last_w: float = 0.0
    is_cancelling: bool = False
    has_stopped: bool = False
    plan_id: int | None = None
    plan_begin: int = 0
    was_near_end: bool = False


class RegulatedPurePursuit:
    """Nav2's Regulated Pure Pursuit controller, number for number, of each release since Humble.

    Macenski, Singh, Martin, Gines: Regulated Pure Pursuit for Robot Path Tracking (2023).
    Plain and adaptive pure pursuit are parameter choices: without regulation, and with a
    velocity-scaled lookahead.
    """

    Parameters: ClassVar[type[RegulatedPurePursuitParameters]] = RegulatedPurePursuitParameters
    nav2_plugin: ClassVar[str] = (
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
    )

    def __init__(self, parameters: RegulatedPurePursuitParameters, setup: ControllerSetup) -> None:
        self._parameters = parameters = parameters.as_read()
        self._release = RULES[parameters.nav2_release]
        self._cut = plan_cut(parameters)
        self._keeps_turning = (
            self._release.cuts_plan
            and parameters.is_read("stateful", parameters.nav2_release)
            and parameters.stateful
        )
        self._setup = setup
        self._extends_plan = (
            parameters.interpolate_curvature_after_goal and parameters.use_fixed_curvature_lookahead
        )
        turns = self._release.turns_or_reverses and parameters.use_rotate_to_heading
        # Options that Nav2 switches off with a warning are off in the kernels' record, too.
        self._settings_record = parameters.as_record(
            release=self._release,
            control_period_s=setup.control_period_s,
            inscribed_radius_m=setup.inscribed_radius_m,
            circumscribed_radius_m=setup.circumscribed_radius_m,
            interpolate_curvature_after_goal=self._extends_plan,
            allow_reversing=parameters.allow_reversing and not turns,
        )
        self._footprint = read_only(setup.footprint)

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's does up to Kilted."""
        return self._release.cuts_plan

    def initial_memory(self) -> RppMemory:
        """Returns the memory at the start of a goal: at rest, not cancelling."""
        return RppMemory()

    def step(self, observation: Observation, memory: RppMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for a plan without poses, or of one pose where it must be extrapolated;
        CollisionAhead where the command collides; ControllerError where the robot's centre is off
        the costmap while tracking. In Humble all of these are NoValidControl, too.
        """
        try:
            return self._step(observation, memory)
        except NoValidControl:
            raise
        except ControllerError as error:
            if not self._release.is_patient:
                raise
            raise NoValidControl(str(error), memory=error.memory) from error

    def explain(self, observation: Observation, memory: RppMemory) -> Explanation:
        """Returns the rule that sets the speed of the cycle."""
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            return Explanation(None, "RPP stops: nothing is left of the plan.", (), ())
        is_cancelling = self._is_cancelling(observation, memory)
        x, y = observation.pose[:2]
        situation = CycleFacts(
            self._parameters,
            limited_speed(self._parameters.max_linear_vel, observation.speed_limit),
            int(cost_at(observation.costmap.grid, x, y)),
            is_cancelling,
        )
        return explained(self._run(observation, plan, memory, is_cancelling), situation)

    def _is_cancelling(self, observation: Observation, memory: RppMemory) -> bool:
        return memory.is_cancelling or (
            observation.cancel_requested and self._parameters.use_cancel_deceleration
        )

    def _step(self, observation: Observation, memory: RppMemory) -> Decision:
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            raise InvalidPath("plan: got no poses, expected at least one", memory=memory)
        is_cancelling = self._is_cancelling(observation, memory)
        cycle = self._run(observation, plan, memory, is_cancelling)
        command = cycle.command
        if self._keeps_turning and command.branch == ROTATE_TO_GOAL:
            memory = memory._replace(was_near_end=True)
        if command.branch == CENTRE_OFF_MAP:
            x, y = observation.pose[:2]
            raise ControllerError(
                f"local costmap: the robot's centre ({x:.3f}, {y:.3f}) m lies outside, "
                "expected inside",
                memory=memory,
            )
        has_stopped = memory.has_stopped or command.has_stopped
        if cycle.collision != NO_COLLISION:
            memory = memory._replace(is_cancelling=is_cancelling, has_stopped=has_stopped)
            raise CollisionAhead.on_arc(cycle.collision, cycle.period, command.v, command.w, memory)
        chosen = np.array([command.v, command.w])
        chosen.flags.writeable = False
        return Decision(
            chosen,
            # Positional arguments: `_replace` would take a tenth of the kernel's time.
            RppMemory(command.v, command.w, is_cancelling, has_stopped, *memory[4:]),
            self._diagnostics(cycle, observation, has_stopped),
        )

    def is_at_rest(self, memory: RppMemory) -> bool:
        """Tells whether a cancelled robot is at rest; True without `use_cancel_deceleration`."""
        return memory.has_stopped or not self._parameters.use_cancel_deceleration

    def _local_plan(self, observation: Observation, memory: RppMemory) -> tuple[Array, RppMemory]:
        """Returns the local plan, and the memory with the index where the rest begins."""
        if not self._release.cuts_plan:
            self._refuse_single_pose(observation.plan)
            return observation.plan, memory
        self._refuse_single_pose(observation.whole_plan)
        if observation.plan_id != memory.plan_id:
            memory = memory._replace(plan_id=observation.plan_id, plan_begin=0, was_near_end=False)
        poses, begin = self._cut.cut(observation, memory.plan_begin)
        return poses, memory._replace(plan_begin=begin)

    def _run(
        self, observation: Observation, plan: Array, memory: RppMemory, is_cancelling: bool
    ) -> Cycle:
        costmap = observation.costmap
        cuts_plan = self._release.cuts_plan
        turns_to_goal = memory.was_near_end if cuts_plan else observation.goal_xy_reached
        return run_cycle(
            self._settings_record,
            read_only(plan),
            (
                tuple(observation.pose.tolist()),
                tuple(observation.twist.tolist()),
                (memory.last_v, memory.last_w),
            ),
            limited_speed(self._parameters.max_linear_vel, observation.speed_limit),
            (turns_to_goal, observation.goal_xy_tolerance_m),
            is_cancelling,
            (costmap.grid, costmap.tracks_unknown),
            self._footprint,
        )

    def _refuse_single_pose(self, plan: Array) -> None:
        if len(plan) == 1 and self._extends_plan:
            raise InvalidPath(
                "plan: got one pose, expected two or more (interpolate_curvature_after_goal)"
            )

    def _diagnostics(
        self, cycle: Cycle, observation: Observation, has_stopped: bool
    ) -> dict[str, Any]:
        aim, command = cycle.aim, cycle.command
        diagnostics = {
            "branch": BRANCH_NAMES[command.branch],
            "lookahead_distance_m": aim.lookahead,
            "curvature_radpm": aim.curvature,
            "heading_error_rad": aim.heading_error,
            "regulated_speed_mps": command.regulated_v,
            "curve_speed_mps": command.curve_v,
            "obstacle_speed_mps": command.obstacle_v,
            "has_stopped": has_stopped,
        }
        if self._setup.wants_diagnostics:
            x, y, yaw = observation.pose.tolist()
            cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
            diagnostics["carrot"] = np.array(
                [
                    x + cos_yaw * aim.carrot_x - sin_yaw * aim.carrot_y,
                    y + sin_yaw * aim.carrot_x + cos_yaw * aim.carrot_y,
                ]
            )
            diagnostics["predicted_trajectory"] = project_arc(
                x,
                y,
                yaw,
                command.v,
                command.w,
                cycle.period,
                cycle.time_limit,
                cycle.distance_limit,
            )
        return diagnostics


def plan_cut(parameters: RegulatedPurePursuitParameters) -> CircleCut:
    """Returns the rules by which the controller cuts the plan up to Kilted."""
    rules, is_humble = RULES[parameters.nav2_release], parameters.nav2_release is Release.HUMBLE
    return CircleCut(
        parameters.max_robot_pose_search_dist,
        takes_first=rules.takes_first_of_equals,
        keeps_two=rules.keeps_two_poses,
        defaults_to_longer=is_humble,
        may_search_all=not is_humble,
    )
