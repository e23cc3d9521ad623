"""The two heuristics of Hybrid-A*: a point's way round obstacles, a car's way without obstacles.

Both are computed only as far as the search needs them. Distances are in cells, float32. Source:
nav2_smac_planner (ObstacleHeuristic, DistanceHeuristic).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.binary_heap import heap_make, heap_pop, heap_push
from drake_navbench.kernels.car_curves import shortest_curve
from drake_navbench.kernels.curve_pieces import PIECES
from drake_navbench.kernels.grid import INSCRIBED
from drake_navbench.kernels.hybrid_releases import IRON, JAZZY

F32 = np.float32
ONE, TWO = F32(1.0), F32(2.0)
SQRT_2 = F32(math.sqrt(2.0))
MAX_COST, MAX_COST_SQUARED = F32(252.0), F32(63504.0)
# The value of the goal's cell at the start of the search; 0 would mean that it was not reached.
OPEN_GOAL = F32(-0.00001)
# Since Jazzy cells nearer to the border than this are never entered.
BORDER = 3
UNSEEN = np.uint8(255)


class Reached(NamedTuple):
    """The progress of the search back from the goal.

    costs: (rows, columns) float32, the least cost of each cell, or of its 2 x 2 where the grid was
    made coarser. values: (rows * columns,) float32, the way to the goal where it is positive; where
    it is negative its size is the least way found so far; 0 where the cell was not reached. keys,
    cells: a heap of open cells, and size: (1,) their number. is_coarse: whether cells are 2 x 2.
    cost_penalty, is_quadratic: parameters of the search. release: the release of Nav2 that
    searches: before Jazzy cells at the border are entered, too; Humble reckons costs in double
    precision.
    """

    costs: NDArray[np.float32]
    values: NDArray[np.float32]
    keys: NDArray[np.float32]
    cells: NDArray[np.int64]
    size: NDArray[np.int64]
    is_coarse: bool
    cost_penalty: np.float32
    is_quadratic: bool
    release: int


def reached_from(
    costs: NDArray[np.uint8],
    goal: tuple[int, int],
    start: tuple[int, int],
    *,
    is_coarse: bool,
    cost_penalty: float,
    is_quadratic: bool,
    release: int,
) -> Reached:
    """Returns a search that has only the goal's cell (column, row) open."""
    if is_coarse:
        rows, columns = costs.shape
        even = np.pad(costs, ((0, rows % 2), (0, columns % 2)), constant_values=UNSEEN)
        shape = (even.shape[0] // 2, 2, even.shape[1] // 2, 2)
        costs = even.reshape(shape).min(axis=(1, 3))
        goal = goal[0] // 2, goal[1] // 2
    rows, columns = costs.shape
    # A cell is opened again whenever a better way to it is found: at most by every neighbour.
    keys = np.empty(8 * rows * columns + 1, np.float32)
    cells = np.empty(8 * rows * columns + 1, np.int64)
    values = np.zeros(rows * columns, np.float32)
    cell = goal[1] * columns + goal[0]
    values[cell] = OPEN_GOAL
    keys[0], cells[0] = math.hypot(goal[0] - start[0], goal[1] - start[1]), cell
    size = np.ones(1, np.int64)
    return Reached(
        costs.astype(np.float32),
        values,
        keys,
        cells,
        size,
        is_coarse,
        F32(cost_penalty),
        is_quadratic,
        release,
    )


@njit(cache=True)
def _straight(cell, columns, to_column, to_row):
    """Returns the distance from a cell to another, in cells, float32."""
    dx, dy = cell % columns - to_column, cell // columns - to_row
    return F32(math.sqrt(dx * dx + dy * dy))


@njit(cache=True)
def way_round(reached, column, row):
    """Returns the cost of a point's way from a cell to the goal; 0 where there is no way.

    The search back from the goal goes on until this cell is closed. With a consistent heuristic the
    value of a closed cell is final, so the results of earlier calls stay valid.
    """
    columns = reached.costs.shape[1]
    if reached.is_coarse:
        column, row = column // 2, row // 2
    asked = row * columns + column
    factor = TWO if reached.is_coarse else ONE
    if reached.values[asked] > 0.0:
        return F32(factor * reached.values[asked])
    values, keys, cells = reached.values, reached.keys, reached.cells
    size = reached.size[0]
    for k in range(size):
        keys[k] = F32(-values[cells[k]] + _straight(cells[k], columns, column, row))
    heap_make(keys, cells, size)
    while size > 0:
        cell = heap_pop(keys, cells, size)
        size -= 1
        if values[cell] > 0.0:
            continue
        value = -values[cell]
        values[cell] = value
        size = _open_neighbours(reached, cell, value, column, row, size)
        if cell == asked:
            break
    reached.size[0] = size
    return F32(factor * values[asked])


@njit(cache=True)
def _are_ends(one, other, count):
    """Tells whether two of `count` columns (or rows) are the first and the last one."""
    return min(one, other) == 0 and max(one, other) >= count - 1


@njit(cache=True)
def _step_cost(reached, cost, length):
    """Returns the cost of a step of a length in cells into a cell of a cost."""
    if reached.release < IRON:
        share = np.float64(reached.cost_penalty) * np.float64(cost) / np.float64(MAX_COST)
        return F32(np.float64(length) * (1.0 + share))
    if reached.is_quadratic:
        part = F32(F32(F32(reached.cost_penalty * cost) * cost) / MAX_COST_SQUARED)
    else:
        part = F32(F32(reached.cost_penalty * cost) / MAX_COST)
    return F32(length * F32(ONE + part))


@njit(cache=True)
def _open_neighbours(reached, cell, value, to_column, to_row, size):
    """Opens the neighbours that a closed cell makes cheaper; returns the size of the heap."""
    rows, columns = reached.costs.shape
    costs = reached.costs.ravel()
    steps = (1, -1, columns, -columns, columns + 1, columns - 1, -columns + 1, -columns - 1)
    for i in range(8):
        other = cell + steps[i]
        if not 0 <= other < rows * columns:
            continue
        cost = costs[other]
        other_row, other_column = other // columns, other % columns
        is_inside = BORDER < other_column < columns - BORDER and BORDER < other_row < rows - BORDER
        if reached.release < JAZZY:
            row, column = cell // columns, cell % columns
            is_inside = not _are_ends(column, other_column, columns)
            is_inside = is_inside and not _are_ends(row, other_row, rows)
        if cost >= INSCRIBED or not is_inside or reached.values[other] > 0.0:
            continue
        new = F32(value + _step_cost(reached, cost, ONE if i <= 3 else SQRT_2))
        known = reached.values[other]
        if known == 0.0 or -known > new:
            reached.values[other] = -new
            key = F32(new + _straight(other, columns, to_column, to_row))
            heap_push(reached.keys, reached.cells, size, key, other)
            size += 1
    return size


class FreeWays(NamedTuple):
    """Lengths of a car's shortest way to the origin, from cells around it, without obstacles.

    lengths: (width, (width + 1) // 2, bins) float32, for cells with y >= 0: the others mirror them;
    0 where it was not asked for yet. width: odd, cells.
    """

    lengths: NDArray[np.float32]
    width: int


def free_ways(width: int, bins: int) -> FreeWays:
    """Returns a table without any length."""
    return FreeWays(np.zeros((width, (width + 1) // 2, bins), np.float32), width)


@njit(cache=True)
def _rounded(value):
    """Rounds a float32 to a whole number, halves away from 0."""
    whole = math.floor(abs(value) + 0.5)
    return int(-whole) if value < 0.0 else int(whole)


@njit(cache=True)
def free_way(ways, motions, column, row, heading, goal, way_round_cost):
    """Returns the length of a car's way from a cell and a bin to the goal (3,) float32.

    Beyond the table the length is 0, except if the way round obstacles is unknown: then it is
    computed with headings of (bin times number of bins) in place of angles, as in Nav2.
    """
    cosine = F32(motions.cosines[int(goal[2])])
    sine = F32(-motions.sines[int(goal[2])])
    dx, dy = F32(F32(column) - goal[0]), F32(F32(row) - goal[1])
    turn = float(F32(F32(heading) - goal[2]))
    if turn < 0.0:
        turn += motions.bins
    if turn > motions.bins:
        turn -= motions.bins
    x = _rounded(F32(F32(dx * cosine) - F32(dy * sine)))
    y = _rounded(F32(F32(dx * sine) + F32(dy * cosine)))
    bin_count = _rounded(turn)
    half = ways.width // 2
    if abs(x) < half and abs(y) < half:
        if y < 0:
            # A whole turn lands in the next row of the table, as in Nav2.
            bin_count = motions.bins - bin_count
        flat = ((x + half) * ways.lengths.shape[1] + abs(y)) * motions.bins + bin_count
        return _tabulated(ways, motions, flat)
    if way_round_cost > 0.0:
        return F32(0.0)
    turn_there = np.float64(F32(goal[2] * F32(motions.bins)))
    start = float(column), float(row), float(heading * motions.bins)
    end = np.float64(goal[0]), np.float64(goal[1]), turn_there
    return _length(motions, start, end)


@njit(cache=True)
def _tabulated(ways, motions, flat):
    lengths = ways.lengths.ravel()
    if lengths[flat] == 0.0:
        depth = ways.lengths.shape[1]
        x = flat // motions.bins // depth - ways.width // 2
        y = flat // motions.bins % depth
        angle = np.float64(F32(F32(flat % motions.bins) * F32(2.0 * math.pi / motions.bins)))
        start, origin = (float(x), float(y), angle), (0.0, 0.0, 0.0)
        lengths[flat] = _length(motions, start, origin)
    return lengths[flat]


@njit(cache=True)
def _length(motions, start, end):
    kinds, lengths = np.empty(PIECES, np.int64), np.empty(PIECES)
    radius = np.float64(motions.radius)
    return F32(shortest_curve(start, end, radius, motions.reverses, kinds, lengths))
