"""Cost-aware A* over the eight neighbours of a costmap cell (Nav2's SmacPlanner2D).

Costs are float32, as in Nav2. A step of length L (1 or sqrt 2 cells) into a cell of cost c takes
L * (1 + cost_travel_multiplier * c / 252); the heuristic is the straight distance from the cell's
index to a point given in the same units. Nav2 gives the goal's continuous map coordinates, so that
its distances count from the cells' lower left corners; less half a cell, they count from the
centres.

Ties: the open set is the C++ standard library's heap (`cell_heap`), ordered by g + h alone, as in
Nav2. A cell keeps its first parent of equal cost; neighbours are visited in the order W, E, S, N,
SW, SE, NW, NE. So the path is a function of the input.

Nothing here reads a clock: a time limit enters as a number of expansions.
Source: nav2_smac_planner (AStarAlgorithm, Node2D, GoalManager).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.cell_heap import (
    ONE,
    TOP,
    UNCOUNTED,
    ZERO,
    cell_of,
    depth_of,
    larger_heap,
    new_heap,
    push_cell,
    remove_top,
)
from drake_navbench.kernels.grid import INSCRIBED, MAX_NON_OBSTACLE, NO_INFORMATION

FOUND = 0
GOAL_OCCUPIED = 1
OPEN_SET_EMPTY = 2
ITERATION_LIMIT = 3
EXPANSION_BUDGET_SPENT = 4
START_OCCUPIED = 5
HEAP_FULL = 6

# Below this tolerance, in cells, releases before Lyrical test the goal's cell.
EXACT_TOLERANCE = 0.001

COST_VALUES = 256
NEIGHBOURS = 8
FIRST_DIAGONAL = 4
COLUMN_STEPS = np.array([-1, 1, 0, 0, -1, 1, -1, 1], dtype=np.int64)
ROW_STEPS = np.array([0, 0, -1, 1, -1, -1, 1, 1], dtype=np.int64)
# The index of the lowest bit of each set of directions; the largest number for the empty set.
LOWEST_BIT = np.array(
    [(k & -k).bit_length() - 1 for k in range(1 << NEIGHBOURS)], dtype=np.int64
).astype(np.uint64)
# Blocked cells around the grid give every cell of the grid eight neighbours.
BORDER = 1

# The g of a cell that was expanded: nothing improves on it.
CLOSED = np.float32(-np.inf)

# A cell of the search in one place of the memory; direction: the step by which it was reached.
CELL = np.dtype([("g", np.float32), ("cost", np.uint8), ("direction", np.uint8)], align=True)


class SearchRules(NamedTuple):
    """Parameters of the search, named as in Nav2's Smac 2D planner.

    tolerance: distance from the goal's point at which a path may end, cells. corner_cutting:
    whether a diagonal step may pass a blocked cell beside it, as in Nav2. max_iterations,
    max_on_approach_iterations: expansions in all, and within the tolerance; zero or less is
    unlimited. expansion_budget: stands for Nav2's time limit, and is checked at every
    `terminal_checking_interval`-th expansion.

    Rules of releases before Lyrical. takes_blocked_goal: a blocked goal is taken as soon as the
    tolerance is above `EXACT_TOLERANCE`, also where no free cell lies within it. fails_when_late:
    with the budget spent there is no path, also where a cell within the tolerance was reached.
    Of those before Jazzy. refuses_blocked_start: a blocked start is START_OCCUPIED.
    """

    tolerance: float
    cost_travel_multiplier: float
    allow_unknown: bool
    corner_cutting: bool
    max_iterations: int
    max_on_approach_iterations: int
    terminal_checking_interval: int
    expansion_budget: int
    takes_blocked_goal: bool = False
    fails_when_late: bool = False
    refuses_blocked_start: bool = False


def are_free(costs: NDArray[np.uint8], allow_unknown: bool) -> NDArray[np.bool_]:
    """Tells for each cost whether a cell may be entered (GridCollisionChecker, by index)."""
    return (costs < INSCRIBED) | ((costs == NO_INFORMATION) & allow_unknown)


def step_costs(cost_travel_multiplier: float, allow_unknown: bool) -> NDArray[np.float32]:
    """Returns (2, 256) float32: cost of a straight and of a diagonal step into a cell, by its cost.

    A blocked cell costs infinity, so that relaxing it never improves anything.
    """
    costs = np.arange(COST_VALUES, dtype=np.uint8)
    normalized = (costs / MAX_NON_OBSTACLE).astype(np.float32)
    penalty = np.float32(cost_travel_multiplier) * normalized
    lengths = np.array([1.0, np.float32(math.sqrt(2.0))])
    table = (lengths[:, None] * (1.0 + penalty.astype(np.float64))).astype(np.float32)
    table[:, ~are_free(costs, allow_unknown)] = np.inf
    return table


@njit(**UNCOUNTED)
def _heuristic(column, row, goal_x, goal_y):
    """Returns the distance from a cell's index to the goal's map coordinate, float32 cells."""
    delta_x = goal_x - np.float32(column)
    delta_y = goal_y - np.float32(row)
    return np.sqrt(delta_x * delta_x + delta_y * delta_y)


def is_goal_admissible(
    costs: NDArray[np.uint8],
    goal_cell: tuple[int, int],
    goal_point: tuple[np.float32, np.float32],
    tolerance: np.float32,
    allow_unknown: bool,
) -> bool:
    """Tells whether a search may start: the goal cell is free, or a cell within `tolerance` is.

    The arguments are those of `search`. A tolerance of less than one cell never relaxes.
    """
    if are_free(costs[goal_cell[1], goal_cell[0]], allow_unknown):
        return True
    if tolerance < 1.0:
        return False
    near_y, near_x = (
        np.arange(max(0, math.floor(centre - tolerance)), math.ceil(centre + tolerance) + 1)
        for centre in (goal_point[1], goal_point[0])
    )
    near_y, near_x = near_y[near_y < costs.shape[0]], near_x[near_x < costs.shape[1]]
    delta_x = near_x.astype(np.float32) - np.float32(goal_point[0])
    delta_y = near_y.astype(np.float32) - np.float32(goal_point[1])
    distance_squared = delta_y[:, None] ** 2 + delta_x**2
    is_near = distance_squared <= tolerance * tolerance
    return bool(np.any(is_near & are_free(costs[np.ix_(near_y, near_x)], allow_unknown)))


@njit(cache=True)
def _cells_to(cells, columns, start, end):
    """Returns (N, 2) int64 [column, row] of the cells from `start` to `end`, both included."""
    count = 1
    cell = end
    while cell != start:
        direction = cells[cell].direction
        cell -= COLUMN_STEPS[direction] + ROW_STEPS[direction] * columns
        count += 1
    path = np.empty((count, 2), dtype=np.int64)
    cell = end
    for k in range(count - 1, -1, -1):
        path[k, 0] = cell % columns
        path[k, 1] = cell // columns
        direction = cells[cell].direction
        cell -= COLUMN_STEPS[direction] + ROW_STEPS[direction] * columns
    return path


@njit(**UNCOUNTED)
def _set_cells(costs, cells):
    """Makes cells those of a grid (rows, columns) in a blocked border; nothing has reached them."""
    rows, columns = costs.shape
    place = 0
    for row in range(-BORDER, rows + BORDER):
        is_in_rows = 0 <= row < rows
        for column in range(-BORDER, columns + BORDER):
            is_inside = is_in_rows and 0 <= column < columns
            cells[place].g = np.float32(np.inf)
            cells[place].cost = costs[row, column] if is_inside else INSCRIBED
            place += 1


@njit(forceinline=True, **UNCOUNTED)
def _improves(there, g, steps):
    """Returns 1 where a step into a cell comes there with a smaller g than the cell has, else 0."""
    return np.int64(g + steps[there.cost] < there.g)


@njit(forceinline=True, **UNCOUNTED)
def _improved(cells, columns, cell, g, straight, diagonal):
    """Returns the neighbours that a cell with the cost `g` improves on, bit k that in direction k.

    All eight are compared without a branch; most are not improved on. Corners are not cut here.
    """
    below, above = cell - columns, cell + columns
    return (
        _improves(cells[cell - ONE], g, straight)
        | _improves(cells[cell + ONE], g, straight) << 1
        | _improves(cells[below], g, straight) << 2
        | _improves(cells[above], g, straight) << 3
        | _improves(cells[below - ONE], g, diagonal) << 4
        | _improves(cells[below + ONE], g, diagonal) << 5
        | _improves(cells[above - ONE], g, diagonal) << 6
        | _improves(cells[above + ONE], g, diagonal) << 7
    )


@njit(forceinline=True, **UNCOUNTED)
def _is_cut(cells, columns, cell, direction, blocking):
    """Tells whether a step passes a blocked cell beside it. blocking: the straight steps' costs."""
    beside = cell + np.uint64(COLUMN_STEPS[direction])
    beyond = cell + np.uint64(ROW_STEPS[direction]) * columns
    return blocking[cells[beside].cost] == np.inf or blocking[cells[beyond].cost] == np.inf


