"""The polish's objective along one roll-out, with its gradient by the adjoint of the roll-out.

Written here from the definitions; float64. A sequence is (N, 2): v m/s and w rad/s. Column t is
driven for `dt` from the pose before it, as in `motion_models`:

    yaw_t = yaw_{t-1} + w_t dt,   x_t = x_{t-1} + v_t cos(yaw_{t-1}) dt,   y_t likewise,

    J = mean_t [ k_path e_t^2 + k_heading (1 - cos(yaw_t - h_t)) + k_obstacle g(x_t, y_t)^2
                 + k_deviation (v_t - v'_t)^2 + k_jerk (second difference of v over dt^2)^2
                 + likewise of w ] + k_progress |p_N - carrot|

with e_t the distance from the line through the reference point t along its heading h_t, g the cost
field interpolated between cell centres, 1 at an inscribed cell, and primes for the sampled
sequence. The distance to the carrot is smoothed: sqrt(d^2 + r^2) - r.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Grid

# Below about this distance from the carrot the pull fades instead of changing sign abruptly, m.
CARROT_SMOOTHING_M = 0.1


class PolishSituation(NamedTuple):
    """The inputs of the objective besides the control sequence.

    pose: (3,) m, m, rad. speed, earlier_speed: (2,) v, w of now and of the cycle before; they only
    enter the jerk. references: (N, 3) points of the path and its heading there. carrot: (2,) m.
    sampled: (N, 2). field: see `cost_field`. starts_now: whether
    column 0 is the present and takes the place of `speed`.
    """

    pose: Array
    speed: Array
    earlier_speed: Array
    references: Array
    carrot: Array
    sampled: Array
    field: Grid
    dt: float
    starts_now: bool


class Weights(NamedTuple):
    """The k of the module's formula."""

    path: float
    heading: float
    obstacle: float
    progress: float
    linear_deviation: float
    angular_deviation: float
    linear_jerk: float
    angular_jerk: float


def cost_field(grid: Grid, *, tracks_unknown: bool) -> Grid:
    """Returns the grid with costs as numbers in [0, 1]; unknown cells are free where tracked."""
    values = np.minimum(np.arange(NO_INFORMATION + 1), INSCRIBED) / INSCRIBED
    values[LETHAL] = 1.0
    values[NO_INFORMATION] = 0.0 if tracks_unknown else 1.0
    return grid._replace(costs=values[grid.costs])


@register_jitable
def _between_centres(field, x, y):
    """Returns (column, row, whether (x, y) lies between cell centres), in columns and rows."""
    rows, columns = field.costs.shape
    along_x = (x - field.origin_x) / field.resolution - 0.5
    along_y = (y - field.origin_y) / field.resolution - 0.5
    is_between = 0.0 <= along_x < columns - 1 and 0.0 <= along_y < rows - 1
    return along_x, along_y, is_between


@njit(cache=True, forceinline=True)
def interpolate(field, x, y):
    """Returns (value, d/dx, d/dy) of the field between cell centres; flat beyond the outer ones."""
    values, resolution = field.costs, field.resolution
    rows, columns = values.shape
    along_x, along_y, is_between = _between_centres(field, x, y)
    if not is_between:
        column = int(min(max(along_x + 0.5, 0.0), columns - 1.0))
        row = int(min(max(along_y + 0.5, 0.0), rows - 1.0))
        return values[row, column], 0.0, 0.0
    column, row = int(along_x), int(along_y)
    a, b = along_x - column, along_y - row
    low = values[row, column] + a * (values[row, column + 1] - values[row, column])
    high = values[row + 1, column] + a * (values[row + 1, column + 1] - values[row + 1, column])
    slope_low = values[row, column + 1] - values[row, column]
    slope_high = values[row + 1, column + 1] - values[row + 1, column]
    slope_x = slope_low + b * (slope_high - slope_low)
    return low + b * (high - low), slope_x / resolution, (high - low) / resolution


@register_jitable(forceinline=True)
def field_twist(field, x, y):
    """Returns the field's mixed second derivative d2f/dxdy, its only one within a cell."""
    values, resolution = field.costs, field.resolution
    along_x, along_y, is_between = _between_centres(field, x, y)
    if not is_between:
        return 0.0
    column, row = int(along_x), int(along_y)
    low = values[row, column + 1] - values[row, column]
    high = values[row + 1, column + 1] - values[row + 1, column]
    return (high - low) / (resolution * resolution)


