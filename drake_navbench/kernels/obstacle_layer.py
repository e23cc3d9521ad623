"""The 2-D obstacle layer: a rolling grid that scans mark and clear.

`update_obstacle_layer` is one whole cycle for one planar scan; `merge_layer` then writes the layer
into a master grid. Grids are (rows, columns) uint8, `[row = y, column = x]`; points and poses are
in the grid's frame.
Source: nav2_costmap_2d (ObstacleLayer, CostmapLayer, Costmap2D) and nav2_util (raytraceLine). The
height band of a point is left to the caller: all points of a planar scan share one height. Nav2
passes points on as float32; here they stay float64.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import (
    FREE,
    LETHAL,
    NO_INFORMATION,
    distance_to_cells,
    world_to_cell,
)

# A ray that leaves the grid through its right or upper edge is cut this far inside of it, m.
UPPER_EDGE_MARGIN = 0.001
# A beam without a return, where that counts as free space, is taken to end this far short of the
# sensor's range, m.
INF_RANGE_MARGIN = 0.0001
WHOLE_LINE = np.iinfo(np.int64).max


class MergeRule(IntEnum):
    """How a layer's cost L is written into the master's cost M; L = NO_INFORMATION writes nothing.

    OVERWRITE: M becomes L. MAX: the larger, where M is unknown L. MAX_KEEP_UNKNOWN: the larger,
    where M is unknown M stays. TRUE_OVERWRITE: M becomes L, even NO_INFORMATION.
    The first three are Nav2's `combination_method`.
    """

    OVERWRITE = 0
    MAX = 1
    MAX_KEEP_UNKNOWN = 2
    TRUE_OVERWRITE = 3


class ObstacleLayerUpdate(NamedTuple):
    """What one cycle leaves.

    costs: (rows, columns) uint8, the layer's grid, a new array.
    origin_x, origin_y: lower left corner of its cell (0, 0), m.
    bounds: (4,) min_x, min_y, max_x, max_y m: the box that the cycle touched, as Nav2 grows it.
    """

    costs: NDArray[np.uint8]
    origin_x: float
    origin_y: float
    bounds: NDArray[np.float64]


def update_obstacle_layer(
    costs: NDArray[np.uint8],
    origin: tuple[float, float],
    *,
    resolution: float,
    robot_pose: NDArray[np.float64],
    footprint: NDArray[np.float64],
    sensor_pose: NDArray[np.float64],
    angles: NDArray[np.float64],
    ranges: NDArray[np.floating],
    range_min: float,
    range_max: float,
    obstacle_min_range: float = 0.0,
    obstacle_max_range: float = 2.5,
    raytrace_min_range: float = 0.0,
    raytrace_max_range: float = 3.0,
    footprint_clearing_enabled: bool = True,
    inf_is_valid: bool = False,
    default_cost: int = FREE,
    rolling_window: bool = True,
) -> ObstacleLayerUpdate:
    """Returns the layer after one cycle: roll, clear along all rays, mark all hits, free the robot.

    costs, origin: the layer's grid and the lower left corner of its cell (0, 0), m; unchanged.
    robot_pose: (3,) x m, y m, yaw rad. footprint: (K, 2) padded, base frame, m.
    sensor_pose: (3,) when the scan was taken. angles: (N,) rad from the sensor's axis.
    ranges: (N,) m; only range_min <= range < range_max gives a point.
    The other arguments are Nav2's parameters of the same names [m], and `default_cost`, that of
    cells never seen (NO_INFORMATION where unknown space is tracked).
    """
    if rolling_window:
        rows, columns = costs.shape
        grid, origin_x, origin_y = roll_window(
            costs,
            origin,
            resolution=resolution,
            wanted=(
                robot_pose[0] - 0.5 * (columns * resolution),
                robot_pose[1] - 0.5 * (rows * resolution),
            ),
            default_cost=default_cost,
        )
    else:
        grid, origin_x, origin_y = costs.copy(), float(origin[0]), float(origin[1])
    bounds = np.array([np.inf, np.inf, -np.inf, -np.inf])
    points = scan_points(
        sensor_pose,
        angles,
        ranges,
        range_min=range_min,
        range_max=range_max,
        inf_is_valid=inf_is_valid,
    )
    sensor_x, sensor_y = sensor_pose[0], sensor_pose[1]
    frame = (origin_x, origin_y, resolution)
    clear_rays(
        grid, bounds, *frame, sensor_x, sensor_y, points, raytrace_min_range, raytrace_max_range
    )
    mark_points(
        grid, bounds, *frame, sensor_x, sensor_y, points, obstacle_min_range, obstacle_max_range
    )
    if footprint_clearing_enabled:
        outline = place_outline(footprint, robot_pose)
        bounds[:2] = np.minimum(bounds[:2], outline.min(axis=0))
        bounds[2:] = np.maximum(bounds[2:], outline.max(axis=0))
        fill_outline(grid, *frame, outline, FREE)
    return ObstacleLayerUpdate(grid, origin_x, origin_y, bounds)


def roll_window(
    costs: NDArray[np.uint8],
    origin: tuple[float, float],
    *,
    resolution: float,
    wanted: tuple[float, float],
    default_cost: int,
) -> tuple[NDArray[np.uint8], float, float]:
    """Returns (costs, origin_x, origin_y) of the grid moved toward a wanted lower left corner, m.

    The move is a whole number of cells, truncated toward zero, so that the origin stays on its
    lattice and may lag by up to a cell. Cells that both windows share keep their cost, the others
    get `default_cost`. The array returned is new. (Costmap2D::updateOrigin)
    """
    rows, columns = costs.shape
    shift_x = int((wanted[0] - origin[0]) / resolution)
    shift_y = int((wanted[1] - origin[1]) / resolution)
    rolled = np.full(costs.shape, default_cost, dtype=np.uint8)
    if abs(shift_x) < columns and abs(shift_y) < rows:
        from_rows, to_rows = _shared(shift_y, rows)
        from_columns, to_columns = _shared(shift_x, columns)
        rolled[to_rows, to_columns] = costs[from_rows, from_columns]
    return rolled, float(origin[0] + shift_x * resolution), float(origin[1] + shift_y * resolution)


def _shared(shift: int, count: int) -> tuple[slice, slice]:
    """Returns which of `count` cells stay in a window moved by `shift`, and where they go."""
    first, last = max(shift, 0), min(shift + count, count)
    return slice(first, last), slice(first - shift, last - shift)


def scan_points(
    sensor_pose: NDArray[np.float64],
    angles: NDArray[np.float64],
    ranges: NDArray[np.floating],
    *,
    range_min: float,
    range_max: float,
    inf_is_valid: bool = False,
) -> NDArray[np.float64]:
    """Returns the (M, 2) hits of a planar scan, m, in the frame of `sensor_pose` (3,).

    A beam gives a point where range_min <= range < range_max; NaN and inf give none. Where
    `inf_is_valid`, +inf counts as a hit just short of range_max.
    """
    distances = np.array(ranges, dtype=np.float64)
    if inf_is_valid:
        distances[distances == np.inf] = range_max - INF_RANGE_MARGIN
    hits = (distances >= range_min) & (distances < range_max)
    headings = sensor_pose[2] + angles[hits]
    points = np.empty((headings.size, 2))
    points[:, 0] = sensor_pose[0] + distances[hits] * np.cos(headings)
    points[:, 1] = sensor_pose[1] + distances[hits] * np.sin(headings)
    return points


@njit(cache=True)
def clear_rays(
    costs,
    bounds,
    origin_x,
    origin_y,
    resolution,
    sensor_x,
    sensor_y,
    points,
    raytrace_min_range,
    raytrace_max_range,
):
    """Frees, in place, the cells of `costs` on the rays from a sensor to (M, 2) points, m.

    A ray is cut at the edges of the grid, then walked between the two cells, from
    raytrace_min_range to at most raytrace_max_range m, both rounded up to cells. The cell of the
    hit is freed too. A sensor outside the grid frees nothing. `bounds`, (4,) min_x, min_y, max_x,
    max_y m, grows in place. (ObstacleLayer::raytraceFreespace)
    """
    rows, columns = costs.shape
    sensor_column, sensor_row = world_to_cell(
        sensor_x, sensor_y, origin_x, origin_y, resolution, columns, rows
    )
    if sensor_column < 0:
        return
    _grow(bounds, sensor_x, sensor_y)
    end_x, end_y = origin_x + columns * resolution, origin_y + rows * resolution
    min_cells = distance_to_cells(raytrace_min_range, resolution)
    max_cells = distance_to_cells(raytrace_max_range, resolution)
    for k in range(points.shape[0]):
        x, y = _cut_ray(
            sensor_x, sensor_y, points[k, 0], points[k, 1], origin_x, origin_y, end_x, end_y
        )
        column, row = world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows)
        if column < 0:
            continue
        _free_ray(costs, sensor_column, sensor_row, column, row, min_cells, max_cells)
        length = math.hypot(x - sensor_x, y - sensor_y)
        if length >= raytrace_min_range:
            part = min(1.0, raytrace_max_range / length) if length > 0.0 else 1.0
            _grow(bounds, sensor_x + (x - sensor_x) * part, sensor_y + (y - sensor_y) * part)


@njit(cache=True)
def mark_points(
    costs,
    bounds,
    origin_x,
    origin_y,
    resolution,
    sensor_x,
    sensor_y,
    points,
    obstacle_min_range,
    obstacle_max_range,
):
    """Marks, in place, the cells of `costs` that hold one of (M, 2) points, m, as LETHAL.

    A point counts within obstacle_min_range and obstacle_max_range m of the sensor, measured in m
    and again in whole cells. Points or a sensor outside the grid mark nothing. `bounds`, (4,)
    min_x, min_y, max_x, max_y m, grows in place. (ObstacleLayer::updateBounds)
    """
    rows, columns = costs.shape
    sensor_column, sensor_row = world_to_cell(
        sensor_x, sensor_y, origin_x, origin_y, resolution, columns, rows
    )
    if sensor_column < 0:
        return
    min_cells = distance_to_cells(obstacle_min_range, resolution)
    max_cells = distance_to_cells(obstacle_max_range, resolution)
    min_squared = obstacle_min_range * obstacle_min_range
    max_squared = obstacle_max_range * obstacle_max_range
    for k in range(points.shape[0]):
        x, y = points[k, 0], points[k, 1]
        column, row = world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows)
        if column < 0:
            continue
        squared = (x - sensor_x) * (x - sensor_x) + (y - sensor_y) * (y - sensor_y)
        if squared < min_squared or squared > max_squared:
            continue
        cells = int(math.hypot(column - sensor_column, row - sensor_row))
        if min_cells <= cells <= max_cells:
            costs[row, column] = LETHAL
            _grow(bounds, x, y)


def place_outline(footprint: NDArray[np.float64], pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns a (K, 2) footprint, base frame, m, as it lies at a pose (3,) x m, y m, yaw rad."""
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    outline = np.empty(footprint.shape)
    outline[:, 0] = pose[0] + (footprint[:, 0] * cos_yaw - footprint[:, 1] * sin_yaw)
    outline[:, 1] = pose[1] + (footprint[:, 0] * sin_yaw + footprint[:, 1] * cos_yaw)
    return outline


