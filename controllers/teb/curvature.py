"""Second derivatives of a band's Lagrangian, as a band matrix: the columns of a pose lie together.

Rates and accelerations are functions of each interval's arc length, turn and time step, whose
second derivatives are exact here, and so are those of the arcs and of the distance field. Backward
motion alone has the curvature of Gauss and Newton's method.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb.arcs import arc_curvature, arc_ratio, band_geometry, band_rates
from drake_navbench.controllers.teb.layout import pose_columns, unpack_poses, variable_count
from drake_navbench.controllers.teb.predicted import field_of
from drake_navbench.kernels.distance_field import sample_curvature, sample_distance

# Unknowns that belong to an interval: its time step and the pose at its end.
STRIDE = 4
# The quantities that an interval's rows are functions of.
LENGTH, TURN, TIME = range(3)
# Distances that the Lagrangian depends on by less have no curvature worth the look-up.
LEAST_PULL = 1e-6


def band_positions(interval_count: int) -> NDArray[np.int64]:
    """Returns (N,) each column's index in the band matrix; -1 for the slack, which is beside it.

    Time step k lies at 4 k, the inner pose i at 4 i - 3.
    """
    m = interval_count
    positions = np.full(variable_count(m), -1)
    positions[:m] = STRIDE * np.arange(m)
    for i in range(1, m):
        first = STRIDE * (i - 1) + 1
        positions[list(pose_columns(i, m))] = first, first + 1, first + 2
    return positions


@register_jitable
def _rate_curvature(path, rates, steps, ends, multipliers, pulls, weight, blocks):
    """Adds the second derivatives by path and time of all terms in one kind of rate.

    path: LENGTH or TURN. rates: (m,). ends: the rates before and after the band. multipliers:
    (m + 1,) of the accelerations. pulls: (m,) slopes of the Lagrangian by each rate from all other
    terms; those of the accelerations and of the smoothness are added to it. weight: weight of the
    smoothness. blocks: own (m, 3, 3) and coupled (m, 3, 3), of each interval, and of the interval
    before (first index) with it.
    """
    (start, end), (own, coupled) = ends, blocks
    m = rates.shape[0]
    for k in range(m + 1):
        has_before, has_after = k > 0, k < m
        before = rates[k - 1] if has_before else start
        after = rates[k] if has_after else end
        span = 0.5 * ((steps[k - 1] if has_before else 0.0) + (steps[k] if has_after else 0.0))
        slope = multipliers[k] / span
        bend = 0.5 * slope / span
        time_bend = bend * (after - before) / span
        smooth = 2.0 * weight if has_before and has_after else 0.0
        if has_before:
            step = steps[k - 1]
            pulls[k - 1] += -slope - smooth * (after - before)
            own[k - 1, path, path] += smooth / (step * step)
            own[k - 1, path, TIME] += bend / step - smooth * before / (step * step)
            own[k - 1, TIME, TIME] += (
                time_bend - 2.0 * bend * before / step + smooth * before * before / (step * step)
            )
        if has_after:
            step = steps[k]
            pulls[k] += slope + smooth * (after - before)
            own[k, path, path] += smooth / (step * step)
            own[k, path, TIME] += -bend / step - smooth * after / (step * step)
            own[k, TIME, TIME] += (
                time_bend + 2.0 * bend * after / step + smooth * after * after / (step * step)
            )
        if has_before and has_after:
            first, second = steps[k - 1], steps[k]
            joint = smooth / (first * second)
            coupled[k, path, path] -= joint
            coupled[k, path, TIME] += bend / first + joint * after
            coupled[k, TIME, path] += -bend / second + joint * before
            coupled[k, TIME, TIME] += (
                time_bend - bend * before / first + bend * after / second - joint * before * after
            )
    for k in range(m):
        squared = steps[k] * steps[k]
        own[k, path, TIME] -= pulls[k] / squared
        own[k, TIME, TIME] += 2.0 * pulls[k] * rates[k] / squared
        # How the Lagrangian grows with the path itself.
        pulls[k] /= steps[k]


@register_jitable
def _arc_bends(first, second, length_weight, offset_weight, bends):
    """Fills (6, 6) with weighted second derivatives of arc length and offset between two poses."""
    dx, dy = second[0] - first[0], second[1] - first[1]
    delta = second[2] - first[2]
    mean_yaw = 0.5 * (first[2] + second[2])
    c, s = math.cos(mean_yaw), math.sin(mean_yaw)
    along, offset = c * dx + s * dy, -s * dx + c * dy
    q, q_slope = arc_ratio(delta)
    # By displacement along x and y, mean yaw and turn.
    x_yaw = -length_weight * q * s - offset_weight * c
    y_yaw = length_weight * q * c - offset_weight * s
    x_turn, y_turn = length_weight * q_slope * c, length_weight * q_slope * s
    yaw_yaw = -length_weight * q * along - offset_weight * offset
    yaw_turn = length_weight * q_slope * offset
    turn_turn = length_weight * arc_curvature(delta) * along
    # The mean yaw is half of either yaw, the turn their difference.
    for i in range(6):
        for j in range(6):
            bends[i, j] = 0.0
    for pose in range(2):
        sign = -1.0 if pose == 0 else 1.0
        for yaw in range(2):
            turn_sign = -1.0 if yaw == 0 else 1.0
            x_slope = sign * (0.5 * x_yaw + turn_sign * x_turn)
            y_slope = sign * (0.5 * y_yaw + turn_sign * y_turn)
            bends[3 * pose, 3 * yaw + 2] = bends[3 * yaw + 2, 3 * pose] = x_slope
            bends[3 * pose + 1, 3 * yaw + 2] = bends[3 * yaw + 2, 3 * pose + 1] = y_slope
    bends[2, 2] = 0.25 * yaw_yaw - yaw_turn + turn_turn
    bends[5, 5] = 0.25 * yaw_yaw + yaw_turn + turn_turn
    bends[2, 5] = bends[5, 2] = 0.25 * yaw_yaw - turn_turn


@register_jitable
def add_outer(matrix, places, slopes, count, weight):
    """Adds weight * slopes slopes^T at the places (count,) of the lower band matrix; -1: none."""
    for i in range(count):
        if places[i] < 0:
            continue
        for j in range(count):
            if 0 <= places[j] <= places[i]:
                matrix[places[i], places[i] - places[j]] += weight * slopes[i] * slopes[j]


@register_jitable
def _multiply(left, right, product):
    """Fills the product of (3, 3) and (3, 7)."""
    for i in range(3):
        for j in range(7):
            product[i, j] = (
                left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]
            )


@register_jitable
def _interval_places(k, m, positions, places):
    """Fills (7,) positions of the poses before and after interval k and of its time step."""
    for pose in range(2):
        columns = pose_columns(k + pose, m)
        for axis in range(3):
            column = columns[axis]
            places[3 * pose + axis] = positions[column] if column >= 0 else -1
    places[6] = positions[k]


@register_jitable
def _add_pose_terms(poses, scene, weights, positions, matrix):
    """Adds the curvature of the length, of backward motion and of via-points."""
    m = poses.shape[0] - 1
    places, slopes = np.empty(7, dtype=np.int64), np.zeros(7)
    for k in range(m):
        _interval_places(k, m, positions, places)
        if weights.length > 0.0:
            for axis in range(2):
                for i in range(6):
                    slopes[i] = 0.0
                slopes[axis], slopes[3 + axis] = -1.0, 1.0
                add_outer(matrix, places, slopes, 6, 2.0 * weights.length)
        dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        if c * dx + s * dy < 0.0:
            slopes[0], slopes[1], slopes[2] = -c, -s, c * dy - s * dx
            slopes[3], slopes[4], slopes[5] = c, s, 0.0
            add_outer(matrix, places, slopes, 6, 2.0 * weights.backwards)
    for j in range(scene.via_points.shape[0]):
        x, y, _ = pose_columns(scene.via_poses[j], m)
        matrix[positions[x], 0] += 2.0 * weights.via_point
        matrix[positions[y], 0] += 2.0 * weights.via_point


@register_jitable
def _add_distance_bends(field, point, arm, pull, slope, places, matrix):
    """Adds pull times the curvature of the distance at a point, by x, y and yaw of the pose.

    arm: from the pose to the point, m. slope: slope of the distance by x and y of the point.
    """
    (x, y), (arm_x, arm_y), (slope_x, slope_y) = point, arm, slope
    by_xx, by_xy, by_yy = sample_curvature(field, x, y)
    x_yaw = -by_xx * arm_y + by_xy * arm_x
    y_yaw = -by_xy * arm_y + by_yy * arm_x
    yaw_yaw = -x_yaw * arm_y + y_yaw * arm_x - slope_x * arm_x - slope_y * arm_y
    matrix[places[0], 0] += pull * by_xx
    matrix[places[1], 0] += pull * by_yy
    matrix[places[2], 0] += pull * yaw_yaw
    # x, y and yaw of a pose lie next to each other.
    matrix[places[1], 1] += pull * by_xy
    matrix[places[2], 2] += pull * x_yaw
    matrix[places[2], 1] += pull * y_yaw


@register_jitable
def _add_clearance_terms(poses, scene, weights, multipliers, positions, matrix):
    """Adds the curvature of the clearance rows, by their multipliers, and of the inflation."""
    places, slopes = np.empty(3, dtype=np.int64), np.zeros(3)
    row = 0
    for i in range(1, poses.shape[0] - 1):
        columns = pose_columns(i, poses.shape[0] - 1)
        for axis in range(3):
            places[axis] = positions[columns[axis]]
        cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        for k in range(scene.discs.shape[0]):
            arm_x, arm_y = scene.discs[k, 0] * cos_yaw, scene.discs[k, 0] * sin_yaw
            x, y = poses[i, 0] + arm_x, poses[i, 1] + arm_y
            distance, slope_x, slope_y = sample_distance(scene.field, x, y)
            shortfall = weights.inflation_dist - (distance - scene.discs[k, 1])
            # By how much the Lagrangian grows with the distance.
            pull = multipliers[row]
            row += 1
            if weights.inflation > 0.0 and shortfall > 0.0:
                pull -= 2.0 * weights.inflation * shortfall
                slopes[0], slopes[1] = slope_x, slope_y
                slopes[2] = slope_y * arm_x - slope_x * arm_y
                add_outer(matrix, places, slopes, 3, 2.0 * weights.inflation)
            if abs(pull) >= LEAST_PULL:
                arm, slope = (arm_x, arm_y), (slope_x, slope_y)
                _add_distance_bends(scene.field, (x, y), arm, pull, slope, places, matrix)


@register_jitable
def _add_moving_clearance_terms(poses, scene, multipliers, positions, matrix):
    """Adds the curvature of the moving obstacles' clearance rows, by their multipliers."""
    places = np.empty(3, dtype=np.int64)
    encounters = scene.encounters
    row = 0
    for i in range(1, encounters.things.shape[0] + 1):
        columns = pose_columns(i, poses.shape[0] - 1)
        for axis in range(3):
            places[axis] = positions[columns[axis]]
        field = field_of(encounters.fields, encounters.things[i - 1])
        cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        for k in range(scene.discs.shape[0]):
            pull = multipliers[row]
            row += 1
            if abs(pull) < LEAST_PULL:
                continue
            arm_x, arm_y = scene.discs[k, 0] * cos_yaw, scene.discs[k, 0] * sin_yaw
            x = poses[i, 0] - encounters.shifts[i - 1, 0] + arm_x
            y = poses[i, 1] - encounters.shifts[i - 1, 1] + arm_y
            _, slope_x, slope_y = sample_distance(field, x, y)
            arm, slope = (arm_x, arm_y), (slope_x, slope_y)
            _add_distance_bends(field, (x, y), arm, pull, slope, places, matrix)