# Called for every cell: the call itself would cost a tenth of the search.
@njit(forceinline=True, **UNCOUNTED)
def _relax(cells, columns, at, goal_point, steps, heap, size, best):
    """Offers a cell's cost to its neighbours. Returns (heap size, best cell, best heuristic).

    at: the cell, its g, and the neighbours that it improves on. goal_point: (x, y) in cells.
    steps: table of `step_costs`, and whether corners may be cut. size: of the heap. best: (cell,
    heuristic) nearest to the goal among all cells relaxed so far, the first on ties.
    """
    cell, cell_g, improved = at
    table, corner_cutting = steps
    straight = table[0]
    best_cell, best_h = best
    row = cell // columns
    column = cell - row * columns
    while improved != 0:
        direction = LOWEST_BIT[np.uint64(improved)]
        improved &= improved - 1
        is_diagonal = np.int64(direction) >= FIRST_DIAGONAL
        passes_corners = corner_cutting or not is_diagonal
        if not passes_corners and _is_cut(cells, columns, cell, direction, straight):
            continue
        column_step, row_step = COLUMN_STEPS[direction], ROW_STEPS[direction]
        neighbour = cell + np.uint64(column_step) + np.uint64(row_step) * columns
        there = cells[neighbour]
        g = cell_g + table[np.uint64(is_diagonal), there.cost]
        there.g, there.direction = g, direction
        h = _heuristic(
            np.int64(column) + column_step - BORDER,
            np.int64(row) + row_step - BORDER,
            goal_point[0],
            goal_point[1],
        )
        if h < best_h:
            best_cell, best_h = neighbour, h
        push_cell(heap, size, g + h, neighbour)
        size += ONE
    return size, best_cell, best_h


