"""Rotation Shim: turns in place towards the plan, and hands over to the primary controller."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np

from drake_navbench.controller import (
    ClosableController,
    ControllerError,
    ControllerSetup,
    Decision,
    Observation,
    PlanCuttingController,
    memory_of_next_task,
)
from drake_navbench.controllers.rotation_shim.kernels import heading_of_plan, turn_by
from drake_navbench.controllers.rotation_shim.parameters import (
    NAV2_PLUGIN,
    RotationShimParameters,
)
from drake_navbench.controllers.rotation_shim.releases import RULES
from drake_navbench.explanation import ExplainingController, Explanation, command_text
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.read_only import read_only

TURNS_TO_PATH = "rotate_to_path"
TURNS_TO_GOAL = "rotate_to_goal"


class ShimMemory(NamedTuple):
    """The memory of the Rotation Shim.

    primary: the memory of the primary controller. is_turning: turned towards the plan in the last
    cycle. last_w: the last command's, rad/s; 0 at the start of a goal. plan_id: id of the last
    cycle's plan.
    goal: (x m, y m, yaw rad) of the last cycle. looks_at_plan: this plan may still ask for a turn.
    goal_xy_reached: the goal's position was reached on this plan. The last three matter before
    Lyrical only.
    """

    primary: Any = None
    is_turning: bool = False
    last_w: float = 0.0
    plan_id: int | None = None
    goal: tuple[float, ...] | None = None
    looks_at_plan: bool = True
    goal_xy_reached: bool = False


class RotationShim:
    """Nav2's Rotation Shim over any registered controller, branches humble to lyrical.

    Before Lyrical it looks at the whole plan, from its first pose on; since then at the path
    handler's part, which begins at the robot. When cancelled, the shim stops at once, whatever its
    primary controller would do, as in Nav2.
    """

    Parameters: ClassVar[type[RotationShimParameters]] = RotationShimParameters
    nav2_plugin: ClassVar[str] = NAV2_PLUGIN

    def __init__(self, parameters: RotationShimParameters, setup: ControllerSetup) -> None:
        parameters = parameters.as_read()
        primary = parameters.primary_controller
        self._primary = primary.controller_class(primary.parameters, setup)
        self._parameters = parameters
        self._release = RULES[parameters.nav2_release]
        self._settings_record = parameters.as_record(
            control_period_s=setup.control_period_s,
            stops_in_time=self._release.stops_in_time,
        )
        self._is_once = parameters.rotate_to_heading_once
        self._is_closed_loop = parameters.closed_loop
        self._uses_orientations = parameters.use_path_orientations
        self._turns_beyond = parameters.angular_dist_threshold
        self._disengages_at = parameters.angular_disengage_threshold
        self._footprint = read_only(setup.footprint)

    @property
    def cuts_plan(self) -> bool:
        """Whether the primary controller cuts the plan itself."""
        return isinstance(self._primary, PlanCuttingController) and self._primary.cuts_plan

    def initial_memory(self) -> ShimMemory:
        """Returns the memory at the start of a goal: at rest."""
        return ShimMemory(self._primary.initial_memory())

    def next_memory(self, memory: ShimMemory) -> ShimMemory:
        """Returns the memory at the start of a task that follows another.

        A turn goes on; a goal equal to that of the last task does not count as a new one.
        """
        return memory._replace(
            primary=memory_of_next_task(self._primary, memory.primary),
            last_w=0.0 if self._release.is_reset else memory.last_w,
            plan_id=None,
            goal_xy_reached=False,
        )

    def step(self, observation: Observation, memory: ShimMemory) -> Decision:
        """Returns the command of one cycle: a turn, or the primary controller's.

        Raises the primary controller's errors. A turn that would collide is left to it, too.
        """
        if self._release.looks_always:
            looks_at_plan, goal_xy_reached = True, observation.goal_xy_reached
        else:
            memory = self._with_plan(observation, memory)
            looks_at_plan, goal_xy_reached = memory.looks_at_plan, memory.goal_xy_reached
        if self._parameters.rotate_to_goal_heading and goal_xy_reached:
            angle = wrap(float(observation.goal[2]) - float(observation.pose[2]))
            w = self._turn(observation, angle, memory.last_w)
            if w is not None:
                return self._turning(TURNS_TO_GOAL, angle, w, memory)
        if looks_at_plan:
            angle = self._angle_to_plan(observation)
            # An angle that is not a number is beyond no threshold.
            if abs(angle) > (self._disengages_at if memory.is_turning else self._turns_beyond):
                w = self._turn(observation, angle, memory.last_w)
                if w is not None:
                    return self._turning(TURNS_TO_PATH, angle, w, memory._replace(is_turning=True))
        return self._let_primary_drive(observation, memory)

    def explain(self, observation: Observation, memory: ShimMemory) -> Explanation:
        """Returns the angle for which the shim turns, or the primary controller's own reasons."""
        try:
            decision = self.step(observation, memory)
        except ControllerError as error:
            return Explanation(None, f"Rotation Shim lets its primary stop: {error}.", (), ())
        found = decision.diagnostics
        if found["shim_is_turning"]:
            place = "goal's heading" if found["branch"] == TURNS_TO_GOAL else "plan"
            sentence = (
                f"Rotation Shim turns {command_text(decision.command)}: the {place} is "
                f"{found['heading_error_rad']:.3g} rad away."
            )
            return Explanation(decision.command, sentence, (), ())
        if not isinstance(self._primary, ExplainingController):
            told = "Rotation Shim lets its primary controller drive, which cannot tell why."
            return Explanation(decision.command, told, (), ())
        return self._primary.explain(observation, memory.primary)

    def close(self) -> None:
        """Closes the primary controller where it has a `close`."""
        if isinstance(self._primary, ClosableController):
            self._primary.close()

    def _with_plan(self, observation: Observation, memory: ShimMemory) -> ShimMemory:
        """Returns the memory updated by a new plan, and by the distance to the goal."""
        goal = tuple(observation.goal.tolist())
        looks_at_plan, reached = memory.looks_at_plan, memory.goal_xy_reached
        if observation.plan_id != memory.plan_id:
            looks_at_plan = not self._is_once or memory.is_turning or memory.goal != goal
            reached = False
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

    def _angle_to_plan(self, observation: Observation) -> float:
        """Returns the angle to the plan's heading, rad; NaN where the plan gives no heading."""
        x, y, yaw = observation.pose.tolist()
        plan = observation.plan if self._release.cuts_plan else observation.whole_plan
        angle: float = heading_of_plan(
            read_only(plan),
            x,
            y,
            yaw,
            self._parameters.forward_sampling_distance,
            self._uses_orientations,
            self._release.takes_last_pose,
        )
        return angle

    def _turn(self, observation: Observation, angle: float, last_w: float) -> float | None:
        """Returns the rate of a turn, rad/s, None where it would collide."""
        turn = turn_by(
            self._settings_record,
            angle,
            float(observation.twist[1]) if self._is_closed_loop else last_w,
            tuple(observation.pose.tolist()),
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
        try:
            decision = self._primary.step(observation, memory.primary)
        except ControllerError as error:
            primary = memory.primary if error.memory is None else error.memory
            error.memory = self._driving(memory, primary, memory.last_w)
            raise
        return Decision(
            decision.command,
            self._driving(memory, decision.memory, float(decision.command[1])),
            {**decision.diagnostics, "shim_is_turning": False},
        )

    @staticmethod
    def _driving(memory: ShimMemory, primary: Any, last_w: float) -> ShimMemory:
        """Returns the memory after a cycle in which the primary controller drove."""
        return ShimMemory(
            primary, False, last_w, memory.plan_id, memory.goal, False, memory.goal_xy_reached
        )