@register_jitable
def _rate_pulls(multipliers, scene, m):
    """Returns (m,) and (m,) by how much the rows that bound rates grow with speed and turn rate."""
    speed_pulls = multipliers[m : 2 * m].copy()
    turn_pulls = multipliers[2 * m : 3 * m].copy()
    if scene.turning_radius > 0.0:
        first = multipliers.shape[0] - 2 * m
        for k in range(m):
            left, right = multipliers[first + 2 * k], multipliers[first + 2 * k + 1]
            speed_pulls[k] += scene.directions[k] * (left + right)
            turn_pulls[k] += scene.turning_radius * (right - left)
    return speed_pulls, turn_pulls


@register_jitable
def _add_interval_terms(
    poses,
    length_slopes,
    speed_pulls,
    offset_multipliers,
    time_weight,
    blocks,
    positions,
    matrix,
):
    """Adds the second derivatives of the intervals' terms to the matrix, by the unknowns.

    blocks: own and coupled derivatives by length, turn and time, see `_rate_curvature`.
    speed_pulls, offset_multipliers: (m,) the slopes of the Lagrangian by arc length and by offset,
    which are themselves curved.
    """
    own, coupled = blocks
    m = own.shape[0]
    bends, inner = np.empty((6, 6)), np.empty((3, 7))
    slopes, before = np.zeros((3, 7)), np.zeros((3, 7))
    places, places_before = np.empty(7, dtype=np.int64), np.empty(7, dtype=np.int64)
    for k in range(m):
        _interval_places(k, m, positions, places)
        own[k, TIME, LENGTH], own[k, TIME, TURN] = own[k, LENGTH, TIME], own[k, TURN, TIME]
        own[k, TIME, TIME] += 2.0 * time_weight
        for i in range(6):
            slopes[LENGTH, i] = length_slopes[k, i]
        slopes[TURN, 2], slopes[TURN, 5], slopes[TIME, 6] = -1.0, 1.0, 1.0
        _arc_bends(poses[k], poses[k + 1], speed_pulls[k], offset_multipliers[k], bends)
        _multiply(own[k], slopes, inner)
        for i in range(7):
            for j in range(7):
                if places[j] < 0 or places[i] < places[j]:
                    continue
                value = bends[i, j] if i < 6 and j < 6 else 0.0
                for a in range(3):
                    value += slopes[a, i] * inner[a, j]
                matrix[places[i], places[i] - places[j]] += value
        if k > 0:
            _multiply(coupled[k], slopes, inner)
            for i in range(7):
                for j in range(7):
                    row, column = places_before[i], places[j]
                    if row < 0 or column < 0:
                        continue
                    value = 0.0
                    for a in range(3):
                        value += before[a, i] * inner[a, j]
                    if row == column:
                        matrix[row, 0] += 2.0 * value
                    else:
                        matrix[max(row, column), abs(row - column)] += value
        for i in range(7):
            places_before[i] = places[i]
            for a in range(3):
                before[a, i] = slopes[a, i]


