"""The limits of a control sequence: its start, its accelerations and the command sent."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.mppi.critics.batch import Float32Array
from drake_navbench.controllers.mppi.float32_math import F32
from drake_navbench.controllers.mppi.motion_models import (
    AXES,
    VX,
    VY,
    WZ,
    MotionLimits,
    MotionModel,
    constrain_axis,
    constrain_axis_freely,
    limit_curvature,
    limit_signed_curvature,
    reachable,
)
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.releases import RULES
from drake_navbench.errors import InputError

# Control periods this close to model_dt count as equal (Optimizer::setOffset), s.
_PERIOD_TOLERANCE_S = 1e-6
HISTORY = 4
# Below this many filtered columns Nav2 leaves the sequence alone.
MIN_FILTERED_COLUMNS = 20
_QUADRATIC = np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], np.float32) / np.float32(231)
_LINEAR = np.full(9, 1 / 9, np.float32)


class SequenceRules:
    """The constraints of one motion model at one control period.

    shifts: whether the sequence moves on by one column a cycle, so that column 0 is the present
    and column 1 is sent; else column 0 is sent. base_limits: without a speed limit.

    Raises InputError where `model_dt` is smaller than the control period.
    """

    def __init__(
        self, parameters: MppiParameters, model: MotionModel, control_period_s: float
    ) -> None:
        self._parameters = parameters
        self._release = RULES[parameters.nav2_release]
        self._model = model
        self._control_period_s = control_period_s
        self.base_limits = limits_of(parameters)
        self.shifts = _shifts(parameters.model_dt, control_period_s)
        self.sent_column = 1 if self.shifts else 0

    @property
    def holonomic(self) -> bool:
        """Whether vy counts."""
        return self._model is MotionModel.OMNI

    def initial_speed(
        self, measured: NDArray[np.float64], last_command: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Returns the speed (3,) that roll-outs start from.

        The last command, as far as the robot can have reached it from the measured speed within one
        control period; with `open_loop` the last command itself. Up to Kilted it is the measured
        speed.
        """
        if self._parameters.open_loop:
            return last_command.copy()
        if not self._release.predicts_start:
            return measured.copy()
        rise, fall = self.rates(self._control_period_s)
        speed = np.minimum(measured + rise, np.maximum(last_command, measured + fall))
        if not self.holonomic:
            speed[VY] = measured[VY]
        return speed

    def rates(self, step_s: float) -> tuple[Float32Array, Float32Array]:
        """Returns the largest rise and fall (negative) of each axis within `step_s`."""
        if not self._release.has_accelerations:
            unlimited = np.full(AXES, np.inf, np.float32)
            return unlimited, -unlimited
        limits = self.base_limits
        rise = np.array([limits.ax_max, limits.ay_max, limits.az_max])
        fall = np.array([limits.ax_min, limits.ay_min, -limits.az_max])
        return rise * F32(step_s), fall * F32(step_s)

    def pinned(self, controls: Float32Array, speed: Float32Array) -> Float32Array:
        """Returns a copy of the sequence that begins with a speed that the robot can have."""
        pinned = controls.copy()
        if not self._release.predicts_start:
            return pinned
        if self.shifts:
            pinned[:, 0] = speed
        else:
            rise, fall = self.rates(self._control_period_s)
            for axis in range(AXES):
                wanted = controls[axis, 0]
                pinned[axis, 0] = reachable(speed[axis], wanted, rise[axis], fall[axis])
        if not self.holonomic:
            pinned[VY] = 0
        return pinned

    def constrain(self, controls: Float32Array, speed: Float32Array, limits: MotionLimits) -> None:
        """Makes a sequence (3, N) obey the limits, in place (applyControlSequenceConstraints)."""
        if not self._release.predicts_start:
            self._constrain_freely(controls, limits)
            return
        min_turning_r = F32(self._parameters.AckermannConstraints.min_turning_r)
        if self._model is MotionModel.ACKERMANN:
            limit_curvature(controls, min_turning_r)
        lowest = (limits.vx_min, -limits.vy_max, -limits.wz_max)
        highest = (limits.vx_max, limits.vy_max, limits.wz_max)
        rise, fall = self.rates(self._parameters.model_dt)
        ratio = F32(self._control_period_s / self._parameters.model_dt)
        for axis in (VX, VY, WZ) if self.holonomic else (VX, WZ):
            if self.shifts:
                controls[axis, 0] = speed[axis]
            bounds = (lowest[axis], highest[axis], rise[axis], fall[axis])
            constrain_axis(controls[axis], speed[axis], *bounds, ratio)
        if self._model is MotionModel.ACKERMANN:
            limit_curvature(controls, min_turning_r)

    def _constrain_freely(self, controls: Float32Array, limits: MotionLimits) -> None:
        """Makes a sequence obey the limits as up to Kilted: it may begin at any speed in them."""
        lowest = (limits.vx_min, -limits.vy_max, -limits.wz_max)
        highest = (limits.vx_max, limits.vy_max, limits.wz_max)
        rise, fall = self.rates(self._parameters.model_dt)
        for axis in (VX, VY, WZ) if self.holonomic else (VX, WZ):
            bounds = (lowest[axis], highest[axis], rise[axis], fall[axis])
            constrain_axis_freely(controls[axis], *bounds)
        if self._model is MotionModel.ACKERMANN:
            limit = limit_signed_curvature if self._release.curves_signed else limit_curvature
            limit(controls, F32(self._parameters.AckermannConstraints.min_turning_r))


