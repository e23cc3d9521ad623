"""Kernels of the critics that read the costmap: they find cells and add their scores, in lanes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.mppi.critics.outline_costs import outline_cost_row
from drake_navbench.controllers.mppi.float32_math import F32
from drake_navbench.controllers.mppi.lanes import LANES

# Marks a sample that collides until the raw terms become costs.
INFINITY = F32(np.inf)


@njit(cache=True)
def add_cell_scores(view, score, step, in_float32, x, y, sums):
    """Adds the score of the cell under every step-th column.

    in_float32: whether the cells are found in float32, otherwise in float64.
    """
    cells = np.empty(LANES, np.int32)
    for block in range(x.shape[0]):
        for t in range(0, x.shape[1], step):
            _find_cell_row(view, in_float32, x[block, t], y[block, t], cells)
            _add_score_row(view.values, score, cells, sums[block])


@njit(cache=True, forceinline=True)
def _add_score_row(values, score, cells, sums):
    for lane in range(LANES):
        sums[lane] += score[values[cells[lane]]]


@njit(cache=True)
def add_outline_collisions(
    view, remembered, footprint_from, outline_collides, step, in_float32, poses, sums
):
    """Makes the sum infinite where the outline of a step-th column collides.

    poses: x, y, yaw, (blocks, N, LANES) each. The outline is checked where the centre's value is at
    least `footprint_from` and not 0.
    """
    x, y, yaw = poses
    values = view.values
    cells, costs = np.empty(LANES, np.int32), np.empty(LANES, np.int64)
    wanted = np.empty(LANES, np.int64)
    for block in range(x.shape[0]):
        for t in range(0, x.shape[1], step):
            _find_cell_row(view, in_float32, x[block, t], y[block, t], cells)
            count = 0
            for lane in range(LANES):
                value = values[cells[lane]]
                if value != 0 and value >= footprint_from and sums[block, lane] < INFINITY:
                    wanted[count] = lane
                    count += 1
            if count == 0:
                continue
            outline_cost_row(
                view, remembered, wanted[:count], x[block, t], y[block, t], yaw[block, t], costs
            )
            for lane in wanted[:count]:
                if outline_collides[costs[lane]]:
                    sums[block, lane] = INFINITY


@njit(cache=True)
def add_distance_shortfalls(
    view, remembered, footprint_from, margin_shortfall, repulsion, poses, sums, repulsion_sums
):
    """Adds to each sample the shortfalls of its columns' distances, up to the sample's collision.

    A shortfall depends on the costmap's value in the column's cell, which is found in float64.
    Where the centre's value is at least `footprint_from`, free cells included, the value under the
    outline takes its place; but not off the map. poses: x, y, yaw, (blocks, N, LANES) each.
    """
    x, y, yaw = poses
    values, outside = view.values, view.outside
    at_centre, at_outline = margin_shortfall
    repulsion_at_centre, repulsion_at_outline = repulsion
    cells, costs = np.empty(LANES, np.int32), np.empty(LANES, np.int64)
    wanted = np.empty(LANES, np.int64)
    for block in range(x.shape[0]):
        block_sums, block_repulsion = sums[block], repulsion_sums[block]
        for t in range(x.shape[1]):
            _float64_cell_row(view, x[block, t], y[block, t], cells)
            count = 0
            for lane in range(LANES):
                value, before = values[cells[lane]], block_sums[lane]
                if value >= footprint_from and cells[lane] != outside and before < INFINITY:
                    wanted[count] = lane
                    count += 1
                    continue
                # Infinite sums stay infinite.
                block_sums[lane] = before + at_centre[value]
                if block_sums[lane] < INFINITY:
                    block_repulsion[lane] += repulsion_at_centre[value]
            if count == 0:
                continue
            outline_cost_row(
                view, remembered, wanted[:count], x[block, t], y[block, t], yaw[block, t], costs
            )
            for lane in wanted[:count]:
                block_sums[lane] += at_outline[costs[lane]]
                if block_sums[lane] < INFINITY:
                    block_repulsion[lane] += repulsion_at_outline[costs[lane]]


@njit(cache=True, forceinline=True)
def _find_cell_row(view, in_float32, x, y, cells):
    if in_float32:
        _float32_cell_row(view, x, y, cells)
    else:
        _float64_cell_row(view, x, y, cells)


@njit(cache=True, forceinline=True)
def _float32_cell_row(view, x, y, cells):
    grid = view.grid
    _cell_row(
        F32(grid.origin_x),
        F32(grid.origin_y),
        F32(grid.resolution),
        view.rows,
        view.columns,
        x,
        y,
        cells,
    )


@register_jitable(forceinline=True)
def _float64_cell_row(view, x, y, cells):
    grid = view.grid
    _cell_row(grid.origin_x, grid.origin_y, grid.resolution, view.rows, view.columns, x, y, cells)


@register_jitable(error_model="numpy", forceinline=True)
def _cell_row(origin_x, origin_y, resolution, rows, columns, x, y, cells):
    """Writes the index into `MapView.values` of each lane's point, in the origin's precision."""
    outside_cell = np.int32(rows * columns)
    for lane in range(LANES):
        column = np.int32((x[lane] - origin_x) / resolution)
        row = np.int32((y[lane] - origin_y) / resolution)
        outside = (x[lane] < origin_x) | (y[lane] < origin_y) | (column >= columns) | (row >= rows)
        cells[lane] = outside_cell if outside else np.int32(row * columns + column)
