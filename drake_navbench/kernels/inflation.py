"""The inflation layer: costs that fall off with the distance to the nearest obstacle.

Source: nav2_costmap_2d's InflationLayer of the lyrical release, which takes exact Euclidean
distances between cell centres. Distances are exact here too, by a column pass and a row pass over
integers, both cut off at the reach.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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

# Nav2 looks costs up by the distance in cells, rounded to one part in this many.
STEPS_PER_CELL = 100


class CellWindow(NamedTuple):
    """A part of a grid: rows and columns from the first to before the last."""

    first_row: int
    last_row: int
    first_column: int
    last_column: int


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

    costs: (rows, columns) uint8. resolution: cell edge, m. inscribed_radius: of the padded
    footprint, m. inflation_radius (the reach, m), cost_scaling_factor (1/m), inflate_unknown
    (graded costs may replace NO_INFORMATION) and inflate_around_unknown (NO_INFORMATION cells are
    obstacles too) are Nav2's parameters. window: cells that may change; None is the whole grid.
    Obstacles outside the window count as far as they reach into it.

    The reach is whole cells, rounded up, and a cell exactly at the reach is still written, as
    Nav2's code does.
    """
    inflated = costs.copy()
    reach = distance_to_cells(float(inflation_radius), float(resolution))
    if reach == 0:
        return inflated
    table = inflation_costs(
        reach, float(resolution), float(inscribed_radius), float(cost_scaling_factor)
    )
    rows, columns = costs.shape
    changed = window or CellWindow(0, rows, 0, columns)
    seen = CellWindow(
        max(0, changed.first_row - reach),
        min(rows, changed.last_row + reach),
        max(0, changed.first_column - reach),
        min(columns, changed.last_column + reach),
    )
    distances = _column_distances(inflated, seen, reach, inflate_around_unknown)
    _raise_costs(inflated, changed, distances, seen, reach, table, inflate_unknown)
    return inflated


@njit(cache=True)
def inflation_costs(reach, resolution, inscribed_radius, cost_scaling_factor):
    """Returns (reach^2 + 1,) uint8: the cost at each squared distance, in cells, of two centres.

    With d the distance in cells, rounded to 1/100: LETHAL at 0, INSCRIBED where d * resolution
    <= inscribed_radius, else trunc(252 exp(-k (d * resolution - inscribed_radius))), where k is
    cost_scaling_factor. Distances are rounded in float32, as in InflationLayer::applyInflation.
    """
    table = np.empty(reach * reach + 1, dtype=np.uint8)
    table[0] = LETHAL
    for squared in range(1, table.shape[0]):
        cells = np.float32(math.sqrt(np.float32(squared)))
        steps = int(np.float32(cells * np.float32(STEPS_PER_CELL) + np.float32(0.5)))
        distance = steps / STEPS_PER_CELL * resolution
        if distance <= inscribed_radius:
            table[squared] = INSCRIBED
        else:
            decay = math.exp(-cost_scaling_factor * (distance - inscribed_radius))
            table[squared] = int(MAX_NON_OBSTACLE * decay)
    return table


@njit(cache=True)
def _column_distances(costs, seen, reach, around_unknown):
    """Returns int32, of the shape of the window `seen`: cells to the nearest source in the column.

    A source is a LETHAL cell, or NO_INFORMATION where `around_unknown`. Distances are cut off at
    reach + 1.
    """
    rows, columns = seen.last_row - seen.first_row, seen.last_column - seen.first_column
    distances = np.empty((rows, columns), dtype=np.int32)
    for row in range(rows):
        for column in range(columns):
            cost = costs[seen.first_row + row, seen.first_column + column]
            nearest = np.int32(reach + 1)
            if row > 0:
                nearest = min(nearest, np.int32(distances[row - 1, column] + 1))
            if (cost == LETHAL) | (around_unknown & (cost == NO_INFORMATION)):
                nearest = np.int32(0)
            distances[row, column] = nearest
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            below = np.int32(distances[row + 1, column] + 1)
            distances[row, column] = min(distances[row, column], below)
    return distances


@njit(cache=True)
def _raise_costs(costs, changed, distances, seen, reach, table, inflate_unknown):
    """Raises `costs`, in place within the window `changed`, to the costs in `table`.

    distances: as from `_column_distances` for the window `seen`. The squared distance to the
    nearest source is the least, over all columns within reach, of the squares along the row plus
    along that column.
    """
    width = distances.shape[1]
    # Squared distances along columns, with a margin so that no column within reach is missing.
    squares = np.full(width + 2 * reach, (reach + 1) * (reach + 1), dtype=np.int32)
    nearest = np.empty(changed.last_column - changed.first_column, dtype=np.int32)
    first = reach + changed.first_column - seen.first_column
    for row in range(changed.first_row, changed.last_row):
        closest = np.int32(reach + 1)
        for column in range(width):
            distance = distances[row - seen.first_row, column]
            closest = min(closest, distance)
            squares[reach + column] = distance * distance
        if closest > reach:
            continue
        _nearest_in_row(nearest, squares, first, reach)
        for k in range(nearest.shape[0]):
            if nearest[k] < table.shape[0]:
                column = changed.first_column + k
                cost, old = table[nearest[k]], costs[row, column]
                if old == NO_INFORMATION:
                    if cost >= INSCRIBED or (inflate_unknown and cost > FREE):
                        costs[row, column] = cost
                elif cost > old:
                    costs[row, column] = cost


@njit(cache=True)
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
