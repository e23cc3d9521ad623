"""The sampling optimiser: one cycle of Nav2's mppi::Optimizer as a function of its state.

The low-level entry for replays of recorded cycles is `Sampler.run`: it takes a `Scene` (pose,
local plan, costmap), the measured speed, a `SamplerState` (control sequence, filter history, last
command, delayed commands), the limits and a function that hands out `Noise`, and returns the
sequence, the costs a critic and the next state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.controller import ControllerSetup, NoValidControl
from drake_navbench.controllers.mppi.critics.base import CriticContext
from drake_navbench.controllers.mppi.critics.batch import Batch, Float32Array, Scene
from drake_navbench.controllers.mppi.critics.registry import load_critics
from drake_navbench.controllers.mppi.float32_math import F32
from drake_navbench.controllers.mppi.lanes import LANES, block_count, frozen
from drake_navbench.controllers.mppi.memory import SamplerState
from drake_navbench.controllers.mppi.motion_models import (
    AXES,
    VX,
    VY,
    WZ,
    MotionLimits,
    MotionModel,
    integrate_controls,
)
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.releases import RULES
from drake_navbench.controllers.mppi.roll_out import (
    RollOutSetting,
    average_controls,
    softmax_weights,
)
from drake_navbench.controllers.mppi.scoring import BatchScorer, Cycle
from drake_navbench.controllers.mppi.sequence_rules import (
    HISTORY,
    SequenceRules,
    filters,
    smooth,
    smooth_in_place,
)
from drake_navbench.controllers.mppi.validator import is_trajectory_clear

_MODELS = {
    "DiffDrive": MotionModel.DIFF_DRIVE,
    "Omni": MotionModel.OMNI,
    "Ackermann": MotionModel.ACKERMANN,
}


@dataclass(frozen=True, eq=False)
class CycleResult:
    """One cycle's outcome.

    command: (3,) vx, vy m/s, wz rad/s. controls: (3, N) float32 before the shift. trajectory:
    (N, 3) poses that `controls` lead to. solved: state before sending. state: for the next cycle,
    after sending. speed: (3,) float32 that the
    roll-outs started from. costs: (B,) totals. critic_costs: (critics, B), in the configured order,
    of the last pass. weights: (B,). furthest: path point reached, or None if no critic asked.
    retry_count: attempts beyond the first. batch: the samples, where they were kept.
    """

    command: NDArray[np.float64]
    controls: Float32Array
    trajectory: Float32Array
    solved: SamplerState
    state: SamplerState
    speed: Float32Array
    costs: Float32Array
    critic_costs: Float32Array
    weights: Float32Array
    furthest: int | None
    retry_count: int
    batch: Batch | None


class Sampler:
    """Optimises a control sequence by sampling.

    parameters: MppiParameters. setup: ControllerSetup. keeps_samples: whether results carry the
    whole batch (for diagnostics; users' critics get it anyway).

    Raises InputError where `model_dt` is smaller than the control period or a critic is unknown.
    """

    def __init__(
        self, parameters: MppiParameters, setup: ControllerSetup, *, keeps_samples: bool = False
    ) -> None:
        self.parameters = p = parameters
        self.release = RULES[parameters.nav2_release]
        self.setup = setup
        model = _MODELS[p.motion_model]
        self.rules = SequenceRules(p, model, setup.control_period_s)
        context = CriticContext(
            setup,
            model,
            self.rules.base_limits,
            p.AckermannConstraints.min_turning_r,
            p.model_dt,
            p.time_steps,
            nav2_release=parameters.nav2_release,
        )
        self.critics = load_critics(((name, p.critic(name)) for name in p.critics), context)
        self._scorer = BatchScorer(p, self.critics, keeps_samples=keeps_samples)
        self._delays = np.array(
            [
                int(np.floor(delay / p.model_dt + 0.5))
                for delay in (p.model_delay_vx, p.model_delay_vy, p.model_delay_wz)
            ]
        )
        self._deviations = np.array(
            [p.vx_std, p.vy_std if self.rules.holonomic else 0.0, p.wz_std], np.float32
        )

    def initial_state(self, reset_count: int = 0) -> SamplerState:
        """Returns the state after a reset: all zero."""
        steps = self.parameters.time_steps
        return SamplerState(
            frozen(np.zeros((AXES, steps), np.float32)),
            frozen(np.zeros((AXES, HISTORY), np.float32)),
            frozen(np.zeros(AXES)),
            frozen(np.zeros((AXES, int(self._delays.max())), np.float32)),
            reset_count,
        )

    def run(
        self,
        scene: Scene,
        measured: ArrayLike,
        state: SamplerState,
        *,
        draw: Callable[[int, int], Noise],
        limits: MotionLimits | None = None,
    ) -> CycleResult:
        """Runs one cycle.

        measured: (3,) vx, vy m/s, wz rad/s. limits: under a speed limit; None: the parameters'.
        draw: called with (reset count, pass index) before each pass; the noise it returns is not
        changed. Raises NoValidControl, with the reset state as its memory, where every sample
        collides, or no attempt passes the validator.
        """
        cycle = self._prepare(scene, measured, state, limits)
        p = self.parameters
        passes = 0
        for attempt in range(p.retry_attempt_limit + 1):
            cycle.costs[:] = 0
            for _ in range(p.iteration_count):
                noise = draw(state.reset_count, passes)
                state = self._one_pass(cycle, state, noise)
                passes += 1
            if cycle.failed:
                # Nav2 leaves the failure flag up while it retries, and critics do not run under
                # it: once every sample collides, each further attempt of the cycle fails as well.
                break
            if not self.release.filters_first:
                smoothed, history = self._smoothed(state.controls, state.history)
                state = state._replace(controls=frozen(smoothed), history=history)
            trajectory = integrate_controls(
                scene.pose.astype(np.float32), F32(p.model_dt), state.controls
            )
            if not self.release.has_validator or self._is_clear(scene, trajectory):
                return self._result(cycle, state, trajectory, retry_count=attempt)
            state = self.initial_state(state.reset_count + 1)
        reason = "every sample collides" if cycle.failed else "the averaged trajectory collides"
        resets = p.retry_attempt_limit + 1 if cycle.failed else 0
        raise NoValidControl(
            f"Optimizer fail to compute path: {reason}",
            details={"reason": reason},
            memory=self.initial_state(state.reset_count + resets),
        )

    def _prepare(
        self,
        scene: Scene,
        measured: ArrayLike,
        state: SamplerState,
        limits: MotionLimits | None,
    ) -> Cycle:
        speed = self.rules.initial_speed(np.asarray(measured, dtype=np.float64), state.last_command)
        size = self.parameters.batch_size
        return Cycle(
            scene,
            speed.astype(np.float32),
            self.rules.base_limits if limits is None else limits,
            np.zeros(size, np.float32),
            np.zeros(size, np.float32),
        )

    def _one_pass(self, cycle: Cycle, state: SamplerState, noise: Noise) -> SamplerState:
        """Samples around the sequence, scores, and returns the state with the new sequence."""
        controls = self.rules.pinned(state.controls, cycle.speed)
        self._scorer.score(cycle, self._setting(cycle, state), controls, noise)
        p = self.parameters
        for axis in (VX, WZ, VY):
            if self._deviations[axis] > 0:
                cycle.costs += self._scorer.control_costs[axis].ravel()[: p.batch_size]
        cycle.weights = softmax_weights(cycle.costs, F32(p.temperature))
        padded = np.zeros(block_count(p.batch_size) * LANES, np.float32)
        padded[: p.batch_size] = cycle.weights
        weights = padded.reshape(-1, LANES)
        clamps = p.clamp_raw_controls or self.release.clamps_samples
        source = self._scorer.clamped if clamps else noise
        for axis, samples in enumerate(source):
            if samples.size:
                controls[axis] = average_controls(weights, controls[axis], samples)
        history = state.history
        if self.release.filters_first:
            controls, history = self._smoothed(controls, history)
        self.rules.constrain(controls, cycle.speed, cycle.limits)
        return state._replace(controls=frozen(controls), history=history)

    def _smoothed(
        self, controls: Float32Array, history: Float32Array
    ) -> tuple[Float32Array, Float32Array]:
        """Returns the smoothed sequence and the filter's history after it."""
        if self.release.filters_in_place:
            smoothed = smooth_in_place(controls, history).copy()
        else:
            smoothed = smooth(controls, history, order=self.parameters.sgf_order).copy()
        if filters(self.parameters.time_steps):
            sent = smoothed[:, self.rules.sent_column]
            history = frozen(np.column_stack([history[:, 1:], sent]))
        return smoothed, history

    def _setting(self, cycle: Cycle, state: SamplerState) -> RollOutSetting:
        p = self.parameters
        rise, fall = self.rules.rates(p.model_dt)
        factors = np.zeros(AXES, np.float32)
        variances = self._deviations * self._deviations
        np.divide(F32(p.gamma), variances, out=factors, where=variances > 0)
        return RollOutSetting(
            cycle.scene.pose.astype(np.float32),
            cycle.speed,
            rise,
            fall,
            factors,
            state.delayed,
            self._delays,
            F32(p.model_dt),
            self.rules.holonomic,
            p.clamp_raw_controls or self.release.clamps_samples,
            self._scorer.column_step,
        )

    def _is_clear(self, scene: Scene, trajectory: Float32Array) -> bool:
        p = self.parameters
        checked = int(F32(p.TrajectoryValidator.collision_lookahead_time) / F32(p.model_dt))
        return is_trajectory_clear(
            scene.costmap.grid,
            self.setup.footprint,
            trajectory,
            min(checked, p.time_steps),
            p.TrajectoryValidator.consider_footprint,
        )

    def _result(
        self, cycle: Cycle, state: SamplerState, trajectory: Float32Array, *, retry_count: int
    ) -> CycleResult:
        command, following = self.send(state)
        return CycleResult(
            command,
            state.controls,
            trajectory,
            state,
            following,
            cycle.speed,
            cycle.costs,
            self._scorer.critic_costs,
            cycle.weights,
            cycle.furthest,
            retry_count,
            cycle.batch,
        )

    def send(self, state: SamplerState) -> tuple[NDArray[np.float64], SamplerState]:
        """Returns the command (3,) of a finished sequence and the state after sending it."""
        controls = state.controls
        command = controls[:, self.rules.sent_column].astype(np.float64)
        if self.rules.shifts:
            controls = frozen(np.column_stack([controls[:, 1:], controls[:, -1]]))
        delayed = state.delayed
        if delayed.shape[1]:
            delayed = frozen(np.column_stack([delayed[:, 1:], command.astype(np.float32)]))
        return command, state._replace(
            controls=controls, last_command=frozen(command.copy()), delayed=delayed
        )
