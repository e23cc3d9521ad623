"""The 2-D obstacle layer: a grid that points mark and the rays to them clear.

`update_obstacle_layer` is one whole cycle; layer_grid.merge_layer then writes the layer into a
master grid. Grids are (rows, columns) uint8, `[row = y, column = x]`; points and poses are in the
grid's frame.
Source: nav2_costmap_2d (ObstacleLayer) and nav2_util (raytraceLine). Nav2 passes points on as
float32; here they stay float64.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.kernels.grid import FREE, LETHAL, Grid, distance_to_cells, world_to_cell
from drake_navbench.kernels.layer_grid import draw_line, fill_outline, grow_box
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.read_only import read_only

# A ray that leaves the grid through its right or upper edge is cut this far inside of it, m.
UPPER_EDGE_MARGIN = 0.001
# A beam without a return, where that counts as free space, is taken to end this far short of the
# sensor's range, m.
INF_RANGE_MARGIN = 0.0001
# How the distance of a point is measured that is to be marked; see `mark_points`.
IN_PLANE, IN_CELLS, IN_SPACE = 0, 1, 2
# The box min_x, min_y, max_x, max_y around nothing.
NOTHING_TOUCHED = (math.inf, math.inf, -math.inf, -math.inf)


def update_obstacle_layer(
    grid: Grid,
    observations: Sequence[Observation],
    *,
    outline: NDArray[np.float64] | None,
    min_obstacle_height: float = 0.0,
    max_obstacle_height: float = 2.0,
    measured: int = IN_PLANE,
) -> NDArray[np.float64]:
    """Clears along all rays, marks all hits, then frees the robot, in place.

    outline: (K, 2) of the robot in the grid's frame, m; None frees nothing. Points outside of the
    two heights [m] do not mark; everything else is in the plane, so that a ray frees cells that it
    passes above. measured: see `mark_points`. Returns (4,) min_x, min_y, max_x, max_y m: the box
    that the cycle touched, as Nav2 grows it.
    """
    bounds = np.array(NOTHING_TOUCHED)
    for seen in observations:
        if seen.clearing:
            ranges = (float(seen.raytrace_min_range), float(seen.raytrace_max_range))
            clear_rays(grid, bounds, seen.origin, seen.points, ranges)
    heights = (float(min_obstacle_height), float(max_obstacle_height))
    for seen in observations:
        if seen.marking:
            ranges = (float(seen.obstacle_min_range), float(seen.obstacle_max_range))
            mark_points(grid, bounds, seen.origin, seen.points, ranges, heights, measured)
    if outline is not None:
        free_robot(grid, bounds, outline)
    return bounds


@njit(cache=True)
def free_robot(grid, bounds, outline):
    """Frees, in place, the cells under the robot's outline (K, 2) m; `bounds` grows around it."""
    for k in range(outline.shape[0]):
        grow_box(bounds, outline[k, 0], outline[k, 1])
    # For a constant it would be compiled once more.
    fill_outline(grid, outline, np.int64(FREE))


def scan_points(
    sensor_pose: NDArray[np.float64],
    angles: NDArray[np.float64],
    ranges: NDArray[np.floating],
    *,
    height: float,
    range_min: float,
    range_max: float,
    inf_is_valid: bool = False,
) -> NDArray[np.float64]:
    """Returns the (M, 3) hits of a planar scan, m, in the frame of `sensor_pose` (3,).

    All of them are `height` m high. A beam gives a point where range_min <= range < range_max; NaN
    and inf give none. Where `inf_is_valid`, +inf counts as a hit just short of range_max.
    """
    place = (*sensor_pose.tolist(), height)
    farthest = range_max - INF_RANGE_MARGIN if inf_is_valid else math.inf
    return _hits(place, read_only(angles), read_only(ranges), range_min, range_max, farthest)


@njit(cache=True)
def _hits(place, angles, ranges, range_min, range_max, farthest):
    """Returns the (M, 3) hits of a scanner at `place`, x m, y m, yaw rad, height m.

    farthest: the distance for which +inf stands, m; +inf where it stands for none.
    """
    x, y, yaw, height = place
    points = np.empty((ranges.size, 3))
    count = 0
    for k in range(ranges.size):
        distance = farthest if ranges[k] == math.inf else ranges[k]
        if range_min <= distance < range_max:
            heading = yaw + angles[k]
            points[count, 0] = x + distance * math.cos(heading)
            points[count, 1] = y + distance * math.sin(heading)
            points[count, 2] = height
            count += 1
    return points[:count]


@njit(cache=True)
def points_between(points, lowest, highest):
    """Returns the points, of (N, 3) m, that lie between two heights, m, both included."""
    within = np.empty(points.shape)
    count = 0
    for k in range(points.shape[0]):
        if lowest <= points[k, 2] <= highest:
            for axis in range(3):
                within[count, axis] = points[k, axis]
            count += 1
    return within[:count]