class _Progress(NamedTuple):
    """A search between two expansions.

    status: HEAP_FULL, or that of the search. size: of the heap. nearest, distance: the
    cell nearest to the goal among all that were reached, the first on ties. approach_expansions:
    those with a cell within the tolerance.
    """

    status: int
    size: int
    nearest: int
    distance: float
    expansions: int
    approach_expansions: int


@njit(**UNCOUNTED)
def _advanced(cells, columns, heap, progress, goal, goal_point, steps, limits):
    """Goes on with `_search` until it ends, or until the heap is full; returns its progress."""
    (tolerance, max_on_approach_iterations), stop_at = limits
    straight, diagonal = steps[0][0], steps[0][1]
    _, size, best_cell, best_h, expansions, approach_expansions = progress
    status, depth = OPEN_SET_EMPTY, np.int64(0)
    while size > ZERO:
        if expansions >= stop_at[0]:
            status = stop_at[1]
            break
        if np.int64(size) + NEIGHBOURS >= heap.size:
            status = HEAP_FULL
            break
        cell = cell_of(heap[TOP])
        cell_g = cells[cell].g
        # The processor fetches the neighbours while the heap is put in order.
        improved = _improved(cells, columns, cell, cell_g, straight, diagonal)
        depth = depth_of(size, depth)
        remove_top(heap, size, depth)
        size -= ONE
        if cell_g == CLOSED:
            continue
        expansions += 1
        cells[cell].g = CLOSED
        if cell == goal:
            status, best_cell = FOUND, cell
            break
        if best_h < tolerance:
            approach_expansions += 1
            if approach_expansions >= max_on_approach_iterations > 0:
                break
        at, best = (cell, cell_g, improved), (best_cell, best_h)
        size, best_cell, best_h = _relax(cells, columns, at, goal_point, steps, heap, size, best)
    return _Progress(status, size, best_cell, best_h, expansions, approach_expansions)


