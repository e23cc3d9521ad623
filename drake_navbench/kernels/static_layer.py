"""The static layer: an occupancy grid as costs, on the map's own grid or sampled on another.

Source: nav2_costmap_2d (StaticLayer).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    world_to_cell,
)

BYTE_VALUES = 256
MAX_LETHAL_THRESHOLD = 100


def static_costs(
    occupancy: NDArray[np.int8],
    *,
    track_unknown_space: bool = False,
    lethal_cost_threshold: int = 100,
    trinary_costmap: bool = True,
    unknown_cost_value: int = 255,
    inscribed_obstacle_cost_value: int = 99,
) -> NDArray[np.uint8]:
    """Returns (rows, columns) uint8 costs of an occupancy grid: int8, -1 unknown, 0 to 100.

    The arguments are Nav2's parameters; lethal_cost_threshold is clamped to 0..100. In Nav2's order
    of precedence: unknown_cost_value (-1 counts as 255) becomes NO_INFORMATION, or FREE where
    unknown space is not tracked; inscribed_obstacle_cost_value becomes INSCRIBED; values from the
    threshold up become LETHAL; the others FREE, or where not trinary_costmap
    trunc(254 value / threshold).
    """
    threshold = min(max(lethal_cost_threshold, 0), MAX_LETHAL_THRESHOLD)
    table = np.empty(BYTE_VALUES, dtype=np.uint8)
    for value in range(BYTE_VALUES):
        if value == unknown_cost_value:
            table[value] = NO_INFORMATION if track_unknown_space else FREE
        elif value == inscribed_obstacle_cost_value:
            table[value] = INSCRIBED
        elif value >= threshold:
            table[value] = LETHAL
        elif trinary_costmap:
            table[value] = FREE
        else:
            table[value] = int(value / threshold * LETHAL)
    return table[np.asarray(occupancy, dtype=np.int8).view(np.uint8)]


@njit(cache=True)
def sample_static(grid, static, static_from_grid, use_maximum):
    """Writes a map's costs into the cells of a grid, in place, as in a rolling window.

    grid, static: `Grid` of uint8 costs, the latter of the map.
    static_from_grid: (3,) x m, y m, yaw rad: pose of the grid's frame in the map's frame. Each cell
    takes the map's cost at its centre; cells off the map stay. use_maximum: the larger number wins,
    so that NO_INFORMATION beats LETHAL, as in Nav2.
    """
    costs, resolution = grid.costs, grid.resolution
    static_rows, static_columns = static.costs.shape
    cos_yaw, sin_yaw = math.cos(static_from_grid[2]), math.sin(static_from_grid[2])
    for row in range(costs.shape[0]):
        y = grid.origin_y + (row + 0.5) * resolution
        for column in range(costs.shape[1]):
            x = grid.origin_x + (column + 0.5) * resolution
            static_column, static_row = world_to_cell(
                static_from_grid[0] + x * cos_yaw - y * sin_yaw,
                static_from_grid[1] + x * sin_yaw + y * cos_yaw,
                static.origin_x,
                static.origin_y,
                static.resolution,
                static_columns,
                static_rows,
            )
            if static_column < 0:
                continue
            new = static.costs[static_row, static_column]
            if not use_maximum or new > costs[row, column]:
                costs[row, column] = new
