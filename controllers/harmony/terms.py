"""The twelve terms of the cost, each with a weight; a published thesis names them (see below).

A term is a function of one stage; with a weight of 0 it is not asked. It returns its cost and adds
its gradient (9,) and a positive semidefinite approximation of its second derivatives (9, 9), those
of Gauss and Newton. Terms of the way are per second, those of the end of the plan once.

F. Schena, Development of an automated benchmark for the analysis of Nav2 controllers (Politecnico
di Torino, 2024), names them; the formulas are ours.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.motion import (
    ALPHA,
    JERK,
    STAGE_SIZE,
    YAW,
    A,
    V,
    W,
    X,
    Y,
)
from drake_navbench.kernels.distance_field import sample_distance

# Discs nearer to obstacles cost, m. A turn at a lower speed counts as one in place, m/s.
INFLATION_M, TURN_IN_PLACE_MPS = 0.35, 0.15
# Names of the weights, in the order of `Scene.weights`.
TERMS = (
    "constraints",
    "goal_angle",
    "goal_position",
    "costmap_cost",
    "path_alignment",
    "path_orientation",
    "forward_preference",
    "twirling",
    "energy",
    "sharp_curves",
    "linear_jerk",
    "maximum_velocity",
)
(
    CONSTRAINTS,
    GOAL_ANGLE,
    GOAL_POSITION,
    COSTMAP_COST,
    PATH_ALIGNMENT,
    PATH_ORIENTATION,
    FORWARD_PREFERENCE,
    TWIRLING,
    ENERGY,
    SHARP_CURVES,
    LINEAR_JERK,
    MAXIMUM_VELOCITY,
) = range(len(TERMS))


@njit(cache=True, error_model="numpy")
def _square(weight, residual, column, slope, gradient, hessian):
    """Adds weight * residual^2 of one variable; returns it."""
    gradient[column] += 2.0 * weight * residual * slope
    hessian[column, column] += 2.0 * weight * slope * slope
    return weight * residual * residual


@njit(cache=True, error_model="numpy")
def _square_of_two(weight, residual, first, first_slope, second, second_slope, gradient, hessian):
    """Adds weight * residual^2 of two variables; returns it."""
    twice = 2.0 * weight
    gradient[first] += twice * residual * first_slope
    gradient[second] += twice * residual * second_slope
    hessian[first, first] += twice * first_slope * first_slope
    hessian[second, second] += twice * second_slope * second_slope
    hessian[first, second] += twice * first_slope * second_slope
    hessian[second, first] += twice * first_slope * second_slope
    return weight * residual * residual


@njit(cache=True, error_model="numpy")
def constraints(scene, stage, weight, gradient, hessian):
    """Penalizes values near a limit: (excess over `limit_share` of it)^2, in parts of the rest."""
    limits, share = scene.limits, scene.limit_share
    left = 1.0 - share
    cost = 0.0
    for column, limit in (
        (V, limits.forward_speed if stage[V] > 0.0 else limits.backward_speed),
        (W, limits.turn_rate),
        (A, limits.acceleration),
        (ALPHA, limits.angular_acceleration),
    ):
        if limit <= 0.0:
            continue
        excess = (abs(stage[column]) / limit - share) / left
        if excess > 0.0:
            slope = math.copysign(1.0 / (limit * left), stage[column])
            cost += _square(weight, excess, column, slope, gradient, hessian)
    return cost


@njit(cache=True, error_model="numpy")
def goal_angle(scene, stage, weight, gradient, hessian):
    """Ends with the goal's heading: squared angle to it, at the end of the plan."""
    angle = stage[YAW] - scene.target[2]
    return _square(weight, angle, YAW, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def goal_position(scene, stage, weight, gradient, hessian):
    """Ends near the target: squared distance to it, at the end of the plan."""
    cost = _square(weight, stage[X] - scene.target[0], X, 1.0, gradient, hessian)
    return cost + _square(weight, stage[Y] - scene.target[1], Y, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def costmap_cost(scene, stage, weight, gradient, hessian):
    """Keeps away from obstacles: squared depth of each disc within the inflation."""
    reach = INFLATION_M
    cosine, sine = math.cos(stage[YAW]), math.sin(stage[YAW])
    cost = 0.0
    for k in range(scene.discs.shape[0]):
        along = scene.discs[k, 0]
        distance, by_x, by_y = sample_distance(
            scene.field, stage[X] + along * cosine, stage[Y] + along * sine
        )
        inside = 1.0 - (distance - scene.discs[k, 1]) / reach
        if inside <= 0.0:
            continue
        by_yaw = (by_y * cosine - by_x * sine) * along
        slopes = (-by_x / reach, -by_y / reach, -by_yaw / reach)
        cost += weight * inside * inside
        for i in range(3):
            gradient[i] += 2.0 * weight * inside * slopes[i]
            for j in range(3):
                hessian[i, j] += 2.0 * weight * slopes[i] * slopes[j]
    return cost


@njit(cache=True, error_model="numpy")
def path_alignment(reference, stage, weight, gradient, hessian):
    """Stays on the path: squared distance across the path."""
    sine, cosine = math.sin(reference[2]), math.cos(reference[2])
    across = cosine * (stage[Y] - reference[1]) - sine * (stage[X] - reference[0])
    return _square_of_two(weight, across, X, -sine, Y, cosine, gradient, hessian)


@njit(cache=True, error_model="numpy")
def path_orientation(reference, stage, weight, gradient, hessian):
    """Heads along the path: squared angle to the path."""
    return _square(weight, stage[YAW] - reference[2], YAW, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def forward_preference(stage, weight, gradient, hessian):
    """Drives forwards: squared speed backwards."""
    if stage[V] >= 0.0:
        return 0.0
    return _square(weight, stage[V], V, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def twirling(stage, weight, gradient, hessian):
    """Turns slowly: squared turn rate."""
    return _square(weight, stage[W], W, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def energy(stage, weight, gradient, hessian):
    """Saves energy: squared power of speeding up and braking, for a mass of 1 kg."""
    power = stage[V] * stage[A]
    return _square_of_two(weight, power, V, stage[A], A, stage[V], gradient, hessian)


@njit(cache=True, error_model="numpy")
def sharp_curves(scene, stage, weight, gradient, hessian):
    """Drives wide curves: squared curvature, at least that of a slow crawl."""
    speed = math.sqrt(stage[V] * stage[V] + TURN_IN_PLACE_MPS * TURN_IN_PLACE_MPS)
    curvature = stage[W] / speed
    by_v = -curvature * stage[V] / (speed * speed)
    return _square_of_two(weight, curvature, W, 1.0 / speed, V, by_v, gradient, hessian)


@njit(cache=True, error_model="numpy")
def linear_jerk(stage, weight, gradient, hessian):
    """Changes its acceleration gently: squared jerk."""
    return _square(weight, stage[JERK], JERK, 1.0, gradient, hessian)


@njit(cache=True, error_model="numpy")
def maximum_velocity(scene, reference, stage, weight, gradient, hessian):
    """Drives as fast as it may: squared part of the wanted speed that is missing."""
    slope = -1.0 / scene.limits.forward_speed
    missing = (reference[3] - stage[V]) / scene.limits.forward_speed
    return _square(weight, missing, V, slope, gradient, hessian)


@njit(cache=True, error_model="numpy")
def stage_cost(scene, k, last, stage, reference, gradient, hessian):
    """Returns the cost of stage k of 0..last, and adds its derivatives.

    reference: (4,) of this stage. Stage 0 is given: only its inputs cost something.
    """
    weights, dt = scene.weights, scene.dt
    cost = 0.0
    if weights[LINEAR_JERK] > 0.0 and k < last:
        cost += linear_jerk(stage, dt * weights[LINEAR_JERK], gradient, hessian)
    if k == 0:
        return cost
    if weights[CONSTRAINTS] > 0.0:
        cost += constraints(scene, stage, dt * weights[CONSTRAINTS], gradient, hessian)
    if weights[COSTMAP_COST] > 0.0:
        cost += costmap_cost(scene, stage, dt * weights[COSTMAP_COST], gradient, hessian)
    if weights[PATH_ALIGNMENT] > 0.0:
        weight = dt * weights[PATH_ALIGNMENT]
        cost += path_alignment(reference, stage, weight, gradient, hessian)
    if weights[PATH_ORIENTATION] > 0.0:
        weight = dt * weights[PATH_ORIENTATION]
        cost += path_orientation(reference, stage, weight, gradient, hessian)
    if weights[FORWARD_PREFERENCE] > 0.0:
        cost += forward_preference(stage, dt * weights[FORWARD_PREFERENCE], gradient, hessian)
    if weights[TWIRLING] > 0.0:
        cost += twirling(stage, dt * weights[TWIRLING], gradient, hessian)
    if weights[ENERGY] > 0.0:
        cost += energy(stage, dt * weights[ENERGY], gradient, hessian)
    if weights[SHARP_CURVES] > 0.0:
        cost += sharp_curves(scene, stage, dt * weights[SHARP_CURVES], gradient, hessian)
    if weights[MAXIMUM_VELOCITY] > 0.0:
        weight = dt * weights[MAXIMUM_VELOCITY]
        cost += maximum_velocity(scene, reference, stage, weight, gradient, hessian)
    if k == last:
        if weights[GOAL_POSITION] > 0.0:
            cost += goal_position(scene, stage, weights[GOAL_POSITION], gradient, hessian)
        if weights[GOAL_ANGLE] > 0.0 and scene.nears_goal > 0.0:
            cost += goal_angle(scene, stage, weights[GOAL_ANGLE], gradient, hessian)
    return cost


@njit(cache=True, error_model="numpy")
def plan_cost(scene, plan):
    """Returns the cost of a plan (N + 1, 9)."""
    gradient, hessian = np.zeros(STAGE_SIZE), np.zeros((STAGE_SIZE, STAGE_SIZE))
    last = plan.shape[0] - 1
    cost = 0.0
    for k in range(last + 1):
        cost += stage_cost(scene, k, last, plan[k], scene.references[k], gradient, hessian)
    return cost
