"""Motion models: velocities and poses by sampled controls, and the constraints of a sequence.

Everything is float32 like Nav2's. Controls and velocities are three axes, vx m/s, vy m/s and
wz rad/s; only the omnidirectional model uses vy. Column t of a trajectory is the pose after step
t. Source: nav2_mppi_controller, MotionModel::predict and Optimizer::integrateStateVelocities,
applyControlSequenceConstraints.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.mppi.float32_math import ZERO, clamp32, sin_cos
from drake_navbench.controllers.mppi.lanes import LANES

# Axes of controls and velocities.
AXES = 3
VX, VY, WZ = range(AXES)


class MotionModel(IntEnum):
    """The three motion models of Nav2."""

    DIFF_DRIVE = 0
    OMNI = 1
    ACKERMANN = 2


class MotionLimits(NamedTuple):
    """Limits of the control sequence, float32: m/s, rad/s, m/s^2, rad/s^2; *_min are signed."""

    vx_max: np.float32
    vx_min: np.float32
    vy_max: np.float32
    wz_max: np.float32
    ax_max: np.float32
    ax_min: np.float32
    ay_max: np.float32
    ay_min: np.float32
    az_max: np.float32

    def scaled(self, ratio: float) -> MotionLimits:
        """Returns the limits under a speed limit: velocities times `ratio`, accelerations kept."""
        scale = np.float32(ratio)
        return self._replace(
            vx_max=self.vx_max * scale,
            vx_min=self.vx_min * scale,
            vy_max=self.vy_max * scale,
            wz_max=self.wz_max * scale,
        )


@njit(cache=True)
def velocity_lanes(speed, rise, fall, controls, noise, velocities):
    """Rolls out one axis: the sampled control, reached at the rate that the base allows.

    speed: velocity now. rise, fall: largest and smallest (negative) change in one step while
    moving forward; mirrored while moving backward or standing. controls: (N,) the mean sequence.
    noise: (N, LANES). velocities: (N, LANES), written; column 0 is `speed`, the last control has
    no influence.
    """
    for lane in range(LANES):
        velocities[0, lane] = speed
    for t in range(1, velocities.shape[0]):
        _velocity_row(velocities[t - 1], controls[t - 1], noise[t - 1], rise, fall, velocities[t])


@register_jitable
def _velocity_row(previous, control, noise, rise, fall, velocities):
    for lane in range(LANES):
        forward = previous[lane] > ZERO
        low = previous[lane] + (fall if forward else -rise)
        high = previous[lane] + (rise if forward else -fall)
        velocities[lane] = clamp32(control + noise[lane], low, high)


@register_jitable
def clamp_noise_lanes(controls, velocities, noise, clamped_noise):
    """Writes the noise that would have led to `velocities` (clamp_raw_controls)."""
    steps = velocities.shape[0]
    for t in range(1, steps):
        for lane in range(LANES):
            clamped_noise[t - 1, lane] = velocities[t, lane] - controls[t - 1]
    for lane in range(LANES):
        clamped_noise[steps - 1, lane] = noise[steps - 1, lane]


@njit(cache=True)
def delay_lanes(velocities, history):
    """Shifts velocities by the actuation delay of D = len(history) steps, in place.

    history: (D,) earlier commands, oldest first. A delay of one step changes nothing.
    """
    delay = history.shape[0]
    if delay <= 1:
        return
    steps = velocities.shape[0]
    for t in range(steps - 1, delay - 1, -1):
        for lane in range(LANES):
            velocities[t, lane] = velocities[t - delay + 1, lane]
    for t in range(1, min(delay, steps)):
        for lane in range(LANES):
            velocities[t, lane] = history[t]


@register_jitable(forceinline=True)
def _step_row(start_x, start_y, start_yaw, vx, vy, wz, dt, holonomic, x, y, yaw):
    """Integrates one step of explicit Euler over a row of lanes."""
    if holonomic:
        for lane in range(LANES):
            sine, cosine = sin_cos(start_yaw[lane])
            x[lane] = start_x[lane] + (vx[lane] * cosine - vy[lane] * sine) * dt
            y[lane] = start_y[lane] + (vx[lane] * sine + vy[lane] * cosine) * dt
            yaw[lane] = start_yaw[lane] + wz[lane] * dt
    else:
        for lane in range(LANES):
            sine, cosine = sin_cos(start_yaw[lane])
            x[lane] = start_x[lane] + vx[lane] * cosine * dt
            y[lane] = start_y[lane] + vx[lane] * sine * dt
            yaw[lane] = start_yaw[lane] + wz[lane] * dt


@register_jitable
def pose_lanes(pose, dt, holonomic, vx, vy, wz, x, y, yaw):
    """Integrates a block of velocities (N, LANES) from `pose` (3,) into x, y, yaw (N, LANES).

    The yaw is not wrapped.
    """
    start = np.empty((3, LANES), np.float32)
    for axis in range(3):
        for lane in range(LANES):
            start[axis, lane] = pose[axis]
    _step_row(start[0], start[1], start[2], vx[0], vy[0], wz[0], dt, holonomic, x[0], y[0], yaw[0])
    for t in range(1, x.shape[0]):
        _step_row(
            x[t - 1], y[t - 1], yaw[t - 1], vx[t], vy[t], wz[t], dt, holonomic, x[t], y[t], yaw[t]
        )


@njit(cache=True)
def integrate_controls(pose, dt, controls):
    """Returns the poses (N, 3) float32 that a control sequence (3, N) leads to from `pose` (3,)."""
    steps = controls.shape[1]
    poses = np.empty((steps, 3), np.float32)
    x, y, yaw = pose[0], pose[1], pose[2]
    for t in range(steps):
        sine, cosine = sin_cos(yaw)
        x = x + (controls[0, t] * cosine - controls[1, t] * sine) * dt
        y = y + (controls[0, t] * sine + controls[1, t] * cosine) * dt
        yaw = yaw + controls[2, t] * dt
        poses[t, 0], poses[t, 1], poses[t, 2] = x, y, yaw
    return poses


@njit(cache=True)
def reachable(previous, wanted, rise, fall):
    """Clamps a velocity to those reachable in a step; 0 counts as forward, unlike in a roll-out."""
    if previous >= ZERO:
        return clamp32(wanted, previous + fall, previous + rise)
    return clamp32(wanted, previous - rise, previous - fall)


@njit(cache=True)
def constrain_axis(controls, speed, v_min, v_max, rise, fall, first_step_ratio):
    """Clamps one axis (N,) in place: first to its limits, then to the rate reachable from `speed`.

    first_step_ratio: control period over model_dt, for the step from `speed` to column 0. The
    rate has the last word, so limits may be exceeded while slowing down from too high a speed.
    """
    previous = speed
    for t in range(controls.shape[0]):
        ratio = first_step_ratio if t == 0 else np.float32(1.0)
        wanted = clamp32(controls[t], v_min, v_max)
        previous = reachable(previous, wanted, rise * ratio, fall * ratio)
        controls[t] = previous


@njit(cache=True)
def constrain_axis_freely(controls, v_min, v_max, rise, fall):
    """Clamps one axis (N,) in place to its limits and, from its own first column on, to the rates.

    As up to Kilted: standing counts as moving backward, and the rate has the last word.
    """
    controls[0] = clamp32(controls[0], v_min, v_max)
    for t in range(1, controls.shape[0]):
        previous = controls[t - 1]
        wanted = clamp32(controls[t], v_min, v_max)
        if previous > ZERO:
            controls[t] = clamp32(wanted, previous + fall, previous + rise)
        else:
            controls[t] = clamp32(wanted, previous - rise, previous - fall)


@njit(cache=True)
def limit_curvature(controls, min_turning_r):
    """Clamps wz of a sequence (3, N) in place so that no turn is tighter than `min_turning_r` m."""
    for t in range(controls.shape[1]):
        bound = np.abs(controls[0, t]) / min_turning_r
        controls[2, t] = clamp32(controls[2, t], -bound, bound)


@njit(cache=True)
def limit_signed_curvature(controls, min_turning_r):
    """Limits curvature as Iron does: with negative vx too tight a turn changes sides."""
    for t in range(controls.shape[1]):
        v, w = controls[0, t], controls[2, t]
        if np.abs(v) < min_turning_r * np.abs(w):
            controls[2, t] = np.sign(w) * v / min_turning_r
