"""The normal equations of a band, into which edges are added one by one.

Columns: x, y, yaw of pose 0, time step 0, pose 1, time step 1, and so on, so that an edge between
neighbours fills consecutive columns. Those of the first and last pose are never solved for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Columns of a pose and its time step.
STRIDE = 4
# Rounding of a residual that lies on its kink.
KINK_WIDTH = 1e-12

OBSTACLE_COST, VIA_POINT_COST, TIME_COST, OTHER_COST = 0, 1, 2, 3
COST_KINDS = 4


class System(NamedTuple):
    """The normal equations. matrix: (4 n - 1, 11), row r and column r - c. right: (4 n - 1,)."""

    matrix: Array
    right: Array


@njit(cache=True, error_model="numpy")
def positive_part(value):
    """Returns (the positive part of a value, its slope); the mean of both slopes at the kink.

    That is what central differences say there, and first guesses lie on it: they turn at the limit.
    """
    if value > KINK_WIDTH:
        return value, 1.0
    if value < -KINK_WIDTH:
        return 0.0, 0.0
    return max(value, 0.0), 0.5


@njit(cache=True, error_model="numpy")
def excess_outside(value, lower, upper, margin):
    """Returns (excess over an interval that is narrowed by a margin, its slope)."""
    if value < 0.5 * (lower + upper):
        excess, slope = positive_part(lower + margin - value)
        return excess, -slope
    return positive_part(value - (upper - margin))


@njit(cache=True, error_model="numpy")
def add_edge(system, first_column, slopes, count, residual, weight):
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