@njit(cache=True)
def fill_outline(costs, origin_x, origin_y, resolution, outline, cost):
    """Sets, in place, the cells of `costs` on and within a convex outline (K, 2), m, to `cost`.

    Cells are those of the edges' lines and, in every column, all between the lowest and the
    highest of them. Fewer than three vertices, or one outside the grid, set nothing.
    (Costmap2D::setConvexPolygonCost)
    """
    rows, columns = costs.shape
    count = outline.shape[0]
    if count < 3:
        return
    cells = np.empty((count, 2), dtype=np.int64)
    left, right, bottom, top = columns, 0, rows, 0
    for k in range(count):
        column, row = world_to_cell(
            outline[k, 0], outline[k, 1], origin_x, origin_y, resolution, columns, rows
        )
        if column < 0:
            return
        left, right = min(left, column), max(right, column)
        bottom, top = min(bottom, row), max(top, row)
        cells[k, 0], cells[k, 1] = column, row
    edges = np.zeros((top - bottom + 1, right - left + 1), dtype=np.uint8)
    for k in range(count):
        end = k + 1 if k + 1 < count else 0
        _draw_line(
            edges,
            cells[k, 0] - left,
            cells[k, 1] - bottom,
            cells[end, 0] - left,
            cells[end, 1] - bottom,
            WHOLE_LINE,
            1,
        )
    for column in range(edges.shape[1]):
        lowest, highest = -1, -1
        for row in range(edges.shape[0]):
            if edges[row, column]:
                highest = row
                if lowest < 0:
                    lowest = row
        for row in range(lowest, highest + 1):
            costs[bottom + row, left + column] = cost