@njit(cache=True)
def objective(situation, weights, sequence):
    """Returns (J, dJ/dsequence (N, 2)) of a sequence (N, 2)."""
    steps = sequence.shape[0]
    poses = poses_along(situation, sequence)
    gradient = np.zeros((steps, 2))
    value = _control_terms(situation, weights, sequence, gradient)
    at_x, at_y, at_yaw = 0.0, 0.0, 0.0
    end_x = poses[steps, 0] - situation.carrot[0]
    end_y = poses[steps, 1] - situation.carrot[1]
    distance = math.sqrt(end_x * end_x + end_y * end_y + CARROT_SMOOTHING_M**2)
    value += weights.progress * (distance - CARROT_SMOOTHING_M)
    at_x += weights.progress * end_x / distance
    at_y += weights.progress * end_y / distance
    for t in range(steps - 1, -1, -1):
        cost, by_x, by_y, by_yaw = pose_terms(situation, weights, t, poses[t + 1])
        value += cost / steps
        at_x += by_x / steps
        at_y += by_y / steps
        at_yaw += by_yaw / steps
        cosine, sine = math.cos(poses[t, 2]), math.sin(poses[t, 2])
        v = sequence[t, 0]
        gradient[t, 0] += situation.dt * (cosine * at_x + sine * at_y)
        gradient[t, 1] += situation.dt * at_yaw
        at_yaw += situation.dt * v * (cosine * at_y - sine * at_x)
    return value, gradient


@register_jitable
def poses_along(situation, sequence):
    """Returns the poses (N + 1, 3), the first one that of the robot."""
    steps = sequence.shape[0]
    poses = np.empty((steps + 1, 3))
    for k in range(3):
        poses[0, k] = situation.pose[k]
    for t in range(steps):
        v, w = sequence[t, 0], sequence[t, 1]
        yaw = poses[t, 2]
        poses[t + 1, 0] = poses[t, 0] + v * math.cos(yaw) * situation.dt
        poses[t + 1, 1] = poses[t, 1] + v * math.sin(yaw) * situation.dt
        poses[t + 1, 2] = yaw + w * situation.dt
    return poses


@register_jitable(forceinline=True)
def pose_terms(situation, weights, t, pose):
    """Returns the terms of one pose and their derivatives by x, y, yaw."""
    x, y, yaw = pose[0], pose[1], pose[2]
    reference = situation.references[t]
    sine, cosine = math.sin(reference[2]), math.cos(reference[2])
    lateral = -sine * (x - reference[0]) + cosine * (y - reference[1])
    turn = yaw - reference[2]
    cell, slope_x, slope_y = interpolate(situation.field, x, y)
    value = weights.path * lateral * lateral + weights.heading * (1.0 - math.cos(turn))
    value += weights.obstacle * cell * cell
    by_lateral = 2.0 * weights.path * lateral
    by_cell = 2.0 * weights.obstacle * cell
    by_x = -sine * by_lateral + by_cell * slope_x
    by_y = cosine * by_lateral + by_cell * slope_y
    return value, by_x, by_y, weights.heading * math.sin(turn)


@register_jitable
def _control_terms(situation, weights, sequence, gradient):
    """Adds the gradient of the deviation and jerk terms; returns their value."""
    steps = sequence.shape[0]
    value = 0.0
    for axis in range(2):
        deviation_weight = weights.linear_deviation if axis == 0 else weights.angular_deviation
        jerk_weight = weights.linear_jerk if axis == 0 else weights.angular_jerk
        dt_squared = situation.dt * situation.dt
        pull = deviation_weight / steps
        scale = jerk_weight / (steps * dt_squared * dt_squared)
        before = situation.earlier_speed[axis]
        now = situation.speed[axis]
        for t in range(steps):
            deviation = sequence[t, axis] - situation.sampled[t, axis]
            value += pull * deviation * deviation
            gradient[t, axis] += 2.0 * pull * deviation
            if t == 0 and situation.starts_now:
                now = sequence[t, axis]
                continue
            bend = sequence[t, axis] - 2.0 * now + before
            value += scale * bend * bend
            gradient[t, axis] += 2.0 * scale * bend
            if t >= 1:
                gradient[t - 1, axis] -= 4.0 * scale * bend
            if t >= 2:
                gradient[t - 2, axis] += 2.0 * scale * bend
            before, now = now, sequence[t, axis]
    return value


