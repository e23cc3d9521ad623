"""Vector Pursuit: follows the plan along screws that reach a pose on it with its heading."""

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
from drake_navbench.controllers.vector_pursuit.cycle import (
    CENTRE_OFF_MAP,
    NO_COLLISION,
    ROTATE_TO_GOAL,
    ROTATE_TO_PATH,
    TRACK,
    Cycle,
    run_cycle,
)
from drake_navbench.controllers.vector_pursuit.parameters import VectorPursuitParameters
from drake_navbench.controllers.vector_pursuit.reasons import CycleFacts, explained
from drake_navbench.controllers.vector_pursuit.releases import RULES
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.command_arc import project_arc
from drake_navbench.kernels.grid import cost_at
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import limited_speed

BRANCH_NAMES = {
    TRACK: "track",
    ROTATE_TO_GOAL: "rotate_to_goal",
    ROTATE_TO_PATH: "rotate_to_path",
}


class VectorPursuitMemory(NamedTuple):
    """The memory of the controller.

    last_v m/s, last_w rad/s: the last command, which it takes for the speed at which the robot
    moves. plan_id, plan_begin: up to Kilted, the plan of the last cycle, and the index at which its
    rest begins.
    """

    last_v: float = 0.0
    last_w: float = 0.0
    plan_id: int | None = None
    plan_begin: int = 0


