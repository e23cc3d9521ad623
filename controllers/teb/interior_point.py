"""Newton's method on the barrier problem of a band, with a banded solver: the same program as IPOPT's.

Primal-dual, with slacks of the inequality rows and a barrier that stays where IPOPT's does in
program.py (Wächter, Biegler 2006). The arc conditions enter the Newton system by multipliers and a
stiff quadratic term, so that it is a positive definite band matrix wherever the reduced
second derivatives are positive, and Cholesky's method tells where they are not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.teb.constraints import BandScene, band_constraints
from drake_navbench.controllers.teb.curvature import (
    BANDWIDTH,
    add_lagrangian_curvature,
    band_positions,
)
from drake_navbench.controllers.teb.layout import VARIABLES_PER_POSE
from drake_navbench.controllers.teb.objective import Weights, band_objective

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Of the way to a bound, how much a step may take.
TO_BOUND_RATIO = 0.99
# Starts keep so far from bounds, or half of the room between two.
BOUND_PUSH = 3e-3
# Compliance of the arc conditions: an iteration leaves so much of their multipliers' change, m.
COMPLIANCE = 1e-6
# Added to the second derivatives where they are not positive: first, then so many times more.
FIRST_DAMPING, DAMPING_GROWTH, MOST_DAMPING = 1e-3, 10.0, 1e8
# A pose moves by so much in one step at most, m or rad.
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
    """Where the rows of a program have slopes: those of row r are columns[starts[r] : starts[r+1]].

    positions: (N,) of the columns in the band matrix.
    """

    starts: Indices
    columns: Indices
    positions: Indices


class Descent(NamedTuple):
    """What the method ends with.

    z: (N,). converged: the conditions of the barrier problem hold to the tolerances asked for.
    iterations: steps taken. error: the largest slope of the Lagrangian. violation: by which the
    rows and their slacks differ.
    """

    z: Array
    converged: bool
    iterations: int
    error: float
    violation: float


def structure_of(pattern: list[tuple[int, int]], rows: int, interval_count: int) -> Structure:
    """Returns the structure of a program from its sparsity pattern, (row, column) in any order."""
    ordered = np.array(sorted(pattern), dtype=np.int64)
    starts = np.searchsorted(ordered[:, 0], np.arange(rows + 1))
    columns = np.ascontiguousarray(ordered[:, 1])
    return Structure(starts.astype(np.int64), columns, band_positions(interval_count))


@njit(cache=True)
def _pushed(value, lower, upper, push):
    """Returns the value moved off its bounds."""
    room = push
    if lower > -math.inf and upper < math.inf:
        room = min(push, 0.5 * (upper - lower))
    return min(max(value, lower + room), upper - room)


@njit(cache=True, error_model="numpy")
def _factorise(matrix, damping, factor):
    """Fills the lower factor of matrix + damping I by Cholesky's method; False if indefinite."""
    size = matrix.shape[0]
    for row in range(size):
        start = max(0, row - BANDWIDTH)
        for column in range(start, row + 1):
            value = matrix[row, row - column]
            if column == row:
                value += damping
            for k in range(max(start, column - BANDWIDTH), column):
                value -= factor[row, row - k] * factor[column, column - k]
            if column < row:
                factor[row, row - column] = value / factor[column, 0]
            elif value > 1e-10:
                factor[row, 0] = math.sqrt(value)
            else:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _substitute(factor, vector):
    """Solves with the factor of `_factorise`, in place."""
    size = factor.shape[0]
    for row in range(size):
        value = vector[row]
        for k in range(max(0, row - BANDWIDTH), row):
            value -= factor[row, row - k] * vector[k]
        vector[row] = value / factor[row, 0]
    for row in range(size - 1, -1, -1):
        value = vector[row]
        for k in range(row + 1, min(size, row + BANDWIDTH + 1)):
            value -= factor[k, k - row] * vector[k]
        vector[row] = value / factor[row, 0]


@njit(cache=True)
def _stiffness(value, lower, upper, lower_multiplier, upper_multiplier):
    """Returns the barrier's second derivative, by its primal-dual estimate."""
    stiffness = 0.0
    if lower > -math.inf:
        stiffness += lower_multiplier / (value - lower)
    if upper < math.inf:
        stiffness += upper_multiplier / (upper - value)
    return stiffness


@njit(cache=True)
def _push(value, lower, upper, barrier):
    """Returns the barrier's first derivative."""
    push = 0.0
    if lower > -math.inf:
        push -= barrier / (value - lower)
    if upper < math.inf:
        push += barrier / (upper - value)
    return push


