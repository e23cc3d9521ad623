"""Theta*: A* over a costmap's cells whose paths run straight between cells that see each other.

Sums are float64. A step takes w_euc_cost times its length in cells and w_traversal_cost times the
square of the scaled cost 26 + 0.9 cost, of the cell that it enters, over 252^2; a straight line
takes the same for every cell that it crosses but the last. When a cell is expanded, its parent's
parent becomes its parent where the line of sight is free and no dearer.

Three quirks of Nav2's are kept. A cell whose sum falls while it waits in the heap is not moved, so
that the heap's order depends on its history. The start stays in the heap while it is expanded for
the first time. And the search gives up as soon as the heap is empty, before it looks at the cell
taken last: along a passage one cell wide it fails, even if that cell is the goal.

Cells are named by row * columns + column. Source: nav2_theta_star_planner (ThetaStar), branch
lyrical, and up to kilted for lines of sight between lattice points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import INSCRIBED, LETHAL, MAX_NON_OBSTACLE, NO_INFORMATION

NO_PARENT = -1
# (column, row) of the neighbours in the order in which they are looked at; the first four suffice
# where only straight steps are allowed.
COLUMN_STEPS = np.array([0, 0, 1, -1, 1, -1, 1, -1], dtype=np.int64)
ROW_STEPS = np.array([1, -1, 0, 0, -1, 1, 1, -1], dtype=np.int64)


class CostTables(NamedTuple):
    """The costs of a step and of a line of sight, by the cell's cost; each (256,).

    may_enter: a step may end in the cell. step: the cost of entering it. may_cross: a line of sight
    may cross it. crossing: the cost of crossing it.
    """

    may_enter: NDArray[np.bool_]
    step: NDArray[np.float64]
    may_cross: NDArray[np.bool_]
    crossing: NDArray[np.float64]


def cost_tables(
    w_traversal_cost: float, *, allow_unknown: bool, highest: int = MAX_NON_OBSTACLE
) -> CostTables:
    """Returns the tables of a search. A cost of 252 may be entered, but not be crossed by lines.

    highest: the highest cost that a step may enter; 251 in Iron.
    """
    costs = np.arange(256)
    scaled = 26 + 0.9 * costs.astype(np.float64)
    crossed = np.where(costs == NO_INFORMATION, float(INSCRIBED), scaled)
    is_allowed_unknown = (costs == NO_INFORMATION) & allow_unknown
    limit = MAX_NON_OBSTACLE

    def weighted(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return w_traversal_cost * values * values / limit / limit

    return CostTables(
        may_enter=is_allowed_unknown | (costs <= highest),
        step=weighted(scaled),
        may_cross=is_allowed_unknown | (scaled <= limit),
        crossing=weighted(crossed),
    )


@njit(cache=True, error_model="numpy")
def _rise(heap, hole, cell, f):
    """Puts a cell at `hole` of the heap or above, below the first parent that is not larger."""
    while hole > 0:
        parent = (hole - 1) >> 1
        if not f[heap[parent]] > f[cell]:
            break
        heap[hole] = heap[parent]
        hole = parent
    heap[hole] = cell


@njit(cache=True, error_model="numpy")
def _pop(heap, size, f):
    """Removes the top of a heap of `size` cells and returns it.

    The hole sinks to the bottom along the smaller children (the right one on ties), the last cell
    rises from there, as in the C++ standard library, also where sums have changed.
    """
    top = heap[0]
    last = size - 1
    if last == 0:
        return top
    hole, child = 0, 2
    while child < last:
        if f[heap[child]] > f[heap[child - 1]]:
            child -= 1
        heap[hole] = heap[child]
        hole = child
        child = 2 * hole + 2
    if child == last:
        heap[hole] = heap[child - 1]
        hole = child - 1
    _rise(heap, hole, np.int64(heap[last]), f)
    return top


@njit(cache=True, error_model="numpy")
def _distance(column_0, row_0, column_1, row_1):
    """Returns the distance between two cells, in cells."""
    return math.hypot(float(column_1 - column_0), float(row_1 - row_0))


@njit(cache=True, error_model="numpy")
def line_of_sight(costs, column_0, row_0, column_1, row_1, may_enter, may_cross, crossing):
    """Returns (is_free, cost) of the straight line between two cells of (rows, columns) costs.

    The line's cells count from the first to the one before the last. A diagonal step needs both
    cells beside it. (ThetaStar::losCheck)
    """
    d_column, d_row = abs(column_1 - column_0), abs(row_1 - row_0)
    column_step = 1 if column_0 < column_1 else -1
    row_step = 1 if row_0 < row_1 else -1
    column, row, error = column_0, row_0, d_column - d_row
    cost = 0.0
    while column != column_1 or row != row_1:
        here = costs[row, column]
        if not may_cross[here]:
            return False, cost
        cost += crossing[here]
        doubled = 2 * error
        if doubled > -d_row and doubled <= d_column:
            beside_column, beside_row = (
                costs[row, column + column_step],
                costs[row + row_step, column],
            )
            if not (may_enter[beside_column] and may_enter[beside_row]):
                return False, cost
            column += column_step
            row += row_step
            error += d_column - d_row
        elif doubled > -d_row:
            column += column_step
            error -= d_row
        else:
            row += row_step
            error += d_column
    return True, cost


@njit(cache=True, error_model="numpy")
def _cost_at(costs, is_along_row, along, beside):
    """Returns the cost of the cell at (along, beside) of a line that runs along rows or columns.

    Left of column 0 lies the last cell of the row below, as in the memory of Nav2's costmap; below
    row 0, where Nav2 reads beyond its costmap, all is LETHAL.
    """
    column, row = (along, beside) if is_along_row else (beside, along)
    index = row * costs.shape[1] + column
    return costs.ravel()[index] if index >= 0 else LETHAL


@njit(cache=True, error_model="numpy")
def lattice_line_of_sight(costs, column_0, row_0, column_1, row_1, may_cross, crossing):
    """Returns (is_free, cost) of the line between two cells, as releases up to Kilted see it.

    The line runs between the lower left corners of the cells. Every cell that it passes through
    must be free. Where it runs along the edges of cells, one of the two cells beside each edge
    must be: the upper or right one counts, and if it is blocked, the other. (ThetaStar::losCheck)
    """
    is_along_row = abs(column_1 - column_0) >= abs(row_1 - row_0)
    along, beside, end, end_beside = column_0, row_0, column_1, row_1
    if not is_along_row:
        along, beside, end, end_beside = row_0, column_0, row_1, column_1
    length, width = abs(end - along), abs(end_beside - beside)
    step, step_beside = 1 if end > along else -1, 1 if end_beside > beside else -1
    # A step back passes the cell before the corner.
    shift, shift_beside = (step - 1) // 2, (step_beside - 1) // 2
    risen, cost = 0, 0.0
    while along != end:
        risen += width
        if risen >= length:
            here = _cost_at(costs, is_along_row, along + shift, beside + shift_beside)
            if not may_cross[here]:
                return False, cost
            cost += crossing[here]
            beside += step_beside
            risen -= length
        if risen != 0:
            here = _cost_at(costs, is_along_row, along + shift, beside + shift_beside)
            if not may_cross[here]:
                return False, cost
            cost += crossing[here]
        if width == 0:
            here = _cost_at(costs, is_along_row, along + shift, beside)
            if not may_cross[here]:
                here = _cost_at(costs, is_along_row, along + shift, beside - 1)
            if not may_cross[here]:
                return False, cost
            cost += crossing[here]
        along += step
    return True, cost


@njit(cache=True, error_model="numpy")
def _reset_parent(costs, cell, tables, weights, goal, reached, by_lattice):
    """Makes a cell's grandparent its parent, where it is in sight and the way is cheaper.

    weights: w_euc_cost and the heuristic's. goal: (column, row). reached: g, f and
    parents of all cells, which change. by_lattice: see cells by `lattice_line_of_sight`.
    """
    (goal_column, goal_row), (g, f, parents), (w_euc_cost, h_weight) = goal, reached, weights
    may_enter, _, may_cross, crossing = tables
    columns = costs.shape[1]
    grandparent = parents[parents[cell]]
    row, far_row = cell // columns, grandparent // columns
    column, far_column = cell - row * columns, grandparent - far_row * columns
    if by_lattice:
        is_free, cost = lattice_line_of_sight(
            costs, column, row, far_column, far_row, may_cross, crossing
        )
    else:
        is_free, cost = line_of_sight(
            costs, column, row, far_column, far_row, may_enter, may_cross, crossing
        )
    if not is_free:
        return
    length = _distance(column, row, far_column, far_row)
    new_g = g[grandparent] + w_euc_cost * length + cost
    if new_g < g[cell]:
        parents[cell] = grandparent
        g[cell] = new_g
        f[cell] = new_g + h_weight * _distance(column, row, goal_column, goal_row)


@njit(cache=True, error_model="numpy")
def _search(costs, start, goal, tables, w_euc_cost, neighbour_count, by_lattice):
    """Returns (found, parents (cells,) int32) of a search from a start to a goal cell."""
    rows, columns = costs.shape
    may_enter, step_costs, _, _ = tables
    h_weight = w_euc_cost if w_euc_cost < 1.0 else 1.0
    goal_row = goal // columns
    goal_column = goal - goal_row * columns
    g, f = np.full(costs.size, np.inf), np.full(costs.size, np.inf)
    parents = np.full(costs.size, NO_PARENT, dtype=np.int32)
    is_waiting = np.zeros(costs.size, dtype=np.bool_)
    # Every cell waits at most once, except for the start.
    heap = np.empty(costs.size + 1, dtype=np.int32)
    start_row, start_column = start // columns, start % columns
    g[start] = step_costs[costs[start_row, start_column]]
    f[start] = g[start] + h_weight * _distance(start_column, start_row, goal_column, goal_row)
    parents[start] = start
    heap[0], size = start, np.int64(1)
    cell = np.int64(start)
    while size > 0:
        if cell == goal:
            return True, parents
        is_waiting[cell] = False
        _reset_parent(
            costs,
            cell,
            tables,
            (w_euc_cost, h_weight),
            (goal_column, goal_row),
            (g, f, parents),
            by_lattice,
        )
        row = cell // columns
        column = cell - row * columns
        for direction in range(neighbour_count):
            next_column = column + COLUMN_STEPS[direction]
            next_row = row + ROW_STEPS[direction]
            if next_column < 0 or next_column >= columns or next_row < 0 or next_row >= rows:
                continue
            cost = costs[next_row, next_column]
            if not may_enter[cost]:
                continue
            length = _distance(column, row, next_column, next_row)
            new_g = g[cell] + w_euc_cost * length + step_costs[cost]
            new_f = new_g + h_weight * _distance(next_column, next_row, goal_column, goal_row)
            neighbour = next_row * columns + next_column
            if f[neighbour] > new_f:
                g[neighbour], f[neighbour] = new_g, new_f
                parents[neighbour] = cell
                if not is_waiting[neighbour]:
                    is_waiting[neighbour] = True
                    _rise(heap, size, neighbour, f)
                    size += 1
        cell = np.int64(_pop(heap, size, f))
        size -= 1
    return False, parents


def search(
    costs: NDArray[np.uint8],
    start_cell: tuple[int, int],
    goal_cell: tuple[int, int],
    *,
    tables: CostTables,
    w_euc_cost: float,
    how_many_corners: int,
    by_lattice: bool = False,
) -> NDArray[np.int64] | None:
    """Returns (N, 2) [column, row] of the corners of the path, both ends included, or None.

    costs: (rows, columns) uint8, C-contiguous. start_cell, goal_cell: (column, row), not the same;
    neither is tested. how_many_corners: 4 or 8 neighbours of a cell. by_lattice: see
    cells by `lattice_line_of_sight`, not by `line_of_sight`. (ThetaStar::generatePath)
    """
    columns = costs.shape[1]
    start = start_cell[1] * columns + start_cell[0]
    goal = goal_cell[1] * columns + goal_cell[0]
    found, parents = _search(costs, start, goal, tables, w_euc_cost, how_many_corners, by_lattice)
    if not found:
        return None
    corners = [goal]
    while corners[-1] != start:
        corners.append(int(parents[corners[-1]]))
    rows, columns = np.divmod(np.array(corners[::-1], dtype=np.int64), columns)
    return np.stack([columns, rows], axis=1)
