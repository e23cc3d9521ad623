"""The objective of a band with its gradient, in one kernel.

The terms are TEB's where they carry TEB's weights; limits are no terms here, they are constraints.
Squared time steps (TEB's own time term) also keep the steps equal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.teb.arcs import band_geometry, band_rates
from drake_navbench.controllers.teb.layout import pose_columns, unpack_poses
from drake_navbench.kernels.distance_field import sample_distance


class Weights(NamedTuple):
    """Weights of the objective's terms; each term is a sum over the band.

    time: squared time steps. length: squared distances between poses. backwards: squared backward
    displacement. via_point: squared distance of via-points to their poses. inflation: squared
    shortfall of clearance below inflation_dist (m). smoothness: squared change of speed and of turn
    rate from one interval to the next. slack: price of a metre of missing clearance.
    """

    time: float
    length: float
    backwards: float
    via_point: float
    inflation: float
    inflation_dist: float
    smoothness: float
    slack: float


@register_jitable(forceinline=True)
def _add_to_pose(gradient, i, m, slope_x, slope_y, slope_yaw):
    """Adds the slopes of pose i to the gradient, unless the pose is given."""
    x, y, yaw = pose_columns(i, m)
    if x >= 0:
        gradient[x] += slope_x
        gradient[y] += slope_y
        gradient[yaw] += slope_yaw


@register_jitable
def _smoothness(rates, slopes, time_steps, weight, gradient):
    """Adds weight * sum of squared rate changes; slopes (m, 6) are those of rate * time step."""
    m = time_steps.shape[0]
    cost = 0.0
    for k in range(m):
        pull = 0.0
        if k > 0:
            change = rates[k] - rates[k - 1]
            cost += weight * change * change
            pull += 2.0 * weight * change
        if k < m - 1:
            pull -= 2.0 * weight * (rates[k + 1] - rates[k])
        scale = pull / time_steps[k]
        gradient[k] -= scale * rates[k]
        s = slopes[k]
        _add_to_pose(gradient, k, m, scale * s[0], scale * s[1], scale * s[2])
        _add_to_pose(gradient, k + 1, m, scale * s[3], scale * s[4], scale * s[5])
    return cost


@register_jitable
def _inflation(poses, discs, field, weights, gradient):
    """Adds the squared shortfall of each disc's clearance below the inflation distance."""
    m = poses.shape[0] - 1
    cost = 0.0
    for i in range(1, m):
        cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        for k in range(discs.shape[0]):
            arm_x, arm_y = discs[k, 0] * cos_yaw, discs[k, 0] * sin_yaw
            distance, slope_x, slope_y = sample_distance(
                field, poses[i, 0] + arm_x, poses[i, 1] + arm_y
            )
            shortfall = weights.inflation_dist - (distance - discs[k, 1])
            if shortfall > 0.0:
                cost += weights.inflation * shortfall * shortfall
                pull = -2.0 * weights.inflation * shortfall
                slope_yaw = slope_y * arm_x - slope_x * arm_y
                _add_to_pose(gradient, i, m, pull * slope_x, pull * slope_y, pull * slope_yaw)
    return cost


@njit(cache=True)
def band_objective(z, interval_count, scene, weights):
    """Returns (cost, gradient (N,)) at the variables z (N,)."""
    m = interval_count
    time_steps = z[:m]
    poses = unpack_poses(z, scene.start, scene.goal, m)
    gradient = np.zeros(z.shape[0])
    cost = weights.slack * z[-1]
    gradient[-1] = weights.slack
    for k in range(m):
        cost += weights.time * time_steps[k] * time_steps[k]
        gradient[k] += 2.0 * weights.time * time_steps[k]
        dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
        cost += weights.length * (dx * dx + dy * dy)
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        back = min(c * dx + s * dy, 0.0)
        cost += weights.backwards * back * back
        slope_x = 2.0 * (weights.length * dx + weights.backwards * back * c)
        slope_y = 2.0 * (weights.length * dy + weights.backwards * back * s)
        slope_yaw = 2.0 * weights.backwards * back * (c * dy - s * dx)
        _add_to_pose(gradient, k, m, -slope_x, -slope_y, slope_yaw)
        _add_to_pose(gradient, k + 1, m, slope_x, slope_y, 0.0)
    for j in range(scene.via_points.shape[0]):
        i = scene.via_poses[j]
        dx, dy = poses[i, 0] - scene.via_points[j, 0], poses[i, 1] - scene.via_points[j, 1]
        cost += weights.via_point * (dx * dx + dy * dy)
        _add_to_pose(
            gradient, i, m, 2.0 * weights.via_point * dx, 2.0 * weights.via_point * dy, 0.0
        )
    if weights.inflation > 0.0:
        cost += _inflation(poses, scene.discs, scene.field, weights, gradient)
    if weights.smoothness > 0.0:
        lengths, _, turns, length_slopes, _ = band_geometry(poses)
        speeds, turn_rates, turn_slopes = band_rates(lengths, turns, time_steps)
        weight = weights.smoothness
        cost += _smoothness(speeds, length_slopes, time_steps, weight, gradient)
        cost += _smoothness(turn_rates, turn_slopes, time_steps, weight, gradient)
    return cost, gradient
