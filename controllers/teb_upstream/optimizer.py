"""Levenberg and Marquardt's method on a band, as g2o runs it for teb_local_planner.

A few outer rounds resize the band, attach obstacles anew and raise their weight; each runs a few
steps. The normal equations are a band matrix, solved by Cholesky's method in linear time. Sources:
teb_local_planner's TebOptimalPlanner::optimizeTEB, g2o's OptimizationAlgorithmLevenberg.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb_upstream.association import attach
from drake_navbench.controllers.teb_upstream.band import copy_band, resize
from drake_navbench.controllers.teb_upstream.normal_equations import (
    COST_KINDS,
    OBSTACLE_COST,
    OTHER_COST,
    STRIDE,
    TIME_COST,
    VIA_POINT_COST,
    System,
)
from drake_navbench.controllers.teb_upstream.penalties import BandSurroundings, add_edges
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.band_cholesky import BANDWIDTH, factorise, substitute

# g2o's settings of the damping.
FIRST_DAMPING = 1e-5
LEAST_DAMPING_FACTOR, MOST_DAMPING_FACTOR = 1.0 / 3.0, 2.0 / 3.0
MOST_TRIALS = 10
# Added to the predicted gain, so that it is never zero.
LEAST_GAIN = 1e-3
# The cost of a step that cannot be computed.
LARGEST_COST = float(np.finfo(np.float64).max)
# With a lower speed limit no band is optimised, m/s.
LEAST_SPEED = 0.01


class Optimized(NamedTuple):
    """The result of optimising a band.

    cost: the cost by which bands are compared. chi_squared: sum of squares of the last step, where
    divergence is detected, zero where the last round ended early. step_count: steps of all rounds
    together.
    """

    succeeded: bool
    poses: Array
    time_steps: Array
    cost: float
    chi_squared: float
    step_count: int


@njit(cache=True, error_model="numpy")
def solve_banded(matrix, damping, right, size, factor, solution):
    """Solves (matrix + damping I) solution = right by Cholesky's method; returns whether it can.

    matrix: (S, 11) lower band, row r and column r - c; only rows and columns 3 to 3 + size. factor:
    (S, 11) scratch. solution: (S,) filled there.
    """
    first = STRIDE - 1
    end = first + size
    if not factorise(matrix[first:end], damping, factor[first:end], 0.0):
        return False
    for row in range(first, end):
        solution[row] = right[row]
    substitute(factor[first:end], solution[first:end])
    return True


@register_jitable(error_model="numpy")
def _move(poses, steps, count, solution):
    """Adds a step (S,) to the inner poses and all time steps, in place."""
    for i in range(count - 1):
        steps[i] += solution[STRIDE * i + 3]
    for i in range(1, count - 1):
        column = STRIDE * i
        poses[i, 0] += solution[column]
        poses[i, 1] += solution[column + 1]
        yaw = poses[i, 2] + solution[column + 2]
        if not (-math.pi <= yaw < math.pi):
            yaw -= math.floor(yaw / (2.0 * math.pi)) * 2.0 * math.pi
            if yaw >= math.pi:
                yaw -= 2.0 * math.pi
            if yaw < -math.pi:
                yaw += 2.0 * math.pi
        poses[i, 2] = yaw


@register_jitable(error_model="numpy")
def _sum(values):
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i]
    return total


@register_jitable(error_model="numpy")
def descend(poses, steps, count, record, around, attached, multiplier):
    """Runs Levenberg and Marquardt's method in place; returns (number of its steps, costs).

    costs: (COST_KINDS,) of the last trial, which need not be the one that was taken: the original
    compares bands by that.
    """
    columns = STRIDE * count
    size = STRIDE * (count - 2) + 1
    matrix, right = np.zeros((columns, BANDWIDTH + 1)), np.zeros(columns)
    costs, motion = np.zeros(COST_KINDS), np.zeros((count, 8))
    # Plain True and False would have numba compile all edges for each.
    system = System(matrix, right, np.bool_(True), costs, motion)
    trial_system = System(matrix, right, np.bool_(False), costs, motion)
    factor = np.zeros((columns, BANDWIDTH + 1))
    solution = np.zeros(columns)
    old_poses, old_steps = np.empty((count, 3)), np.empty(count)
    damping, growth = 0.0, 2.0
    first, end = STRIDE - 1, STRIDE - 1 + size
    done = 0
    for iteration in range(record[0].no_inner_iterations):
        add_edges(poses, steps, count, record, around, attached, multiplier, system)
        current = _sum(costs)
        if iteration == 0:
            largest = 0.0
            for row in range(first, end):
                largest = max(largest, matrix[row, 0])
            damping = FIRST_DAMPING * largest
        trials = 0
        gain_ratio = 0.0
        done += 1
        while True:
            copy_band(poses, steps, count, old_poses, old_steps)
            solved = solve_banded(system.matrix, damping, system.right, size, factor, solution)
            _move(poses, steps, count, solution)
            add_edges(poses, steps, count, record, around, attached, multiplier, trial_system)
            trial = _sum(costs) if solved else LARGEST_COST
            predicted = LEAST_GAIN
            for k in range(first, end):
                predicted += solution[k] * (damping * solution[k] + system.right[k])
            gain_ratio = (current - trial) / predicted
            trials += 1
            if gain_ratio > 0.0 and math.isfinite(trial):
                factor_wanted = min(1.0 - (2.0 * gain_ratio - 1.0) ** 3, MOST_DAMPING_FACTOR)
                damping *= max(LEAST_DAMPING_FACTOR, factor_wanted)
                growth = 2.0
                current = trial
            else:
                damping *= growth
                growth *= 2.0
                copy_band(old_poses, old_steps, count, poses, steps)
                if not math.isfinite(damping):
                    break
            if not (gain_ratio < 0.0 and trials < MOST_TRIALS):
                break
        if trials == MOST_TRIALS or gain_ratio == 0.0 or not math.isfinite(damping):
            break
    return done, costs


@njit(cache=True, error_model="numpy")
def optimize(poses, steps, record, around):
    """Returns (succeeded, poses (n, 3), time steps (n - 1,), cost, chi squared, steps taken).

    Fails where the robot is too slow or the band too short.
    """
    terms = record[0]
    fewest, most = terms.min_samples, terms.max_samples
    count = poses.shape[0]
    capacity = max(count, most + 2)
    band_poses, band_steps = np.empty((capacity, 3)), np.empty(capacity)
    copy_band(poses, steps, count, band_poses, band_steps)
    costs = np.zeros(COST_KINDS)
    multiplier = 1.0
    total = 0
    chi_squared = 0.0
    succeeded = terms.no_outer_iterations > 0
    for _ in range(terms.no_outer_iterations):
        if terms.teb_autosize:
            count = resize(
                band_poses,
                band_steps,
                count,
                terms.dt_ref,
                terms.dt_hysteresis,
                fewest,
                most,
                not terms.include_dynamic_obstacles,
            )
        if terms.max_vel_x < LEAST_SPEED or count < max(fewest, 3):
            succeeded = False
            break
        attached = attach(band_poses, count, around, record)
        taken, costs = descend(band_poses, band_steps, count, record, around, attached, multiplier)
        total += taken
        if terms.divergence_detection_enable:
            unused = np.zeros((1, 1)), np.zeros(1)
            system = System(*unused, np.bool_(False), costs, np.zeros((count, 8)))
            add_edges(band_poses, band_steps, count, record, around, attached, multiplier, system)
            chi_squared = _sum(costs) if taken == terms.no_inner_iterations else 0.0
        multiplier *= terms.weight_adapt_factor
    duration = _sum(band_steps[: count - 1])
    cost = (
        terms.selection_obst_cost_scale * costs[OBSTACLE_COST]
        + terms.selection_viapoint_cost_scale * costs[VIA_POINT_COST]
        + (duration if terms.selection_alternative_time_cost else costs[TIME_COST])
        + costs[OTHER_COST]
    )
    return (
        succeeded,
        band_poses[:count].copy(),
        band_steps[: count - 1].copy(),
        cost,
        chi_squared,
        total,
    )


def optimize_band(
    poses: Array, time_steps: Array, record: NDArray[np.void], around: BandSurroundings
) -> Optimized:
    """Returns the optimised band; see `optimize`."""
    result = Optimized(*optimize(poses, time_steps, record, around))
    result.poses.flags.writeable = False
    result.time_steps.flags.writeable = False
    return result
