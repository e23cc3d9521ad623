"""The sampling optimiser: one cycle of Nav2's mppi::Optimizer as a function of its state.

The low-level entry for replays of recorded cycles is `Sampler.run`: it takes a `Scene` (pose,
local plan, costmap), the measured speed, a `SamplerState` (control sequence, filter history, last
command, delayed commands), the limits and a function that hands out `Noise`, and returns the
sequence, the costs a critic and the next state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.controller import ControllerSetup, NoValidControl
from drake_navbench.controllers.mppi.critics.base import (
    CriticContext,
    MapView,
    PathCritic,
    PointwiseCritic,
    Trajectories,
)
from drake_navbench.controllers.mppi.critics.batch import (
    Batch,
    Float32Array,
    Reach,
    Scene,
    furthest_point,
)
from drake_navbench.controllers.mppi.critics.registry import load_critics
from drake_navbench.controllers.mppi.float32_math import F32
from drake_navbench.controllers.mppi.lanes import LANES, block_count, frozen
from drake_navbench.controllers.mppi.motion_models import (
    MotionLimits,
    MotionModel,
    constrain_axis,
    integrate_controls,
    limit_curvature,
    reachable,
)
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.roll_out import (
    RollOutSetting,
    average_controls,
    roll_out,
    softmax_weights,
)
from drake_navbench.controllers.mppi.smoothing import HISTORY, filters, smooth
from drake_navbench.controllers.mppi.validator import is_trajectory_clear
from drake_navbench.errors import InputError

AXES = 3
VX, VY, WZ = range(AXES)
# Control periods this close to model_dt count as equal (Optimizer::setOffset), s.
_PERIOD_TOLERANCE_S = 1e-6
# Blocks rolled out and scored at a time: 6 quantities x 8 blocks x 56 steps x 64 lanes in float32
# are 0.7 MB, which stays in the second-level cache.
_CHUNK_BLOCKS = 8

_MODELS = {
    "DiffDrive": MotionModel.DIFF_DRIVE,
    "Omni": MotionModel.OMNI,
    "Ackermann": MotionModel.ACKERMANN,
}


class SamplerState(NamedTuple):
    """What survives a cycle; arrays are read-only and by axis (vx, vy, wz).

    controls: (3, N) float32, warm start. history: (3, 4) float32, what the filter sees before
    column 0. last_command: (3,) float64. delayed: (3, D) float32 commands, oldest first.
    reset_count: how often the optimiser was reset, which names the fixed noise.
    """

    controls: Float32Array
    history: Float32Array
    last_command: NDArray[np.float64]
    delayed: Float32Array
    reset_count: int = 0


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


@dataclass
class _Cycle:
    """What one cycle accumulates; lives no longer than `Sampler.run`."""

    scene: Scene
    speed: Float32Array
    limits: MotionLimits
    costs: Float32Array
    weights: Float32Array
    furthest: int | None = None
    failed: bool = False
    batch: Batch | None = None


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
        self.setup = setup
        self.model = _MODELS[p.motion_model]
        self.holonomic = self.model is MotionModel.OMNI
        self.base_limits = limits_of(p)
        self.context = CriticContext(
            setup,
            self.model,
            self.base_limits,
            p.AckermannConstraints.min_turning_r,
            p.model_dt,
            p.time_steps,
        )
        self.critics = load_critics(p, self.context)
        self.shifts = _shifts(p.model_dt, setup.control_period_s)
        self.delays = np.array(
            [
                int(np.floor(delay / p.model_dt + 0.5))
                for delay in (p.model_delay_vx, p.model_delay_vy, p.model_delay_wz)
            ]
        )
        built_in = (PointwiseCritic, PathCritic)
        self._keeps = keeps_samples or not all(isinstance(c, built_in) for c in self.critics)
        self._column_step = self._find_column_step()
        self._allocate()

    def _find_column_step(self) -> int:
        steps = {getattr(critic, "column_step", 0) for critic in self.critics} - {0}
        return steps.pop() if steps else self.parameters.time_steps

    def _allocate(self) -> None:
        """Allocates the scratch arrays, which no result depends on."""
        p = self.parameters
        blocks, steps = block_count(p.batch_size), p.time_steps
        self._chunk_blocks = min(blocks, _CHUNK_BLOCKS)
        self._stored = Trajectories.empty(blocks if self._keeps else self._chunk_blocks, steps)
        self._table = np.zeros((len(self.critics), blocks, LANES), np.float32)
        self._control_costs = np.zeros((AXES, blocks, LANES), np.float32)
        self._clamped = Noise.empty(p.batch_size, steps, holonomic=self.holonomic)
        columns = (steps - 1) // self._column_step + 1
        ends = [np.zeros((blocks, LANES), np.float32) for _ in range(4)]
        kept = [np.zeros((blocks, columns, LANES), np.float32) for _ in range(3)]
        self._reach = Reach(*ends, *kept)

    def initial_state(self, reset_count: int = 0) -> SamplerState:
        """Returns the state after a reset: all zero."""
        steps = self.parameters.time_steps
        return SamplerState(
            frozen(np.zeros((AXES, steps), np.float32)),
            frozen(np.zeros((AXES, HISTORY), np.float32)),
            frozen(np.zeros(AXES)),
            frozen(np.zeros((AXES, int(self.delays.max())), np.float32)),
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
            trajectory = integrate_controls(
                scene.pose.astype(np.float32), F32(p.model_dt), state.controls
            )
            if self._is_clear(scene, trajectory):
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
    ) -> _Cycle:
        speed = self.initial_speed(np.asarray(measured, dtype=np.float64), state.last_command)
        size = self.parameters.batch_size
        return _Cycle(
            scene,
            speed.astype(np.float32),
            self.base_limits if limits is None else limits,
            np.zeros(size, np.float32),
            np.zeros(size, np.float32),
        )

    def initial_speed(
        self, measured: NDArray[np.float64], last_command: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Returns the speed (3,) that roll-outs start from.

        The last command, as far as the robot can have reached it from the measured speed within
        one control period; with `open_loop` the last command itself.
        """
        if self.parameters.open_loop:
            return last_command.copy()
        rise, fall = self._rates(self.setup.control_period_s)
        speed = np.minimum(measured + rise, np.maximum(last_command, measured + fall))
        if not self.holonomic:
            speed[VY] = measured[VY]
        return speed

    def _rates(self, step_s: float) -> tuple[Float32Array, Float32Array]:
        """Returns the largest rise and fall (negative) of each axis within `step_s`."""
        limits = self.base_limits
        rise = np.array([limits.ax_max, limits.ay_max, limits.az_max])
        fall = np.array([limits.ax_min, limits.ay_min, -limits.az_max])
        return rise * F32(step_s), fall * F32(step_s)

    def _one_pass(self, cycle: _Cycle, state: SamplerState, noise: Noise) -> SamplerState:
        """Samples around the sequence, scores, and returns the state with the new sequence."""
        controls = self._pinned(state.controls, cycle.speed)
        self._score(cycle, state, controls, noise)
        p = self.parameters
        deviations = (p.vx_std, p.vy_std if self.holonomic else 0.0, p.wz_std)
        for axis in (VX, WZ, VY):
            if deviations[axis] > 0:
                cycle.costs += self._control_costs[axis].ravel()[: p.batch_size]
        cycle.weights = softmax_weights(cycle.costs, F32(p.temperature))
        weights = np.zeros(block_count(p.batch_size) * LANES, np.float32)
        weights[: p.batch_size] = cycle.weights
        weights = weights.reshape(-1, LANES)
        source = self._clamped if p.clamp_raw_controls else noise
        for axis, samples in enumerate(source):
            if samples.size:
                controls[axis] = average_controls(weights, controls[axis], samples)
        smoothed = smooth(controls, state.history, order=p.sgf_order).copy()
        history = state.history
        if filters(p.time_steps):
            sent = smoothed[:, 1 if self.shifts else 0]
            history = frozen(np.column_stack([history[:, 1:], sent]))
        self.constrain(smoothed, cycle.speed, cycle.limits)
        return state._replace(controls=frozen(smoothed), history=history)

    def _pinned(self, controls: Float32Array, speed: Float32Array) -> Float32Array:
        """Returns a copy of the sequence whose first column the robot can be at."""
        pinned = controls.copy()
        if self.shifts:
            pinned[:, 0] = speed
        else:
            rise, fall = self._rates(self.setup.control_period_s)
            for axis in range(AXES):
                wanted = controls[axis, 0]
                pinned[axis, 0] = reachable(speed[axis], wanted, rise[axis], fall[axis])
        if not self.holonomic:
            pinned[VY] = 0
        return pinned

    def constrain(self, controls: Float32Array, speed: Float32Array, limits: MotionLimits) -> None:
        """Makes a sequence (3, N) obey the limits, in place (applyControlSequenceConstraints)."""
        min_turning_r = F32(self.parameters.AckermannConstraints.min_turning_r)
        if self.model is MotionModel.ACKERMANN:
            limit_curvature(controls, min_turning_r)
        lowest = (limits.vx_min, -limits.vy_max, -limits.wz_max)
        highest = (limits.vx_max, limits.vy_max, limits.wz_max)
        rise, fall = self._rates(self.parameters.model_dt)
        ratio = F32(self.setup.control_period_s / self.parameters.model_dt)
        for axis in (VX, VY, WZ) if self.holonomic else (VX, WZ):
            if self.shifts:
                controls[axis, 0] = speed[axis]
            bounds = (lowest[axis], highest[axis], rise[axis], fall[axis])
            constrain_axis(controls[axis], speed[axis], *bounds, ratio)
        if self.model is MotionModel.ACKERMANN:
            limit_curvature(controls, min_turning_r)

    def _setting(self, cycle: _Cycle, state: SamplerState) -> RollOutSetting:
        p = self.parameters
        rise, fall = self._rates(p.model_dt)
        deviations = np.array([p.vx_std, p.vy_std if self.holonomic else 0.0, p.wz_std], F32)
        factors = np.zeros(AXES, np.float32)
        np.divide(F32(p.gamma), deviations * deviations, out=factors, where=deviations > 0)
        return RollOutSetting(
            cycle.scene.pose.astype(np.float32),
            cycle.speed,
            rise,
            fall,
            factors,
            state.delayed,
            self.delays,
            F32(p.model_dt),
            self.holonomic,
            p.clamp_raw_controls,
            self._column_step,
        )

    def _score(
        self, cycle: _Cycle, state: SamplerState, controls: Float32Array, noise: Noise
    ) -> None:
        """Rolls out the batch and adds all critics' costs to the cycle's."""
        size = self.parameters.batch_size
        begun = self._run_pointwise(cycle, self._setting(cycle, state), controls, noise)
        if self._keeps:
            cycle.batch = Batch(cycle.scene, size, *self._stored, known_furthest=cycle.furthest)
        for row, critic in enumerate(self.critics):
            costs = self._table[row].ravel()[:size]
            if cycle.failed:
                costs[:] = 0
                continue
            if isinstance(critic, PointwiseCritic):
                active = begun.get(row)
                cycle.failed = active is not None and critic.finish(active, costs)
            elif isinstance(critic, PathCritic):
                self._run_path_critic(cycle, critic, row)
            else:
                costs[:], cycle.failed = critic.score(cycle.batch)
            cycle.costs += costs

    def _run_pointwise(
        self, cycle: _Cycle, setting: RollOutSetting, controls: Float32Array, noise: Noise
    ) -> dict[int, object]:
        """Rolls out chunk by chunk, each scored while it is in the cache.

        Returns what the active point-wise critics began, by row.
        """
        self._table[:] = 0
        blocks = self._table.shape[1]
        begun = {
            row: critic.begin(cycle.scene, blocks)
            for row, critic in enumerate(self.critics)
            if isinstance(critic, PointwiseCritic) and critic.parameters.enabled
        }
        begun = {row: active for row, active in begun.items() if active is not None}
        for first in range(0, blocks, self._chunk_blocks):
            last = min(first + self._chunk_blocks, blocks)
            offset = first if self._keeps else 0
            chunk = self._stored.blocks(offset, offset + last - first)
            roll_out(
                setting,
                controls,
                noise,
                self._clamped,
                first,
                chunk,
                self._reach,
                self._control_costs,
            )
            for row, active in begun.items():
                sums = self._table[row, first:last]
                self.critics[row].add(active, chunk, sums, first_block=first)
        return begun

    def _run_path_critic(self, cycle: _Cycle, critic: PathCritic, row: int) -> None:
        size = self.parameters.batch_size
        if not critic.considers(cycle.scene):
            return
        if cycle.furthest is None:
            cycle.furthest = furthest_point(cycle.scene, self._reach, size)
        terms = critic.score_reach(cycle.scene, self._reach, cycle.furthest)
        if terms is not None:
            critic.finish(terms)
            self._table[row] = terms

    def _is_clear(self, scene: Scene, trajectory: Float32Array) -> bool:
        p = self.parameters
        checked = int(F32(p.TrajectoryValidator.collision_lookahead_time) / F32(p.model_dt))
        return is_trajectory_clear(
            MapView.of(scene.costmap, self.setup.footprint),
            trajectory,
            min(checked, p.time_steps),
            p.TrajectoryValidator.consider_footprint,
        )

    def _result(
        self, cycle: _Cycle, state: SamplerState, trajectory: Float32Array, *, retry_count: int
    ) -> CycleResult:
        command, following = self.send(state)
        size = self.parameters.batch_size
        rows, blocks, _ = self._table.shape
        critic_costs = self._table.reshape(rows, blocks * LANES)[:, :size].copy()
        return CycleResult(
            command,
            state.controls,
            trajectory,
            state,
            following,
            cycle.speed,
            cycle.costs,
            critic_costs,
            cycle.weights,
            cycle.furthest,
            retry_count,
            cycle.batch,
        )

    def send(self, state: SamplerState) -> tuple[NDArray[np.float64], SamplerState]:
        """Returns the command (3,) of a finished sequence and the state after sending it."""
        controls = state.controls
        command = controls[:, 1 if self.shifts else 0].astype(np.float64)
        if self.shifts:
            controls = frozen(np.column_stack([controls[:, 1:], controls[:, -1]]))
        delayed = state.delayed
        if delayed.shape[1]:
            delayed = frozen(np.column_stack([delayed[:, 1:], command.astype(np.float32)]))
        return command, state._replace(
            controls=controls, last_command=frozen(command.copy()), delayed=delayed
        )


def limits_of(parameters: MppiParameters) -> MotionLimits:
    """Returns the limits in float32; accelerations get the sign that they must have."""
    p = parameters
    return MotionLimits(
        F32(p.vx_max),
        F32(p.vx_min),
        F32(p.vy_max),
        F32(p.wz_max),
        F32(abs(p.ax_max)),
        F32(-abs(p.ax_min)),
        F32(abs(p.ay_max)),
        F32(-abs(p.ay_min)),
        F32(abs(p.az_max)),
    )


def _shifts(model_dt: float, control_period_s: float) -> bool:
    """Whether the sequence moves on by one column a cycle; raises InputError if it would lag."""
    if abs(control_period_s - model_dt) < _PERIOD_TOLERANCE_S:
        return True
    if model_dt < control_period_s:
        raise InputError(
            f"model_dt: found {model_dt}, expected at least the control period {control_period_s} s"
        )
    return False
