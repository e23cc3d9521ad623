"""The denoise layer: small groups of obstacle cells become free.

Source: nav2_costmap_2d (DenoiseLayer). Belongs before inflation.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION

FOUR_CONNECTED = 4
EIGHT_CONNECTED = 8


def denoise(
    costs: NDArray[np.uint8],
    *,
    minimal_group_size: int = 2,
    group_connectivity_type: int = EIGHT_CONNECTED,
    unknown_is_obstacle: bool = False,
) -> NDArray[np.uint8]:
    """Returns a new grid in which groups of fewer than minimal_group_size cells are FREE.

    costs: (rows, columns) uint8, unchanged: the window that is being updated; nothing beyond it
    counts. Obstacle cells are INSCRIBED, LETHAL and, where `unknown_is_obstacle`, NO_INFORMATION:
    in Nav2 that is so where cells never seen are not unknown by default.
    group_connectivity_type: 4 joins cells along edges only; anything else joins them at corners
    too, as in Nav2.
    """
    if minimal_group_size <= 1:
        return costs.copy()
    return _without_small_groups(
        np.ascontiguousarray(costs),
        minimal_group_size,
        group_connectivity_type == FOUR_CONNECTED,
        unknown_is_obstacle,
    )


@njit(cache=True)
def _without_small_groups(costs, minimal_group_size, four_connected, unknown_is_obstacle):
    rows, columns = costs.shape
    kept = costs.copy()
    seen = np.zeros((rows, columns), dtype=np.bool_)
    # The cells of the group in hand: rows, columns, in the order of their discovery.
    group = np.empty((rows * columns, 2), dtype=np.int32)
    for row in range(rows):
        for column in range(columns):
            if seen[row, column] or not _is_obstacle(costs[row, column], unknown_is_obstacle):
                continue
            size = _collect_group(
                costs, seen, group, row, column, four_connected, unknown_is_obstacle
            )
            if size < minimal_group_size:
                for k in range(size):
                    kept[group[k, 0], group[k, 1]] = FREE
    return kept


@njit(cache=True)
def _is_obstacle(cost, unknown_is_obstacle):
    return cost in (INSCRIBED, LETHAL) or (unknown_is_obstacle and cost == NO_INFORMATION)


@njit(cache=True)
def _collect_group(costs, seen, group, row, column, four_connected, unknown_is_obstacle):
    """Writes the connected cells into `group`, marks them in `seen`, and returns their number."""
    rows, columns = costs.shape
    group[0, 0], group[0, 1] = row, column
    seen[row, column] = True
    size, done = 1, 0
    while done < size:
        for step_row in range(-1, 2):
            for step_column in range(-1, 2):
                if four_connected and step_row != 0 and step_column != 0:
                    continue
                next_row, next_column = group[done, 0] + step_row, group[done, 1] + step_column
                if not (0 <= next_row < rows and 0 <= next_column < columns):
                    continue
                if seen[next_row, next_column]:
                    continue
                if _is_obstacle(costs[next_row, next_column], unknown_is_obstacle):
                    seen[next_row, next_column] = True
                    group[size, 0], group[size, 1] = next_row, next_column
                    size += 1
        done += 1
    return size