# Second derivatives by the polish's variables, the rules of `objective` differentiated once more:
# derivatives of the poses by the variables go forward along the roll-out, its adjoints backward;
# the bends of the roll-out enter with these. Exact but on the borders between cells, where the cost
# field's slopes jump.
@njit(cache=True, error_model="numpy")
def add_pose_curvature(situation, weights, sequence, spline, curvature):
    """Adds the second derivatives of pose and carrot terms to the lower triangle of `curvature`.

    curvature: (n, n). sequence: (N, 2). spline: (2 N, n), its derivatives by the variables, v and w
    in turn. The terms of the controls are quadratic, their second derivatives constant.
    """
    steps, count = sequence.shape[0], spline.shape[1]
    dt = situation.dt
    poses = poses_along(situation, sequence)
    adjoints = _position_adjoints(situation, weights, sequence, poses)
    by_x, by_y, by_yaw = np.zeros(count), np.zeros(count), np.zeros(count)
    for t in range(steps):
        by_v, by_w = spline[2 * t], spline[2 * t + 1]
        v, cosine, sine = sequence[t, 0], math.cos(poses[t, 2]), math.sin(poses[t, 2])
        along = dt * (cosine * adjoints[t, 0] + sine * adjoints[t, 1])
        across = dt * (cosine * adjoints[t, 1] - sine * adjoints[t, 0])
        for i in range(count):
            for j in range(i + 1):
                curvature[i, j] += across * (by_v[i] * by_yaw[j] + by_yaw[i] * by_v[j])
                curvature[i, j] -= along * v * by_yaw[i] * by_yaw[j]
        for i in range(count):
            by_x[i] += dt * (cosine * by_v[i] - v * sine * by_yaw[i])
            by_y[i] += dt * (sine * by_v[i] + v * cosine * by_yaw[i])
            by_yaw[i] += dt * by_w[i]
        xx, xy, yy, turn = _pose_curvature(situation, weights, t, poses[t + 1], steps)
        for i in range(count):
            along_x = xx * by_x[i] + xy * by_y[i]
            along_y = xy * by_x[i] + yy * by_y[i]
            for j in range(i + 1):
                curvature[i, j] += along_x * by_x[j] + along_y * by_y[j]
                curvature[i, j] += turn * by_yaw[i] * by_yaw[j]


@register_jitable(error_model="numpy")
def _position_adjoints(situation, weights, sequence, poses):
    """Returns (N, 2): derivatives of the objective by x and y of the pose behind each column."""
    steps = sequence.shape[0]
    adjoints = np.empty((steps, 2))
    end_x = poses[steps, 0] - situation.carrot[0]
    end_y = poses[steps, 1] - situation.carrot[1]
    distance = math.sqrt(end_x * end_x + end_y * end_y + CARROT_SMOOTHING_M**2)
    at_x, at_y = weights.progress * end_x / distance, weights.progress * end_y / distance
    for t in range(steps - 1, -1, -1):
        _, by_x, by_y, _ = pose_terms(situation, weights, t, poses[t + 1])
        at_x += by_x / steps
        at_y += by_y / steps
        adjoints[t, 0], adjoints[t, 1] = at_x, at_y
    return adjoints


@register_jitable(error_model="numpy", forceinline=True)
def _pose_curvature(situation, weights, t, pose, steps):
    """Returns the second derivatives of a pose's terms by (x, x), (x, y), (y, y) and (yaw, yaw)."""
    reference = situation.references[t]
    sine, cosine = math.sin(reference[2]), math.cos(reference[2])
    cell, slope_x, slope_y = interpolate(situation.field, pose[0], pose[1])
    path, obstacle = 2.0 * weights.path / steps, 2.0 * weights.obstacle / steps
    twist = field_twist(situation.field, pose[0], pose[1])
    xx = path * sine * sine + obstacle * slope_x * slope_x
    xy = -path * sine * cosine + obstacle * (slope_x * slope_y + cell * twist)
    yy = path * cosine * cosine + obstacle * slope_y * slope_y
    turn = weights.heading * math.cos(pose[2] - reference[2]) / steps
    if t == steps - 1:
        x, y = pose[0] - situation.carrot[0], pose[1] - situation.carrot[1]
        squared = x * x + y * y + CARROT_SMOOTHING_M**2
        pull = weights.progress / math.sqrt(squared)
        xx += pull * (1.0 - x * x / squared)
        xy -= pull * x * y / squared
        yy += pull * (1.0 - y * y / squared)
    return xx, xy, yy, turn
