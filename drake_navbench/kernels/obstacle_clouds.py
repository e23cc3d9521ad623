"""One whole cycle of the 2-D obstacle layer for points of any height from any number of sources.

Source: nav2_costmap_2d (ObstacleLayer). Heights decide which points mark; all else is in the plane,
so that a ray frees what it passes above, as there. `obstacle_layer` is the same for planar scans.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.grid import FREE
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import (
    NOTHING_TOUCHED,
    ObstacleLayerUpdate,
    clear_rays,
    free_robot,
    grid_of_cycle,
    mark_points,
)
from drake_navbench.kernels.poses import place_outline


def update_obstacle_layer_from_clouds(
    costs: NDArray[np.uint8],
    origin: tuple[float, float],
    observations: Sequence[Observation],
    *,
    resolution: float,
    robot_pose: NDArray[np.float64],
    footprint: NDArray[np.float64],
    min_obstacle_height: float = 0.0,
    max_obstacle_height: float = 2.0,
    footprint_clearing_enabled: bool = True,
    default_cost: int = FREE,
    rolling_window: bool = True,
    is_short: bool = False,
) -> ObstacleLayerUpdate:
    """Returns the layer after one cycle: roll, clear along all rays, mark all hits, free the robot.

    Arguments as for `update_obstacle_layer`; points outside of the two heights [m] do not mark.
    """
    grid = grid_of_cycle(
        costs,
        origin,
        resolution=resolution,
        robot_pose=robot_pose,
        default_cost=default_cost,
        rolling_window=rolling_window,
        is_short=is_short,
    )
    bounds = np.array(NOTHING_TOUCHED)
    for seen in observations:
        if seen.clearing:
            points = np.array(seen.points[:, :2], dtype=np.float64, order="C")
            ranges = (float(seen.raytrace_min_range), float(seen.raytrace_max_range))
            clear_rays(grid, bounds, seen.origin[0], seen.origin[1], points, *ranges)
    for seen in observations:
        if seen.marking:
            heights = seen.points[:, 2]
            is_within = (heights >= min_obstacle_height) & (heights <= max_obstacle_height)
            points = np.array(seen.points[is_within, :2], dtype=np.float64, order="C")
            ranges = (float(seen.obstacle_min_range), float(seen.obstacle_max_range))
            mark_points(grid, bounds, seen.origin[0], seen.origin[1], points, *ranges)
    if footprint_clearing_enabled:
        free_robot(grid, bounds, place_outline(footprint, robot_pose))
    return ObstacleLayerUpdate(grid.costs, grid.origin_x, grid.origin_y, bounds)
