"""The inflation of the releases up to Kilted: a wave that spreads from the obstacles cell by cell.

A cell inherits the obstacle of the neighbour that reached it first, in the order of its distance
from that obstacle, so that now and then it takes one that is not the nearest. Costs are those of
exact distances, not rounded.
Source: nav2_costmap_2d (InflationLayer), branches humble to kilted; lyrical has it as
LegacyInflationLayer. The layer since then is `inflation`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    INSCRIBED,
    LETHAL,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    distance_to_cells,
)
from drake_navbench.kernels.inflation import CellWindow

# Each cell may be queued once by each of its neighbours.
NEIGHBOURS = 4
END = -1


def inflate_by_wave(
    costs: NDArray[np.uint8],
    *,
    resolution: float,
    inscribed_radius: float,
    inflation_radius: float = 0.55,
    cost_scaling_factor: float = 10.0,
    inflate_unknown: bool = False,
    inflate_around_unknown: bool = False,
    window: CellWindow | None = None,
) -> NDArray[np.uint8]:
    """Returns a new grid with the costs around LETHAL cells raised; arguments as for `inflate`."""
    inflated = costs.copy()
    reach = distance_to_cells(float(inflation_radius), float(resolution))
    if reach == 0:
        return inflated
    table = wave_costs(
        reach,
        resolution=resolution,
        inscribed_radius=inscribed_radius,
        cost_scaling_factor=cost_scaling_factor,
    )
    changed = window or CellWindow.whole(costs.shape)
    _spread(inflated, changed, reach, table, inflate_unknown, inflate_around_unknown)
    return inflated


def wave_costs(
    reach: int, *, resolution: float, inscribed_radius: float, cost_scaling_factor: float
) -> NDArray[np.uint8]:
    """Returns (reach^2 + 1,) uint8: the cost at each squared distance, in cells, of two centres.

    LETHAL at 0, INSCRIBED up to the inscribed radius, else trunc(252 exp(-k (d - radius))), where k
    is cost_scaling_factor and d the distance, m. (InflationLayer::computeCost)
    """
    distances = np.sqrt(np.arange(reach * reach + 1, dtype=np.float64)) * resolution
    factors = np.exp(-1.0 * cost_scaling_factor * np.maximum(distances - inscribed_radius, 0.0))
    costs = (MAX_NON_OBSTACLE * factors).astype(np.uint8)
    costs[distances <= inscribed_radius] = INSCRIBED
    costs[0] = LETHAL
    return costs


@njit(cache=True)
def _spread(costs, window, reach, table, inflate_unknown, inflate_around_unknown):
    """Raises `costs`, in place within a window, from the obstacles in it and up to `reach` beside.

    The queue is one list of entries for each squared distance, first in, first out; an entry that
    comes into a list that is done with is lost, as in Nav2.
    """
    first_row, last_row, first_column, last_column = window
    rows, columns = costs.shape
    low_row, high_row = max(0, first_row - reach), min(rows, last_row + reach)
    low_column, high_column = max(0, first_column - reach), min(columns, last_column + reach)
    visited = (high_row - low_row + 2 * reach) * (high_column - low_column + 2 * reach)
    capacity = (NEIGHBOURS + 1) * min(visited, rows * columns)
    cells = np.empty(capacity, dtype=np.int32)
    sources = np.empty(capacity, dtype=np.int32)
    following = np.empty(capacity, dtype=np.int32)
    heads = np.full(table.shape[0], END, dtype=np.int32)
    tails = np.full(table.shape[0], END, dtype=np.int32)
    queue = cells, sources, following, heads, tails
    seen = np.zeros(rows * columns, dtype=np.bool_)
    # No plain constants, for each of which `_append` would be compiled anew.
    count, here = np.int64(0), np.int64(0)
    for row in range(low_row, high_row):
        for column in range(low_column, high_column):
            cost = costs[row, column]
            if cost == LETHAL or (inflate_around_unknown and cost == NO_INFORMATION):
                cell = row * columns + column
                count = _append(queue, count, here, cell, cell)
    for squared in range(table.shape[0]):
        entry = heads[squared]
        while entry != END:
            cell, source = np.int64(cells[entry]), np.int64(sources[entry])
            if not seen[cell]:
                seen[cell] = True
                row, column = cell // columns, cell % columns
                is_in_window = first_row <= row < last_row and first_column <= column < last_column
                if is_in_window:
                    _raise(costs, row, column, table[squared], inflate_unknown)
                source_row, source_column = source // columns, source % columns
                # Left, down, right, up, as Nav2 looks at them.
                for step in range(NEIGHBOURS):
                    next_row = row + (-1 if step == 1 else 1 if step == 3 else 0)
                    next_column = column + (-1 if step == 0 else 1 if step == 2 else 0)
                    if not (0 <= next_row < rows and 0 <= next_column < columns):
                        continue
                    beside = next_row * columns + next_column
                    away_row, away_column = next_row - source_row, next_column - source_column
                    away = away_row * away_row + away_column * away_column
                    if not seen[beside] and away <= reach * reach:
                        count = _append(queue, count, away, beside, source)
            entry = following[entry]


@njit(cache=True)
def _append(queue, count, squared, cell, source):
    """Puts an entry at the end of the list of a squared distance; returns how many there are."""
    cells, sources, following, heads, tails = queue
    cells[count], sources[count], following[count] = cell, source, END
    if heads[squared] == END:
        heads[squared] = count
    else:
        following[tails[squared]] = count
    tails[squared] = count
    return count + 1


@njit(cache=True)
def _raise(costs, row, column, cost, inflate_unknown):
    old = costs[row, column]
    if old == NO_INFORMATION:
        if cost >= INSCRIBED or (inflate_unknown and cost > FREE):
            costs[row, column] = cost
    elif cost > old:
        costs[row, column] = cost
