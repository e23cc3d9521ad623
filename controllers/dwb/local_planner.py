"""One cycle of DWB: sample, roll out, let the critics judge, choose (Nav2's DWBLocalPlanner)."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup, SpeedLimit
from drake_navbench.controllers.dwb.critics.base import Critic
from drake_navbench.controllers.dwb.critics.registry import load_critic
from drake_navbench.controllers.dwb.kinematics import Kinematics
from drake_navbench.controllers.dwb.memory import DwbMemory
from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.controllers.dwb.trajectories import Trajectories, TrajectoryGenerator
from drake_navbench.kernels.arrays import Array

# Nav2 starts with this total as "none yet", and takes any total below zero for it.
NO_TOTAL = np.float32(-1.0)
NONE_CHOSEN = -1


class Evaluation(NamedTuple):
    """One cycle's result; K trajectories, C critics. Arrays are valid until the next cycle.

    best: index of the chosen trajectory; -1 where none is legal.
    command: (3,) vx m/s, vy m/s, wz rad/s; zeros where none is legal.
    memory: for the next cycle, also where none is legal.
    trajectories: the window.
    scales: (C,) float32 weights of this cycle.
    raw_scores: (C, K) unweighted scores. violations: (C, K) number of the broken rule, 0 for none.
        Rows of critics with a scale of 0 are NaN and 0.
    totals: (K,) float32 weighted sums; partial where scoring stopped early, -1 where illegal.
    judged_counts: (K,) number of critics that Nav2 would have called, in order: all, or up to the
        one that stopped the scoring or found a rule broken.
    """

    best: int
    command: Array
    memory: DwbMemory
    trajectories: Trajectories
    scales: NDArray[np.float32]
    raw_scores: Array
    violations: NDArray[np.uint8]
    totals: NDArray[np.float32]
    judged_counts: NDArray[np.int64]

    @property
    def is_legal(self) -> NDArray[np.bool_]:
        """(K,) whether each trajectory broke none of the rules that it was held against."""
        last = self.judged_counts - 1
        return self.violations[last, np.arange(len(last))] == 0


@njit(cache=True)
def choose(raw_scores, violations, scales, short_circuit, totals, judged_counts):
    """Adds up the scores as Nav2 does and returns the index of the least total; -1 if none.

    raw_scores (C, K), violations (C, K), scales (C,) float32: as in Evaluation. totals (K,)
    float32, judged_counts (K,): output. Totals are rounded to float32 after each critic. With
    short_circuit the scoring of a trajectory ends as soon as its total exceeds the best so far;
    rules that only later critics would find broken then do not count. Equal totals keep the earlier
    one.
    """
    best_total = NO_TOTAL
    best = NONE_CHOSEN
    critic_count = scales.size
    for k in range(totals.size):
        total = np.float32(0.0)
        is_legal = True
        judged_counts[k] = critic_count
        for c in range(critic_count):
            if scales[c] == 0.0:
                continue
            if violations[c, k] != 0:
                is_legal = False
                judged_counts[k] = c + 1
                break
            weighted = raw_scores[c, k] * np.float64(scales[c])
            total = np.float32(np.float64(total) + weighted)
            if short_circuit and best_total > 0.0 and total > best_total:
                judged_counts[k] = c + 1
                break
        totals[k] = total if is_legal else NO_TOTAL
        if is_legal and (best_total < 0.0 or total < best_total):
            best_total = total
            best = k
    return NONE_CHOSEN if best_total < 0.0 else best


class LocalPlanner:
    """DWB for a base that may also move sideways; `DynamicWindowApproach` is the plugin around it.

    This is the level at which recorded cycles of Nav2 can be replayed, lateral velocity included:
    build it from parameters, then call `evaluate` once a cycle with the memory of the one before.
    Raises InputError for a critic that is not registered.
    """

    def __init__(self, parameters: DynamicWindowApproachParameters, setup: ControllerSetup) -> None:
        self._parameters = parameters
        self._base_kinematics = Kinematics.from_parameters(parameters)
        self._generator = TrajectoryGenerator(parameters, setup.control_period_s)
        self._critics = _build_critics(parameters, setup)

    @property
    def critic_names(self) -> tuple[str, ...]:
        """The critics' names, in the order of evaluation."""
        return self._parameters.critics

    def initial_memory(self) -> DwbMemory:
        """Returns the memory at the start of a trial."""
        return DwbMemory(
            plan_id=None,
            kinematics=self._base_kinematics,
            critics=tuple(critic.initial_memory() for critic in self._critics),
        )

    def with_plan(self, memory: DwbMemory, plan_id: int) -> DwbMemory:
        """Returns the memory for a plan; of another plan than before, the critics forget."""
        if plan_id == memory.plan_id:
            return memory
        pairs = zip(self._critics, memory.critics, strict=True)
        critics = tuple(critic.reset(own) for critic, own in pairs)
        return DwbMemory(plan_id, memory.kinematics, critics)

    def evaluate(
        self,
        situation: Situation,
        memory: DwbMemory,
        *,
        speed_limit: SpeedLimit | None = None,
    ) -> Evaluation:
        """Returns the window of one cycle with its scores and the chosen trajectory.

        situation: pose and measured twist (vx, vy, wz), local plan, goal, costmap. memory: from
        `with_plan`.
        """
        kinematics = memory.kinematics.limited(self._base_kinematics, speed_limit)
        memories = tuple(
            critic.prepare(situation, own)
            for critic, own in zip(self._critics, memory.critics, strict=True)
        )
        window = self._generator.generate(situation.pose, situation.twist, kinematics)
        scales, raw_scores, violations = self._judge(situation, window, memories)
        totals = np.empty(len(window.twists), dtype=np.float32)
        judged_counts = np.empty(len(window.twists), dtype=np.int64)
        best = choose(
            raw_scores,
            violations,
            scales,
            self._parameters.short_circuit_trajectory_evaluation,
            totals,
            judged_counts,
        )
        command = np.zeros(3) if best == NONE_CHOSEN else window.velocities[best].copy()
        memories = tuple(
            critic.debrief(situation, command, own)
            for critic, own in zip(self._critics, memories, strict=True)
        )
        return Evaluation(
            best=best,
            command=command,
            memory=memory._replace(kinematics=kinematics, critics=memories),
            trajectories=window,
            scales=scales,
            raw_scores=raw_scores,
            violations=violations,
            totals=totals,
            judged_counts=judged_counts,
        )

    def _judge(
        self, situation: Situation, window: Trajectories, memories: tuple[Any, ...]
    ) -> tuple[NDArray[np.float32], Array, NDArray[np.uint8]]:
        """Returns scales (C,), raw scores (C, K) and violations (C, K) of all critics."""
        scene = Scene.of(situation, window)
        shape = (len(self._critics), len(window.twists))
        scales = np.empty(len(self._critics), dtype=np.float32)
        raw_scores = np.empty(shape)
        violations = np.zeros(shape, dtype=np.uint8)
        for c, (critic, memory) in enumerate(zip(self._critics, memories, strict=True)):
            scales[c] = critic.scale(scene, memory)
            if scales[c] == 0.0:
                raw_scores[c] = np.nan
                continue
            verdict = critic.score(scene, memory)
            raw_scores[c] = verdict.scores
            if verdict.violations is not None:
                violations[c] = verdict.violations
        return scales, raw_scores, violations

    def rejections(self, evaluation: Evaluation) -> dict[str, int]:
        """Returns the number of trajectories rejected by each (critic, reason), as Nav2's tracker.

        Keys read 'RotateToGoal/Nonrotation command near goal.'.
        """
        illegal = np.flatnonzero(~evaluation.is_legal)
        critics = evaluation.judged_counts[illegal] - 1
        codes = evaluation.violations[critics, illegal]
        counts = Counter(zip(critics.tolist(), codes.tolist(), strict=True))
        return {
            f"{self.critic_names[c]}/{self._critics[c].reasons[code - 1]}": count
            for (c, code), count in sorted(counts.items())
        }


def _build_critics(
    parameters: DynamicWindowApproachParameters, setup: ControllerSetup
) -> list[Critic]:
    critics = []
    for name in parameters.critics:
        block = parameters.critic(name)
        critic_class = load_critic(block.critic_class or name)
        critics.append(critic_class(block, parameters, setup=setup))
    return critics
