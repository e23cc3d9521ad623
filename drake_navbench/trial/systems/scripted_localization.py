"""A localization that errs by a script: odometry that drifts, and fixes that are late or off."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, InputPort, State

from drake_navbench.inputs.localization import DRIFTS, LocalizationSettings
from drake_navbench.inputs.timeline import SLACK_S, Timeline
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.poses import carrier_pose, compose, drifted_frame, placed_state
from drake_navbench.kernels.wheels import turned
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.actuators import WHEELS
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import POSE_SIZE, STATE_SIZE, value_or_none

SAME_FRAME = np.zeros(POSE_SIZE)
NO_NOISE = np.zeros(STATE_SIZE)
# The odometry's error stays between two of its steps, so that the odometry follows the base
# continuously.
ODOMETRY_PERIOD_S = 0.05


@dataclass(frozen=True)
class _Draw(Immutable):
    """The random directions of a trial's errors.

    drift: (2,) unit vector in the base frame; jump: (2,) unit vector in the map. The sides are -1
    or 1.
    """

    drift: tuple[float, float] = (1.0, 0.0)
    drift_side: float = 1.0
    jump: tuple[float, float] = (1.0, 0.0)
    jump_side: float = 1.0

    @classmethod
    def of(cls, seed: int) -> _Draw:
        generator = NoiseKey(seed, NoiseStream.DRIFT, 0).generator()
        drift, jump = (2.0 * math.pi * generator.random(2)).tolist()
        sides = np.where(generator.random(2) < 0.5, -1.0, 1.0).tolist()
        return cls(
            (math.cos(drift), math.sin(drift)), sides[0], (math.cos(jump), math.sin(jump)), sides[1]
        )


@dataclass(frozen=True)
class _Offset(Immutable):
    """The error of a fix: `bias` (3,) in the base frame, then `jump` (3,) in the map; m, m, rad."""

    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    jump: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def of(self, pose: Array) -> Array:
        """Returns the pose (3,) at which a robot at a true pose (3,) is localized."""
        return np.asarray(compose(pose, self.bias) + np.array(self.jump))


@dataclass(frozen=True, eq=False)
class _Fixes(Immutable):
    """The offset of the last fix, and fixes on their way, (due s, map_from_odometry)."""

    draw: _Draw = _Draw()
    offset: _Offset = _Offset()
    coming: tuple[tuple[float, Array], ...] = ()


class ScriptedLocalization(FloorAware):
    """Odometry in a frame of its own, and the pose of that frame in the map.

    Input `state` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] is the truth, in the world frame,
    which the map shares; `noise` is added to the state in the odometry's frame.
    Outputs, of the same six numbers: `odometry`, the pose in the odometry's frame, without that
    noise, for the places of costmaps and scans; `odometry_estimate`, with it, for the controller;
    `estimate`, the latter in the map, for the planners. Outputs (3,) x m, y m, yaw rad:
    `map_from_odometry` is Nav2's transform from map to odom, the pose of the odometry's frame in
    the map; `odometry_from_world` is the pose of the world in the odometry's frame.

    At the start both are the world's, apart from a bias. The odometry's drift grows with every
    step, one every 0.05 s from `offset_s` on. A fix finds the true pose, off by its noise, the bias
    and the jump, and sets `map_from_odometry` so that the robot was there; without fixes only a
    change of bias or jump moves it.

    With `wheel_odometry` the odometry's pose and speed are computed from the turns of the wheels,
    which are `wheel_separation_m` apart. Input `wheel_gains` (2,) is `gains` of SlippingWheels (not
    connected: 1).

    floor_clock: where there are several floors. On another one the odometry goes on as if nothing
    had happened, and a fix finds the pose there, off by the error of the lift as well.
    """

    def __init__(
        self,
        settings: Timeline[LocalizationSettings],
        *,
        offset_s: float,
        floor_clock: FloorClock | None = None,
        wheel_separation_m: float = 0.0,
    ) -> None:
        super().__init__()
        self._wheel_separation_m = wheel_separation_m
        if floor_clock is not None:
            self._declare_floors(floor_clock)
        self._settings = settings
        self._fixes = self.DeclareAbstractState(AbstractValue.Make(_Fixes()))
        self._odometry_frame = self.DeclareDiscreteState(POSE_SIZE)
        self._map_frame = self.DeclareDiscreteState(POSE_SIZE)
        self._last_pose = self.DeclareDiscreteState(POSE_SIZE)
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._noise_port = self.DeclareVectorInputPort("noise", STATE_SIZE)
        odometry_frame = self.discrete_state_ticket(self._odometry_frame)
        state = self.input_port_ticket(self._state_port.get_index())
        noise = self.input_port_ticket(self._noise_port.get_index())
        self._gains_port: InputPort | None = None
        # Whether the odometry is misled by the wheels, with or without slip.
        self._believes_wheels = settings.at(0.0).wheel_odometry
        if self._believes_wheels:
            self._gains_port = self.DeclareVectorInputPort("wheel_gains", WHEELS)
        in_map = {odometry_frame, self.discrete_state_ticket(self._map_frame), state, noise}
        told = set()
        if self._gains_port is not None:
            told.add(self.input_port_ticket(self._gains_port.get_index()))
        for name, calc, tickets in (
            ("odometry", self._calc_odometry, {odometry_frame, state}),
            ("odometry_estimate", self._calc_odometry_estimate, {odometry_frame, state, noise}),
            ("estimate", self._calc_estimate, in_map),
        ):
            self.DeclareVectorOutputPort(
                name, STATE_SIZE, weakly_bound(calc), prerequisites_of_calc=tickets | told
            )
        self.DeclareStateOutputPort("odometry_from_world", self._odometry_frame)
        self.DeclareStateOutputPort("map_from_odometry", self._map_frame)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            ODOMETRY_PERIOD_S, offset_s, weakly_bound(self._on_step)
        )

    def set_start(self, context: Context, pose: Array, seed: int) -> None:
        """Puts all frames at their start of a trial, with the robot at a true pose (3,)."""
        draw = _Draw.of(seed)
        offset = _offset(self._settings.at(0.0), draw, 0.0)
        context.get_mutable_abstract_parameter(self.seed_parameter).set_value(seed)
        context.SetAbstractState(self._fixes, _Fixes(draw, offset))
        context.SetDiscreteState(self._odometry_frame, SAME_FRAME)
        context.SetDiscreteState(self._map_frame, carrier_pose(offset.of(pose), pose))
        context.SetDiscreteState(self._last_pose, pose)

    def _on_step(self, context: Context, state: State) -> None:
        now_s = context.get_time()
        settings = self._settings.at(now_s)
        pose = self._state_port.Eval(context)[:POSE_SIZE]
        frame = self._drifted(context, settings, pose)
        if frame is not None:
            state.get_mutable_discrete_state(self._odometry_frame).SetFromVector(frame)
        state.get_mutable_discrete_state(self._last_pose).SetFromVector(pose)
        before: _Fixes = context.get_abstract_state(self._fixes).get_value()
        if frame is None:
            frame = context.get_discrete_state(self._odometry_frame).value()
        fixes = self._with_new_fix(context, settings, before, pose=pose, frame=frame)
        due = [fix for fix in fixes.coming if fix[0] <= now_s + SLACK_S]
        if due:
            state.get_mutable_discrete_state(self._map_frame).SetFromVector(due[-1][1])
            fixes = replace(fixes, coming=fixes.coming[len(due) :])
        if fixes is not before:
            state.get_mutable_abstract_state(self._fixes).set_value(fixes)

    def _on_floor(self, context: Context, state: State, switch: FloorSwitch) -> None:
        pose = self._state_port.Eval(context)[:POSE_SIZE]
        frame = context.get_discrete_state(self._odometry_frame).value()
        odometry_pose, arrival = compose(frame, pose), switch.carried(pose)
        fixes: _Fixes = context.get_abstract_state(self._fixes).get_value()
        now_s = context.get_time()
        offset = _offset(self._settings.at(now_s), fixes.draw, now_s)
        believed = offset.of(arrival) + np.array(switch.error)
        for index, value in (
            (self._odometry_frame, carrier_pose(odometry_pose, arrival)),
            (self._map_frame, carrier_pose(believed, odometry_pose)),
            (self._last_pose, arrival),
        ):
            state.get_mutable_discrete_state(index).SetFromVector(value)
        after = replace(fixes, offset=offset, coming=())
        state.get_mutable_abstract_state(self._fixes).set_value(after)

    def _drifted(
        self, context: Context, settings: LocalizationSettings, pose: Array
    ) -> Array | None:
        """Returns odometry_from_world after a step to a true pose (3,); None: unchanged."""
        if not (self._believes_wheels or any(getattr(settings, name) for name in DRIFTS)):
            return None
        x, y, yaw = pose.tolist()
        last_x, last_y, last_yaw = context.get_discrete_state(self._last_pose).value().tolist()
        way_m, turn_rad = math.hypot(x - last_x, y - last_y), abs(wrap(yaw - last_yaw))
        draw = context.get_abstract_state(self._fixes).get_value().draw
        error_m, error_rad = settings.drift * way_m, settings.yaw_drift * turn_rad
        error = np.array(
            [error_m * draw.drift[0], error_m * draw.drift[1], error_rad * draw.drift_side]
        )
        if settings.random_drift or settings.random_yaw_drift:
            error += self._wheel_noise(context, settings, way_m)
        if self._believes_wheels:
            heading = 0.5 * (yaw + last_yaw)
            ahead_m = (x - last_x) * math.cos(heading) + (y - last_y) * math.sin(heading)
            error += self._error_of_wheels(context, ahead_m, wrap(yaw - last_yaw))
        if not error.any():
            return None
        frame = context.get_discrete_state(self._odometry_frame).value()
        return np.asarray(drifted_frame(frame, pose, *error.tolist()))

    def _error_of_wheels(self, context: Context, ahead: float, turn: float) -> Array:
        """Returns (3,) the motion that the wheels' turns tell, less the base's `ahead`, `turn`.

        In m and rad as seen from the base, or in m/s and rad/s for speeds.
        """
        assert self._gains_port is not None
        gains = value_or_none(self._gains_port, context)
        if gains is None:
            return np.zeros(POSE_SIZE)
        measured_ahead, measured_turn = turned(
            ahead, turn, self._wheel_separation_m, gains[0], gains[1]
        )
        return np.array([measured_ahead - ahead, 0.0, measured_turn - turn])

    def _measured_state(self, context: Context) -> Array:
        """Returns the state (6,) with the speeds that the odometry measures."""
        state = self._state_port.Eval(context)
        if not self._believes_wheels:
            return state
        told = state.copy()
        error = self._error_of_wheels(context, *state[POSE_SIZE : POSE_SIZE + 2].tolist())
        told[POSE_SIZE : POSE_SIZE + 2] += error[::2]
        return told

    def _wheel_noise(self, context: Context, settings: LocalizationSettings, way_m: float) -> Array:
        """Returns the error (3,) of a step of `way_m`, m, m and rad, as seen from the base."""
        if way_m == 0.0:
            return np.zeros(POSE_SIZE)
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round(context.get_time() / ODOMETRY_PERIOD_S)
        normals = NoiseKey(seed, NoiseStream.WHEEL_NOISE, step).generator().standard_normal(3)
        spreads = (settings.random_drift, settings.random_drift, settings.random_yaw_drift)
        return normals * spreads * math.sqrt(way_m)

    def _with_new_fix(
        self,
        context: Context,
        settings: LocalizationSettings,
        fixes: _Fixes,
        *,
        pose: Array,
        frame: Array,
    ) -> _Fixes:
        """Returns the fixes, and this step's fix where one is due.

        pose: (3,) the true pose. frame: (3,) odometry_from_world.
        """
        now_s = context.get_time()
        offset = _offset(settings, fixes.draw, now_s)
        period_s = settings.fix_period_s
        if period_s is None:
            if offset == fixes.offset:
                return fixes
            odometry_pose = compose(frame, pose)
            fix = carrier_pose(offset.of(odometry_pose), odometry_pose)
            return replace(fixes, offset=offset, coming=((now_s, fix),))
        number = _periods(now_s, period_s)
        if number == _periods(now_s - ODOMETRY_PERIOD_S, period_s):
            return fixes
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        noise = NoiseKey(seed, NoiseStream.FIX, number).generator().standard_normal(POSE_SIZE)
        std = (settings.fix_xy_std_m, settings.fix_xy_std_m, settings.fix_yaw_std_rad)
        fix = carrier_pose(offset.of(pose) + noise * std, compose(frame, pose))
        coming = (*fixes.coming, (now_s + settings.fix_lag_s, fix))
        return replace(fixes, offset=offset, coming=coming)

    def _calc_odometry(self, context: Context, output: BasicVector) -> None:
        frame = context.get_discrete_state(self._odometry_frame).value()
        state = self._measured_state(context)
        output.SetFromVector(placed_state(state, frame, NO_NOISE, SAME_FRAME))

    def _calc_odometry_estimate(self, context: Context, output: BasicVector) -> None:
        frame = context.get_discrete_state(self._odometry_frame).value()
        state, noise = self._measured_state(context), self._noise_port.Eval(context)
        output.SetFromVector(placed_state(state, frame, noise, SAME_FRAME))

    def _calc_estimate(self, context: Context, output: BasicVector) -> None:
        frame = context.get_discrete_state(self._odometry_frame).value()
        state, noise = self._measured_state(context), self._noise_port.Eval(context)
        map_frame = context.get_discrete_state(self._map_frame).value()
        output.SetFromVector(placed_state(state, frame, noise, map_frame))


def jump_of(settings: LocalizationSettings, seed: int) -> Array:
    """Returns (3,) m, m, rad: the jump of the localization in the trial with this seed."""
    draw = _Draw.of(seed)
    jump_m = settings.jump_m
    return np.array(
        [jump_m * draw.jump[0], jump_m * draw.jump[1], settings.jump_yaw_rad * draw.jump_side]
    )


def _offset(settings: LocalizationSettings, draw: _Draw, now_s: float) -> _Offset:
    bias = (settings.x_bias_m, settings.y_bias_m, settings.yaw_bias_rad)
    if now_s < settings.jump_time_s - SLACK_S:
        return _Offset(bias)
    jump_m = settings.jump_m
    jump_rad = settings.jump_yaw_rad * draw.jump_side
    return _Offset(bias, (jump_m * draw.jump[0], jump_m * draw.jump[1], jump_rad))


def _periods(time_s: float, period_s: float) -> int:
    """Returns the number of whole periods that have passed, -1 before the start."""
    return math.floor((time_s + SLACK_S) / period_s)
