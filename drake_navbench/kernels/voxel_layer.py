"""The voxel layer: columns of voxels that points mark and rays clear, and the costs they stand for.

A column is one uint32: of voxel z, bit 16 + z says that it is marked and bit z that it is marked or
unknown, so that both set mean marked, the low one alone unknown, none free. At most MAX_VOXELS fit;
levels above the grid's own stay unknown for ever, and the threshold of unknown voxels is raised by
their number. Grids are (rows, columns), `[row = y, column = x]`; poses and points are in the grid's
frame.

Unlike in the obstacle layer, rays end two cells before their point, run through voxels between ends
that are not rounded to cells, and start nowhere if the sensor is above or below the grid. A voxel
that is cleared sets the cost of its column anew: free, or unknown where too many of its voxels are.
The footprint frees costs only; the voxels under it stay.
Source: nav2_costmap_2d (VoxelLayer) and nav2_voxel_grid, branch lyrical. Before it, rays were cut
half a voxel before the grid's top and far sides; humble cuts them at the sides without a margin,
and marks points below min_obstacle_height.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    LETHAL,
    NO_INFORMATION,
    Grid,
    distance_to_cells,
    world_to_cell,
)
from drake_navbench.kernels.layer_grid import grow_box
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import NOTHING_TOUCHED, free_robot

MAX_VOXELS = 16
UNKNOWN_COLUMN = np.uint32((1 << MAX_VOXELS) - 1)
LOW_BITS = (1 << MAX_VOXELS) - 1
VOXEL_MASK = (1 << MAX_VOXELS) | 1
# The distance of a ray's end before the point that was hit, cells.
RAY_GAP_CELLS = 2
# A ray through the top of the grid ends this far below it, m.
TOP_MARGIN = 0.01
# A ray that leaves the grid is cut by this share of its length more.
CUT_SHARE = 1e-5


class VoxelGrid(NamedTuple):
    """The voxels of a layer and the costs of their columns, in the form that kernels take.

    costs: (rows, columns) uint8. voxels: (rows, columns) uint32, a column each.
    origin_x, origin_y, origin_z: lower corner, m. resolution, z_resolution: edges of a voxel along
    x or y and along z, m. z_voxels: levels.
    max_unknown: a column with more unknown voxels, among all MAX_VOXELS, stays unknown.
    mark_threshold: a column with more marked voxels is lethal.
    """

    costs: NDArray[np.uint8]
    voxels: NDArray[np.uint32]
    origin_x: float
    origin_y: float
    origin_z: float
    resolution: float
    z_resolution: float
    z_voxels: int
    max_unknown: int
    mark_threshold: int


def voxel_grid(
    grid: Grid,
    voxels: NDArray[np.uint32],
    *,
    origin_z: float = 0.0,
    z_resolution: float = 0.2,
    z_voxels: int = 10,
    unknown_threshold: int = 15,
    mark_threshold: int = 0,
) -> VoxelGrid:
    """Returns the layer's grids as one; the other arguments are Nav2's parameters of these names.

    Levels that the grid does not have stay unknown; unknown_threshold does not count them.
    """
    return VoxelGrid(
        grid.costs,
        voxels,
        float(grid.origin_x),
        float(grid.origin_y),
        float(origin_z),
        float(grid.resolution),
        float(z_resolution),
        z_voxels,
        unknown_threshold + (MAX_VOXELS - z_voxels),
        mark_threshold,
    )


def update_voxel_layer(
    grid: VoxelGrid,
    observations: Sequence[Observation],
    *,
    outline: NDArray[np.float64] | None,
    min_obstacle_height: float = 0.0,
    max_obstacle_height: float = 2.0,
) -> NDArray[np.float64]:
    """Clears along all rays, marks all hits, then frees the robot, in place.

    outline: (K, 2) of the robot in the grid's frame, m; None frees nothing. Points outside of the
    two heights [m] do not mark.
    Returns (4,) min_x, min_y, max_x, max_y m: the box that the cycle touched, as Nav2 grows it.
    """
    bounds = np.array(NOTHING_TOUCHED)
    for seen in observations:
        if seen.clearing:
            ranges = (float(seen.raytrace_min_range), float(seen.raytrace_max_range))
            clear_voxel_rays(grid, bounds, seen.origin, seen.points, ranges)
    heights = (float(min_obstacle_height), float(max_obstacle_height))
    for seen in observations:
        if seen.marking:
            ranges = (float(seen.obstacle_min_range), float(seen.obstacle_max_range))
            mark_voxels(grid, bounds, seen.origin, seen.points, ranges, heights)
    if outline is not None:
        costs = Grid(grid.costs, grid.origin_x, grid.origin_y, grid.resolution)
        free_robot(costs, bounds, outline)
    return bounds


@njit(cache=True)
def count_bits(bits):
    """Returns the number of set bits of a non-negative integer."""
    count = 0
    while bits:
        bits &= bits - 1
        count += 1
    return count


@njit(cache=True, error_model="numpy")
def mark_voxels(grid, bounds, origin, points, ranges, heights):
    """Marks, in place, the voxels that hold points (N, 3), m.

    A point counts from ranges[0] to less than ranges[1] off the sensor at `origin` (3,), m, between
    both heights, m, and on the grid; one below the grid counts on its lowest level. A column with
    more than mark_threshold marks gets the cost LETHAL. `bounds`, (4,) min_x, min_y, max_x, max_y
    m, grows around the points in such columns. (VoxelLayer::updateBounds)
    """
    rows, columns = grid.costs.shape
    min_range, max_range = ranges
    for k in range(points.shape[0]):
        x, y, z = np.float64(points[k, 0]), np.float64(points[k, 1]), np.float64(points[k, 2])
        if z < heights[0] or z > heights[1]:
            continue
        d_x, d_y, d_z = x - origin[0], y - origin[1], z - origin[2]
        squared = d_x * d_x + d_y * d_y + d_z * d_z
        if squared >= max_range * max_range or squared < min_range * min_range:
            continue
        column, row = world_to_cell(
            x, y, grid.origin_x, grid.origin_y, grid.resolution, columns, rows
        )
        level = (max(z, grid.origin_z) - grid.origin_z) / grid.z_resolution
        if column < 0 or not level < grid.z_voxels:
            continue
        marked = np.int64(grid.voxels[row, column]) | (VOXEL_MASK << int(level))
        grid.voxels[row, column] = marked
        if count_bits(marked >> MAX_VOXELS) > grid.mark_threshold:
            grid.costs[row, column] = LETHAL
            grow_box(bounds, x, y)


@njit(cache=True, error_model="numpy")
def _in_voxels(grid, x, y, z):
    """Returns ((column, row, level), is_on_grid) of a point m, not rounded."""
    rows, columns = grid.costs.shape
    column = (x - grid.origin_x) / grid.resolution
    row = (y - grid.origin_y) / grid.resolution
    level = (z - grid.origin_z) / grid.z_resolution
    is_low_enough = column < columns and row < rows and level < grid.z_voxels
    is_high_enough = x >= grid.origin_x and y >= grid.origin_y and z >= grid.origin_z
    return (column, row, level), is_low_enough and is_high_enough


@njit(cache=True, error_model="numpy")
def _ray_end(grid, origin, point):
    """Returns (x, y, z) where the ray from a sensor to a point ends, m.

    That is two cells before the point, or at the sensor where the point is nearer than that. A ray
    that leaves the grid ends a margin before its edge.
    """
    rows, columns = grid.costs.shape
    x_0, y_0, z_0 = origin[0], origin[1], origin[2]
    x, y, z = np.float64(point[0]), np.float64(point[1]), np.float64(point[2])
    length = math.sqrt((x - x_0) * (x - x_0) + (y - y_0) * (y - y_0) + (z - z_0) * (z - z_0))
    part = (length - RAY_GAP_CELLS * grid.resolution) / length
    part = max(part if part < 1.0 else 1.0, 0.0)
    x, y, z = part * (x - x_0) + x_0, part * (y - y_0) + y_0, part * (z - z_0) + z_0
    d_x, d_y, d_z = x - x_0, y - y_0, z - z_0
    end_x = grid.origin_x + columns * grid.resolution
    end_y = grid.origin_y + rows * grid.resolution
    end_z = grid.origin_z + grid.z_voxels * grid.z_resolution
    share = 1.0
    is_cut = False
    if z > end_z:
        share = max(0.0, min(share, (end_z - TOP_MARGIN - z_0) / d_z))
        is_cut = True
    elif z < grid.origin_z:
        share = min(share, (grid.origin_z - z_0) / d_z)
        is_cut = True
    if x < grid.origin_x:
        share = min(share, (grid.origin_x - x_0) / d_x)
        is_cut = True
    if y < grid.origin_y:
        share = min(share, (grid.origin_y - y_0) / d_y)
        is_cut = True
    if x > end_x:
        share = min(share, (end_x - x_0) / d_x)
        is_cut = True
    if y > end_y:
        share = min(share, (end_y - y_0) / d_y)
        is_cut = True
    if is_cut and share > 0.0:
        share -= CUT_SHARE
    return x_0 + d_x * share, y_0 + d_y * share, z_0 + d_z * share


@njit(cache=True, error_model="numpy")
def clear_voxel_rays(grid, bounds, origin, points, ranges):
    """Clears, in place, the voxels on the rays from a sensor at `origin` (3,) to points (N, 3), m.

    A ray is walked from ranges[0] to at most ranges[1] m, both rounded up to cells, and compared
    with its length in voxels. Each column that it clears a voxel of, and that has no more than
    mark_threshold marks, becomes FREE, or NO_INFORMATION where more than max_unknown of its voxels
    are unknown. A sensor off the grid clears nothing. `bounds`, (4,) min_x, min_y, max_x, max_y m,
    grows around the ends of the rays. (VoxelLayer::raytraceFreespace)
    """
    start, is_on_grid = _in_voxels(grid, origin[0], origin[1], origin[2])
    if not is_on_grid:
        return
    min_range, max_range = ranges
    min_cells = distance_to_cells(min_range, grid.resolution)
    max_cells = distance_to_cells(max_range, grid.resolution)
    for k in range(points.shape[0]):
        x, y, z = _ray_end(grid, origin, points[k])
        end, is_on_grid = _in_voxels(grid, x, y, z)
        if not is_on_grid:
            continue
        _clear_line(grid, start, end, min_cells, max_cells)
        length = math.hypot(x - origin[0], y - origin[1])
        if length >= min_range:
            part = min(1.0, max_range / length) if length > 0.0 else 1.0
            grow_box(bounds, origin[0] + (x - origin[0]) * part, origin[1] + (y - origin[1]) * part)


@njit(cache=True, error_model="numpy")
def _clear_line(grid, start, end, min_cells, max_cells):
    """Clears the voxels of a line between two points given in voxels (VoxelGrid::raytraceLine)."""
    x_0, y_0, z_0 = start
    x_1, y_1, z_1 = end
    length = math.sqrt(
        (x_0 - x_1) * (x_0 - x_1) + (y_0 - y_1) * (y_0 - y_1) + (z_0 - z_1) * (z_0 - z_1)
    )
    if int(length) < min_cells:
        return
    part = 1.0
    if length > 0.0:
        part = min(1.0, max_cells / length)
        x_0 = x_0 + (x_1 - x_0) / length * min_cells
        y_0 = y_0 + (y_1 - y_0) / length * min_cells
        z_0 = z_0 + (z_1 - z_0) / length * min_cells
    column, row, level = int(x_0), int(y_0), int(z_0)
    d_column, d_row, d_level = int(x_1) - column, int(y_1) - row, int(z_1) - level
    step_column = 1 if d_column > 0 else -1
    step_row = 1 if d_row > 0 else -1
    step_level = 1 if d_level > 0 else -1
    d_column, d_row, d_level = abs(d_column), abs(d_row), abs(d_level)
    steps = max(d_column, d_row, d_level)
    error_column, error_row, error_level = steps // 2, steps // 2, steps // 2
    _clear_voxel(grid, row, column, level)
    for _ in range(min(int(part * steps), steps)):
        error_column += d_column
        error_row += d_row
        error_level += d_level
        if error_column >= steps:
            column += step_column
            error_column -= steps
        if error_row >= steps:
            row += step_row
            error_row -= steps
        if error_level >= steps:
            level += step_level
            error_level -= steps
        _clear_voxel(grid, row, column, level)


@njit(cache=True)
def _clear_voxel(grid, row, column, level):
    """Clears one voxel and sets the cost of its column (VoxelGrid::ClearVoxelInMap)."""
    left = np.int64(grid.voxels[row, column]) & ~(VOXEL_MASK << level)
    grid.voxels[row, column] = left
    marked = left >> MAX_VOXELS
    if count_bits(marked) <= grid.mark_threshold:
        unknown = (marked ^ left) & LOW_BITS
        is_known = count_bits(unknown) <= grid.max_unknown
        grid.costs[row, column] = FREE if is_known else NO_INFORMATION
