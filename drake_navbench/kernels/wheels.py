"""The motion of wheels by a command."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def wheel_speed_obeyed(speed, deadband, step):
    """Returns the actual speed of a wheel, m/s, for the commanded `speed`.

    deadband: a slower wheel stands still, m/s. step: speeds are rounded to multiples of this, m/s;
    0: no rounding.
    """
    if step > 0.0:
        speed = math.floor(speed / step + 0.5) * step
    return 0.0 if abs(speed) < deadband else speed


@njit(cache=True)
def obeyed(v, w, separation, deadband, step, left_gain, right_gain):
    """Returns (v m/s, w rad/s) over the floor of a differential base that is commanded (v, w).

    separation: between the wheels, m. left_gain, right_gain: speed over the floor per wheel speed
    at the nominal radius. See `wheel_speed_obeyed` for the others.
    """
    half = 0.5 * separation
    left = left_gain * wheel_speed_obeyed(v - w * half, deadband, step)
    right = right_gain * wheel_speed_obeyed(v + w * half, deadband, step)
    return 0.5 * (left + right), (right - left) / separation


@njit(cache=True)
def turned(v, w, separation, left_gain, right_gain):
    """Returns (v m/s, w rad/s) as the wheels' turns tell a motion (v, w) over the floor.

    Wheel odometry computes it from encoders, for wheels of nominal radius that do not slip. See
    `obeyed`.
    """
    half = 0.5 * separation
    left, right = (v - w * half) / left_gain, (v + w * half) / right_gain
    return 0.5 * (left + right), (right - left) / separation
