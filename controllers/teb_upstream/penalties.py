"""The penalties that the optimiser minimises: teb_local_planner's edges with their slopes.

Every edge is a residual e with a weight w and adds w e^2. Formulas of teb_local_planner's
g2o_types (ros2-master); slopes are exact, where g2o takes most of them by central differences.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb_upstream.motion_edges import (
    add_accelerations,
    add_intervals,
    fill_speed_row,
)
from drake_navbench.controllers.teb_upstream.normal_equations import (
    DIFFERENCE,
    KINK_REACH,
    OBSTACLE_COST,
    OTHER_COST,
    STRIDE,
    VIA_POINT_COST,
    add_edge,
    add_magnitude,
    add_penalty,
    excess_outside,
)
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel, model_distance
from drake_navbench.kernels.arrays import Array


class BandSurroundings(NamedTuple):
    """The surroundings of one band in one cycle.

    start_twist: (2,) v m/s, w rad/s. stops_at_goal: the band ends at rest. preferred_turn: 1 left,
    -1 right, 0 neither. obstacles: (N, 2) m. via_points: (V, 2) m. robot: the robot's shape.
    """

    start_twist: Array
    stops_at_goal: bool
    preferred_turn: float
    obstacles: Array
    via_points: Array
    robot: RobotModel


class Attached(NamedTuple):
    """Which poses feel which obstacles and via-points, until the next rebuild of the edges.

    obstacle_poses, obstacles: (P,) index pairs; of pose 0 they only limit the speed. via_poses:
    (V,) index of the pose, or -1.
    """

    obstacle_poses: NDArray[np.int64]
    obstacles: NDArray[np.int64]
    via_poses: NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def add_edges(poses, steps, count, record, around, attached, multiplier, system):
    """Fills the costs and the motion of the system and, if wanted, its normal equations.

    poses (C, 3), steps (C,): the first `count` poses are the band's. record: (1,) the parameters'
    `kernel_record`. multiplier: factor on the weight of obstacles.
    """
    terms = record[0]
    system.costs[:] = 0.0
    if system.with_slopes:
        system.matrix[: STRIDE * count] = 0.0
        system.right[: STRIDE * count] = 0.0
    add_intervals(poses, steps, count, terms, around, system)
    add_accelerations(steps, count, terms, around, system)
    add_obstacles(poses, steps, terms, around, attached, multiplier, system)
    add_via_points(poses, terms, around, attached, system)


@register_jitable(error_model="numpy")
def add_obstacles(poses, steps, terms, around, attached, multiplier, system):
    """Edges of obstacles: distance, inflation, and the speed near them."""
    with_slopes, costs = system.with_slopes, system.costs
    row = np.zeros(7)
    least_dist = terms.min_obstacle_dist + terms.penalty_epsilon
    reach = max(least_dist, terms.inflation_dist)
    limits_speed = terms.weight_velocity_obstacle_ratio > 0.0
    is_inflated = terms.inflation_dist > terms.min_obstacle_dist
    last_pose = -1
    cos_yaw = sin_yaw = 0.0
    for k in range(attached.obstacles.shape[0]):
        i, index = attached.obstacle_poses[k], attached.obstacles[k]
        pose = poses[i]
        if i != last_pose:
            cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
            last_pose = i
        point = around.obstacles[index]
        if not limits_speed:
            far = around.robot.reach + reach
            dx, dy = point[0] - pose[0], point[1] - pose[1]
            if dx * dx + dy * dy > far * far:
                continue
        distance, by_x, by_y, by_yaw = model_distance(
            around.robot, pose[0], pose[1], cos_yaw, sin_yaw, point[0], point[1]
        )
        column = STRIDE * i
        if i > 0:
            missing = least_dist - distance
            weight = multiplier * terms.weight_obstacle
            if missing > -KINK_REACH:
                slope = 1.0
                if terms.obstacle_cost_exponent != 1.0 and terms.min_obstacle_dist > 0.0:
                    missing, slope = _bent(missing, terms)
                costs[OBSTACLE_COST] += weight * max(missing, 0.0) ** 2
                if with_slopes:
                    row[0], row[1], row[2] = -slope * by_x, -slope * by_y, -slope * by_yaw
                    add_penalty(system, column, row, 3, missing, weight)
            missing = terms.inflation_dist - distance
            if is_inflated and missing > -KINK_REACH:
                weight = terms.weight_inflation
                costs[OBSTACLE_COST] += weight * max(missing, 0.0) ** 2
                if with_slopes:
                    row[0], row[1], row[2] = -by_x, -by_y, -by_yaw
                    add_penalty(system, column, row, 3, missing, weight)
        if limits_speed:
            gradient = by_x, by_y, by_yaw
            _add_speed_near_obstacle(i, steps[i], distance, gradient, terms, system, row)


@register_jitable(error_model="numpy")
def _bent(missing, terms):
    """Returns (missing distance raised to the exponent, in m, and its slope); zero outside."""
    if missing <= 0.0:
        return 0.0, 0.0
    exponent, wanted = terms.obstacle_cost_exponent, terms.min_obstacle_dist
    share = missing / wanted
    return wanted * share**exponent, exponent * share ** (exponent - 1.0)


@register_jitable(error_model="numpy")
def _add_speed_near_obstacle(i, step, distance, gradient, terms, system, row):
    """Edges that slow the robot down near an obstacle that pose i is attached to."""
    with_slopes, costs, motion = system.with_slopes, system.costs, system.motion
    lower, upper = terms.obstacle_proximity_lower_bound, terms.obstacle_proximity_upper_bound
    ratio, ratio_slope = 1.0, 0.0
    if distance < lower:
        ratio = 0.0
    elif distance <= upper:
        ratio, ratio_slope = (distance - lower) / (upper - lower), 1.0 / (upper - lower)
    ratio *= terms.obstacle_proximity_ratio_max_vel
    ratio_slope *= terms.obstacle_proximity_ratio_max_vel
    weight = terms.weight_velocity_obstacle_ratio
    for axis in range(2):
        limit = terms.max_vel_x if axis == 0 else terms.max_vel_theta
        value = motion[i, axis]
        excess, side = excess_outside(value, -ratio * limit, ratio * limit, 0.0)
        if excess < -KINK_REACH:
            continue
        costs[OTHER_COST] += weight * max(excess, 0.0) ** 2
        if with_slopes:
            if axis == 0:
                fill_speed_row(row, motion[i, 2:], side, step, value)
            else:
                row[:] = 0.0
                row[2], row[3], row[6] = -side / step, -side * value / step, side / step
            for k in range(3):
                row[k] -= limit * ratio_slope * gradient[k]
            if ratio == 0.0:
                # No speed is allowed at all, so that every one of either sign costs.
                add_magnitude(system, STRIDE * i, row, 7, excess, weight)
            else:
                add_penalty(system, STRIDE * i, row, 7, excess, weight)


@register_jitable(error_model="numpy")
def add_via_points(poses, terms, around, attached, system):
    with_slopes, costs = system.with_slopes, system.costs
    row = np.zeros(3)
    for k in range(attached.via_poses.shape[0]):
        i = attached.via_poses[k]
        if i < 0:
            continue
        dx, dy = poses[i, 0] - around.via_points[k, 0], poses[i, 1] - around.via_points[k, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        costs[VIA_POINT_COST] += terms.weight_viapoint * distance * distance
        if with_slopes and distance > 0.0:
            row[0], row[1] = dx / distance, dy / distance
            if distance < KINK_REACH:
                # Via-points are poses of the plan, from which first guesses are made as well.
                row[0] = _difference_of_length(dx, dy)
                row[1] = _difference_of_length(dy, dx)
            add_edge(system, STRIDE * i, row, 3, distance, terms.weight_viapoint)


@register_jitable(error_model="numpy")
def _difference_of_length(along, across):
    """Returns the slope of a length (along m, across m) as g2o's central differences have it."""
    ahead = math.hypot(along + DIFFERENCE, across)
    behind = math.hypot(along - DIFFERENCE, across)
    return (ahead - behind) / (2.0 * DIFFERENCE)
