"""Planned motions: their layout, the step between stages, and how plans are cut and shifted.

A plan is (N + 1, 9) float64, one row a stage, `dt` apart: the state x m, y m, yaw rad (not
wrapped), v m/s, w rad/s, a m/s^2, alpha rad/s^2, and the inputs of the step that begins there, the
jerks of v and w. The jerks are constant within a step; those of the last row are 0.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

X, Y, YAW, V, W, A, ALPHA, JERK, ANGULAR_JERK = range(9)
STATE_SIZE = 7
STAGE_SIZE = 9


@njit(cache=True)
def fill(target, source):
    """Fills a row with the first numbers of another.

    One by one: assigned as a whole, it would have numba compile its strings, for an error message.
    """
    for i in range(target.shape[0]):
        target[i] = source[i]


@njit(cache=True)
def advance(stage, dt, following):
    """Writes into `following[:7]` the state after the step that begins at `stage`.

    Velocities and accelerations are exact; the path within a step is the chord of an arc.
    """
    path = dt * (stage[V] + dt * (0.5 * stage[A] + dt * stage[JERK] / 6.0))
    turn = dt * (stage[W] + dt * (0.5 * stage[ALPHA] + dt * stage[ANGULAR_JERK] / 6.0))
    heading = stage[YAW] + 0.5 * turn
    following[X] = stage[X] + path * math.cos(heading)
    following[Y] = stage[Y] + path * math.sin(heading)
    following[YAW] = stage[YAW] + turn
    following[V] = stage[V] + dt * (stage[A] + 0.5 * dt * stage[JERK])
    following[W] = stage[W] + dt * (stage[ALPHA] + 0.5 * dt * stage[ANGULAR_JERK])
    following[A] = stage[A] + dt * stage[JERK]
    following[ALPHA] = stage[ALPHA] + dt * stage[ANGULAR_JERK]


@njit(cache=True)
def slopes_of_advance(stage, dt, slopes):
    """Writes into `slopes` (7, 9) the derivatives of `advance` by the stage."""
    half, sixth = 0.5 * dt * dt, dt * dt * dt / 6.0
    path = dt * stage[V] + half * stage[A] + sixth * stage[JERK]
    turn = dt * stage[W] + half * stage[ALPHA] + sixth * stage[ANGULAR_JERK]
    heading = stage[YAW] + 0.5 * turn
    cosine, sine = math.cos(heading), math.sin(heading)
    slopes[:] = 0.0
    for row in range(STATE_SIZE):
        slopes[row, row] = 1.0
    for row, along, across in ((X, cosine, -path * sine), (Y, sine, path * cosine)):
        slopes[row, YAW] = across
        slopes[row, V], slopes[row, A], slopes[row, JERK] = dt * along, half * along, sixth * along
        slopes[row, W] = 0.5 * dt * across
        slopes[row, ALPHA] = 0.5 * half * across
        slopes[row, ANGULAR_JERK] = 0.5 * sixth * across
    slopes[YAW, W], slopes[YAW, ALPHA], slopes[YAW, ANGULAR_JERK] = dt, half, sixth
    slopes[V, A], slopes[V, JERK] = dt, half
    slopes[W, ALPHA], slopes[W, ANGULAR_JERK] = dt, half
    slopes[A, JERK] = slopes[ALPHA, ANGULAR_JERK] = dt


@njit(cache=True)
def roll_out(plan, dt):
    """Recomputes the states of a plan (N + 1, 9) in place, from its first one and its inputs."""
    for k in range(plan.shape[0] - 1):
        advance(plan[k], dt, plan[k + 1])


@njit(cache=True)
def stage_at(plan, dt, time_s):
    """Returns the state of a plan, and its jerks, at a time since its start, (9,).

    After the end of the plan the robot rests at the plan's last pose.
    """
    last = plan.shape[0] - 1
    stage = np.zeros(STAGE_SIZE)
    time_s = max(time_s, 0.0)
    index = int(time_s / dt + 1e-9)
    if index >= last:
        fill(stage[: YAW + 1], plan[last])
        return stage
    advance(plan[index], time_s - index * dt, stage)
    stage[JERK], stage[ANGULAR_JERK] = plan[index, JERK], plan[index, ANGULAR_JERK]
    return stage


@njit(cache=True)
def shifted(plan, dt, time_s, start):
    """Returns the rest of a plan from a time on, as a plan of its length that begins in `start`.

    start: (9,) the state now. Accelerations are those of the old plan at the new stages; after the
    old plan's end the robot waits there.
    """
    count = plan.shape[0]
    rest = np.zeros((count, STAGE_SIZE))
    fill(rest[0], start)
    for k in range(count - 1):
        there = stage_at(plan, dt, time_s + (k + 1) * dt)
        rest[k, JERK] = (there[A] - rest[k, A]) / dt
        rest[k, ANGULAR_JERK] = (there[ALPHA] - rest[k, ALPHA]) / dt
        advance(rest[k], dt, rest[k + 1])
    return rest


@njit(cache=True)
def plan_of_velocities(velocities, dt, start):
    """Returns a plan (N + 1, 9) close to the velocities (N + 1, 2) v m/s, w rad/s of its stages.

    start: (9,) the state it begins in. The accelerations between stages are those of the velocities
    one stage before to one behind, so that they do not swing.
    """
    count = velocities.shape[0]
    plan = np.zeros((count, STAGE_SIZE))
    fill(plan[0], start)
    for k in range(count - 1):
        after = min(k + 2, count - 1)
        for axis in range(2):
            wanted = (velocities[after, axis] - velocities[k, axis]) / (2.0 * dt)
            if k + 1 == count - 1:
                wanted = 0.0
            plan[k, JERK + axis] = (wanted - plan[k, A + axis]) / dt
        advance(plan[k], dt, plan[k + 1])
    return plan
