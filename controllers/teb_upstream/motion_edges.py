"""Edges of a band's motion: speeds, the arc condition, accelerations, time, length.

`terms` are the parameters, as a record; `around` are the surroundings of the band, see `penalties`.
"""

from __future__ import annotations

import math

import numpy as np
from numba.extending import register_jitable

from drake_navbench.controllers.teb_upstream.band import normalize
from drake_navbench.controllers.teb_upstream.normal_equations import (
    KINK_REACH,
    OTHER_COST,
    STRIDE,
    TIME_COST,
    add_edge,
    add_magnitude,
    add_penalty,
    excess_outside,
)

# Steepness of the sign of the speed, 1/m.
SIGN_STEEPNESS = 100.0
# The number of first intervals for which the preferred direction of turning holds.
PREFERRED_TURNS = 3


@register_jitable(error_model="numpy")
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


@register_jitable(error_model="numpy")
def add_intervals(poses, steps, count, terms, around, system):
    """Edges of single intervals: speeds, the arc condition, time, length, direction of turning.

    Fills the motion of the system.
    """
    with_slopes, costs, motion = system.with_slopes, system.costs, system.motion
    # In one piece: limits of the speed in a function of their own make all edges a tenth slower.
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

        excess, side = excess_outside(speed, -terms.max_vel_x_backwards, terms.max_vel_x, margin)
        if excess > -KINK_REACH:
            costs[OTHER_COST] += terms.weight_max_vel_x * max(excess, 0.0) ** 2
            if with_slopes:
                fill_speed_row(row, slopes, side, step, speed)
                add_penalty(system, column, row, 7, excess, terms.weight_max_vel_x)
        excess, side = excess_outside(rate, -terms.max_vel_theta, terms.max_vel_theta, margin)
        if excess > -KINK_REACH:
            costs[OTHER_COST] += terms.weight_max_vel_theta * max(excess, 0.0) ** 2
            if with_slopes:
                row[:] = 0.0
                row[2], row[3], row[6] = -side / step, -side * rate / step, side / step
                add_penalty(system, column, row, 7, excess, terms.weight_max_vel_theta)

        # The arc condition: both headings touch one circle.
        arc = (cos_0 + cos_1) * dy - (sin_0 + sin_1) * dx
        costs[OTHER_COST] += terms.weight_kinematics_nh * arc * arc
        if with_slopes and arc != 0.0:
            row[0], row[1], row[2] = sin_0 + sin_1, -(cos_0 + cos_1), -sin_0 * dy - cos_0 * dx
            row[3] = 0.0
            row[4], row[5], row[6] = -row[0], -row[1], -sin_1 * dy - cos_1 * dx
            if terms.is_carlike:
                # The one form of this edge whose slopes the original takes by differences.
                add_magnitude(system, column, row, 7, arc, terms.weight_kinematics_nh)
            else:
                add_edge(system, column, row, 7, arc, terms.weight_kinematics_nh)
        if terms.is_carlike:
            _add_turning_radius(column, dx, dy, distance, turn, terms, system, row)
        else:
            along = dx * cos_0 + dy * sin_0
            if along < 0.0:
                costs[OTHER_COST] += terms.weight_kinematics_forward_drive * along * along
                if with_slopes:
                    row[0], row[1], row[2] = cos_0, sin_0, sin_0 * dx - cos_0 * dy
                    row[3] = 0.0
                    row[4], row[5], row[6] = -cos_0, -sin_0, 0.0
                    add_edge(system, column, row, 7, -along, terms.weight_kinematics_forward_drive)

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
                add_edge(system, column, row, 7, distance, terms.weight_shortest_path)
        if i < PREFERRED_TURNS and around.preferred_turn != 0.0:
            against = -around.preferred_turn * turn
            costs[OTHER_COST] += terms.weight_prefer_rotdir * max(against, 0.0) ** 2
            if with_slopes and against > -KINK_REACH:
                row[:] = 0.0
                row[2], row[6] = around.preferred_turn, -around.preferred_turn
                add_penalty(system, column, row, 7, against, terms.weight_prefer_rotdir)


@register_jitable(error_model="numpy")
def fill_speed_row(row, slopes, side, step, speed):
    """Fills (7,) with the slopes of side * speed by two poses and the time step between them."""
    scale = side / step
    for k in range(3):
        row[k] = scale * slopes[k]
        row[4 + k] = scale * slopes[3 + k]
    row[3] = -side * speed / step


@register_jitable(error_model="numpy")
def _add_turning_radius(column, dx, dy, distance, turn, terms, system, row):
    """The edge of a car: a turning radius of at least min_turning_radius."""
    if turn == 0.0:
        return
    half_sine = math.sin(0.5 * turn)
    arc = 2.0 * abs(half_sine) if terms.exact_arc_length else abs(turn)
    missing = terms.min_turning_radius - distance / arc
    if missing < -KINK_REACH:
        return
    system.costs[OTHER_COST] += terms.weight_kinematics_turning_radius * max(missing, 0.0) ** 2
    if system.with_slopes:
        by_turn = math.copysign(distance, turn) / (arc * arc)
        if terms.exact_arc_length:
            by_turn *= math.cos(0.5 * turn)
        row[:] = 0.0
        if distance > 0.0:
            row[0], row[1] = dx / (distance * arc), dy / (distance * arc)
            row[4], row[5] = -row[0], -row[1]
        row[2], row[6] = -by_turn, by_turn
        add_penalty(system, column, row, 7, missing, terms.weight_kinematics_turning_radius)


@register_jitable(error_model="numpy")
def add_accelerations(steps, count, terms, around, system):
    """Edges of accelerations: at the start, between intervals, at the goal.

    As in the original, the first and the last acceleration divide by one whole time step, the
    others by half the sum of two.
    """
    with_slopes, costs, motion = system.with_slopes, system.costs, system.motion
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
            excess, side = excess_outside(acceleration, -limit, limit, margin)
            if excess < -KINK_REACH:
                continue
            costs[OTHER_COST] += weight * max(excess, 0.0) ** 2
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
            add_penalty(system, STRIDE * i + first, row[first:last], last - first, excess, weight)
