"""The inflation layer: costs that fall off with the distance to the nearest obstacle.

Source: nav2_costmap_2d's InflationLayer of the lyrical release, which takes exact Euclidean
distances between cell centres. Distances are exact here too, by a column pass and a row pass over
integers, both cut off at the reach.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    INSCRIBED,
    LETHAL,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    distance_to_cells,
)

# Nav2 looks up costs by the distance in cells, rounded to 1 / this number.
STEPS_PER_CELL = 100


class CellWindow(NamedTuple):
    """A part of a grid: rows and columns from the first to before the last."""

    first_row: int
    last_row: int
    first_column: int
    last_column: int

    @classmethod
    def whole(cls, shape: tuple[int, int]) -> CellWindow:
        """Returns the window that covers a grid of (rows, columns)."""
        return cls(0, shape[0], 0, shape[1])

    @property
    def slices(self) -> tuple[slice, slice]:
        """The part of an array [row, column]."""
        return slice(self.first_row, self.last_row), slice(self.first_column, self.last_column)


def inflate(
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
    """Returns a new grid with the costs around LETHAL cells raised; `costs` stays unchanged.

    costs: (rows, columns) uint8. resolution: cell edge, m. inscribed_radius: inscribed radius of
    the padded footprint, m. inflation_radius (the reach, m), cost_scaling_factor (1/m),
    inflate_unknown (graded costs may replace NO_INFORMATION) and inflate_around_unknown
    (NO_INFORMATION cells are obstacles too) are Nav2's parameters. window: cells that may change;
    None is the whole grid. Obstacles outside the window count as far as they reach into it.

    The reach is whole cells, rounded up, and a cell exactly at the reach is still written, as
    Nav2's code does.
    """
    inflated = costs.copy()
    reach = distance_to_cells(float(inflation_radius), float(resolution))
    if reach == 0:
        return inflated
    table = inflation_costs(
        reach,
        resolution=resolution,
        inscribed_radius=inscribed_radius,
        cost_scaling_factor=cost_scaling_factor,
    )
    rows, columns = costs.shape
    changed = window or CellWindow.whole(costs.shape)
    seen_rows = slice(max(0, changed.first_row - reach), min(rows, changed.last_row + reach))
    seen_columns = slice(
        max(0, changed.first_column - reach), min(columns, changed.last_column + reach)
    )
    sources = costs[seen_rows, seen_columns] == LETHAL
    if inflate_around_unknown:
        sources |= costs[seen_rows, seen_columns] == NO_INFORMATION
    if sources.any():
        distances = _distances_in_columns(sources, reach)
        corner = (seen_rows.start, seen_columns.start)
        _raise_costs(inflated, changed, distances, corner, reach, table, inflate_unknown)
    return inflated


# A costmap asks for the same table at every update.
@lru_cache(maxsize=16)
def inflation_costs(
    reach: int, *, resolution: float, inscribed_radius: float, cost_scaling_factor: float
) -> NDArray[np.uint8]:
    """Returns read-only (reach^2 + 1,) uint8: costs at the squared distances of two centres, cells.

    With d the distance in cells, rounded to 1/100: LETHAL at 0, INSCRIBED where d * resolution
    <= inscribed_radius, else trunc(252 exp(-k (d * resolution - inscribed_radius))), where k is
    cost_scaling_factor. Distances are rounded in float32, as in InflationLayer::applyInflation.
    """
    cells = np.sqrt(np.arange(reach * reach + 1, dtype=np.float32))
    steps = (cells * np.float32(STEPS_PER_CELL) + np.float32(0.5)).astype(np.int64)
    distances = steps / STEPS_PER_CELL * resolution
    beyond = np.maximum(0.0, distances - inscribed_radius)
    costs = (MAX_NON_OBSTACLE * np.exp(-cost_scaling_factor * beyond)).astype(np.uint8)
    costs[distances <= inscribed_radius] = INSCRIBED
    costs[0] = LETHAL
    costs.flags.writeable = False
    return costs


@njit(cache=True)
def _distances_in_columns(sources, reach):
    """Returns (rows, columns) int32: the cells to the nearest source in the same column.

    sources: (rows, columns) bool. Beyond the reach it is reach + 1.
    """
    rows, columns = sources.shape
    distances = np.empty(sources.shape, np.int32)
    nearest = np.full(columns, np.int32(reach + 1))
    for row in range(rows):
        for column in range(columns):
            farther = min(np.int32(nearest[column] + 1), np.int32(reach + 1))
            nearest[column] = np.int32(0) if sources[row, column] else farther
            distances[row, column] = nearest[column]
    for row in range(rows - 1, -1, -1):
        for column in range(columns):
            nearest[column] = min(np.int32(nearest[column] + 1), distances[row, column])
            distances[row, column] = nearest[column]
    return distances


@njit(cache=True)
def _raise_costs(costs, window, distances, corner, reach, table, inflate_unknown):
    """Raises `costs`, in place within a window, to the costs in `table`.

    distances: as from `_distances_in_columns`; its cell (0, 0) is the cell `corner`, (row, column),
    of `costs`. The squared distance to the nearest source is the least, over all columns within
    reach, of the squares along the row plus along that column.
    """
    first_row, last_row, first_column, last_column = window
    columns = distances.shape[1]
    # Beyond the sides of the grid nothing is within reach.
    squares = np.full(columns + 2 * reach, np.int32((reach + 1) * (reach + 1)))
    inner = squares[reach : reach + columns]
    nearest = np.empty(last_column - first_column, dtype=np.int32)
    for row in range(first_row, last_row):
        closest = np.int32(reach + 1)
        for column in range(columns):
            distance = distances[row - corner[0], column]
            closest = min(closest, distance)
            inner[column] = distance * distance
        if closest > reach:
            continue
        _nearest_in_row(nearest, squares, first_column - corner[1] + reach, reach)
        for column in range(first_column, last_column):
            squared = nearest[column - first_column]
            if squared < table.shape[0]:
                cost, old = table[squared], costs[row, column]
                if old == NO_INFORMATION:
                    if cost >= INSCRIBED or (inflate_unknown and cost > FREE):
                        costs[row, column] = cost
                elif cost > old:
                    costs[row, column] = cost


@register_jitable
def _nearest_in_row(nearest, squares, first, reach):
    """Writes into `nearest` the least of squares[first + column + k] + k^2 over |k| <= reach."""
    count = nearest.shape[0]
    for column in range(count):
        nearest[column] = squares[first + column]
    for k in range(1, reach + 1):
        along = np.int32(k * k)
        left, right = squares[first - k :], squares[first + k :]
        for column in range(count):
            candidate = np.int32(min(left[column], right[column]) + along)
            nearest[column] = min(nearest[column], candidate)
