"""Cholesky's method for band matrices, such as those of both TEBs.

A matrix is its lower half, (N, bandwidth + 1): element (row, column) is at [row, row - column].
"""

import math

from numba.extending import register_jitable

# The bandwidth of both TEBs: an acceleration couples two intervals, so the columns of three poses.
BANDWIDTH = 10


@register_jitable(error_model="numpy")
def factorise(matrix, damping, factor, least_pivot):
    """Fills the lower factor of matrix + damping I by Cholesky's method.

    Returns whether it could: all squared pivots are above the least one.
    """
    size, bandwidth = matrix.shape[0], matrix.shape[1] - 1
    for row in range(size):
        start = max(0, row - bandwidth)
        for column in range(start, row + 1):
            value = matrix[row, row - column]
            if column == row:
                value += damping
            for k in range(max(start, column - bandwidth), column):
                value -= factor[row, row - k] * factor[column, column - k]
            if column < row:
                factor[row, row - column] = value / factor[column, 0]
            elif value > least_pivot:
                factor[row, 0] = math.sqrt(value)
            else:
                return False
    return True


@register_jitable(error_model="numpy")
def substitute(factor, vector):
    """Solves with the factor of `factorise`, in place."""
    size, bandwidth = factor.shape[0], factor.shape[1] - 1
    for row in range(size):
        value = vector[row]
        for k in range(max(0, row - bandwidth), row):
            value -= factor[row, row - k] * vector[k]
        vector[row] = value / factor[row, 0]
    for row in range(size - 1, -1, -1):
        value = vector[row]
        for k in range(row + 1, min(size, row + bandwidth + 1)):
            value -= factor[k, k - row] * vector[k]
        vector[row] = value / factor[row, 0]
