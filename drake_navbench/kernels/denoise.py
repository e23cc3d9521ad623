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
    kept = costs.copy()
    if minimal_group_size <= 1:
        return kept
    pending = (costs == INSCRIBED) | (costs == LETHAL)
    if unknown_is_obstacle:
        pending |= costs == NO_INFORMATION
    group = np.empty((np.count_nonzero(pending), 2), dtype=np.int32)
    _free_small_groups(
        kept, pending, group, minimal_group_size, group_connectivity_type == FOUR_CONNECTED
    )
    return kept


@njit(cache=True)
def _free_small_groups(costs, pending, group, minimal_group_size, four_connected):
    """Frees small groups in `costs`, in place; clears `pending`, the obstacle cells, on the way.

    group: (N, 2) scratch for the rows and columns of the group in hand.
    """
    rows, columns = costs.shape
    for row in range(rows):
        for column in range(columns):
            if pending[row, column]:
                size = _collect_group(pending, group, row, column, four_connected)
                if size < minimal_group_size:
                    for k in range(size):
                        costs[group[k, 0], group[k, 1]] = FREE


@njit(cache=True)
def _collect_group(pending, group, row, column, four_connected):
    """Moves the cells connected to one from `pending` into `group`, and returns their number."""
    rows, columns = pending.shape
    group[0, 0], group[0, 1] = row, column
    pending[row, column] = False
    size, done = 1, 0
    while done < size:
        for next_row in range(max(0, group[done, 0] - 1), min(rows, group[done, 0] + 2)):
            for next_column in range(max(0, group[done, 1] - 1), min(columns, group[done, 1] + 2)):
                is_corner = next_row != group[done, 0] and next_column != group[done, 1]
                if pending[next_row, next_column] and not (four_connected and is_corner):
                    pending[next_row, next_column] = False
                    group[size, 0], group[size, 1] = next_row, next_column
                    size += 1
        done += 1
    return size