@njit(cache=True)
def _search(cells, columns, start, goal, goal_point, steps, limits):
    """Runs `search` on the cells of `_set_cells`, named by row * columns + column.

    The goal is admitted. columns: with the border. steps: table of `step_costs`, and whether
    corners may be cut. limits: (tolerance in cells, max_on_approach_iterations), and (expansions,
    status) at which the search ends, and whether it then ends without a path even where it has come
    within the tolerance. Returns (status, last cell of the path, expansions).
    """
    (tolerance, _), stop_at = limits
    heap = new_heap()
    heap[TOP] = np.int64(start)
    cells[start].g = np.float32(0.0)
    none = np.int64(0)
    progress = _Progress(HEAP_FULL, ONE, start, np.float32(np.inf), none, none)
    while True:
        progress = _advanced(cells, columns, heap, progress, goal, goal_point, steps, limits)
        if progress.status != HEAP_FULL:
            break
        heap = larger_heap(heap)
    status = progress.status
    if progress.distance < tolerance and not (status == stop_at[1] and stop_at[2]):
        status = FOUND
    return status, progress.nearest, progress.expansions


def search(
    costs: NDArray[np.uint8],
    start_cell: tuple[int, int],
    goal_cell: tuple[int, int],
    goal_point: tuple[float, float],
    rules: SearchRules,
) -> tuple[int, NDArray[np.int64], int]:
    """Searches a path of cells. Returns (status, cells, expansions).

    costs: (rows, columns) uint8, C-contiguous.
    start_cell, goal_cell: (column, row).
    goal_point: (x, y) in cells, from which the cells' indices are measured.
    status: FOUND (cells (N, 2) int64 [column, row], ending in the goal cell or within tolerance of
        the goal); GOAL_OCCUPIED; START_OCCUPIED; OPEN_SET_EMPTY; ITERATION_LIMIT;
        EXPANSION_BUDGET_SPENT.
    """
    no_cells = np.empty((0, 2), dtype=np.int64)
    point = np.float32(goal_point[0]), np.float32(goal_point[1])
    reach = np.float32(rules.tolerance)
    if not (rules.takes_blocked_goal and reach >= EXACT_TOLERANCE) and not is_goal_admissible(
        costs, goal_cell, point, reach, rules.allow_unknown
    ):
        return GOAL_OCCUPIED, no_cells, 0
    start_cost = costs[start_cell[1], start_cell[0]]
    if rules.refuses_blocked_start and not are_free(start_cost, rules.allow_unknown):
        return START_OCCUPIED, no_cells, 0
    rows, columns = (side + 2 * BORDER for side in costs.shape)
    # By numpy: it asks for large pages where numba does not.
    cells = np.empty(rows * columns, dtype=CELL)
    _set_cells(costs, cells)
    start, goal = (
        (int(row) + BORDER) * columns + int(column) + BORDER
        for column, row in (start_cell, goal_cell)
    )
    status, end, expansions = _search(
        cells,
        np.uint64(columns),
        np.uint64(start),
        np.uint64(goal),
        point,
        (step_costs(rules.cost_travel_multiplier, rules.allow_unknown), rules.corner_cutting),
        ((reach, rules.max_on_approach_iterations), _stop_at(rules)),
    )
    if status != FOUND:
        return status, no_cells, expansions
    return status, _cells_to(cells, columns, start, int(end)) - BORDER, expansions


def _stop_at(rules: SearchRules) -> tuple[int, int, bool]:
    """Returns the expansions that end `search`, its status then, and whether it then fails."""
    interval = rules.terminal_checking_interval
    spent_at = -(-rules.expansion_budget // interval) * interval
    if 0 < rules.max_iterations <= spent_at:
        return rules.max_iterations, ITERATION_LIMIT, False
    return spent_at, EXPANSION_BUDGET_SPENT, rules.fails_when_late
