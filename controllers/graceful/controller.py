"""Graceful Controller: drives along smooth curves to a pose on the plan that it can reach."""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import (
    ControllerError,
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
)
from drake_navbench.controllers.circle_cut import CircleCut
from drake_navbench.controllers.graceful.control_law import Law
from drake_navbench.controllers.graceful.cycle import (
    BLOCKED,
    FOLLOW,
    ROTATE_TO_GOAL,
    ROTATE_TO_TARGET,
    Cycle,
    run_cycle,
)
from drake_navbench.controllers.graceful.earlier_cycles import run_humble_cycle, run_kilted_cycle
from drake_navbench.controllers.graceful.parameters import GracefulParameters
from drake_navbench.controllers.graceful.reasons import explained
from drake_navbench.controllers.graceful.releases import RULES
from drake_navbench.controllers.graceful.simulation import Scene
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import MAX_NON_OBSTACLE
from drake_navbench.kernels.poses import compose
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import NO_SPEED_LIMIT, limited_speed, speed_limit_ratio

BRANCH_NAMES = {
    FOLLOW: "follow",
    ROTATE_TO_GOAL: "rotate_to_goal",
    ROTATE_TO_TARGET: "rotate_to_target",
}
# A deceleration that slows no drive down: before Lyrical nothing limits how fast the robot brakes.
NO_DECELERATION_LIMIT = 1e300


class GracefulMemory(NamedTuple):
    """The memory of the Graceful Controller; it begins anew with each plan.

    plan_id: id of the last cycle's plan. may_turn_first: the robot has not faced a target of
    this plan yet.
    safe_angle: the heading, in the base frame, at which it last arrived without coming near an
    obstacle, rad; None where it did not have to look for one. plan_begin, near_goal: up to Kilted,
    the index at which the rest of the plan begins, and whether the robot was near its end.
    """

    plan_id: int | None = None
    may_turn_first: bool = True
    safe_angle: float | None = None
    plan_begin: int = 0
    near_goal: bool = False


class Graceful:
    """Nav2's Graceful Controller, number for number, of each release that has it.

    In Lyrical, without `use_collision_detection` Nav2 crashes where it approaches the goal with
    `prefer_final_rotation`; this reads the costs along the approach all the same.
    """

    Parameters: ClassVar[type[GracefulParameters]] = GracefulParameters
    nav2_plugin: ClassVar[str] = "nav2_graceful_controller::GracefulController"

    def __init__(self, parameters: GracefulParameters, setup: ControllerSetup) -> None:
        parameters = parameters.as_read()
        self._release = RULES[parameters.nav2_release]
        margin = parameters.obstacle_cost_margin
        if setup.footprint_is_circle and margin > MAX_NON_OBSTACLE:
            raise ValueError(
                f"obstacle_cost_margin: got {margin}, expected at most {MAX_NON_OBSTACLE} for a "
                "robot given by robot_radius"
            )
        self._parameters = parameters
        self._cut = CircleCut(
            parameters.max_robot_pose_search_dist, takes_first=self._release.takes_first_of_equals
        )
        self._settings_record = _kernel_settings(parameters, setup)
        self._wants_diagnostics = setup.wants_diagnostics
        self._footprint = read_only(setup.footprint)

    def initial_memory(self) -> GracefulMemory:
        """Returns the memory at the start of a goal."""
        return GracefulMemory()

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's does up to Kilted."""
        return self._release.cuts_plan

    def step(self, observation: Observation, memory: GracefulMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for a plan without poses; NoValidControl where no target on the plan can
        be reached, or the only one left is where the robot stands. In Humble all errors are
        NoValidControl.
        """
        if observation.plan_id != memory.plan_id:
            memory = GracefulMemory(observation.plan_id)
        plan, begin = observation.plan, 0
        if self._release.cuts_plan:
            plan, begin = self._cut.cut(observation, memory.plan_begin)
        if len(plan) == 0:
            text = "plan: got no poses, expected at least one"
            error: type[ControllerError] = (
                NoValidControl if self._release.is_patient else InvalidPath
            )
            raise error(text, memory=memory._replace(plan_begin=begin))
        cycle = self._run(observation, read_only(plan), memory)
        memory = GracefulMemory(
            observation.plan_id,
            cycle.may_turn_first,
            None if math.isnan(cycle.safe_angle) else cycle.safe_angle,
            begin,
            cycle.near_goal,
        )
        if cycle.branch == BLOCKED:
            raise NoValidControl("collision on the way to every target", memory=memory)
        if not (math.isfinite(cycle.v) and math.isfinite(cycle.w)):
            # Nav2 divides by the distance to the target and sends the result.
            raise NoValidControl("the only free target is where the robot stands", memory=memory)
        command = np.array([cycle.v, cycle.w])
        command.flags.writeable = False
        return Decision(command, memory, self._diagnostics(cycle, observation))

    def explain(self, observation: Observation, memory: GracefulMemory) -> Explanation:
        """Returns the rule that sets the speed of the cycle."""
        if observation.plan_id != memory.plan_id:
            memory = GracefulMemory(observation.plan_id)
        plan = observation.plan
        if self._release.cuts_plan:
            plan, _ = self._cut.cut(observation, memory.plan_begin)
        if len(plan) == 0:
            return Explanation(None, "Graceful stops: nothing is left of the plan.", (), ())
        cycle = self._run(observation, read_only(plan), memory)
        return explained(cycle, self._scene(observation))

    def _run(self, observation: Observation, plan: Array, memory: GracefulMemory) -> Cycle:
        scene = self._scene(observation)
        if not self._release.cuts_plan:
            safe_angle = math.nan if memory.safe_angle is None else memory.safe_angle
            return run_cycle(
                self._settings_record,
                scene,
                plan,
                observation.goal_xy_reached,
                memory.may_turn_first,
                safe_angle,
            )
        tolerance_m = float(observation.goal_xy_tolerance_m)
        if self._release.aims_once:
            return run_humble_cycle(
                self._settings_record, scene, plan, memory.near_goal, tolerance_m
            )
        return run_kilted_cycle(
            self._settings_record,
            scene,
            plan,
            memory.near_goal,
            tolerance_m,
            memory.may_turn_first,
        )

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
                NO_DECELERATION_LIMIT if self._release.cuts_plan else parameters.deceleration_max,
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


def _kernel_settings(parameters: GracefulParameters, setup: ControllerSetup) -> NDArray[np.void]:
    """Returns the kernels' record: parameters under Nav2's names, as their release has them."""
    release = RULES[parameters.nav2_release]
    facts: dict[str, Any] = {
        "allow_backward": parameters.drives_backward,
        "is_circle": setup.footprint_is_circle,
    }
    if release.cuts_plan:
        # The outline is not widened, so no drive is tried again more slowly.
        facts["footprint_scaling_linear_vel"] = math.inf
    if release.aims_once:
        facts["v_angular_min_in_place"] = 0.0
    return parameters.as_record(**facts)