@njit(cache=True)
def _step_to_bound(value, change, lower, upper):
    """Returns the largest share of a change, up to 1, that keeps off the bounds."""
    share = 1.0
    if change < 0.0 and lower > -math.inf:
        share = min(share, TO_BOUND_RATIO * (value - lower) / -change)
    if change > 0.0 and upper < math.inf:
        share = min(share, TO_BOUND_RATIO * (upper - value) / change)
    return share


@njit(cache=True)
def _multiplier_after(multiplier, room, room_change, barrier):
    """Returns the change of a bound's multiplier that goes with a change of the room before it."""
    return (barrier - multiplier * room_change) / room - multiplier


@njit(cache=True)
def _share_of_multiplier(multiplier, change):
    """Returns the largest share of a change, up to 1, that keeps a multiplier positive."""
    return 1.0 if change >= 0.0 else min(1.0, TO_BOUND_RATIO * multiplier / -change)


@njit(cache=True)
def _kept_near(multiplier, room, barrier):
    """Returns a bound's multiplier, kept within a factor of the barrier's own."""
    own = barrier / room
    return min(max(multiplier, own / MULTIPLIER_SPREAD), own * MULTIPLIER_SPREAD)


@njit(cache=True)
def _is_equality(bounds, row):
    return bounds.row_lower[row] == bounds.row_upper[row]


@njit(cache=True)
def _is_bounded(lower, upper):
    return lower > -math.inf or upper < math.inf


