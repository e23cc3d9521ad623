"""Model Predictive Path Integral control: samples control sequences and averages the good ones."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from drake_navbench.controller import (
    ControllerError,
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
    SpeedLimit,
)
from drake_navbench.controllers.mppi.critics.batch import Scene
from drake_navbench.controllers.mppi.lanes import frozen
from drake_navbench.controllers.mppi.memory import MppiMemory, PlanState
from drake_navbench.controllers.mppi.motion_models import VX, VY, WZ, MotionLimits
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.own_plan import OwnPlan
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.polish import PolishStatus
from drake_navbench.controllers.mppi.reasons import explained, polished
from drake_navbench.controllers.mppi.refinement import Refinement, Refiner
from drake_navbench.controllers.mppi.releases import RULES, Goal
from drake_navbench.controllers.mppi.sampler import CycleResult, Sampler
from drake_navbench.errors import InputError
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.noise import NoiseKey
from drake_navbench.kernels.speed_limit import speed_limit_ratio

# Names the two ways of drawing noise in its key, so that they never share numbers.
_FIXED, _REGENERATED = 0, 1
# Times are whole nanoseconds; only a pause longer than `reset_period` resets.
_SLACK_S = 0.5e-9


class ModelPredictivePathIntegral:
    """Nav2's MPPI controller, of each release since Humble, with an optional polish of its own.

    Raises InputError for a parameter that does not fit the setup: `model_dt` below the control
    period, a footprint check for a robot given by a radius, an unknown critic, or the motion model
    Omni for a base that cannot move sideways.
    """

    Parameters: ClassVar[type[MppiParameters]] = MppiParameters
    nav2_plugin: ClassVar[str | None] = "nav2_mppi_controller::MPPIController"

    def __init__(self, parameters: MppiParameters, setup: ControllerSetup) -> None:
        is_omni = parameters.motion_model == "Omni"
        if is_omni and setup.max_lateral_velocity_mps == 0.0:
            raise InputError(
                "motion_model: got 'Omni', expected DiffDrive or Ackermann: the robot's base "
                "cannot move sideways"
            )
        self._axes = [VX, WZ, VY] if is_omni else [VX, WZ]
        self._parameters = parameters = parameters.as_read()
        self._release = RULES[parameters.nav2_release]
        self._own_plan = OwnPlan(parameters) if self._release.cuts_plan else None
        self._wants_diagnostics = setup.wants_diagnostics
        self._sampler = Sampler(parameters, setup, keeps_samples=setup.wants_diagnostics)
        self._refiner = Refiner(parameters, self._sampler) if parameters.polish.enabled else None
        # The noise of the last draw and its key: a cache, since the key decides the numbers.
        self._noise = Noise.empty(parameters.batch_size, parameters.time_steps, holonomic=is_omni)
        self._noise_key: tuple[int, ...] | None = None

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's does up to Kilted."""
        return self._own_plan is not None

    def initial_memory(self) -> MppiMemory:
        """Returns the memory after a reset."""
        return MppiMemory(self._sampler.initial_state(), frozen(np.zeros(2)))

    def next_memory(self, memory: MppiMemory) -> MppiMemory:
        """Returns the memory at the start of a task that follows another.

        In Humble the optimiser continues from the end of the last task; else it is reset.
        """
        if self._release.outlives_task:
            return memory._replace(plan=PlanState())
        return self.initial_memory()._replace(
            limit=memory.limit,
            limit_is_lifted=memory.limit_is_lifted or self._release.task_lifts_limit,
        )

    def step(self, observation: Observation, memory: MppiMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath for an empty plan, and NoValidControl where every sample collides or no
        attempt passes the trajectory validator; its memory is that of a reset optimiser. In Humble
        both are a ControllerError, to which the server's patience does not apply.
        """
        if len(observation.plan) == 0 and len(observation.global_plan) == 0:
            raise InvalidPath("plan: got no poses, expected at least one")
        memory = self._resumed(observation, memory)
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            kind = InvalidPath if self._release.is_patient else ControllerError
            raise kind("Resulting plan has 0 poses in it.", memory=memory)
        scene, limits = self._scene(observation, plan), self._limits(observation, memory)
        try:
            result = self._sampled(observation, scene, memory, limits)
        except NoValidControl as failure:
            failure.memory = memory._replace(
                sampler=failure.memory,
                start_speed=frozen(np.zeros(2)),
                limit_is_lifted=memory.limit_is_lifted or self._release.failure_lifts_limit,
            )
            if not self._release.is_patient:
                raise ControllerError(
                    str(failure), details=failure.details, memory=failure.memory
                ) from failure
            raise
        return self._decide(scene, result, memory, limits)

    def explain(self, observation: Observation, memory: MppiMemory) -> Explanation:
        """Returns the critics' costs of the samples, by the way they lead.

        The samples are there with `ControllerSetup.wants_diagnostics`.
        """
        if len(observation.plan) == 0 and len(observation.global_plan) == 0:
            return Explanation(None, "MPPI stops: nothing is left of the plan.", (), ())
        memory = self._resumed(observation, memory)
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            return Explanation(None, "MPPI stops: nothing is left of the plan.", (), ())
        scene, limits = self._scene(observation, plan), self._limits(observation, memory)
        try:
            result = self._sampled(observation, scene, memory, limits)
        except NoValidControl as failure:
            return Explanation(None, f"MPPI stops: {failure.details['reason']}.", (), ())
        command = self._decide(scene, result, memory, limits).command
        found = explained(result, self._parameters.critics, result.command[self._axes])
        if self._refiner is None:
            return found
        return polished(found, command)

    def _resumed(self, observation: Observation, memory: MppiMemory) -> MppiMemory:
        """Returns the memory at the start of a cycle: in Humble a reset one after a pause."""
        if observation.speed_limit != memory.limit:
            memory = memory._replace(limit=observation.speed_limit, limit_is_lifted=False)
        if not self._release.outlives_task:
            return memory
        before_s, now_s = memory.driven_at_s, observation.time_s
        memory = memory._replace(driven_at_s=now_s)
        if before_s is None or now_s - before_s <= self._parameters.reset_period + _SLACK_S:
            return memory
        return memory._replace(
            sampler=self._sampler.initial_state(memory.sampler.reset_count + 1),
            start_speed=frozen(np.zeros(2)),
            limit_is_lifted=True,
        )

    def _scene(self, observation: Observation, plan: np.ndarray) -> Scene:
        """Returns the scene of a cycle. plan: (M, 3) the local one."""
        return Scene.from_plan(
            plan,
            pose=observation.pose,
            costmap=observation.costmap,
            goal_xy_tolerance_m=observation.goal_xy_tolerance_m,
            straight_goal=straight_goal(self._parameters, observation, plan),
            furthest=self._release.furthest,
        )

    def _limits(self, observation: Observation, memory: MppiMemory) -> MotionLimits:
        limit = None if memory.limit_is_lifted else observation.speed_limit
        return limited(self._sampler.rules.base_limits, limit)

    def _sampled(
        self, observation: Observation, scene: Scene, memory: MppiMemory, limits: MotionLimits
    ) -> CycleResult:
        """Returns the cycle of the sampler; raises NoValidControl."""
        v, w = observation.twist
        return self._sampler.run(
            scene,
            (v, observation.vy_mps, w),
            memory.sampler,
            draw=lambda resets, index: self._draw(observation.noise_key, resets, index),
            limits=limits,
        )

    def _local_plan(
        self, observation: Observation, memory: MppiMemory
    ) -> tuple[np.ndarray, MppiMemory]:
        """Returns the local plan, and the memory with the progress along the whole one."""
        if self._own_plan is None:
            return observation.plan, memory
        plan, state = self._own_plan.cut(observation, memory.plan)
        return plan, memory._replace(plan=state)

    def _decide(
        self, scene: Scene, result: CycleResult, memory: MppiMemory, limits: MotionLimits
    ) -> Decision:
        fallbacks = memory.polish_fallback_count
        command, state, trajectory = result.command, result.state, result.trajectory
        refinement = None
        if self._refiner is not None:
            refinement = self._refiner.refine(scene, result, memory.start_speed, limits)
            command, state = self._sampler.send(refinement.state)
            trajectory = refinement.trajectory
            fallbacks += refinement.status is not PolishStatus.ACCEPTED
        diagnostics = self._diagnostics(result, refinement, fallbacks)
        if self._wants_diagnostics:
            diagnostics["predicted_trajectory"] = trajectory.astype(np.float64)
        start_speed = frozen(result.speed[[VX, WZ]].astype(np.float64))
        after = memory._replace(
            sampler=state, start_speed=start_speed, polish_fallback_count=fallbacks
        )
        return Decision(command[self._axes], after, diagnostics)

    def _draw(self, key: NoiseKey, reset_count: int, pass_index: int) -> Noise:
        """Returns the noise of one pass: new in every pass, or the same between two resets."""
        p = self._parameters
        words: tuple[int, ...]
        if p.regenerate_noises:
            words = (key.seed, key.stream, _REGENERATED, key.step, pass_index)
        else:
            words = (key.seed, key.stream, _FIXED, reset_count)
        if words != self._noise_key:
            self._noise.draw(words, (p.vx_std, p.vy_std, p.wz_std))
            self._noise_key = words
        return self._noise

    def _diagnostics(
        self, result: CycleResult, refinement: Refinement | None, fallbacks: int
    ) -> dict[str, Any]:
        numbers: dict[str, Any] = {
            "retry_count": result.retry_count,
            "least_cost": float(result.costs.min()),
        }
        if refinement is not None:
            numbers["polish_status"] = str(refinement.status)
            numbers["polish_accepted"] = refinement.status is PolishStatus.ACCEPTED
            numbers["polish_evaluation_count"] = refinement.outcome.evaluation_count
            numbers["polish_solver"] = refinement.outcome.solver
            numbers["polish_fallback_count"] = fallbacks
        if self._wants_diagnostics and result.batch is not None:
            step = self._parameters.TrajectoryVisualizer.trajectory_step
            numbers["sampled_trajectories"] = result.batch.poses[::step].astype(np.float64)
            numbers["sampled_costs"] = result.costs[::step].astype(np.float64)
            numbers["sampled_step"] = step
            for name, costs in zip(self._parameters.critics, result.critic_costs, strict=True):
                numbers[f"critic_cost_{name}"] = costs[::step].astype(np.float64)
        return numbers


def straight_goal(
    parameters: MppiParameters, observation: Observation, plan: np.ndarray
) -> np.ndarray | None:
    """Returns (3,) x m, y m, yaw rad to which critics measure straight distances; or None.

    None in Lyrical, whose critics measure along the local plan. plan: (M, 3) the local one.
    """
    release = RULES[parameters.nav2_release]
    if release.goal is Goal.PATH:
        return None
    follows_cusps = release.turns_at_inversion and parameters.enforce_path_inversion
    if release.goal is Goal.PLAN_END or follows_cusps:
        return plan[-1]
    if release.heads_as_goal:
        return observation.goal
    return np.array([*observation.goal[:2], plan[-1, 2]])


def limited(limits: MotionLimits, speed_limit: SpeedLimit | None) -> MotionLimits:
    """Returns the limits under a speed limit: its ratio to vx_max scales every velocity limit."""
    if speed_limit is None or limits.vx_max <= 0:
        return limits
    return limits.scaled(speed_limit_ratio(float(limits.vx_max), speed_limit))
