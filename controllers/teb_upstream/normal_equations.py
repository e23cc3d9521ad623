"""The normal equations of a band, into which edges are added one by one.

Columns: x, y, yaw of pose 0, time step 0, pose 1, time step 1, and so on, so that an edge between
neighbours fills consecutive columns. Those of the first and last pose are never solved for.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.arrays import Array

# Columns of a pose and its time step.
STRIDE = 4
# g2o takes slopes by central differences of this step.
DIFFERENCE = 1e-9
# A value nearer to its kink than this may be within such a step of it: slopes are below 1000.
KINK_REACH = 1e-6

OBSTACLE_COST, VIA_POINT_COST, TIME_COST, OTHER_COST = 0, 1, 2, 3
COST_KINDS = 4


class System(NamedTuple):
    """The sums over all edges: costs, and, with slopes, the normal equations.

    matrix: (4 n - 1, 11), row r and column r - c. right: (4 n - 1,). costs: (COST_KINDS,). motion:
    (n, 8) speed, turn rate and the six slopes of the signed length of each interval.
    """

    matrix: Array
    right: Array
    with_slopes: bool
    costs: Array
    motion: Array


@njit(cache=True, error_model="numpy")
def excess_outside(value, lower, upper, margin):
    """Returns (signed excess over an interval that is narrowed by a margin, side).

    A negative excess means that the value is inside. The side is -1 at the lower limit and 1 at the
    upper: a slope of the value times the side is the slope of the excess.
    """
    if value < max(0.5 * (lower + upper), lower + margin):
        return lower + margin - value, -1.0
    return value - (upper - margin), 1.0


@register_jitable(error_model="numpy")
def add_edge(system, first_column, slopes, count, residual, weight):
    """Adds one edge, whose slopes (count,) fill the columns from the first one on."""
    matrix, right = system.matrix, system.right
    for i in range(count):
        slope = weight * slopes[i]
        if slope == 0.0:
            continue
        row = first_column + i
        right[row] -= slope * residual
        for j in range(i + 1):
            matrix[row, i - j] += slope * slopes[j]


@register_jitable(error_model="numpy")
def add_penalty(system, first_column, slopes, count, value, weight):
    """Adds the edge whose residual is the positive part of a value with these slopes (count,).

    Within a step of its kink the slopes are g2o's, by central differences: half of the value's
    slopes where the value is 0. First guesses lie there, as they turn at the limit. Changes slopes.
    """
    if abs(value) < KINK_REACH:
        for i in range(count):
            reach = DIFFERENCE * abs(slopes[i])
            if reach > 0.0:
                slopes[i] *= min(max(0.5 + 0.5 * value / reach, 0.0), 1.0)
    add_edge(system, first_column, slopes, count, max(value, 0.0), weight)


@register_jitable(error_model="numpy")
def add_magnitude(system, first_column, slopes, count, value, weight):
    """Adds the edge whose residual is the magnitude of a value with these slopes (count,).

    Within a step of zero the slopes are g2o's, by central differences: none where the value is 0.
    Changes slopes.
    """
    for i in range(count):
        reach = DIFFERENCE * abs(slopes[i])
        if reach > abs(value):
            slopes[i] *= abs(value) / reach
    add_edge(system, first_column, slopes, count, value, weight)
