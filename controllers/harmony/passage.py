"""Whether the map has a way from one point to another at all, however the robot would turn."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.grid import world_to_cell


@njit(cache=True)
def is_connected(field, clearance, longest, start, end):
    """Returns whether cells at least `clearance` m from obstacles lead from a point to another.

    field: DistanceField. start, end: (2,) m. Cells side by side are connected; those over which
    even the straight way from start to end is longer than `longest` m do not count. A start that is
    nearer to obstacles counts as free; a point off the map is connected with nothing.
    """
    distances = field.distances
    rows, columns = distances.shape
    place = (field.origin_x, field.origin_y, field.resolution, columns, rows)
    first_column, first_row = world_to_cell(start[0], start[1], *place)
    end_column, end_row = world_to_cell(end[0], end[1], *place)
    if first_column < 0 or end_column < 0:
        return False
    most = longest / field.resolution
    is_seen = np.zeros((rows, columns), dtype=np.bool_)
    stack = np.empty(rows * columns, dtype=np.int64)
    stack[0] = first_row * columns + first_column
    is_seen[first_row, first_column] = True
    height = 1
    while height > 0:
        height -= 1
        row, column = stack[height] // columns, stack[height] % columns
        if row == end_row and column == end_column:
            return True
        for step in range(4):
            near_row = row + (step == 0) - (step == 1)
            near_column = column + (step == 2) - (step == 3)
            if not (0 <= near_row < rows and 0 <= near_column < columns):
                continue
            so_far = math.hypot(near_row - first_row, near_column - first_column)
            if so_far + math.hypot(near_row - end_row, near_column - end_column) > most:
                continue
            if is_seen[near_row, near_column] or distances[near_row, near_column] < clearance:
                continue
            is_seen[near_row, near_column] = True
            stack[height] = near_row * columns + near_column
            height += 1
    return False
