"""The DWB controller plugin: the dynamic window approach with critics."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from drake_navbench.controller import (
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
)
from drake_navbench.controllers.dwb.local_planner import (
    NONE_CHOSEN,
    Evaluation,
    LocalPlanner,
)
from drake_navbench.controllers.dwb.memory import DwbMemory
from drake_navbench.controllers.dwb.own_plan import OwnPlan
from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters
from drake_navbench.controllers.dwb.reasons import explained
from drake_navbench.controllers.dwb.scene import Situation
from drake_navbench.errors import InputError
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.read_only import read_only


class DynamicWindowApproach:
    """Nav2's dwb_core::DWBLocalPlanner as a pure function of observation and memory.

    Every cycle it samples the velocities within reach, simulates each over `sim_time`, lets the
    critics score the trajectories in order and commands the one with the least weighted total
    (Fox, Burgard, Thrun: The dynamic window approach to collision avoidance, 1997).

    Raises InputError where the parameters ask for lateral velocity and the base cannot follow it,
    or name a critic that is not registered.
    """

    Parameters: ClassVar[type[DynamicWindowApproachParameters]] = DynamicWindowApproachParameters
    nav2_plugin: ClassVar[str | None] = "dwb_core::DWBLocalPlanner"

    def __init__(self, parameters: DynamicWindowApproachParameters, setup: ControllerSetup) -> None:
        parameters = parameters.as_read()
        for name in ("min_vel_y", "max_vel_y"):
            value = getattr(parameters, name)
            if value != 0.0 and setup.max_lateral_velocity_mps == 0.0:
                raise InputError(
                    f"{name}: got {value}, expected 0: the robot's base cannot move sideways"
                )
        is_lateral = parameters.min_vel_y != 0.0 or parameters.max_vel_y != 0.0
        self._axes = [0, 2, 1] if is_lateral else [0, 2]
        self._wants_diagnostics = setup.wants_diagnostics
        self._planner = LocalPlanner(parameters, setup)
        self._own_plan = OwnPlan(parameters) if parameters.cuts_plan else None
        self._no_plan = NoValidControl if parameters.is_patient else InvalidPath

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's does up to Kilted."""
        return self._own_plan is not None

    def initial_memory(self) -> DwbMemory:
        """Returns the memory that the first `step` of a goal gets."""
        return self._planner.initial_memory()

    def step(self, observation: Observation, memory: DwbMemory) -> Decision:
        """Returns the command of one cycle.

        Raises InvalidPath, in Humble NoValidControl, for an empty plan. Raises NoValidControl where
        every trajectory is illegal; its `details` count the rejections per 'critic/reason', its
        `memory` is that of the critics after the failed cycle.
        """
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            raise self._no_plan("Resulting plan has 0 poses in it.", memory=memory)
        evaluation = self._evaluated(observation, plan, memory)
        after = evaluation.memory
        sample_count = len(evaluation.totals)
        if evaluation.best == NONE_CHOSEN:
            raise NoValidControl(
                f"Could not find a legal trajectory: {_why_none_is_chosen(evaluation)}",
                details=self._planner.rejections(evaluation),
                memory=after,
            )
        diagnostics: dict[str, Any] = {
            "sample_count": sample_count,
            "illegal_count": sample_count - int(np.count_nonzero(evaluation.is_legal)),
            "best_total": float(evaluation.totals[evaluation.best]),
        }
        if self._wants_diagnostics:
            diagnostics.update(self._window_diagnostics(evaluation))
        return Decision(evaluation.command[self._axes], after, diagnostics)

    def explain(self, observation: Observation, memory: DwbMemory) -> Explanation:
        """Returns the critics' costs of the chosen trajectory and of the best others."""
        plan, memory = self._local_plan(observation, memory)
        if len(plan) == 0:
            return Explanation(None, "DWB stops: nothing is left of the plan.", (), ())
        evaluation = self._evaluated(observation, plan, memory)
        command = None if evaluation.best == NONE_CHOSEN else evaluation.command[self._axes]
        rejections = self._planner.rejections(evaluation)
        return explained(evaluation, self._planner.critic_names, rejections, command)

    def _evaluated(
        self, observation: Observation, plan: np.ndarray, memory: DwbMemory
    ) -> Evaluation:
        """Returns the window of a cycle along a local plan."""
        return self._planner.evaluate(
            _situation(observation, plan), memory, speed_limit=observation.speed_limit
        )

    def _local_plan(
        self, observation: Observation, memory: DwbMemory
    ) -> tuple[np.ndarray, DwbMemory]:
        """Returns the local plan, and the memory with the index where the rest begins."""
        memory = self._planner.with_plan(memory, observation.plan_id)
        if self._own_plan is None:
            return observation.plan, memory
        plan, begin = self._own_plan.cut(
            observation.whole_plan, memory.plan_begin, observation.pose, observation.costmap
        )
        return plan, memory._replace(plan_begin=begin)

    def _window_diagnostics(self, evaluation: Evaluation) -> dict[str, Any]:
        """Returns the whole window for replay and report; K trajectories, C critics.

        sampled_trajectories: (K, N, 3), shorter ones padded with their last pose.
        sampled_costs: (K,) totals, NaN where illegal. sampled_is_legal: (K,) flags.
        sampled_twists: (K, 2) v m/s, w rad/s, or (K, 3) with vy m/s. critic_scales: (C,).
        critic_scores: (K, C) raw scores, NaN where Nav2 would not have asked the critic.
        sampled_rejected_by: (K,) position of the critic that found a rule broken, -1 for none.
        predicted_trajectory: the chosen one.
        """
        window = evaluation.trajectories
        poses = _padded(window.poses, window.pose_counts)
        was_called = np.arange(len(evaluation.scales)) < evaluation.judged_counts[:, None]
        is_sound = was_called & (evaluation.violations.T == 0)
        best = evaluation.best
        return {
            "predicted_trajectory": poses[best, : window.pose_counts[best]].copy(),
            "sampled_trajectories": poses,
            "sampled_costs": np.where(evaluation.is_legal, evaluation.totals, np.nan),
            "sampled_is_legal": evaluation.is_legal,
            "sampled_twists": window.twists[:, self._axes],
            "critic_names": ",".join(self._planner.critic_names),
            "critic_scales": evaluation.scales,
            "critic_scores": np.where(is_sound, evaluation.raw_scores.T, np.nan),
            "sampled_rejected_by": np.where(
                evaluation.is_legal, NONE_CHOSEN, evaluation.judged_counts - 1
            ),
        }


