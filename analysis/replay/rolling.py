"""Rolling angles of wheels and swivel angles of casters under a base that moves in the plane.

Velocities are in the base frame. The base moves forward with v and to the left with vy, and turns
with w. The point (x, y) of the base then has the velocity (v - w y, vy + w x).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_navbench.kernels.arrays import Array


class BaseMotion(NamedTuple):
    """A log's true motion, (T,) each: time s, x m, y m, yaw rad (not wrapped), v, w and vy."""

    time_s: Array
    x_m: Array
    y_m: Array
    yaw_rad: Array
    v_mps: Array
    w_radps: Array
    vy_mps: Array

    def point_velocity(self, point: Array) -> Array:
        """Returns the velocity of a point (2,) m of the base, (T, 2) m/s."""
        ahead = self.v_mps - self.w_radps * point[1]
        return np.column_stack([ahead, self.vy_mps + self.w_radps * point[0]])


def rolled_angle(time_s: Array, speed_mps: Array, radius_m: float) -> Array:
    """Returns the angle of a wheel that rolls without slip from angle 0, (T,) rad (trapezoids)."""
    steps = 0.5 * (speed_mps[1:] + speed_mps[:-1]) * np.diff(time_s) / radius_m
    return np.concatenate([[0.0], np.cumsum(steps)])


def trailing_heading(
    motion: BaseMotion, pivot_velocity: Array, *, trail_m: float, initial_rad: float
) -> Array:
    """Returns the heading of a caster in the base frame, (T,) rad.

    The contact point trails the pivot by `trail_m` and does not slip sideways. With e the angle
    from the caster's heading to the pivot's velocity u, its heading in the world turns with sin(e)
    |u| / trail: the tractrix. For constant u, tan(e/2) decays exponentially; each step takes that
    exact solution, so that no step is too long.
    """
    speed = np.hypot(*pivot_velocity.T)
    direction = np.arctan2(pivot_velocity[:, 1], pivot_velocity[:, 0])
    step_s = np.diff(motion.time_s)
    decay = np.exp(-speed[:-1] * step_s / trail_m)
    turn = motion.w_radps[:-1] * step_s
    heading = np.empty(len(speed))
    heading[0] = initial_rad
    for k in range(len(step_s)):
        error = direction[k] - heading[k]
        remaining = 2.0 * np.arctan(np.tan(0.5 * error) * decay[k])
        # arctan gives the remaining error in (-pi, pi); the error must be in that interval, too.
        swung = np.arctan2(np.sin(error), np.cos(error)) - remaining
        heading[k + 1] = heading[k] + swung - turn[k]
    return heading
