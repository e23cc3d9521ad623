"""A layer's own grid: moved along with the robot, drawn on, merged into the master grid.

Grids are (rows, columns), `[row = y, column = x]`, of costs, uint8, unless stated otherwise; the
origin is the lower left corner of cell (0, 0), m. Source: nav2_costmap_2d (Costmap2D, CostmapLayer)
and nav2_util (raytraceLine).
"""

from __future__ import annotations

from enum import IntEnum
from typing import TypeVar

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.kernels.grid import NO_INFORMATION, world_to_cell

Value = TypeVar("Value", bound=np.generic)
# The cells by which Nav2 up to Kilted tells a grid's length too short (getSizeInMetersX).
MISSING_CELLS = 0.5
WHOLE_LINE = np.iinfo(np.int64).max


class MergeRule(IntEnum):
    """The rule that writes a layer's cost L into the master's M; NO_INFORMATION writes nothing.

    OVERWRITE: M becomes L. MAX: the larger, where M is unknown L. MAX_KEEP_UNKNOWN: the larger,
    where M is unknown M stays. TRUE_OVERWRITE: M becomes L, even NO_INFORMATION.
    The first three are Nav2's `combination_method`.
    """

    OVERWRITE = 0
    MAX = 1
    MAX_KEEP_UNKNOWN = 2
    TRUE_OVERWRITE = 3


def rolled_origin(
    origin: tuple[float, float],
    shape: tuple[int, int],
    *,
    resolution: float,
    robot_pose: NDArray[np.float64],
    is_short: bool = False,
) -> tuple[float, float]:
    """Returns the lower left corner (x, y), m, of a window that follows the robot.

    origin: the corner so far, m. shape: (rows, columns). robot_pose: (3,) x m, y m, yaw rad; the
    window is moved until the robot is in its middle. The move is a whole number of cells, truncated
    toward zero, so that the corner stays on its lattice and may lag by up to a cell. is_short: the
    grid counts as half a cell shorter than it is, as in Nav2 up to Kilted, so that it lies a
    quarter of a cell off. (Costmap2D::updateOrigin)
    """
    rows, columns = shape
    missing = MISSING_CELLS if is_short else 0.0
    x, y, _ = robot_pose.tolist()
    wanted_x = x - 0.5 * ((columns - missing) * resolution)
    wanted_y = y - 0.5 * ((rows - missing) * resolution)
    shift_x = int((wanted_x - origin[0]) / resolution)
    shift_y = int((wanted_y - origin[1]) / resolution)
    return origin[0] + shift_x * resolution, origin[1] + shift_y * resolution


def moved_cells(
    cells: NDArray[Value],
    origin: tuple[float, float],
    new_origin: tuple[float, float],
    *,
    resolution: float,
    default: int | np.unsignedinteger,
) -> NDArray[Value]:
    """Returns a new array with the cells of a grid whose lower left corner has moved.

    cells: (rows, columns) of any type. origin, new_origin: the corner before and after, m, a whole
    number of cells apart. Cells that both grids share keep their value, the others get `default`.
    """
    rows, columns = cells.shape
    shift_x = round((new_origin[0] - origin[0]) / resolution)
    shift_y = round((new_origin[1] - origin[1]) / resolution)
    moved = np.full(cells.shape, default, dtype=cells.dtype)
    if abs(shift_x) < columns and abs(shift_y) < rows:
        from_rows, to_rows = _shared(shift_y, rows)
        from_columns, to_columns = _shared(shift_x, columns)
        moved[to_rows, to_columns] = cells[from_rows, from_columns]
    return moved


def _shared(shift: int, count: int) -> tuple[slice, slice]:
    """Returns the slice of `count` cells that stay in a window moved by `shift`, and where to."""
    first, last = max(shift, 0), min(shift + count, count)
    return slice(first, last), slice(first - shift, last - shift)


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


@register_jitable
def grow_box(box, x, y):
    """Grows a box, (4,) min_x, min_y, max_x, max_y m, in place, so that it holds a point, m."""
    box[0], box[1] = min(box[0], x), min(box[1], y)
    box[2], box[3] = max(box[2], x), max(box[3], y)


@njit(cache=True)
def fill_outline(grid, outline, cost):
    """Sets, in place, the cells of a `Grid` on and within a convex outline (K, 2), m, to `cost`.

    Cells are those of the edges' lines and, in every column, all between the lowest and the
    highest of them. Fewer than three vertices, or one outside the grid, set nothing.
    (Costmap2D::setConvexPolygonCost)
    """
    costs = grid.costs
    rows, columns = costs.shape
    count = outline.shape[0]
    if count < 3:
        return
    cells = np.empty((count, 2), dtype=np.int64)
    left, right, bottom, top = columns, 0, rows, 0
    for k in range(count):
        column, row = world_to_cell(
            outline[k, 0],
            outline[k, 1],
            grid.origin_x,
            grid.origin_y,
            grid.resolution,
            columns,
            rows,
        )
        if column < 0:
            return
        left, right = min(left, column), max(right, column)
        bottom, top = min(bottom, row), max(top, row)
        cells[k, 0], cells[k, 1] = column, row
    edges = np.zeros((top - bottom + 1, right - left + 1), dtype=np.uint8)
    for k in range(count):
        end = k + 1 if k + 1 < count else 0
        draw_line(
            edges,
            cells[k, 0] - left,
            cells[k, 1] - bottom,
            cells[end, 0] - left,
            cells[end, 1] - bottom,
            # For constants it would be compiled once more.
            np.int64(WHOLE_LINE),
            np.int64(1),
        )
    for column in range(edges.shape[1]):
        lowest, highest = edges.shape[0], -1
        for row in range(edges.shape[0]):
            if edges[row, column]:
                lowest, highest = min(lowest, row), row
        for row in range(lowest, highest + 1):
            costs[bottom + row, left + column] = cost


@register_jitable
def draw_line(costs, column_0, row_0, column_1, row_1, step_limit, cost):
    """Sets the cells of Nav2's line (see grid.line_max_cost), in at most `step_limit` steps."""
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