def _situation(observation: Observation, plan: np.ndarray) -> Situation:
    """Returns the cycle's facts for the critics: time, pose, twist, plan, goal and costmap."""
    v, w = observation.twist.tolist()
    return Situation(
        time_s=observation.time_s,
        pose=tuple(observation.pose.tolist()),
        twist=(v, observation.vy_mps, w),
        plan=read_only(plan),
        goal=tuple(observation.goal.tolist()),
        costmap=observation.costmap,
    )


def _why_none_is_chosen(evaluation: Evaluation) -> str:
    """Returns Nav2's message, or the share of legal trajectories where there are any."""
    sample_count = len(evaluation.totals)
    legal_count = int(np.count_nonzero(evaluation.is_legal))
    if legal_count == 0:
        return f"No valid trajectories out of {sample_count}!"
    share = legal_count / sample_count
    return (
        f"{legal_count} valid trajectories found ({share:.0%} of {sample_count}), "
        "but with a total below zero, which counts as none"
    )


def _padded(poses: np.ndarray, pose_counts: np.ndarray) -> np.ndarray:
    """Returns a copy of (K, N, 3) poses in which the last pose of each row fills the rest."""
    longest = int(pose_counts.max())
    indices = np.minimum(np.arange(longest), pose_counts[:, None] - 1)
    return np.take_along_axis(poses[:, :longest], indices[:, :, None], axis=1)