def limits_of(parameters: MppiParameters) -> MotionLimits:
    """Returns the limits in float32; accelerations get the sign that their names demand."""
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
            f"model_dt: got {model_dt:g}, expected at least the control period "
            f"{control_period_s:.6g} s"
        )
    return False


def smooth(controls: Float32Array, history: Float32Array, *, order: int) -> Float32Array:
    """Returns the smoothed sequences; too short ones unchanged.

    controls: (3, N). history: (3, 4), the sequence's columns -4 .. -1. order: 1 or 2, else 2.
    The last column stays, and stands in for those behind it.
    """
    if not filters(controls.shape[1]):
        return controls
    return _smooth(controls, history, _LINEAR if order == 1 else _QUADRATIC)


def smooth_in_place(controls: Float32Array, history: Float32Array) -> Float32Array:
    """Returns the sequences smoothed as up to Iron, where the filter reads values it has filtered.

    The last column is filtered, too, the fifth from the end is not.
    """
    if not filters(controls.shape[1]):
        return controls
    return _smooth_in_place(controls, history, _QUADRATIC)


def filters(steps: int) -> bool:
    """Whether a sequence of `steps` columns is long enough to be smoothed."""
    return steps - 1 >= MIN_FILTERED_COLUMNS


@njit(cache=True)
def _smooth_in_place(controls, history, taps):
    axes, steps = controls.shape
    smoothed = controls.copy()
    for axis in range(axes):
        row = smoothed[axis]
        for t in range(steps):
            if t == steps - HISTORY - 1:
                continue
            total = np.float32(0)
            for k in range(taps.shape[0]):
                i = t + k - HISTORY
                if i < 0:
                    total += taps[k] * history[axis, HISTORY + i]
                else:
                    total += taps[k] * row[min(i, steps - 1)]
            row[t] = total
    return smoothed


@njit(cache=True)
def _smooth(controls, history, taps):
    axes, steps = controls.shape
    smoothed = controls.copy()
    for axis in range(axes):
        for t in range(steps - 1):
            total = np.float32(0)
            for k in range(taps.shape[0]):
                i = t + k - HISTORY
                later = controls[axis, min(max(i, 0), steps - 1)]
                value = history[axis, HISTORY + i] if i < 0 else later
                total += taps[k] * value
            smoothed[axis, t] = total
    return smoothed
