"""Newton's method on the barrier problem of a band, which is the one that IPOPT solves.

Primal-dual, with slacks of the inequality rows and a constant barrier, the one that IPOPT has in
program.py (Wächter, Biegler 2006). The arc conditions enter the Newton system by multipliers and a
stiff quadratic term, so that it is a positive definite band matrix wherever the reduced second
derivatives are positive, and Cholesky's method tells where they are not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb.constraints import BandScene, band_constraints
from drake_navbench.controllers.teb.curvature import (
    add_lagrangian_curvature,
    band_positions,
)
from drake_navbench.controllers.teb.objective import Weights, band_objective
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.band_cholesky import BANDWIDTH, factorise, substitute
from drake_navbench.kernels.barrier import barrier_terms, next_multiplier, share_to_bounds

Indices = NDArray[np.int64]

# The distance of starts from bounds; or half of the room between two.
BOUND_PUSH = 3e-3
# The least room before a bound, and the room to either side of a fixed variable.
LEAST_ROOM, FIXED_ROOM = 1e-12, 1e-8
# Compliance of the arc conditions, m: their residual a unit of their multipliers' change.
COMPLIANCE = 1e-6
# Added to second derivatives that are not positive definite: first value, growth, largest value.
FIRST_DAMPING, DAMPING_GROWTH, MOST_DAMPING = 1e-3, 10.0, 1e8
# Second derivatives with a smaller pivot are not taken for positive.
LEAST_PIVOT = 1e-10
# The largest move of a pose in one step, m or rad.
LONGEST_MOVE = 0.3
# A bound's multiplier stays within this factor of the barrier's own, as IPOPT's kappa_sigma.
MULTIPLIER_SPREAD = 1e6


class Bounds(NamedTuple):
    """Bounds of the program: of rows (R,) and of variables (N,), infinite where there is none."""

    row_lower: Array
    row_upper: Array
    lower: Array
    upper: Array


class Structure(NamedTuple):
    """The sparsity of a program's rows: row r has slopes in columns[starts[r] : starts[r+1]].

    positions: (N,) of the columns in the band matrix.
    """

    starts: Indices
    columns: Indices
    positions: Indices


class DescentSettings(NamedTuple):
    """The settings of Newton's method.

    barrier: the barrier parameter, constant. iterations: the most allowed. error_tolerance:
    tolerance of the slopes of the Lagrangian. violation_tolerance: largest violation of rows and
    slacks. The method stops after `review` iterations if a slope is then above `hopeless_error`.
    """

    barrier: float = 1e-3
    iterations: int = 60
    error_tolerance: float = 0.03
    violation_tolerance: float = 1e-4
    review: int = 25
    hopeless_error: float = math.inf


class Descent(NamedTuple):
    """The result of Newton's method.

    z: (N,). converged: the conditions of the barrier problem hold to the tolerances asked for.
    iterations: steps taken. error: the largest slope of the Lagrangian. violation: largest
    difference between the rows and their slacks.
    """

    z: Array
    converged: bool
    iterations: int
    error: float
    violation: float


def structure_of(pattern: Indices, rows: int, interval_count: int) -> Structure:
    """Returns the structure of a program from its sparsity pattern (K, 2), by rows."""
    starts = np.searchsorted(pattern[:, 0], np.arange(rows + 1))
    columns = np.ascontiguousarray(pattern[:, 1])
    return Structure(starts.astype(np.int64), columns, band_positions(interval_count))


@register_jitable(error_model="numpy")
def _advance(quantities, steps, share, lower, upper, low, high, barrier):
    """Takes a share of the steps, also of those of the bounds' multipliers."""
    for i in range(quantities.shape[0]):
        if lower[i] > -math.inf:
            room = quantities[i] - lower[i]
            low[i] = next_multiplier(low[i], room, steps[i], share, barrier, MULTIPLIER_SPREAD)
        if upper[i] < math.inf:
            room = upper[i] - quantities[i]
            high[i] = next_multiplier(high[i], room, -steps[i], share, barrier, MULTIPLIER_SPREAD)
        # Off the bounds also where rounding says otherwise.
        moved = max(quantities[i] + share * steps[i], lower[i] + LEAST_ROOM)
        quantities[i] = min(moved, upper[i] - LEAST_ROOM)