@njit(cache=True)
def clear_rays(grid, bounds, sensor, points, ranges):
    """Frees, in place, the cells of a `Grid` on the rays from a sensor (3,) to (M, 3) points, m.

    A ray is cut at the edges of the grid, then walked between the two cells, from ranges[0] to at
    most ranges[1] m, both rounded up to cells. The cell of the hit is freed too. A sensor outside
    the grid frees nothing. `bounds`, (4,) min_x, min_y, max_x, max_y m, grows in place.
    (ObstacleLayer::raytraceFreespace)
    """
    costs, origin_x, origin_y, resolution = grid
    rows, columns = costs.shape
    sensor_x, sensor_y = sensor[0], sensor[1]
    min_range, max_range = ranges
    sensor_column, sensor_row = world_to_cell(
        sensor_x, sensor_y, origin_x, origin_y, resolution, columns, rows
    )
    if sensor_column < 0:
        return
    grow_box(bounds, sensor_x, sensor_y)
    end_x, end_y = origin_x + columns * resolution, origin_y + rows * resolution
    min_cells = distance_to_cells(min_range, resolution)
    max_cells = distance_to_cells(max_range, resolution)
    for k in range(points.shape[0]):
        x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
        x, y = _cut_ray(sensor_x, sensor_y, x, y, origin_x, origin_y, end_x, end_y)
        column, row = world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows)
        if column < 0:
            continue
        _free_ray(costs, sensor_column, sensor_row, column, row, min_cells, max_cells)
        length = math.hypot(x - sensor_x, y - sensor_y)
        if length >= min_range:
            part = min(1.0, max_range / length) if length > 0.0 else 1.0
            grow_box(bounds, sensor_x + (x - sensor_x) * part, sensor_y + (y - sensor_y) * part)


@njit(cache=True)
def mark_points(grid, bounds, sensor, points, ranges, heights, measured=IN_PLANE):
    """Marks, in place, the cells of a `Grid` that hold one of (M, 3) points, m, as LETHAL.

    A point counts between the two heights [m] and from ranges[0] to ranges[1] m off the sensor
    (3,). measured: IN_PLANE (Jazzy, Lyrical): in the plane in m and again in whole cells; IN_CELLS
    (Humble): in whole cells alone; IN_SPACE (Iron, Kilted): in m with the height, less than
    ranges[1], also from a sensor outside the grid. Otherwise a sensor outside the grid marks
    nothing, nor do points there. `bounds`, (4,) min_x, min_y, max_x, max_y m, grows in place.
    (ObstacleLayer::updateBounds)
    """
    costs, origin_x, origin_y, resolution = grid
    rows, columns = costs.shape
    sensor_x, sensor_y = sensor[0], sensor[1]
    min_range, max_range = ranges
    sensor_column, sensor_row = world_to_cell(
        sensor_x, sensor_y, origin_x, origin_y, resolution, columns, rows
    )
    if sensor_column < 0 and measured != IN_SPACE:
        return
    min_cells = distance_to_cells(min_range, resolution)
    max_cells = distance_to_cells(max_range, resolution)
    min_squared = min_range * min_range
    max_squared = max_range * max_range
    for k in range(points.shape[0]):
        x, y, height = np.float64(points[k, 0]), np.float64(points[k, 1]), points[k, 2]
        if not heights[0] <= height <= heights[1]:
            continue
        column, row = world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows)
        if column < 0:
            continue
        squared = (x - sensor_x) * (x - sensor_x) + (y - sensor_y) * (y - sensor_y)
        if measured == IN_SPACE:
            squared += (height - sensor[2]) * (height - sensor[2])
            if not min_squared <= squared < max_squared:
                continue
        else:
            if measured == IN_PLANE and not min_squared <= squared <= max_squared:
                continue
            cells = int(math.hypot(column - sensor_column, row - sensor_row))
            if not min_cells <= cells <= max_cells:
                continue
        costs[row, column] = LETHAL
        grow_box(bounds, x, y)


@register_jitable
def _cut_ray(sensor_x, sensor_y, x, y, min_x, min_y, max_x, max_y):
    """Returns the end of a ray, cut where it leaves the grid; edge by edge, in Nav2's order."""
    along_x, along_y = x - sensor_x, y - sensor_y
    if x < min_x:
        y = sensor_y + along_y * ((min_x - sensor_x) / along_x)
        x = min_x
    if y < min_y:
        x = sensor_x + along_x * ((min_y - sensor_y) / along_y)
        y = min_y
    if x > max_x:
        y = sensor_y + along_y * ((max_x - sensor_x) / along_x)
        x = max_x - UPPER_EDGE_MARGIN
    if y > max_y:
        x = sensor_x + along_x * ((max_y - sensor_y) / along_y)
        y = max_y - UPPER_EDGE_MARGIN
    return x, y


@register_jitable
def _free_ray(costs, column_0, row_0, column_1, row_1, min_cells, max_cells):
    """Frees the cells of a line, from min_cells after its start to at most max_cells."""
    length = math.hypot(column_1 - column_0, row_1 - row_0)
    if length < min_cells:
        return
    part = 1.0
    if length > 0.0:
        column_delta, row_delta = column_1 - column_0, row_1 - row_0
        column_0 = int(column_0 + column_delta / length * min_cells)
        row_0 = int(row_0 + row_delta / length * min_cells)
        part = min(1.0, max_cells / length)
    extent = max(abs(column_1 - column_0), abs(row_1 - row_0))
    draw_line(costs, column_0, row_0, column_1, row_1, int(part * extent), np.int64(FREE))
