"""Edges between a band and the obstacles and via-points near it.

`terms`, `around` and `attached` are those of `penalties`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.teb_upstream.motion_edges import fill_speed_row
from drake_navbench.controllers.teb_upstream.normal_equations import (
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
from drake_navbench.controllers.teb_upstream.robot_models import model_distance


@njit(cache=True, error_model="numpy")
def add_obstacles(
    poses, steps, terms, around, attached, multiplier, system, with_slopes, costs, motion
):
    """Edges of obstacles: distance, inflation, and the speed near them."""
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
            _add_speed_near_obstacle(
                i,
                steps[i],
                distance,
                (by_x, by_y, by_yaw),
                terms,
                system,
                with_slopes,
                costs,
                motion,
                row,
            )


@njit(cache=True, error_model="numpy")
def _bent(missing, terms):
    """Returns (missing distance raised to the exponent, in m, and its slope); zero outside."""
    if missing <= 0.0:
        return 0.0, 0.0
    exponent, wanted = terms.obstacle_cost_exponent, terms.min_obstacle_dist
    share = missing / wanted
    return wanted * share**exponent, exponent * share ** (exponent - 1.0)


@njit(cache=True, error_model="numpy")
def _add_speed_near_obstacle(
    i, step, distance, gradient, terms, system, with_slopes, costs, motion, row
):
    """Edges that slow the robot down near an obstacle that pose i is attached to."""
    ramp = terms.proximity_upper - terms.proximity_lower
    ratio, ratio_slope = 1.0, 0.0
    if distance < terms.proximity_lower:
        ratio = 0.0
    elif distance <= terms.proximity_upper:
        ratio, ratio_slope = (distance - terms.proximity_lower) / ramp, 1.0 / ramp
    ratio *= terms.proximity_ratio
    ratio_slope *= terms.proximity_ratio
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


@njit(cache=True, error_model="numpy")
def add_via_points(poses, terms, around, attached, system, with_slopes, costs):
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
            add_edge(system, STRIDE * i, row, 3, distance, terms.weight_viapoint)
