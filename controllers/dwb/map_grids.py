"""Distances on the costmap's cells: Nav2's map grids (dwb_critics MapGridCritic, costmap_queue).

Nav2 propagates Manhattan distances from seed cells over all cells, obstacles or not. On a
rectangle without barriers that is the exact L1 distance transform, which two passes give.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.kernels.grid import NO_INFORMATION, world_to_cell

# A plan may have holes of up to this many cells before points are put in between.
LARGEST_HOLE_CELLS = 2.0


@register_jitable
def split_hole(distance_squared, resolution):
    """Returns the number of intervals into which Nav2 splits the gap between two poses."""
    hole_squared = resolution * resolution * LARGEST_HOLE_CELLS * LARGEST_HOLE_CELLS
    if distance_squared <= hole_squared:
        return 1
    excess = math.sqrt(distance_squared) - math.sqrt(hole_squared)
    return max(1, int(excess / resolution) - 1)


@njit(cache=True)
def densify_plan(plan, resolution):
    """Returns a plan's points with the larger holes filled (nav_2d_utils adjustPlanResolution).

    plan: (M, 3) poses, M >= 1. Returns (P, 2) m.
    """
    count = plan.shape[0]
    intervals = np.empty(count, dtype=np.int64)
    point_count = 1
    for i in range(1, count):
        dx, dy = plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1]
        intervals[i] = split_hole(dx * dx + dy * dy, resolution)
        point_count += intervals[i]
    points = np.empty((point_count, 2))
    points[0, 0], points[0, 1] = plan[0, 0], plan[0, 1]
    filled = 1
    for i in range(1, count):
        step_x = (plan[i, 0] - plan[i - 1, 0]) / intervals[i]
        step_y = (plan[i, 1] - plan[i - 1, 1]) / intervals[i]
        for j in range(1, intervals[i]):
            points[filled, 0] = plan[i - 1, 0] + j * step_x
            points[filled, 1] = plan[i - 1, 1] + j * step_y
            filled += 1
        points[filled, 0], points[filled, 1] = plan[i, 0], plan[i, 1]
        filled += 1
    return points


@njit(cache=True)
def first_run_of_cells(points, grid, cells):
    """Writes the flat cell indices of the first run of points on known cells; returns how many.

    Points before the map are skipped; the run ends at the first point off the map or on a cell
    without information. points: (P, 2) m. cells: (P,) output.
    """
    costs, origin_x, origin_y, resolution = grid
    rows, columns = costs.shape
    count = 0
    for i in range(points.shape[0]):
        column, row = world_to_cell(
            points[i, 0], points[i, 1], origin_x, origin_y, resolution, columns, rows
        )
        if column >= 0 and costs[row, column] != NO_INFORMATION:
            cells[count] = row * columns + column
            count += 1
        elif count > 0:
            break
    return count


def cell_distances(
    rows: int, columns: int, seeds: NDArray[np.integer], *, diagonal: bool = False
) -> NDArray[np.int32]:
    """Returns each cell's distance to the nearest seed, in cells: (rows, columns) int32.

    seeds: (S,) flat cell indices. diagonal: whether a diagonal step counts as one (Chebyshev
    distance), not as two (Manhattan distance). Without a seed every cell is rows * columns + 1:
    unreachable.
    """
    # With a margin of one cell around the grid no loop has to ask whether it is at the border.
    distances = np.full((rows + 2, columns + 2), rows * columns + 1, dtype=np.int32)
    if seeds.size > 0:
        distances[1 + seeds // columns, 1 + seeds % columns] = 0
        spread_distances(distances, diagonal)
    return distances[1:-1, 1:-1].copy()


@njit(cache=True)
def spread_distances(distances, diagonal):
    """Lowers each distance inside a margin to at most a neighbour's distance plus 1.

    Two passes over the grid are exact for both distances (Rosenfeld and Pfaltz: Sequential
    operations in digital picture processing, 1966).
    """
    rows, columns = distances.shape
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            nearest = min(distances[row - 1, column], distances[row, column - 1])
            if diagonal:
                corners = min(distances[row - 1, column - 1], distances[row - 1, column + 1])
                nearest = min(nearest, corners)
            distances[row, column] = min(distances[row, column], nearest + 1)
    for row in range(rows - 2, 0, -1):
        for column in range(columns - 2, 0, -1):
            nearest = min(distances[row + 1, column], distances[row, column + 1])
            if diagonal:
                corners = min(distances[row + 1, column - 1], distances[row + 1, column + 1])
                nearest = min(nearest, corners)
            distances[row, column] = min(distances[row, column], nearest + 1)


@njit(cache=True)
def locate(poses, pose_counts, grid, cells, on_map_counts):
    """Writes the flat cell index of each pose of the trajectories, up to the first one off the map.

    poses: (K, N, 3). pose_counts: (K,). Output: cells (K, N) int32, the flat cell index of each
    pose as far as the first one off the map, and its index there or else pose_counts: (K,) int64.
    """
    costs, origin_x, origin_y, resolution = grid
    rows, columns = costs.shape
    for k in range(poses.shape[0]):
        on_map = pose_counts[k]
        for i in range(pose_counts[k]):
            column, row = world_to_cell(
                poses[k, i, 0], poses[k, i, 1], origin_x, origin_y, resolution, columns, rows
            )
            if column < 0:
                on_map = i
                break
            cells[k, i] = row * columns + column
        on_map_counts[k] = on_map
