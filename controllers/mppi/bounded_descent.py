"""Newton's method on the barrier problem of the polish, which is the one that IPOPT solves.

Primal-dual (Wächter, Biegler 2006) for variables between bounds, with exact second derivatives and
a constant barrier, that with which IPOPT starts. Matrices are dense, as variables are few.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.mppi.objective import add_pose_curvature, objective
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.band_cholesky import factorise, substitute
from drake_navbench.kernels.barrier import barrier_terms, next_multiplier, share_to_bounds

# The distance of starts from either bound, as a share of the room between the bounds.
_BOUND_PUSH_RATIO = 0.01
# The share of the decrease by the slope that a step must reach (Armijo), or it is halved.
_ARMIJO_RATIO = 1e-4
_MOST_HALVINGS = 10
# The largest rounding error of the merit, for steps that are too small to lower it.
_ROUNDING = 1e-12
# Added to second derivatives that are not positive definite: first value, then growth.
_FIRST_DAMPING, _DAMPING_GROWTH, _MOST_DAMPING = 1e-3, 4.0, 1e8
# A squared pivot below this counts as not positive.
_LEAST_PIVOT = 1e-10
# A bound's multiplier stays within this factor of the barrier's own, as IPOPT's kappa_sigma.
_SPREAD = 1e10


class DescentSettings(NamedTuple):
    """The settings of the descent.

    barrier: the barrier parameter, constant. iterations: the most allowed. tolerance: tolerance of
    the slopes of the Lagrangian and of the products of rooms and multipliers.
    """

    barrier: float
    iterations: int = 30
    tolerance: float = 1e-6


class ControlSpline(NamedTuple):
    """Sequences (2 N,), v and w in turn, as offset + by_variables @ variables.

    offset: (2 N,). by_variables: (2 N, n). control_curvature: (n, n), second derivatives of the
    objective's terms of controls, which are constant.
    """

    offset: Array
    by_variables: Array
    control_curvature: Array


@njit(cache=True, error_model="numpy")
def descend(situation, weights, spline, start, lower, upper, settings):
    """Returns (variables (n,), whether the conditions of the barrier problem hold).

    start, lower, upper: (n,), bounds finite and apart.
    """
    barrier = settings.barrier
    count = start.shape[0]
    variables, moved, slopes = np.empty(count), np.empty(count), np.empty(count)
    low, high = np.empty(count), np.empty(count)
    stiffness, push = np.empty(count), np.empty(count)
    for i in range(count):
        margin = _BOUND_PUSH_RATIO * (upper[i] - lower[i])
        variables[i] = np.minimum(np.maximum(start[i], lower[i] + margin), upper[i] - margin)
        low[i], high[i] = barrier / (variables[i] - lower[i]), barrier / (upper[i] - variables[i])
    sequence = _sequence(spline, variables)
    value, by_sequence = objective(situation, weights, sequence)
    for _ in range(settings.iterations):
        gradient = by_sequence.ravel() @ spline.by_variables
        if _error(gradient, variables, low, high, lower, upper, barrier) < settings.tolerance:
            return variables, True
        curvature = spline.control_curvature.copy()
        add_pose_curvature(situation, weights, sequence, spline.by_variables, curvature)
        barrier_terms(variables, lower, upper, low, high, barrier, stiffness, push)
        for i in range(count):
            slopes[i] = gradient[i] + push[i]
            curvature[i, i] += stiffness[i]
        step = _newton_step(curvature, slopes)
        share = share_to_bounds(variables, step, lower, upper)
        merit = value + _barrier(variables, lower, upper, barrier)
        promised = _ARMIJO_RATIO * (slopes @ step)
        for halvings in range(_MOST_HALVINGS):
            if halvings > 0:
                share *= 0.5
            for i in range(count):
                moved[i] = variables[i] + share * step[i]
            sequence = _sequence(spline, moved)
            value, by_sequence = objective(situation, weights, sequence)
            after = value + _barrier(moved, lower, upper, barrier)
            if after <= merit + share * promised + _ROUNDING:
                break
        for i in range(count):
            room_below, room_above = variables[i] - lower[i], upper[i] - variables[i]
            low[i] = next_multiplier(low[i], room_below, step[i], share, barrier, _SPREAD)
            high[i] = next_multiplier(high[i], room_above, -step[i], share, barrier, _SPREAD)
            variables[i] = moved[i]
    return variables, False


@register_jitable(error_model="numpy")
def _sequence(spline, variables):
    sequence = spline.by_variables @ variables
    for i in range(sequence.shape[0]):
        sequence[i] += spline.offset[i]
    return sequence.reshape(-1, 2)


@register_jitable(error_model="numpy")
def _error(gradient, variables, low, high, lower, upper, barrier):
    """Returns the largest residual of the barrier problem's conditions."""
    error = 0.0
    for i in range(variables.shape[0]):
        error = max(error, abs(gradient[i] - low[i] + high[i]))
        error = max(error, abs(low[i] * (variables[i] - lower[i]) - barrier))
        error = max(error, abs(high[i] * (upper[i] - variables[i]) - barrier))
    return error


@register_jitable(error_model="numpy")
def _barrier(variables, lower, upper, barrier):
    total = 0.0
    for i in range(variables.shape[0]):
        total -= barrier * math.log((variables[i] - lower[i]) * (upper[i] - variables[i]))
    return total


@register_jitable(error_model="numpy")
def _newton_step(curvature, slopes):
    """Returns the step against the slopes; damps the second derivatives until they are positive.

    The step is zero where even the largest damping does not make them positive.
    """
    count = slopes.shape[0]
    band, factor, step = np.empty((count, count)), np.empty((count, count)), np.zeros(count)
    for row in range(count):
        for column in range(row + 1):
            band[row, row - column] = curvature[row, column]
    damping = _FIRST_DAMPING
    while not factorise(band, 0.0, factor, _LEAST_PIVOT):
        if damping > _MOST_DAMPING:
            return step
        for row in range(count):
            band[row, 0] += damping
        damping *= _DAMPING_GROWTH
    for i in range(count):
        step[i] = -slopes[i]
    substitute(factor, step)
    return step
