"""Cost-aware A* over the eight neighbours of a costmap cell (Nav2's SmacPlanner2D).

Costs are float32, as in Nav2. A step of length L (1 or sqrt 2 cells) into a cell of cost c takes
L * (1 + cost_travel_multiplier * c / 252); the heuristic is the straight distance from the cell's
index to a point given in the same units. Nav2 gives the goal's continuous map coordinates, so that
its distances count from the cells' lower left corners; less half a cell, they count from the
centres.

Ties: the open set is a binary heap ordered by g + h alone. Among equal sums the right child rises
before the left one, a new entry never passes an equal parent, and a cell keeps its first parent of
equal cost; neighbours are visited in the order W, E, S, N, SW, SE, NW, NE. That is what the C++
standard library's priority queue does inside Nav2, and it makes the path a function of the input.

Nothing here reads a clock: a time limit enters as a number of expansions.
Source: nav2_smac_planner (AStarAlgorithm, Node2D, GoalManager).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import INSCRIBED, MAX_NON_OBSTACLE, NO_INFORMATION

FOUND = 0
GOAL_OCCUPIED = 1
OPEN_SET_EMPTY = 2
ITERATION_LIMIT = 3
EXPANSION_BUDGET_SPENT = 4
START_OCCUPIED = 5

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

# A heap entry is one int64: the bits of the float32 sum g + h above, the cell's index below. Sums
# are never negative, so that their bits sort like their values.
KEY_SHIFT = 32
CELL_MASK = (1 << KEY_SHIFT) - 1

INITIAL_HEAP_CAPACITY = 4096

# Places in the heap are unsigned: of a signed index numba asks at every access whether it counts
# from the end. A plain number beside an unsigned one would make both floating.
ZERO, ONE, TWO, THREE = (np.uint64(number) for number in range(4))


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


@njit(cache=True)
def _entry(key, cell):
    """Returns the heap entry of a cell whose g + h is `key` (float32)."""
    return (np.int64(np.float32(key).view(np.int32)) << KEY_SHIFT) | cell


@njit(cache=True)
def _rise(heap, hole, entry):
    """Puts an entry into the heap at `hole` or above, below the first parent that is not larger."""
    key = entry >> KEY_SHIFT
    while hole > ZERO:
        parent = (hole - ONE) >> ONE
        above = heap[parent]
        if not (above >> KEY_SHIFT) > key:
            break
        heap[hole] = above
        hole = parent
    heap[hole] = entry


@njit(cache=True)
def _is_larger(entry, other):
    """Returns 1 where the key of an entry is larger than that of another, else 0."""
    return np.int64((entry >> KEY_SHIFT) > (other >> KEY_SHIFT))


@njit(cache=True)
def _chosen(is_first, first, second):
    """Returns the first of two whole numbers for 1, the second for 0, without a branch."""
    return second ^ ((first ^ second) & -is_first)


@njit(cache=True)
def _pop(heap, size):
    """Removes the top of a heap of `size` entries and returns its cell.

    The hole sinks to the bottom along the smaller children (the right one on ties); the last entry
    rises from there. Which child is smaller no processor can guess, so it is chosen without a
    branch, two levels at once: the children of both are compared before it is known whose count.
    """
    top = heap[ZERO] & CELL_MASK
    last = size - ONE
    hole = ZERO
    below = THREE
    while below + THREE < last:
        beside = (hole << ONE) + ONE
        left, right = heap[beside], heap[beside + ONE]
        left_left, left_right = heap[below], heap[below + ONE]
        right_left, right_right = heap[below + TWO], heap[below + THREE]
        is_left = _is_larger(right, left)
        is_left_left = _is_larger(left_right, left_left)
        is_right_left = _is_larger(right_right, right_left)
        of_left = _chosen(is_left_left, left_left, left_right)
        of_right = _chosen(is_right_left, right_left, right_right)
        heap[hole] = _chosen(is_left, left, right)
        heap[beside + ONE - np.uint64(is_left)] = _chosen(is_left, of_left, of_right)
        from_left = np.int64(below + ONE) - is_left_left
        from_right = np.int64(below + THREE) - is_right_left
        hole = np.uint64(_chosen(is_left, from_left, from_right))
        below = (hole << TWO) + THREE
    child = (hole << ONE) + TWO
    while child < last:
        child -= np.uint64(_is_larger(heap[child], heap[child - ONE]))
        heap[hole] = heap[child]
        hole = child
        child = (hole << ONE) + TWO
    if child == last:
        heap[hole] = heap[child - ONE]
        hole = child - ONE
    if last > ZERO:
        _rise(heap, hole, heap[last])
    return np.uint64(top)


@njit(cache=True)
def _grown(array):
    """Returns a copy of `array` with twice the room."""
    larger = np.empty(2 * array.size, dtype=array.dtype)
    for k in range(array.size):
        larger[k] = array[k]
    return larger


@njit(cache=True)
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
def _cells_to(directions, columns, start, end):
    """Returns (N, 2) int64 [column, row] of the cells from `start` to `end`, both included."""
    count = 1
    cell = end
    while cell != start:
        direction = directions[cell]
        cell -= COLUMN_STEPS[direction] + ROW_STEPS[direction] * columns
        count += 1
    path = np.empty((count, 2), dtype=np.int64)
    cell = end
    for k in range(count - 1, -1, -1):
        path[k, 0] = cell % columns
        path[k, 1] = cell // columns
        direction = directions[cell]
        cell -= COLUMN_STEPS[direction] + ROW_STEPS[direction] * columns
    return path


@njit(cache=True)
def _improved(flat_costs, columns, cell, cell_g, table, g):
    """Returns the neighbours that a cell's cost improves on, bit k that in direction k.

    All eight are compared without a branch; most are not improved on. Corners are not cut here.
    """
    below, above = cell - columns, cell + columns
    mask = np.int64(cell_g + table[0, flat_costs[cell - ONE]] < g[cell - ONE])
    mask |= np.int64(cell_g + table[0, flat_costs[cell + ONE]] < g[cell + ONE]) << 1
    mask |= np.int64(cell_g + table[0, flat_costs[below]] < g[below]) << 2
    mask |= np.int64(cell_g + table[0, flat_costs[above]] < g[above]) << 3
    mask |= np.int64(cell_g + table[1, flat_costs[below - ONE]] < g[below - ONE]) << 4
    mask |= np.int64(cell_g + table[1, flat_costs[below + ONE]] < g[below + ONE]) << 5
    mask |= np.int64(cell_g + table[1, flat_costs[above - ONE]] < g[above - ONE]) << 6
    mask |= np.int64(cell_g + table[1, flat_costs[above + ONE]] < g[above + ONE]) << 7
    return mask


# Called for every cell: the call itself would cost a tenth of the search.
@njit(cache=True, forceinline=True)
def _relax_neighbours(flat_costs, columns, cell, cell_g, goal_point, steps, reached, best):
    """Offers the cell's cost to its neighbours. Returns (heap size, best cell, best heuristic).

    goal_point: (x, y) in cells. steps: table of `step_costs`, and whether corners may be cut.
    reached: g and directions by cell, the heap, and its size. best: (cell, heuristic) nearest to
    the goal among all cells relaxed so far, the first on ties.
    """
    goal_x, goal_y = goal_point
    table, corner_cutting = steps
    g, directions, heap, size = reached
    best_cell, best_h = best
    row = cell // columns
    column = cell - row * columns
    mask = _improved(flat_costs, columns, cell, cell_g, table, g)
    while mask != 0:
        direction = LOWEST_BIT[np.uint64(mask)]
        mask &= mask - 1
        column_step, row_step = COLUMN_STEPS[direction], ROW_STEPS[direction]
        beside = cell + np.uint64(column_step)
        neighbour = beside + np.uint64(row_step) * columns
        is_diagonal = np.int64(direction) >= FIRST_DIAGONAL
        if is_diagonal and not corner_cutting:
            beyond = neighbour - np.uint64(column_step)
            if table[0, flat_costs[beside]] == np.inf or table[0, flat_costs[beyond]] == np.inf:
                continue
        new_g = cell_g + table[np.uint64(is_diagonal), flat_costs[neighbour]]
        g[neighbour] = new_g
        directions[neighbour] = direction
        h = _heuristic(
            np.int64(column) + column_step - BORDER,
            np.int64(row) + row_step - BORDER,
            goal_x,
            goal_y,
        )
        if h < best_h:
            best_h = h
            best_cell = neighbour
        _rise(heap, size, _entry(new_g + h, np.int64(neighbour)))
        size += ONE
    return size, best_cell, best_h


@njit(cache=True)
def _search(flat_costs, columns, start, goal, goal_point, steps, approach, stop_at):
    """Runs `search` on a flat grid with a blocked border, cells named by row * columns + column.

    The goal is admitted. steps: as of `_relax_neighbours`. approach: (tolerance in cells,
    max_on_approach_iterations). stop_at: (expansions, status) at which the search ends, and whether
    it then ends without a path even where it has come within the tolerance. Returns (status, last
    cell of the path, expansions, directions by which cells were reached).
    """
    tolerance, max_on_approach_iterations = approach
    g = np.full(flat_costs.size, np.float32(np.inf), dtype=np.float32)
    directions = np.empty(flat_costs.size, dtype=np.uint8)
    heap = np.empty(INITIAL_HEAP_CAPACITY, dtype=np.int64)
    g[start] = np.float32(0.0)
    heap[0] = np.int64(start)
    size = ONE
    best_cell, best_h = start, np.float32(np.inf)
    expansions, approach_expansions = np.int64(0), np.int64(0)
    status = OPEN_SET_EMPTY
    while size > ZERO:
        if expansions >= stop_at[0]:
            status = stop_at[1]
            break
        cell = _pop(heap, size)
        size -= ONE
        cell_g = g[cell]
        if cell_g == CLOSED:
            continue
        expansions += 1
        g[cell] = CLOSED
        if cell == goal:
            return FOUND, cell, expansions, directions
        if best_h < tolerance:
            approach_expansions += 1
            if approach_expansions >= max_on_approach_iterations > 0:
                break
        if np.int64(size) + NEIGHBOURS > heap.size:
            heap = _grown(heap)
        size, best_cell, best_h = _relax_neighbours(
            flat_costs, columns, cell, cell_g, goal_point, steps,
            (g, directions, heap, size), (best_cell, best_h),
        )  # fmt: skip
    if best_h < tolerance and not (status == stop_at[1] and stop_at[2]):
        status = FOUND
    return status, best_cell, expansions, directions


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
    walled = np.full([side + 2 * BORDER for side in costs.shape], INSCRIBED, dtype=np.uint8)
    walled[BORDER:-BORDER, BORDER:-BORDER] = costs
    columns = walled.shape[1]
    start, goal = (
        (int(row) + BORDER) * columns + int(column) + BORDER
        for column, row in (start_cell, goal_cell)
    )
    status, end, expansions, directions = _search(
        walled.ravel(),
        np.uint64(columns),
        np.uint64(start),
        np.uint64(goal),
        point,
        (step_costs(rules.cost_travel_multiplier, rules.allow_unknown), rules.corner_cutting),
        (reach, rules.max_on_approach_iterations),
        _stop_at(rules),
    )
    if status != FOUND:
        return status, no_cells, expansions
    return status, _cells_to(directions, columns, start, int(end)) - BORDER, expansions


def _stop_at(rules: SearchRules) -> tuple[int, int, bool]:
    """Returns the expansions that end `search`, its status then, and whether it then fails."""
    interval = rules.terminal_checking_interval
    spent_at = -(-rules.expansion_budget // interval) * interval
    if 0 < rules.max_iterations <= spent_at:
        return rules.max_iterations, ITERATION_LIMIT, False
    return spent_at, EXPANSION_BUDGET_SPENT, rules.fails_when_late
