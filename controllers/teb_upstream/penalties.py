"""What the optimiser minimises: teb_local_planner's edges with their slopes.

Every edge is a residual e with a weight w and adds w e^2. Formulas of teb_local_planner's
g2o_types (ros2-master); slopes are exact, where g2o takes most of them by central differences.
Columns: x, y, yaw of pose 0, time step 0, pose 1, time step 1, and so on, so that an edge between
neighbours fills consecutive columns. Those of the first and last pose are never solved for.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.teb_upstream.band import normalize
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel, model_distance

Array = NDArray[np.float64]

# Columns of a pose and its time step.
STRIDE = 4
# Steepness of the sign of the speed, 1/m.
SIGN_STEEPNESS = 100.0
# Rounding of a residual that lies on its kink.
KINK_WIDTH = 1e-12
# The preferred direction of turning holds for so many intervals.
PREFERRED_TURNS = 3

OBSTACLE_COST, VIA_POINT_COST, TIME_COST, OTHER_COST = 0, 1, 2, 3
COST_KINDS = 4


class Terms(NamedTuple):
    """Limits and weights of the edges, by teb_local_planner's names.

    Speeds m/s, rad/s, accelerations m/s^2, rad/s^2, distances m. is_carlike: the turning radius
    is bounded. obstacle_ratio_weight: of the speed limit near obstacles.
    """

    max_vel_x: float
    max_vel_x_backwards: float
    max_vel_theta: float
    acc_lim_x: float
    acc_lim_theta: float
    min_turning_radius: float
    is_carlike: bool
    exact_arc_length: bool
    penalty_epsilon: float
    min_obstacle_dist: float
    inflation_dist: float
    obstacle_cost_exponent: float
    proximity_ratio: float
    proximity_lower: float
    proximity_upper: float
    weight_max_vel_x: float
    weight_max_vel_theta: float
    weight_acc_lim_x: float
    weight_acc_lim_theta: float
    weight_kinematics_nh: float
    weight_kinematics_forward_drive: float
    weight_kinematics_turning_radius: float
    weight_optimaltime: float
    weight_shortest_path: float
    weight_obstacle: float
    weight_inflation: float
    weight_viapoint: float
    weight_prefer_rotdir: float
    weight_velocity_obstacle_ratio: float


class Surroundings(NamedTuple):
    """What one band meets in one cycle.

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


class System(NamedTuple):
    """The normal equations. matrix: (4 n - 1, 11), row r and column r - c. right: (4 n - 1,)."""

    matrix: Array
    right: Array


@njit(cache=True, error_model="numpy")
def _above(value):
    """Returns (the positive part of a value, its slope); the mean of both slopes at the kink.

    That is what central differences say there, and first guesses lie on it: they turn at the limit.
    """
    if value > KINK_WIDTH:
        return value, 1.0
    if value < -KINK_WIDTH:
        return 0.0, 0.0
    return max(value, 0.0), 0.5


@njit(cache=True, error_model="numpy")
def _inside(value, lower, upper, margin):
    """Returns (excess over an interval that is narrowed by a margin, its slope)."""
    if value < 0.5 * (lower + upper):
        excess, slope = _above(lower + margin - value)
        return excess, -slope
    return _above(value - (upper - margin))


@njit(cache=True, error_model="numpy")
def _add(system, first_column, slopes, count, residual, weight):
    """Adds one edge, whose slopes (count,) fill the columns from the first one on."""
    matrix, right = system
    for i in range(count):
        slope = weight * slopes[i]
        if slope == 0.0:
            continue
        row = first_column + i
        right[row] -= slope * residual
        for j in range(i + 1):
            matrix[row, i - j] += slope * slopes[j]