@njit(cache=True)
def add_lagrangian_curvature(z, interval_count, scene, weights, multipliers, positions, matrix):
    """Adds the second derivatives of objective + multipliers . rows to the lower band matrix.

    z: (N,). multipliers: (R,) of the rows of `band_constraints`. matrix: (4 m - 3, 11), element
    (row, row - column). The slack has none.
    """
    m = interval_count
    steps = z[:m]
    poses = unpack_poses(z, scene.start, scene.goal, m)
    lengths, _, turns, length_slopes, _ = band_geometry(poses)
    speeds, turn_rates, _ = band_rates(lengths, turns, steps)
    blocks = np.zeros((m, 3, 3)), np.zeros((m, 3, 3))
    speed_pulls, turn_pulls = _rate_pulls(multipliers, scene, m)
    _rate_curvature(
        # Plain constants would have numba compile it for each.
        np.int64(LENGTH),
        speeds,
        steps,
        (scene.start_twist[0], scene.goal_twist[0]),
        multipliers[3 * m : 4 * m + 1],
        speed_pulls,
        weights.smoothness,
        blocks,
    )
    _rate_curvature(
        np.int64(TURN),
        turn_rates,
        steps,
        (scene.start_twist[1], scene.goal_twist[1]),
        multipliers[4 * m + 1 : 5 * m + 2],
        turn_pulls,
        weights.smoothness,
        blocks,
    )
    _add_pose_terms(poses, scene, weights, positions, matrix)
    first, count = 5 * m + 2, scene.discs.shape[0] * (m - 1)
    _add_clearance_terms(
        poses, scene, weights, multipliers[first : first + count], positions, matrix
    )
    _add_moving_clearance_terms(poses, scene, multipliers[first + count :], positions, matrix)
    _add_interval_terms(
        poses,
        length_slopes,
        speed_pulls,
        multipliers[:m],
        weights.time,
        blocks,
        positions,
        matrix,
    )
