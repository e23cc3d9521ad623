"""Converts the costs of a costmap to the occupancy that Nav2 publishes, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.inputs.world import World
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.rasterize import mark_polygon

UNKNOWN, OCCUPIED = -1, 100
MAP_RESOLUTION_M = 0.05
# A larger world gets larger cells.
MAX_MAP_CELLS = 4_000_000


def _occupancy_table() -> NDArray[np.int8]:
    """Returns the occupancy, by cost c, that Costmap2DPublisher sends: 1 + floor(97 (c - 1) / 251).

    Costs 0, INSCRIBED, LETHAL and NO_INFORMATION have values of their own.
    """
    costs = np.arange(256)
    table = 1 + 97 * (costs - 1) // 251
    table[0] = 0
    table[INSCRIBED], table[LETHAL], table[NO_INFORMATION] = OCCUPIED - 1, OCCUPIED, UNKNOWN
    return table.astype(np.int8)


OCCUPANCY_OF_COST = _occupancy_table()
# For each occupancy from 0 to 100 the lowest cost that is published as it; last, at -1, unknown.
COST_OF_OCCUPANCY = np.array(
    [*(int(np.flatnonzero(value == OCCUPANCY_OF_COST)[0]) for value in range(101)), NO_INFORMATION],
    dtype=np.uint8,
)


def occupancy_from_costs(costs: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Returns costs as the occupancy that Nav2 publishes, -1 (unknown) to 100 (lethal)."""
    return OCCUPANCY_OF_COST[costs]


def costs_from_occupancy(occupancy: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Returns the lowest costs that are published as these occupancies; others are unknown."""
    is_known = (occupancy >= 0) & (occupancy <= OCCUPIED)
    return COST_OF_OCCUPANCY[np.where(is_known, occupancy, UNKNOWN)]


def map_of_world(world: World, points: NDArray[np.float64], margin_m: float) -> Grid:
    """Returns a grid, 0 or 100, of the standing obstacles, around them and points (N, 2), m."""
    outlines = [shape.outline for shape in world.shapes]
    corners = np.vstack([points, *outlines])
    low, high = corners.min(axis=0) - margin_m, corners.max(axis=0) + margin_m
    resolution = MAP_RESOLUTION_M
    while np.prod(np.ceil((high - low) / resolution)) > MAX_MAP_CELLS:
        resolution *= 2.0
    low = np.floor(low / resolution) * resolution
    columns, rows = np.ceil((high - low) / resolution).astype(int)
    costs = np.zeros((rows, columns), dtype=np.uint8)
    grid = Grid(costs, float(low[0]), float(low[1]), resolution)
    for outline in outlines:
        mark_polygon(grid, outline)
    return grid._replace(costs=np.where(costs == LETHAL, OCCUPIED, 0).astype(np.int8))