@njit(cache=True, error_model="numpy")
def _interval(first, second, cos_yaw, sin_yaw, exact_arc_length, slopes):
    """Returns (signed length m, turn rad, dx, dy, distance m) between two poses (3,).

    slopes: (6,) filled with those of the signed length by x, y, yaw of the first and the second.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    distance = math.sqrt(dx * dx + dy * dy)
    turn = normalize(second[2] - first[2])
    ratio, ratio_slope = 1.0, 0.0
    if exact_arc_length and turn != 0.0:
        sine = math.sin(0.5 * turn)
        ratio = abs(turn / (2.0 * sine))
        ratio_slope = ratio * (1.0 / turn - 0.5 * math.cos(0.5 * turn) / sine)
    along = dx * cos_yaw + dy * sin_yaw
    steep = SIGN_STEEPNESS * along
    sign = steep / (1.0 + abs(steep))
    sign_slope = SIGN_STEEPNESS / ((1.0 + abs(steep)) * (1.0 + abs(steep)))
    length = distance * ratio
    by_distance = sign * ratio / distance if distance > 0.0 else 0.0
    by_along = length * sign_slope
    by_turn = distance * ratio_slope * sign
    slopes[3] = by_distance * dx + by_along * cos_yaw
    slopes[4] = by_distance * dy + by_along * sin_yaw
    slopes[5] = by_turn
    slopes[0], slopes[1] = -slopes[3], -slopes[4]
    slopes[2] = by_along * (dy * cos_yaw - dx * sin_yaw) - by_turn
    return length * sign, turn, dx, dy, distance


@njit(cache=True, error_model="numpy")
def _add_intervals(poses, steps, count, terms, around, system, with_slopes, costs, motion):
    """Edges of single intervals: speeds, the arc condition, time, length, direction of turning.

    motion: (n, 8) filled with speed, turn rate and the six slopes of the signed length.
    """
    row = np.zeros(7)
    margin = terms.penalty_epsilon
    for i in range(count - 1):
        first, second, step = poses[i], poses[i + 1], steps[i]
        cos_0, sin_0 = math.cos(first[2]), math.sin(first[2])
        cos_1, sin_1 = math.cos(second[2]), math.sin(second[2])
        slopes = motion[i, 2:]
        length, turn, dx, dy, distance = _interval(
            first, second, cos_0, sin_0, terms.exact_arc_length, slopes
        )
        speed, rate = length / step, turn / step
        motion[i, 0], motion[i, 1] = speed, rate
        column = STRIDE * i

        excess, side = _inside(speed, -terms.max_vel_x_backwards, terms.max_vel_x, margin)
        if side != 0.0:
            costs[OTHER_COST] += terms.weight_max_vel_x * excess * excess
            if with_slopes:
                _fill_speed_row(row, slopes, side, step, speed)
                _add(system, column, row, 7, excess, terms.weight_max_vel_x)
        excess, side = _inside(rate, -terms.max_vel_theta, terms.max_vel_theta, margin)
        if side != 0.0:
            costs[OTHER_COST] += terms.weight_max_vel_theta * excess * excess
            if with_slopes:
                row[:] = 0.0
                row[2], row[3], row[6] = -side / step, -side * rate / step, side / step
                _add(system, column, row, 7, excess, terms.weight_max_vel_theta)

        # The arc condition: both headings touch one circle.
        arc = (cos_0 + cos_1) * dy - (sin_0 + sin_1) * dx
        costs[OTHER_COST] += terms.weight_kinematics_nh * arc * arc
        if with_slopes and arc != 0.0:
            row[0], row[1], row[2] = sin_0 + sin_1, -(cos_0 + cos_1), -sin_0 * dy - cos_0 * dx
            row[3] = 0.0
            row[4], row[5], row[6] = -row[0], -row[1], -sin_1 * dy - cos_1 * dx
            _add(system, column, row, 7, arc, terms.weight_kinematics_nh)
        if terms.is_carlike:
            _add_turning_radius(
                column, dx, dy, distance, turn, terms, system, with_slopes, costs, row
            )
        else:
            along = dx * cos_0 + dy * sin_0
            if along < 0.0:
                costs[OTHER_COST] += terms.weight_kinematics_forward_drive * along * along
                if with_slopes:
                    row[0], row[1], row[2] = cos_0, sin_0, sin_0 * dx - cos_0 * dy
                    row[3] = 0.0
                    row[4], row[5], row[6] = -cos_0, -sin_0, 0.0
                    _add(system, column, row, 7, -along, terms.weight_kinematics_forward_drive)

        costs[TIME_COST] += terms.weight_optimaltime * step * step
        if with_slopes:
            system.matrix[column + 3, 0] += terms.weight_optimaltime
            system.right[column + 3] -= terms.weight_optimaltime * step
        if terms.weight_shortest_path > 0.0:
            costs[OTHER_COST] += terms.weight_shortest_path * distance * distance
            if with_slopes and distance > 0.0:
                row[:] = 0.0
                row[4], row[5] = dx / distance, dy / distance
                row[0], row[1] = -row[4], -row[5]
                _add(system, column, row, 7, distance, terms.weight_shortest_path)
        if i < PREFERRED_TURNS and around.preferred_turn * turn < 0.0:
            costs[OTHER_COST] += terms.weight_prefer_rotdir * turn * turn
            if with_slopes:
                row[:] = 0.0
                row[2], row[6] = around.preferred_turn, -around.preferred_turn
                _add(system, column, row, 7, abs(turn), terms.weight_prefer_rotdir)


@njit(cache=True, error_model="numpy")
def _fill_speed_row(row, slopes, side, step, speed):
    """Fills (7,) with the slopes of side * speed by two poses and the time step between them."""
    scale = side / step
    for k in range(3):
        row[k] = scale * slopes[k]
        row[4 + k] = scale * slopes[3 + k]
    row[3] = -side * speed / step


@njit(cache=True, error_model="numpy")
def _add_turning_radius(column, dx, dy, distance, turn, terms, system, with_slopes, costs, row):
    """The edge of a car: a turning radius of at least min_turning_radius."""
    if turn == 0.0:
        return
    half_sine = math.sin(0.5 * turn)
    arc = 2.0 * abs(half_sine) if terms.exact_arc_length else abs(turn)
    missing = terms.min_turning_radius - distance / arc
    if missing <= 0.0:
        return
    costs[OTHER_COST] += terms.weight_kinematics_turning_radius * missing * missing
    if with_slopes:
        by_turn = math.copysign(distance, turn) / (arc * arc)
        if terms.exact_arc_length:
            by_turn *= math.cos(0.5 * turn)
        row[:] = 0.0
        if distance > 0.0:
            row[0], row[1] = dx / (distance * arc), dy / (distance * arc)
            row[4], row[5] = -row[0], -row[1]
        row[2], row[6] = -by_turn, by_turn
        _add(system, column, row, 7, missing, terms.weight_kinematics_turning_radius)


@njit(cache=True, error_model="numpy")
def _add_accelerations(steps, count, terms, around, system, with_slopes, costs, motion):
    """Edges of accelerations: at the start, between intervals, at the goal.

    The first and last one divide by the whole step, those between by half of two: the original's.
    """
    row = np.zeros(11)
    margin = terms.penalty_epsilon
    for axis in range(2):
        limit = terms.acc_lim_x if axis == 0 else terms.acc_lim_theta
        weight = terms.weight_acc_lim_x if axis == 0 else terms.weight_acc_lim_theta
        for i in range(-1, count - 1):
            if i == count - 2 and not around.stops_at_goal:
                continue
            before = motion[i, axis] if i >= 0 else around.start_twist[axis]
            after = motion[i + 1, axis] if i < count - 2 else 0.0
            if i < 0:
                span = steps[0]
            elif i == count - 2:
                span = steps[i]
            else:
                span = 0.5 * (steps[i] + steps[i + 1])
            acceleration = (after - before) / span
            excess, side = _inside(acceleration, -limit, limit, margin)
            if side == 0.0:
                continue
            costs[OTHER_COST] += weight * excess * excess
            if not with_slopes:
                continue
            row[:] = 0.0
            # Slopes of the span: by each step that it is made of.
            share = 0.5 if 0 <= i < count - 2 else 1.0
            if i >= 0:
                scale = -side / (steps[i] * span)
                if axis == 0:
                    for k in range(3):
                        row[k] += scale * motion[i, 2 + k]
                        row[4 + k] += scale * motion[i, 5 + k]
                else:
                    row[2] -= scale
                    row[6] += scale
                row[3] = side * (before / steps[i] - share * acceleration) / span
            if i < count - 2:
                scale = side / (steps[i + 1] * span)
                if axis == 0:
                    for k in range(3):
                        row[4 + k] += scale * motion[i + 1, 2 + k]
                        row[8 + k] += scale * motion[i + 1, 5 + k]
                else:
                    row[6] -= scale
                    row[10] += scale
                row[7] = -side * (after / steps[i + 1] + share * acceleration) / span
            first = 4 if i < 0 else 0
            last = 7 if i == count - 2 else 11
            _add(system, STRIDE * i + first, row[first:last], last - first, excess, weight)


@njit(cache=True, error_model="numpy")
def _add_obstacles(
    poses, steps, terms, around, attached, multiplier, system, with_slopes, costs, motion
):
    """Edges of obstacles: distance, inflation, and the speed near them."""
    row = np.zeros(7)
    reach = max(terms.min_obstacle_dist + terms.penalty_epsilon, terms.inflation_dist)
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
            excess, slope = _above(terms.min_obstacle_dist + terms.penalty_epsilon - distance)
            weight = multiplier * terms.weight_obstacle
            if slope > 0.0:
                exponent = terms.obstacle_cost_exponent
                if exponent != 1.0 and terms.min_obstacle_dist > 0.0:
                    share = excess / terms.min_obstacle_dist
                    slope *= exponent * share ** (exponent - 1.0)
                    excess = terms.min_obstacle_dist * share**exponent
                costs[OBSTACLE_COST] += weight * excess * excess
                if with_slopes:
                    row[0], row[1], row[2] = -slope * by_x, -slope * by_y, -slope * by_yaw
                    _add(system, column, row, 3, excess, weight)
            excess, slope = _above(terms.inflation_dist - distance)
            if is_inflated and slope > 0.0:
                weight = terms.weight_inflation
                costs[OBSTACLE_COST] += weight * excess * excess
                if with_slopes:
                    row[0], row[1], row[2] = -slope * by_x, -slope * by_y, -slope * by_yaw
                    _add(system, column, row, 3, excess, weight)
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
        excess, side = _inside(value, -ratio * limit, ratio * limit, 0.0)
        if side == 0.0:
            continue
        costs[OTHER_COST] += weight * excess * excess
        if with_slopes:
            if axis == 0:
                _fill_speed_row(row, motion[i, 2:], side, step, value)
            else:
                row[:] = 0.0
                row[2], row[3], row[6] = -side / step, -side * value / step, side / step
            for k in range(3):
                row[k] -= limit * ratio_slope * gradient[k]
            _add(system, STRIDE * i, row, 7, excess, weight)


@njit(cache=True, error_model="numpy")
def _add_via_points(poses, terms, around, attached, system, with_slopes, costs):
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
            _add(system, STRIDE * i, row, 3, distance, terms.weight_viapoint)


@njit(cache=True, error_model="numpy")
def add_edges(
    poses, steps, count, terms, around, attached, multiplier, system, with_slopes, costs, motion
):
    """Fills `costs` (COST_KINDS,) and, where asked for, the normal equations.

    poses (C, 3), steps (C,): the first `count` poses are the band's. multiplier: of the weight of
    obstacles. motion: (C, 8) scratch.
    """
    costs[:] = 0.0
    if with_slopes:
        system.matrix[: STRIDE * count] = 0.0
        system.right[: STRIDE * count] = 0.0
    _add_intervals(poses, steps, count, terms, around, system, with_slopes, costs, motion)
    _add_accelerations(steps, count, terms, around, system, with_slopes, costs, motion)
    _add_obstacles(
        poses, steps, terms, around, attached, multiplier, system, with_slopes, costs, motion
    )
    _add_via_points(poses, terms, around, attached, system, with_slopes, costs)