@register_jitable(error_model="numpy")
def _assemble(jacobian, row_stiffness, column_stiffness, structure, matrix, border):
    """Adds J^T diag(row_stiffness) J + diag(column_stiffness); returns the slack's own element.

    matrix: matrix of the other columns. border: (size,) of the slack with them.
    """
    columns, positions = structure.columns, structure.positions
    corner = column_stiffness[-1]
    for column in range(positions.shape[0] - 1):
        matrix[positions[column], 0] += column_stiffness[column]
    for row in range(row_stiffness.shape[0]):
        stiffness = row_stiffness[row]
        if stiffness == 0.0:
            continue
        first, end = structure.starts[row], structure.starts[row + 1]
        for i in range(first, end):
            place = positions[columns[i]]
            scaled = stiffness * jacobian[row, columns[i]]
            for j in range(first, end):
                other = positions[columns[j]]
                value = scaled * jacobian[row, columns[j]]
                if place < 0:
                    if other < 0:
                        corner += value
                    else:
                        border[other] += value
                elif 0 <= other <= place:
                    matrix[place, place - other] += value
    return corner


@register_jitable(error_model="numpy")
def _add_row_slopes(jacobian, multipliers, structure, gradient):
    """Adds J^T multipliers to the gradient (N,)."""
    for row in range(multipliers.shape[0]):
        for i in range(structure.starts[row], structure.starts[row + 1]):
            column = structure.columns[i]
            gradient[column] += multipliers[row] * jacobian[row, column]


@register_jitable(error_model="numpy")
def _newton_step(matrix, border, corner, gradient, positions, step):
    """Fills step (N,) with -(second derivatives)^-1 gradient; returns whether it could.

    Where the second derivatives are not positive, as much is added to their diagonal as it takes.
    """
    size = matrix.shape[0]
    factor = np.empty_like(matrix)
    across, along = np.empty(size), np.empty(size)
    damping = 0.0
    while True:
        if factorise(matrix, damping, factor, LEAST_PIVOT):
            for i in range(size):
                across[i] = border[i]
            substitute(factor, across)
            pivot = corner + damping
            for i in range(size):
                pivot -= border[i] * across[i]
            if pivot > 0.0:
                break
        damping = max(FIRST_DAMPING, damping * DAMPING_GROWTH)
        if damping > MOST_DAMPING:
            return False
    last = gradient.shape[0] - 1
    for column in range(last):
        along[positions[column]] = -gradient[column]
    substitute(factor, along)
    slack = -gradient[last]
    for i in range(size):
        slack -= border[i] * along[i]
    slack /= pivot
    for column in range(last):
        step[column] = along[positions[column]] - slack * across[positions[column]]
    step[last] = slack
    return True


@register_jitable(error_model="numpy")
def _row_steps(jacobian, step, structure, gaps, steps):
    """Fills the steps (R,) of the slacks that go with a step (N,) of the variables."""
    for r in range(gaps.shape[0]):
        change = gaps[r]
        for i in range(structure.starts[r], structure.starts[r + 1]):
            change += jacobian[r, structure.columns[i]] * step[structure.columns[i]]
        steps[r] = change


@register_jitable(error_model="numpy")
def _largest(numbers):
    """Returns the largest absolute value; infinity where one is not a number."""
    largest = 0.0
    for i in range(numbers.shape[0]):
        size = abs(numbers[i])
        if not size < math.inf:
            return math.inf
        largest = max(largest, size)
    return largest


# Inlined before it is typed: compiled alone as well, all of this would be optimized twice.
@njit(cache=True, error_model="numpy", inline="always")
def _newton_direction(state, problem, values, jacobian, gradient, steps, targets):
    """Fills the steps (N + R,) of variables and slacks and the rows' next multipliers (R,).

    values, jacobian, gradient: values and derivatives of rows and objective at the variables.
    Returns whether it could.
    """
    quantities, low, high, multipliers = state
    m, scene, weights, lower, upper, is_equality, structure, barrier = problem
    rows, count = values.shape[0], gradient.shape[0]
    stiffness, push = np.empty(count + rows), np.empty(count + rows)
    matrix, border = np.zeros((count - 1, BANDWIDTH + 1)), np.zeros(count - 1)
    positions = structure.positions
    add_lagrangian_curvature(quantities[:count], m, scene, weights, multipliers, positions, matrix)
    barrier_terms(quantities, lower, upper, low, high, barrier, stiffness, push)
    gaps, pull = np.empty(rows), np.empty(count)
    for r in range(rows):
        gaps[r] = values[r] - quantities[count + r]
        if is_equality[r]:
            stiffness[count + r] = 1.0 / COMPLIANCE
            push[count + r] = multipliers[r]
        targets[r] = push[count + r] + stiffness[count + r] * gaps[r]
    for i in range(count):
        pull[i] = gradient[i] + push[i]
    corner = _assemble(jacobian, stiffness[count:], stiffness[:count], structure, matrix, border)
    _add_row_slopes(jacobian, targets, structure, pull)
    if not _newton_step(matrix, border, corner, pull, positions, steps[:count]):
        return False
    _row_steps(jacobian, steps[:count], structure, gaps, steps[count:])
    for r in range(rows):
        targets[r] = push[count + r] + stiffness[count + r] * steps[count + r]
        if is_equality[r]:
            # The next iteration reduces the residual that the compliance leaves.
            steps[count + r] = 0.0
    return True


