"""Second derivatives of the polish's objective by its variables.

The rules of `objective` differentiated once more: derivatives of the poses by the variables go
forward along the roll-out, its adjoints backward; the bends of the roll-out enter with these.
Exact but on the borders between cells, where the cost field's slopes jump.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.mppi.objective import (
    CARROT_SMOOTHING_M,
    field_twist,
    interpolate,
    pose_terms,
    poses_along,
)


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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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