def merge_layer(
    master: NDArray[np.uint8], layer: NDArray[np.uint8], rule: MergeRule = MergeRule.MAX
) -> None:
    """Writes a layer's costs into `master`, in place; both (rows, columns) uint8.

    A window of a grid is merged by passing the two slices. (CostmapLayer::updateWithMax etc.)
    """
    if rule == MergeRule.TRUE_OVERWRITE:
        master[:] = layer
        return
    writes = layer != NO_INFORMATION
    if rule == MergeRule.MAX:
        writes &= (layer > master) | (master == NO_INFORMATION)
    elif rule == MergeRule.MAX_KEEP_UNKNOWN:
        writes &= layer > master
    np.copyto(master, layer, where=writes)


@njit(cache=True)
def _grow(bounds, x, y):
    bounds[0], bounds[1] = min(bounds[0], x), min(bounds[1], y)
    bounds[2], bounds[3] = max(bounds[2], x), max(bounds[3], y)


@njit(cache=True)
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


@njit(cache=True)
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
    _draw_line(costs, column_0, row_0, column_1, row_1, int(part * extent), FREE)


@njit(cache=True)
def _draw_line(costs, column_0, row_0, column_1, row_1, step_limit, cost):
    """Sets the cells of Nav2's line (see grid.line_max_cost), after at most so many steps."""
    delta_column, delta_row = abs(column_1 - column_0), abs(row_1 - row_0)
    step_column = 1 if column_1 >= column_0 else -1
    step_row = 1 if row_1 >= row_0 else -1
    along_x = delta_column >= delta_row
    major = delta_column if along_x else delta_row
    minor = delta_row if along_x else delta_column
    error = major // 2
    column, row = column_0, row_0
    costs[row, column] = cost
    for _ in range(min(step_limit, major)):
        error += minor
        step_minor = error >= major
        if step_minor:
            error -= major
        if along_x or step_minor:
            column += step_column
        if not along_x or step_minor:
            row += step_row
        costs[row, column] = cost