@njit(cache=True, error_model="numpy")
def _descend(state, problem, settings):
    """Runs the method on a state, in place; returns converged, iterations, error, violation.

    state: variables and slacks (N + R,), multipliers of their lower and upper bounds (N + R,) each,
    those of the rows (R,).
    """
    quantities, low, high, multipliers = state
    m, scene, weights, lower, upper, _, structure, barrier = problem
    rows = multipliers.shape[0]
    count = quantities.shape[0] - rows
    z, slacks = quantities[:count], quantities[count:]
    steps, targets, gaps = np.empty(count + rows), np.empty(rows), np.empty(rows)
    iteration = 0
    while True:
        values, jacobian = band_constraints(z, m, scene)
        _, gradient = band_objective(z, m, scene, weights)
        slope = gradient.copy()
        for i in range(count):
            slope[i] += high[i] - low[i]
        for r in range(rows):
            gaps[r] = values[r] - slacks[r]
        _add_row_slopes(jacobian, multipliers, structure, slope)
        error, violation = _largest(slope), _largest(gaps)
        if error <= settings.error_tolerance and violation <= settings.violation_tolerance:
            return True, iteration, error, violation
        if iteration >= settings.iterations or not (error < math.inf and violation < math.inf):
            return False, iteration, error, violation
        if iteration == settings.review and error > settings.hopeless_error:
            return False, iteration, error, violation
        if not _newton_direction(state, problem, values, jacobian, gradient, steps, targets):
            return False, iteration, error, violation
        move = _largest(steps[m : count - 1])
        share = LONGEST_MOVE / move if move > LONGEST_MOVE else 1.0
        share = min(share, share_to_bounds(quantities, steps, lower, upper))
        for r in range(rows):
            multipliers[r] += share * (targets[r] - multipliers[r])
        _advance(quantities, steps, share, lower, upper, low, high, barrier)
        iteration += 1


def descend(
    guess: Array,
    interval_count: int,
    *,
    scene: BandScene,
    weights: Weights,
    bounds: Bounds,
    structure: Structure,
    settings: DescentSettings,
) -> Descent:
    """Runs Newton's method from a guess (N,)."""
    is_equality = bounds.row_lower == bounds.row_upper
    is_fixed = bounds.upper - bounds.lower < FIXED_ROOM
    # A fixed variable gets a little room; the slack of an equality stays where it is.
    lower = np.concatenate(
        [
            np.where(is_fixed, bounds.lower - FIXED_ROOM, bounds.lower),
            np.where(is_equality, -np.inf, bounds.row_lower),
        ]
    )
    upper = np.concatenate(
        [
            np.where(is_fixed, bounds.upper + FIXED_ROOM, bounds.upper),
            np.where(is_equality, np.inf, bounds.row_upper),
        ]
    )
    values, _ = band_constraints(guess, interval_count, scene)
    quantities = np.concatenate([guess, np.where(is_equality, bounds.row_lower, values)])
    room = np.minimum(BOUND_PUSH, 0.5 * (upper - lower))
    quantities = np.minimum(np.maximum(quantities, lower + room), upper - room)
    low, high = settings.barrier / (quantities - lower), settings.barrier / (upper - quantities)
    multipliers = (high - low)[len(guess) :]
    converged, iterations, error, violation = _descend(
        (quantities, low, high, multipliers),
        (
            interval_count,
            scene,
            weights,
            lower,
            upper,
            is_equality,
            structure,
            settings.barrier,
        ),
        settings,
    )
    return Descent(quantities[: len(guess)], converged, iterations, error, violation)