@njit(cache=True)
def _assemble(jacobian, row_stiffness, column_stiffness, structure, matrix, border):
    """Adds J^T diag(row_stiffness) J + diag(column_stiffness); returns the slack's own element.

    matrix: of the other columns. border: (size,) of the slack with them.
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


@njit(cache=True)
def _add_row_slopes(jacobian, multipliers, structure, gradient):
    """Adds J^T multipliers to the gradient (N,)."""
    for row in range(multipliers.shape[0]):
        for i in range(structure.starts[row], structure.starts[row + 1]):
            column = structure.columns[i]
            gradient[column] += multipliers[row] * jacobian[row, column]


@njit(cache=True)
def _newton_step(matrix, border, corner, gradient, positions, step):
    """Fills step (N,) with -(second derivatives)^-1 gradient; returns whether it could.

    Where the second derivatives are not positive, as much is added to their diagonal as it takes.
    """
    size = matrix.shape[0]
    factor = np.empty_like(matrix)
    across, along = np.empty(size), np.empty(size)
    damping = 0.0
    while True:
        if _factorise(matrix, damping, factor):
            across[:] = border
            _substitute(factor, across)
            pivot = corner + damping - np.dot(border, across)
            if pivot > 0.0:
                break
        damping = max(FIRST_DAMPING, damping * DAMPING_GROWTH)
        if damping > MOST_DAMPING:
            return False
    last = gradient.shape[0] - 1
    for column in range(last):
        along[positions[column]] = -gradient[column]
    _substitute(factor, along)
    slack = (-gradient[last] - np.dot(border, along)) / pivot
    for column in range(last):
        step[column] = along[positions[column]] - slack * across[positions[column]]
    step[last] = slack
    return True


@njit(cache=True)
def descend(
    guess,
    interval_count,
    scene,
    weights,
    bounds,
    structure,
    barrier,
    iterations,
    error_tolerance,
    violation_tolerance,
):
    """Returns (z, converged, iterations, error, violation) as `Descent`, from a guess (N,)."""
    m = interval_count
    count = guess.shape[0]
    size = count - 1
    z = guess.copy()
    z_low, z_high = np.zeros(count), np.zeros(count)
    for i in range(count):
        z[i] = _pushed(z[i], bounds.lower[i], bounds.upper[i], BOUND_PUSH)
        if bounds.lower[i] > -math.inf:
            z_low[i] = barrier / (z[i] - bounds.lower[i])
        if bounds.upper[i] < math.inf:
            z_high[i] = barrier / (bounds.upper[i] - z[i])
    values, jacobian = band_constraints(z, m, scene)
    rows = values.shape[0]
    slacks, multipliers = values.copy(), np.zeros(rows)
    low, high = np.zeros(rows), np.zeros(rows)
    for r in range(rows):
        lower, upper = bounds.row_lower[r], bounds.row_upper[r]
        if lower == upper:
            slacks[r] = lower
            continue
        slacks[r] = _pushed(values[r], lower, upper, BOUND_PUSH)
        if lower > -math.inf:
            low[r] = barrier / (slacks[r] - lower)
        if upper < math.inf:
            high[r] = barrier / (upper - slacks[r])
        multipliers[r] = high[r] - low[r]
    row_stiffness, targets = np.empty(rows), np.empty(rows)
    column_stiffness, step = np.empty(count), np.empty(count)
    border = np.empty(size)
    slack_steps = np.empty(rows)
    error, violation = math.inf, math.inf
    for iteration in range(iterations + 1):
        _, gradient = band_objective(z, m, scene, weights)
        # How far the conditions of the barrier problem are from holding.
        slope = gradient.copy()
        _add_row_slopes(jacobian, multipliers, structure, slope)
        error, violation = 0.0, 0.0
        for i in range(count):
            error = max(error, abs(slope[i] - z_low[i] + z_high[i]))
        for r in range(rows):
            violation = max(violation, abs(values[r] - slacks[r]))
        if not (error < math.inf and violation < math.inf):
            return z, False, iteration, error, violation
        if error <= error_tolerance and violation <= violation_tolerance:
            return z, True, iteration, error, violation
        if iteration == iterations:
            break
        matrix = np.zeros((size, BANDWIDTH + 1))
        add_lagrangian_curvature(z, m, scene, weights, multipliers, structure.positions, matrix)
        for r in range(rows):
            if _is_equality(bounds, r):
                row_stiffness[r] = 1.0 / COMPLIANCE
                targets[r] = multipliers[r] + (values[r] - slacks[r]) / COMPLIANCE
            else:
                lower, upper = bounds.row_lower[r], bounds.row_upper[r]
                row_stiffness[r] = _stiffness(slacks[r], lower, upper, low[r], high[r])
                targets[r] = row_stiffness[r] * (values[r] - slacks[r])
                targets[r] += _push(slacks[r], lower, upper, barrier)
        for i in range(count):
            lower, upper = bounds.lower[i], bounds.upper[i]
            column_stiffness[i] = _stiffness(z[i], lower, upper, z_low[i], z_high[i])
            gradient[i] += _push(z[i], lower, upper, barrier)
        _add_row_slopes(jacobian, targets, structure, gradient)
        border[:] = 0.0
        corner = _assemble(jacobian, row_stiffness, column_stiffness, structure, matrix, border)
        if not _newton_step(matrix, border, corner, gradient, structure.positions, step):
            break
        share, multiplier_share = 1.0, 1.0
        for i in range(m, m + VARIABLES_PER_POSE * (m - 1)):
            if abs(step[i]) > LONGEST_MOVE:
                share = min(share, LONGEST_MOVE / abs(step[i]))
        for i in range(count):
            lower, upper = bounds.lower[i], bounds.upper[i]
            share = min(share, _step_to_bound(z[i], step[i], lower, upper))
        for r in range(rows):
            change = values[r] - slacks[r]
            for i in range(structure.starts[r], structure.starts[r + 1]):
                change += jacobian[r, structure.columns[i]] * step[structure.columns[i]]
            slack_steps[r] = change
            if not _is_equality(bounds, r):
                lower, upper = bounds.row_lower[r], bounds.row_upper[r]
                share = min(share, _step_to_bound(slacks[r], change, lower, upper))
        for r in range(rows):
            if _is_equality(bounds, r):
                multipliers[r] += share * slack_steps[r] / COMPLIANCE
                continue
            lower, upper = bounds.row_lower[r], bounds.row_upper[r]
            if not _is_bounded(lower, upper):
                slacks[r] += share * slack_steps[r]
                continue
            target = row_stiffness[r] * slack_steps[r] + _push(slacks[r], lower, upper, barrier)
            multipliers[r] += share * (target - multipliers[r])
            if lower > -math.inf:
                room = slacks[r] - lower
                low_step = _multiplier_after(low[r], room, slack_steps[r], barrier)
                low[r] += _share_of_multiplier(low[r], low_step) * low_step
            if upper < math.inf:
                room = upper - slacks[r]
                high_step = _multiplier_after(high[r], room, -slack_steps[r], barrier)
                high[r] += _share_of_multiplier(high[r], high_step) * high_step
            slacks[r] += share * slack_steps[r]
            if lower > -math.inf:
                low[r] = _kept_near(low[r], slacks[r] - lower, barrier)
            if upper < math.inf:
                high[r] = _kept_near(high[r], upper - slacks[r], barrier)
        for i in range(count):
            lower, upper = bounds.lower[i], bounds.upper[i]
            if lower > -math.inf:
                low_step = _multiplier_after(z_low[i], z[i] - lower, step[i], barrier)
                z_low[i] += _share_of_multiplier(z_low[i], low_step) * low_step
            if upper < math.inf:
                high_step = _multiplier_after(z_high[i], upper - z[i], -step[i], barrier)
                z_high[i] += _share_of_multiplier(z_high[i], high_step) * high_step
            z[i] += share * step[i]
            if lower > -math.inf:
                z_low[i] = _kept_near(z_low[i], z[i] - lower, barrier)
            if upper < math.inf:
                z_high[i] = _kept_near(z_high[i], upper - z[i], barrier)
        values, jacobian = band_constraints(z, m, scene)
    return z, False, iterations, error, violation
