"""Shapes and masks as cells of a costmap.

A cell is covered where its centre is. Costs are (rows, columns) uint8; `origin_x`, `origin_y` is
the lower left corner of cell (0, 0), m.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, world_to_cell

# Round coordinates put edges right onto centres; without a tolerance, m, rounding would decide.
EDGE_TOLERANCE = 1e-9

MASK_UNKNOWN = -1
MASK_FULL = 100


@njit(cache=True)
def mark_polygon(costs, origin_x, origin_y, resolution, vertices):
    """Marks, in place, the cells of `costs` whose centres lie in a polygon as LETHAL.

    vertices: (K, 2) m, in either direction; the last is joined to the first. Inside is decided by
    the even-odd rule; centres on an edge count as inside. Parts off the grid are ignored.
    """
    rows, columns = costs.shape
    count = vertices.shape[0]
    # Where the state changes between outside and inside, from left to right.
    changes = np.zeros(columns + 1, dtype=np.bool_)
    for row in range(rows):
        y = origin_y + (row + 0.5) * resolution
        changes[:] = False
        for k in range(count):
            x0, y0 = vertices[k, 0], vertices[k, 1]
            x1, y1 = vertices[(k + 1) % count, 0], vertices[(k + 1) % count, 1]
            _mark_edge(costs[row], origin_x, resolution, x0, y0 - y, x1, y1 - y)
            if (y0 <= y) != (y1 <= y):
                crossing = x0 + (x1 - x0) * ((y - y0) / (y1 - y0))
                column = math.ceil((crossing - origin_x) / resolution - 0.5)
                column = min(max(column, 0), columns)
                changes[column] = not changes[column]
        inside = False
        for column in range(columns):
            inside ^= changes[column]
            if inside:
                costs[row, column] = LETHAL


@njit(cache=True)
def _mark_edge(row_costs, origin_x, resolution, x0, y0, x1, y1):
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
    last = min(row_costs.shape[0] - 1, math.floor((high - origin_x) / resolution - 0.5))
    for column in range(first, last + 1):
        row_costs[column] = LETHAL


@njit(cache=True)
def mark_circle(costs, origin_x, origin_y, resolution, x, y, radius):
    """Marks, in place, the cells of `costs` whose centres lie in a circle, m, as LETHAL.

    Centres on the rim count as inside. Parts off the grid are ignored.
    """
    rows, columns = costs.shape
    limit = radius + EDGE_TOLERANCE
    for row in range(rows):
        above = origin_y + (row + 0.5) * resolution - y
        if abs(above) > limit:
            continue
        for column in range(columns):
            if math.hypot(origin_x + (column + 0.5) * resolution - x, above) <= limit:
                costs[row, column] = LETHAL


def mask_costs(mask):
    """Returns (rows, columns) uint8 costs of a keepout mask (rows, columns) int8, -1 to 100.

    round(254 m / 100), halves away from zero; MASK_UNKNOWN becomes NO_INFORMATION.
    (CostmapFilter::getMaskCost)
    """
    values = np.asarray(mask, dtype=np.float64)
    costs = np.floor(values * LETHAL / MASK_FULL + 0.5)
    return np.where(values == MASK_UNKNOWN, NO_INFORMATION, costs).astype(np.uint8)


@njit(cache=True)
def apply_keepout(
    costs,
    origin_x,
    origin_y,
    resolution,
    mask,
    mask_origin_x,
    mask_origin_y,
    mask_resolution,
    override_cost,
):
    """Raises, in place, the cells of `costs` to the keepout mask at their centres.

    mask: (rows, columns) uint8 as from `mask_costs`, on a grid of its own in the same frame. A cell
    is written where the mask exceeds it, or where it is NO_INFORMATION; not where the mask is.
    override_cost: written in place of the mask's cost, -1 for none: Nav2's lethal_override_cost
    while the robot itself stands in the keepout. (KeepoutFilter::process)
    """
    mask_rows, mask_columns = mask.shape
    for row in range(costs.shape[0]):
        y = origin_y + (row + 0.5) * resolution
        for column in range(costs.shape[1]):
            x = origin_x + (column + 0.5) * resolution
            mask_column, mask_row = world_to_cell(
                x, y, mask_origin_x, mask_origin_y, mask_resolution, mask_columns, mask_rows
            )
            if mask_column < 0:
                continue
            new, old = mask[mask_row, mask_column], costs[row, column]
            if new != NO_INFORMATION and (new > old or old == NO_INFORMATION):
                costs[row, column] = new if override_cost < 0 else override_cost
