"""The distance by which a cluster of occupied cells has moved between two costmaps.

A convex shape that is moved covers one cell that lies as far from all old cells as it has moved,
and straight ahead of the nearest of them: the directed Hausdorff distance, whatever else of the
shape is in sight. Cells count only where the other costmap saw them free: a cell that only came
into sight shows no motion.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Steps along a line of sight, in cells.
SIGHT_STEP_CELLS = 0.5


@njit(cache=True)
def _is_near(lethal, row, column):
    """Whether a cell or one of its eight neighbours is occupied.

    The neighbours count because a slanted surface has gaps between its cells.
    """
    rows, columns = lethal.shape
    for i in range(max(row - 1, 0), min(row + 2, rows)):
        for j in range(max(column - 1, 0), min(column + 2, columns)):
            if lethal[i, j]:
                return True
    return False


@njit(cache=True)
def _sees(lethal, corner, robot, row, column, sight):
    """Whether a cell was free and in plain sight of the robot; all in cells of the frame."""
    ahead, aside = row + 0.5 - robot[0], column + 0.5 - robot[1]
    distance = math.hypot(ahead, aside)
    if distance > sight:
        return False
    rows, columns = lethal.shape
    steps = int(distance / SIGHT_STEP_CELLS) + 1
    for k in range(steps + 1):
        share = k / steps
        i = math.floor(robot[0] + share * ahead) - corner[0]
        j = math.floor(robot[1] + share * aside) - corner[1]
        if not (0 <= i < rows and 0 <= j < columns) or _is_near(lethal, i, j):
            return False
    return True


@njit(cache=True)
def farthest_free_cell(cells, others, lethal, corner, robot, sight):
    """Returns (distance, row, column) from the nearest of the others to the farthest of the cells.

    cells (N, 2), others (M, 2): rows and columns. Of the cells only those count that the costmap
    `lethal`, with its first cell at `corner`, shows free and in sight of the robot within `sight`.
    The distance is 0 where no cell counts.
    """
    best, best_row, best_column = 0.0, 0.0, 0.0
    for n in range(cells.shape[0]):
        row, column = cells[n, 0], cells[n, 1]
        nearest, along_rows, along_columns = math.inf, 0.0, 0.0
        for m in range(others.shape[0]):
            rows, columns = float(row - others[m, 0]), float(column - others[m, 1])
            squared = rows * rows + columns * columns
            if squared < nearest:
                nearest, along_rows, along_columns = squared, rows, columns
                if nearest <= best * best:
                    break
        is_farther = best * best < nearest < math.inf
        if is_farther and _sees(lethal, corner, robot, row, column, sight):
            best, best_row, best_column = math.sqrt(nearest), along_rows, along_columns
    return best, best_row, best_column


@njit(cache=True)
def nearest_labels(cells, labels, count, others, other_labels):
    """Returns (count,) for each label the nearest one of the others, and its distance.

    cells (N, 2), labels (N,), others (M, 2), other_labels (M,). -1 where there is none.
    """
    squared = np.full(count, np.inf)
    nearest = np.full(count, -1, dtype=np.int64)
    for n in range(cells.shape[0]):
        if squared[labels[n]] == 0.0:
            continue
        for m in range(others.shape[0]):
            rows, columns = cells[n, 0] - others[m, 0], cells[n, 1] - others[m, 1]
            distance = float(rows * rows + columns * columns)
            if distance < squared[labels[n]]:
                squared[labels[n]], nearest[labels[n]] = distance, other_labels[m]
    return nearest, np.sqrt(squared)
