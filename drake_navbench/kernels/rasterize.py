"""Shapes and masks as cells of a costmap.

A cell is covered if its centre is. Grids hold uint8 costs.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, Grid, world_to_cell

# Edges at round coordinates lie right on centres; without a tolerance, m, rounding would decide.
EDGE_TOLERANCE = 1e-9

MASK_UNKNOWN = -1
MASK_FULL = 100


def mark_polygon(grid: Grid, vertices: NDArray[np.float64]) -> None:
    """Marks, in place, the cells of a grid whose centres lie in a polygon as LETHAL.

    vertices: (K, 2) m, in either direction; the last is joined to the first. Inside is decided by
    the even-odd rule; centres on an edge count as inside. Parts off the grid are ignored.
    """
    # The columns of a row at which outside turns into inside, or back.
    turns = np.zeros(grid.costs.shape[1] + 1, dtype=np.bool_)
    edges = np.hstack([vertices, np.roll(vertices, -1, axis=0)])
    _mark_rows(grid, turns, edges)


@njit(cache=True)
def _mark_rows(grid, turns, edges):
    """Marks a polygon row by row. edges: (K, 4) x0, y0, x1, y1 m. turns: scratch, all False."""
    costs, origin_x, resolution = grid.costs, grid.origin_x, grid.resolution
    rows, columns = costs.shape
    for row in range(rows):
        y = grid.origin_y + (row + 0.5) * resolution
        for k in range(edges.shape[0]):
            x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
            _mark_edge(costs, row, origin_x, resolution, x0, y0 - y, x1, y1 - y)
            if (y0 <= y) != (y1 <= y):
                crossing = x0 + (x1 - x0) * ((y - y0) / (y1 - y0))
                column = math.ceil((crossing - origin_x) / resolution - 0.5)
                column = min(max(column, 0), columns)
                turns[column] = not turns[column]
        inside = False
        for column in range(columns):
            inside = inside != turns[column]
            turns[column] = False
            if inside:
                costs[row, column] = LETHAL
        turns[columns] = False


@njit(cache=True)
def _mark_edge(costs, row, origin_x, resolution, x0, y0, x1, y1):
    """Marks the cells of one row whose centres lie on an edge; y is counted from the centres."""
    if min(y0, y1) > EDGE_TOLERANCE or max(y0, y1) < -EDGE_TOLERANCE:
        return
    start, end = 0.0, 1.0
    if y0 != y1:
        one, other = (-EDGE_TOLERANCE - y0) / (y1 - y0), (EDGE_TOLERANCE - y0) / (y1 - y0)
        start, end = max(0.0, min(one, other)), min(1.0, max(one, other))
    start_x, end_x = x0 + start * (x1 - x0), x0 + end * (x1 - x0)
    low, high = min(start_x, end_x) - EDGE_TOLERANCE, max(start_x, end_x) + EDGE_TOLERANCE
    first = max(0, math.ceil((low - origin_x) / resolution - 0.5))
    last = min(costs.shape[1] - 1, math.floor((high - origin_x) / resolution - 0.5))
    for column in range(first, last + 1):
        costs[row, column] = LETHAL


def mask_costs(mask: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Returns (rows, columns) uint8 costs of a keepout mask (rows, columns) int8, -1 to 100.

    round(254 m / 100), halves away from zero; MASK_UNKNOWN becomes NO_INFORMATION.
    (CostmapFilter::getMaskCost)
    """
    table = np.full(MASK_FULL + 2, NO_INFORMATION, dtype=np.uint8)
    table[: MASK_FULL + 1] = np.floor(np.arange(MASK_FULL + 1) * LETHAL / MASK_FULL + 0.5)
    # An index of -1, MASK_UNKNOWN, counts from the end and finds the table's last entry.
    return table[mask]


@njit(cache=True)
def apply_keepout(grid, mask, mask_from_grid, override_cost):
    """Raises, in place, the cells of a `Grid` to the keepout mask at their centres.

    mask: `Grid` of costs as from `mask_costs`. mask_from_grid: (3,) x m, y m, yaw rad: pose of the
    grid's frame in the mask's. A cell is written if the mask's cost is larger, or if the cell is
    NO_INFORMATION; never where the mask is NO_INFORMATION. override_cost: written in place of the
    mask's cost, -1 for none: Nav2's lethal_override_cost while the robot itself stands in the
    keepout. (KeepoutFilter::process)
    """
    costs, resolution = grid.costs, grid.resolution
    mask_rows, mask_columns = mask.costs.shape
    cos_yaw, sin_yaw = math.cos(mask_from_grid[2]), math.sin(mask_from_grid[2])
    for row in range(costs.shape[0]):
        y = grid.origin_y + (row + 0.5) * resolution
        for column in range(costs.shape[1]):
            x = grid.origin_x + (column + 0.5) * resolution
            mask_column, mask_row = world_to_cell(
                mask_from_grid[0] + x * cos_yaw - y * sin_yaw,
                mask_from_grid[1] + x * sin_yaw + y * cos_yaw,
                mask.origin_x,
                mask.origin_y,
                mask.resolution,
                mask_columns,
                mask_rows,
            )
            if mask_column < 0:
                continue
            new, old = mask.costs[mask_row, mask_column], costs[row, column]
            if new != NO_INFORMATION and (new > old or old == NO_INFORMATION):
                costs[row, column] = new if override_cost < 0 else override_cost
