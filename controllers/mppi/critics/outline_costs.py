"""The costs under the outline that samples of a cycle ask for again and again, remembered.

What the outline costs at a pose depends on the pose by the cells of its vertices alone. Samples of
a cycle lie close to each other, so most of their poses share those cells with another one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.mppi.critics.base import MapView
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import LETHAL, world_to_cell
from drake_navbench.kernels.poses import place_point

# A power of two, so that a mask wraps a place; 2000 samples of 56 columns reach some 10,000.
PLACES = 1 << 15
# Above it a search for a place takes longer than it saves; what comes later is not remembered.
MOST_REMEMBERED = PLACES * 3 // 4
NOTHING = -1


class OutlineCosts(NamedTuple):
    """A hash table of one cycle, open addressing: cells of the vertices to the largest cost.

    cells: (PLACES, K) int32 index of each vertex's cell, row by row. costs: (PLACES,) int16,
    NOTHING at a free place. asked: (K,) int32, the cells that are looked for. taken: (1,) how many
    are remembered.
    """

    cells: NDArray[np.int32]
    costs: NDArray[np.int16]
    asked: NDArray[np.int32]
    taken: NDArray[np.int64]

    @classmethod
    def of(cls, view: MapView) -> OutlineCosts:
        """Returns one in which nothing is remembered yet."""
        vertices = len(view.footprint)
        return cls(
            np.empty((PLACES, vertices), np.int32),
            np.full(PLACES, NOTHING, np.int16),
            np.empty(vertices, np.int32),
            np.zeros(1, np.int64),
        )


@njit(cache=True)
def outline_cost(view, remembered, x, y, yaw):
    """Returns the largest cost under the outline at a pose (m, m, rad), as `footprint_cost` does.

    A vertex off the map is LETHAL whatever the others meet, so that case needs no place.
    """
    x, y, yaw = np.float64(x), np.float64(y), np.float64(yaw)
    cells, costs, asked, taken = remembered
    if not _find_cells(view, x, y, yaw, asked):
        return LETHAL
    place = _first_place(asked)
    while costs[place] != NOTHING:
        if np.array_equal(cells[place], asked):
            return np.int64(costs[place])
        place = (place + 1) & (PLACES - 1)
    cost = footprint_cost(view.grid, view.footprint, x, y, yaw, True)
    if taken[0] < MOST_REMEMBERED:
        taken[0] += 1
        cells[place] = asked
        costs[place] = cost
    return cost


@njit(cache=True)
def _find_cells(view, x, y, yaw, cells):
    """Writes the cell of each vertex; returns whether all are on the map."""
    grid, footprint = view.grid, view.footprint
    rows, columns = grid.costs.shape
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    for k in range(footprint.shape[0]):
        vertex_x, vertex_y = place_point(footprint[k, 0], footprint[k, 1], x, y, cos_yaw, sin_yaw)
        column, row = world_to_cell(
            vertex_x, vertex_y, grid.origin_x, grid.origin_y, grid.resolution, columns, rows
        )
        if column < 0:
            return False
        cells[k] = row * columns + column
    return True


@njit(cache=True)
def _first_place(cells):
    """Returns where the search for these cells begins: FNV-1a, its upper half mixed in."""
    mixed = np.uint64(0xCBF29CE484222325)
    for k in range(cells.shape[0]):
        mixed = (mixed ^ np.uint64(cells[k])) * np.uint64(0x100000001B3)
    return np.int64((mixed ^ (mixed >> np.uint64(32))) & np.uint64(PLACES - 1))
