"""The program of one cycle, solved in numba by a primal-dual interior-point method.

Single shooting: a plan always is the motion that its inputs lead to, so that it can be driven
whenever the method stops. Inequality rows have slacks and multipliers; a Newton step is one
Riccati recursion with the second derivatives of Gauss and Newton, and a line search on a merit
function decides how much of it is taken (Nocedal, Wright: Numerical Optimization, chapter 19; with
the roll-out of Pavlov, Shames, Manzie: Interior Point Differential Dynamic Programming, 2021).
Rest at the end is an equality, kept by multipliers and a stiff quadratic term.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.motion import (
    STAGE_SIZE,
    STATE_SIZE,
    V,
    advance,
    fill,
    roll_out,
    slopes_of_advance,
)
from drake_navbench.controllers.harmony.riccati import feedback_gains
from drake_navbench.controllers.harmony.rows import (
    FIRST_DISC_ROW,
    SLOPES_A_ROW,
    is_row_of,
    row_count,
    stage_rows,
)
from drake_navbench.controllers.harmony.scene import Scene
from drake_navbench.controllers.harmony.terms import stage_cost
from drake_navbench.kernels.barrier import TO_BOUND_RATIO

Array = NDArray[np.float64]

# Violations of clearance count only by this factor: the gatekeeper checks the outline itself.
CLEARANCE_SHARE = 0.1
# The least slack at the start, in parts of the limits.
LEAST_SLACK = 1e-2
# The weight of squared velocities and accelerations at the end, besides their multipliers.
REST_PRICE = 5000.0
# Added to the second derivatives of the jerks, on which no term may depend.
DAMPING = 1e-5
BARRIER_CUT = 0.2
MOST_CUTS = 8
# The barrier falls after a step of at least this share of the Newton step.
FULL_ENOUGH = 0.5
SUFFICIENT_DECREASE = 1e-4
# The merit has converged when a step lowers it by no more than this.
STILL = 1e-9


class SolverSettings(NamedTuple):
    """The settings of the interior-point method.

    iterations: the most. first_barrier, last_barrier: the barrier parameter falls from the first to
    the last. tolerance: a plan is solved if no row is violated by more, in parts of its limit, and
    rest at the end by no more, in SI units.
    """

    iterations: int
    first_barrier: float
    last_barrier: float
    tolerance: float


class Solution(NamedTuple):
    """The result of the interior-point method.

    plan: (N + 1, 9). cost: that of the terms. violation: the largest violation of the rows, in
    parts of their limits (a tenth of it for clearances), and of rest at the end. iterations: the
    number taken. solved: whether the violation is within the tolerance.
    """

    plan: Array
    cost: float
    violation: float
    iterations: int
    solved: bool


class Expansion(NamedTuple):
    """Rows and derivatives at a plan of N + 1 stages.

    values: (N + 1, R) of the rows; columns, slopes: (N + 1, R, S) of each, which variables of its
    stage it depends on and how. gradients: (N + 1, 9), hessians: (N + 1, 9, 9) of the cost.
    """

    values: Array
    columns: NDArray[np.int64]
    slopes: Array
    gradients: Array
    hessians: Array


@njit(cache=True, error_model="numpy")
def _new_expansion(count, rows):
    return Expansion(
        np.empty((count, rows)),
        np.zeros((count, rows, SLOPES_A_ROW), dtype=np.int64),
        np.empty((count, rows, SLOPES_A_ROW)),
        np.empty((count, STAGE_SIZE)),
        np.empty((count, STAGE_SIZE, STAGE_SIZE)),
    )


@njit(cache=True, error_model="numpy")
def _evaluate(scene, plan, at):
    """Fills the expansion at a plan; returns the cost."""
    last = plan.shape[0] - 1
    at.gradients[:] = 0.0
    at.hessians[:] = 0.0
    cost = 0.0
    for k in range(last + 1):
        reference = scene.references[k]
        cost += stage_cost(scene, k, last, plan[k], reference, at.gradients[k], at.hessians[k])
        stage_rows(scene, k, plan[k], at.values[k], at.columns[k], at.slopes[k])
    return cost


@njit(cache=True, error_model="numpy")
def _add_barrier(last, at, slacks, multipliers, barrier):
    """Adds to the derivatives the terms of the eliminated slacks and multipliers."""
    values, columns, slopes = at.values, at.columns, at.slopes
    for k in range(last + 1):
        for row in range(values.shape[1]):
            if not is_row_of(k, last, row):
                continue
            stiffness = multipliers[k, row] / slacks[k, row]
            residual = values[k, row] - slacks[k, row]
            force = barrier / slacks[k, row] - stiffness * residual
            for i in range(SLOPES_A_ROW):
                slope = slopes[k, row, i]
                if slope == 0.0:
                    continue
                column = columns[k, row, i]
                at.gradients[k, column] -= slope * force
                for j in range(SLOPES_A_ROW):
                    other = slopes[k, row, j]
                    if other != 0.0:
                        at.hessians[k, column, columns[k, row, j]] += stiffness * slope * other


@njit(cache=True, error_model="numpy")
def _add_rest(plan, rest_multipliers, at):
    """Adds to the derivatives the terms of rest at the end."""
    last = plan.shape[0] - 1
    for i in range(STATE_SIZE - V):
        at.gradients[last, V + i] += rest_multipliers[i] + REST_PRICE * plan[last, V + i]
        at.hessians[last, V + i, V + i] += REST_PRICE


@njit(cache=True, error_model="numpy")
def _rest_cost(plan, rest_multipliers):
    last = plan.shape[0] - 1
    cost = 0.0
    for i in range(STATE_SIZE - V):
        value = plan[last, V + i]
        cost += value * (rest_multipliers[i] + 0.5 * REST_PRICE * value)
    return cost


@njit(cache=True, error_model="numpy")
def _slack_sums(last, values, slacks):
    """Returns the sums of the rows' differences from their slacks and of the slacks' logarithms."""
    gap, logarithms = 0.0, 0.0
    for k in range(last + 1):
        for row in range(values.shape[1]):
            if is_row_of(k, last, row):
                gap += abs(values[k, row] - slacks[k, row])
                logarithms += math.log(slacks[k, row])
    return gap, logarithms


@njit(cache=True, error_model="numpy")
def _row_steps(last, steps, at, slacks, multipliers, barrier, slack_steps, dual_steps):
    """Fills the steps of slacks and multipliers; returns the shares of both that may be taken."""
    values, columns, slopes = at.values, at.columns, at.slopes
    primal, dual = 1.0, 1.0
    for k in range(last + 1):
        for row in range(values.shape[1]):
            if not is_row_of(k, last, row):
                continue
            change = values[k, row] - slacks[k, row]
            for i in range(SLOPES_A_ROW):
                change += slopes[k, row, i] * steps[k, columns[k, row, i]]
            slack, multiplier = slacks[k, row], multipliers[k, row]
            dual_change = (barrier - multiplier * change) / slack - multiplier
            slack_steps[k, row], dual_steps[k, row] = change, dual_change
            if change < 0.0:
                primal = min(primal, -TO_BOUND_RATIO * slack / change)
            if dual_change < 0.0:
                dual = min(dual, -TO_BOUND_RATIO * multiplier / dual_change)
    return primal, dual


@njit(cache=True, error_model="numpy")
def _linear_steps(slopes, offsets, gains, steps):
    """Fills the steps (N + 1, 9) of all stages by the linear model."""
    steps[:] = 0.0
    for k in range(slopes.shape[0]):
        for i in range(2):
            total = offsets[k, i]
            for j in range(STATE_SIZE):
                total += gains[k, i, j] * steps[k, j]
            steps[k, STATE_SIZE + i] = total
        for i in range(STATE_SIZE):
            total = 0.0
            for j in range(STAGE_SIZE):
                total += slopes[k, i, j] * steps[k, j]
            steps[k + 1, i] = total


@njit(cache=True, error_model="numpy")
def _rolled_step(plan, offsets, gains, share, dt, moved):
    """Fills `moved` with the plan whose inputs take a share of the step, with feedback."""
    fill(moved[0], plan[0])
    for k in range(plan.shape[0] - 1):
        for i in range(2):
            total = plan[k, STATE_SIZE + i] + share * offsets[k, i]
            for j in range(STATE_SIZE):
                total += gains[k, i, j] * (moved[k, j] - plan[k, j])
            moved[k, STATE_SIZE + i] = total
        advance(moved[k], dt, moved[k + 1])


@njit(cache=True, error_model="numpy")
def _violation(last, values, plan):
    worst = 0.0
    for k in range(last + 1):
        for row in range(values.shape[1]):
            if is_row_of(k, last, row):
                share = CLEARANCE_SHARE if row >= FIRST_DISC_ROW else 1.0
                worst = max(worst, -share * values[k, row])
    for i in range(V, STATE_SIZE):
        worst = max(worst, abs(plan[last, i]))
    return worst


@njit(cache=True, error_model="numpy")
def minimise(scene, guess, iterations, first_barrier, last_barrier, tolerance):
    """Returns (plan, cost, violation, iterations taken); arguments as in SolverSettings."""
    count, rows = guess.shape[0], row_count(scene)
    last, dt = count - 1, scene.dt
    plan, moved = guess.copy(), guess.copy()
    roll_out(plan, dt)
    here, there = _new_expansion(count, rows), _new_expansion(count, rows)
    step_slopes = np.empty((last, STATE_SIZE, STAGE_SIZE))
    offsets, gains = np.zeros((last, 2)), np.zeros((last, 2, STATE_SIZE))
    steps = np.zeros((count, STAGE_SIZE))
    slack_steps, dual_steps = np.zeros((count, rows)), np.zeros((count, rows))
    rest_multipliers = np.zeros(STATE_SIZE - V)
    cost = _evaluate(scene, plan, here)
    barrier = first_barrier
    slacks = np.maximum(here.values, LEAST_SLACK)
    multipliers = barrier / slacks
    price = 1.0
    taken = 0
    for _ in range(iterations):
        taken += 1
        _add_barrier(last, here, slacks, multipliers, barrier)
        _add_rest(plan, rest_multipliers, here)
        for k in range(last):
            slopes_of_advance(plan[k], dt, step_slopes[k])
        predicted, is_convex = feedback_gains(
            here.hessians, here.gradients, step_slopes, DAMPING, offsets, gains
        )
        if not is_convex:
            break
        _linear_steps(step_slopes, offsets, gains, steps)
        primal, dual = _row_steps(
            last, steps, here, slacks, multipliers, barrier, slack_steps, dual_steps
        )
        gap, logarithms = _slack_sums(last, here.values, slacks)
        if gap > STILL:
            price = max(price, 1.5 * np.max(multipliers))
        before = cost + _rest_cost(plan, rest_multipliers) - barrier * logarithms
        before += price * gap
        share = primal
        after = before
        new_cost = cost
        new_slacks = slacks
        for _cut in range(MOST_CUTS):
            _rolled_step(plan, offsets, gains, share, dt, moved)
            new_cost = _evaluate(scene, moved, there)
            new_slacks = slacks + share * slack_steps
            new_gap, logarithms = _slack_sums(last, there.values, new_slacks)
            after = new_cost + _rest_cost(moved, rest_multipliers)
            after += price * new_gap
            after -= barrier * logarithms
            expected = SUFFICIENT_DECREASE * share * (2.0 * predicted - price * gap)
            if after <= before + min(expected, 0.0) + STILL:
                break
            share *= 0.5
        plan, moved = moved, plan
        here, there = there, here
        cost, slacks = new_cost, new_slacks
        multipliers = multipliers + dual * dual_steps
        is_still = abs(before - after) < 1e-6 * (1.0 + abs(after))
        for i in range(STATE_SIZE - V):
            rest_multipliers[i] += share * REST_PRICE * plan[last, V + i]
        is_last = barrier <= last_barrier and is_still and share > 0.5
        if is_last and _violation(last, here.values, plan) <= tolerance:
            break
        if share > FULL_ENOUGH or is_still:
            barrier = max(last_barrier, BARRIER_CUT * barrier)
    return plan, cost, _violation(last, here.values, plan), taken


def solve(scene: Scene, guess: Array, settings: SolverSettings) -> Solution:
    """Optimises a guess (N + 1, 9) by the interior-point method; reads its inputs only."""
    plan, cost, violation, taken = minimise(scene, guess, *settings)
    solved = bool(np.isfinite(plan).all()) and violation <= settings.tolerance
    return Solution(plan, cost, violation, taken, solved)