class VectorPursuit:
    """Black Coffee Robotics' Vector Pursuit for Nav2, number for number.

    Wit, Crane, Armstrong: Autonomous Ground Vehicle Path Tracking (2004).
    The original exists for Humble, Jazzy and Kilted. In Lyrical the port drives by Humble's version
    on the plan that Nav2's path handler cuts. Its last command outlives the task, and the next one
    starts from it.
    """

    Parameters: ClassVar[type[VectorPursuitParameters]] = VectorPursuitParameters
    nav2_plugin: ClassVar[str] = "vector_pursuit_controller::VectorPursuitController"

    def __init__(self, parameters: VectorPursuitParameters, setup: ControllerSetup) -> None:
        self._parameters = parameters
        self._release = RULES[parameters.nav2_release]
        self._cut = CircleCut(
            parameters.max_robot_pose_search_dist,
            takes_first=self._release.takes_first_of_equals,
            defaults_to_longer=True,
            may_search_all=False,
        )
        self._settings_record = parameters.as_record(
            control_period_s=setup.control_period_s,
            inscribed_radius_m=setup.inscribed_radius_m,
            circumscribed_radius_m=setup.circumscribed_radius_m,
            is_mirrored=self._release.is_mirrored,
            # The original, too, turns in place where `min_turning_radius` is 0.
            use_rotate_to_heading=parameters.turns_in_place(),
        )
        self._wants_diagnostics = setup.wants_diagnostics
        self._footprint = read_only(setup.footprint)

    def initial_memory(self) -> VectorPursuitMemory:
        """Returns the memory at the start of the first task: at rest."""
        return VectorPursuitMemory()

    def next_memory(self, memory: VectorPursuitMemory) -> VectorPursuitMemory:
        """Returns the memory at the start of a task that follows another: its last command."""
        return memory._replace(plan_id=None, plan_begin=0)

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's do up to Kilted."""
        return self._release.cuts_plan

    def step(self, observation: Observation, memory: VectorPursuitMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for a plan without poses, or of one pose where a heading is taken from
        its segments; CollisionAhead where the command collides; NoValidControl where the robot's
        centre is off the costmap while tracking, or the turn rate is without bound. From Iron to
        Kilted all of these are a plain ControllerError, since the server does not know the
        original's types.
        """
        try:
            return self._step(observation, memory)
        except ControllerError as error:
            if self._release.is_patient:
                raise
            raise ControllerError(str(error), details=error.details, memory=error.memory) from error

    def _step(self, observation: Observation, memory: VectorPursuitMemory) -> Decision:
        plan, memory = self._local_plan(observation, memory)
        self._check_plan(len(plan), memory)
        x, y, _ = observation.pose.tolist()
        cycle = self._run(observation, plan, memory)
        command = cycle.command
        if command.branch == CENTRE_OFF_MAP:
            raise NoValidControl(
                f"local costmap: the robot's centre ({x:.3f}, {y:.3f}) m lies outside, "
                "expected inside",
                memory=memory,
            )
        if cycle.collision != NO_COLLISION:
            raise CollisionAhead.on_arc(cycle.collision, cycle.period, command.v, command.w, memory)
        if not math.isfinite(command.w):
            text = f"turn rate: got {command.w} at a radius of {command.radius} m"
            raise NoValidControl(text, memory=memory)
        chosen = np.array([command.v, command.w])
        chosen.flags.writeable = False
        return Decision(
            chosen,
            VectorPursuitMemory(command.v, command.w, memory.plan_id, memory.plan_begin),
            self._diagnostics(cycle, observation),
        )

    def explain(self, observation: Observation, memory: VectorPursuitMemory) -> Explanation:
        """Returns the rule that sets the speed of the cycle."""
        plan, memory = self._local_plan(observation, memory)
        try:
            self._check_plan(len(plan), memory)
        except InvalidPath as error:
            return Explanation(None, f"Vector Pursuit stops: {error}.", (), ())
        x, y, _ = observation.pose.tolist()
        situation = CycleFacts(
            self._parameters,
            self._settings_record,
            limited_speed(self._parameters.desired_linear_vel, observation.speed_limit),
            memory.last_v,
            int(cost_at(observation.costmap.grid, x, y)),
            float(arc_length(plan)),
            math.hypot(plan[-1, 0] - x, plan[-1, 1] - y),
        )
        return explained(self._run(observation, plan, memory), situation)

    def _run(self, observation: Observation, plan: Array, memory: VectorPursuitMemory) -> Cycle:
        costmap = observation.costmap
        return run_cycle(
            self._settings_record,
            read_only(plan),
            tuple(observation.pose.tolist()),
            limited_speed(self._parameters.desired_linear_vel, observation.speed_limit),
            (memory.last_v, memory.last_w),
            observation.goal_xy_tolerance_m,
            (costmap.grid, costmap.tracks_unknown),
            self._footprint,
        )

    def _local_plan(
        self, observation: Observation, memory: VectorPursuitMemory
    ) -> tuple[Array, VectorPursuitMemory]:
        """Returns the local plan (M, 3), and the memory with the index where the rest begins."""
        if not self._release.cuts_plan:
            return observation.plan, memory
        if observation.plan_id != memory.plan_id:
            memory = memory._replace(plan_id=observation.plan_id, plan_begin=0)
        poses, begin = self._cut.cut(observation, memory.plan_begin)
        return poses, memory._replace(plan_begin=begin)

    def _check_plan(self, count: int, memory: VectorPursuitMemory) -> None:
        if count == 0:
            raise InvalidPath("plan: got no poses, expected at least one", memory=memory)
        if count == 1 and not self._parameters.use_heading_from_path:
            text = "plan: got one pose, expected two or more (use_heading_from_path)"
            raise InvalidPath(text, memory=memory)

    def _diagnostics(self, cycle: Cycle, observation: Observation) -> dict[str, Any]:
        command = cycle.command
        diagnostics: dict[str, Any] = {
            "branch": BRANCH_NAMES[command.branch],
            "target_distance_m": command.lookahead,
            "target_yaw_rad": command.target_yaw,
            "curvature_radpm": 1.0 / command.radius if command.radius > 0.0 else 0.0,
        }
        if self._wants_diagnostics:
            x, y, yaw = observation.pose.tolist()
            target = (command.target_x, command.target_y, command.target_yaw)
            diagnostics["carrot"] = compose(observation.pose, target)[:2]
            diagnostics["predicted_trajectory"] = project_arc(
                x,
                y,
                yaw,
                command.v,
                command.w,
                cycle.period,
                self._parameters.max_allowed_time_to_collision_up_to_target,
                command.lookahead,
            )
        return diagnostics
