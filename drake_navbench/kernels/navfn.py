"""NavFn's navigation function: a potential that spreads from a seed, and the path down its slope.

The potential of a cell is the cost of the way to it from the seed. It spreads over the four
neighbours as a planar wave, in float32. Cells wait in three buffers: those of this cycle, those of
the next one, and those beyond the threshold of this cycle, which rises when the next one is empty.
A buffer holds BUFFER_SIZE cells; cells that do not fit are dropped for good, so that a wide front
on a large map loses cells, as in Nav2. The A* variant adds the straight distance to the target to
the potential before it looks at the threshold and at the neighbours.

Cells are named by row * columns + column. The outermost cells of the map are blocked.
Source: nav2_navfn_planner (NavFn), whose rounding is that of a compiler without fused operations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import INSCRIBED, NO_INFORMATION

NEUTRAL_COST = 50
COST_FACTOR = 0.8
BLOCKED_COST = 254
HIGHEST_COST = BLOCKED_COST - 1
UNREACHED = np.float32(1.0e10)
BUFFER_SIZE = 10_000
FIRST_THRESHOLD = np.float32(BLOCKED_COST)
THRESHOLD_STEP = np.float32(2 * NEUTRAL_COST)
INVERSE_SQRT_2 = 0.707106781
STEP_CELLS = np.float32(0.5)
ONE, ZERO = np.float32(1.0), np.float32(0.0)
# A cell's status is its cost and whether it waits in a buffer.
IS_WAITING = np.uint16(1 << 8)
COST_BITS = np.uint16(0xFF)
UINT_0, UINT_1 = np.uint64(0), np.uint64(1)

# A neighbour is visited again if its potential is higher by this, which is less than a step costs.
REACH_OF_COST = (INVERSE_SQRT_2 * np.arange(256)).astype(np.float32)


def traversal_costs(costs: NDArray[np.uint8], *, allow_unknown: bool) -> NDArray[np.uint8]:
    """Returns (rows, columns) uint8: NavFn's cost of each cell, from NEUTRAL_COST to BLOCKED_COST.

    costs: costs of a costmap. Unknown cells are blocked or get HIGHEST_COST. (NavFn::setCostmap)
    """
    table = np.full(256, BLOCKED_COST, dtype=np.uint8)
    table[:INSCRIBED] = NEUTRAL_COST + COST_FACTOR * np.arange(INSCRIBED)
    if allow_unknown:
        table[NO_INFORMATION] = HIGHEST_COST
    crossing = table[costs]
    crossing[[0, -1], :] = BLOCKED_COST
    crossing[:, [0, -1]] = BLOCKED_COST
    return crossing


@njit(cache=True, error_model="numpy")
def _potential_at(potential, cell):
    """Returns a cell's potential; that of cells beyond the map's memory counts as UNREACHED."""
    if 0 <= cell < potential.size:
        return potential[cell]
    return UNREACHED


@njit(cache=True, error_model="numpy")
def _planar_wave(left, right, up, down, cost):
    """Returns the potential of a cell of a cost from those of its neighbours, all float32.

    Both cases are computed: a choice without a branch takes three quarters of the time.
    """
    low_x, low_y = min(left, right), min(up, down)
    lowest, difference = min(low_x, low_y), abs(low_x - low_y)
    share = difference / cost
    factor = np.float32(-0.2301 * share * share + 0.5307 * share + 0.7040)
    return lowest + cost if difference >= cost else lowest + cost * factor


@njit(cache=True, error_model="numpy")
def _cost_of_distance(column_0, row_0, column_1, row_1):
    """Returns the least that the way from one cell to another may cost, float32."""
    distance = math.hypot(float(column_0 - column_1), float(row_0 - row_1))
    return np.float32(distance * NEUTRAL_COST)


@njit(cache=True, error_model="numpy")
def _offer(waiting, base, count, cell, potential, value, status):
    """Puts a neighbour into the buffer at `base` if `value` may lower its potential.

    It must be free, must not wait yet, and must fit. Returns the buffer's new count.
    """
    cost = status[cell]
    if cost < BLOCKED_COST and potential > value + REACH_OF_COST[cost] and count < BUFFER_SIZE:
        waiting[base + count] = cell
        status[cell] = cost | IS_WAITING
        return count + UINT_1
    return count


@njit(cache=True, error_model="numpy")
def spread_potential(costs, seed_column, seed_row, target_column, target_row, use_astar):
    """Returns the potential (rows, columns) float32 around a seed, UNREACHED elsewhere.

    costs: (rows, columns) uint8 from `traversal_costs`. The spreading ends when the target is
    reached, to which the A* variant measures distances; for a target off the map it goes on over
    all of the map. A column beyond the last one means the first cell of the next row; for the seed
    that cell must be on the map. (NavFn::setupNavFn, propNavFnDijkstra, propNavFnAstar)
    """
    columns = costs.shape[1]
    costs = costs.ravel()
    cell_count = costs.size
    seed = seed_row * columns + seed_column
    target = target_row * columns + target_column
    potential = np.full(cell_count, UNREACHED)
    status = costs.astype(np.uint16)
    waiting = np.empty(3 * BUFFER_SIZE, dtype=np.uint32)
    current, following, beyond = UINT_0, np.uint64(BUFFER_SIZE), np.uint64(2 * BUFFER_SIZE)
    current_count, following_count, beyond_count = UINT_0, UINT_0, UINT_0
    width = np.uint64(columns)
    threshold = FIRST_THRESHOLD
    if use_astar:
        threshold += _cost_of_distance(seed_column, seed_row, target_column, target_row)
    potential[seed] = ZERO
    for neighbour in (seed + 1, seed - 1, seed - columns, seed + columns):
        if 0 <= neighbour < cell_count:
            current_count = _offer(
                waiting, current, current_count, np.uint64(neighbour), UNREACHED, ZERO, status
            )
    for _ in range(max(cell_count // 20, columns + cell_count // columns)):
        if current_count == 0 and following_count == 0:
            break
        for k in range(current, current + current_count):
            status[waiting[k]] &= COST_BITS
        for k in range(current, current + current_count):
            cell = np.uint64(waiting[k])
            left, right = potential[cell - UINT_1], potential[cell + UINT_1]
            up, down = potential[cell - width], potential[cell + width]
            cost = np.float32(status[cell] & COST_BITS)
            value = _planar_wave(left, right, up, down, cost)
            if not value < potential[cell]:
                continue
            potential[cell] = value
            if use_astar:
                row = np.int64(cell) // columns
                column = np.int64(cell) - row * columns
                value += _cost_of_distance(column, row, target_column, target_row)
            is_near = value < threshold
            base = following if is_near else beyond
            count = following_count if is_near else beyond_count
            count = _offer(waiting, base, count, cell - UINT_1, left, value, status)
            count = _offer(waiting, base, count, cell + UINT_1, right, value, status)
            count = _offer(waiting, base, count, cell - width, up, value, status)
            count = _offer(waiting, base, count, cell + width, down, value, status)
            if is_near:
                following_count = count
            else:
                beyond_count = count
        current, following = following, current
        current_count, following_count = following_count, UINT_0
        if current_count == 0:
            threshold += THRESHOLD_STEP
            current, beyond = beyond, current
            current_count, beyond_count = beyond_count, UINT_0
        if _potential_at(potential, target) < UNREACHED:
            break
    return potential.reshape((-1, columns))


@njit(cache=True, error_model="numpy")
def _slope(potential, columns, cell):
    """Returns the unit vector (x, y) down the potential at a cell, float32, or zeros without slope.

    The cell is beside one whose eight neighbours were reached; its own neighbours may not have
    been. (NavFn::gradCell, which caches slopes; a new call gives the same ones)
    """
    here = potential[cell]
    left, right = potential[cell - 1], potential[cell + 1]
    up, down = potential[cell - columns], potential[cell + columns]
    x, y = ZERO, ZERO
    if left < UNREACHED:
        x += left - here
    if right < UNREACHED:
        x += here - right
    if up < UNREACHED:
        y += up - here
    if down < UNREACHED:
        y += here - down
    length = _length(x, y)
    if length > ZERO:
        scale = np.float32(1.0 / length)
        return scale * x, scale * y
    return ZERO, ZERO


@njit(cache=True, error_model="numpy")
def _length(x, y):
    """Returns the length of a float32 vector, rounded once (hypotf)."""
    return np.float32(math.sqrt(np.float64(x) * np.float64(x) + np.float64(y) * np.float64(y)))


@njit(cache=True, error_model="numpy")
def _between(first, second, share):
    """Returns the value at a share of the way between two, float32, rounded as in Nav2."""
    return np.float32((1.0 - share) * first + np.float64(share * second))


@njit(cache=True, error_model="numpy")
def _rounded(value):
    """Returns the nearest whole number, halves away from zero."""
    magnitude = abs(np.float64(value))
    whole = math.floor(magnitude)
    nearest = int(whole) + (1 if magnitude - whole >= 0.5 else 0)
    return nearest if value >= ZERO else -nearest


@njit(cache=True, error_model="numpy")
def _is_beside_unreached(potential, columns, cell):
    """Tells whether a cell or one of its eight neighbours was not reached."""
    for row_start in (cell - columns, cell, cell + columns):
        for neighbour in range(row_start - 1, row_start + 2):
            if _potential_at(potential, neighbour) >= UNREACHED:
                return True
    return False


@njit(cache=True, error_model="numpy")
def _lowest_neighbour(potential, columns, cell):
    """Returns the lowest of a cell and its eight neighbours, the first on ties.

    The lowest potential so far counts without its fraction, so that a neighbour that is less than
    one below it may be passed over: then the path stays where it is.
    """
    lowest, lowest_cell = int(potential[cell]), cell
    for row_start in (cell - columns, cell, cell + columns):
        for neighbour in range(row_start - 1, row_start + 2):
            value = _potential_at(potential, neighbour)
            if neighbour != cell and value < lowest:
                lowest, lowest_cell = int(value), neighbour
    return lowest_cell


@njit(cache=True, error_model="numpy")
def _step_down(potential, columns, cell, x, y):
    """Returns (cell, x, y, moved): half a cell down the interpolated slope from x, y off a cell."""
    here_x, here_y = _slope(potential, columns, cell)
    right_x, right_y = _slope(potential, columns, cell + 1)
    above_x, above_y = _slope(potential, columns, cell + columns)
    diagonal_x, diagonal_y = _slope(potential, columns, cell + columns + 1)
    along_x = _between(_between(here_x, right_x, x), _between(above_x, diagonal_x, x), y)
    along_y = _between(_between(here_y, right_y, x), _between(above_y, diagonal_y, x), y)
    if along_x == ZERO and along_y == ZERO:
        return cell, x, y, False
    scale = STEP_CELLS / _length(along_x, along_y)
    x += along_x * scale
    y += along_y * scale
    if x > ONE:
        cell += 1
        x -= ONE
    if x < -ONE:
        cell -= 1
        x += ONE
    if y > ONE:
        cell += columns
        y -= ONE
    if y < -ONE:
        cell -= columns
        y += ONE
    return cell, x, y, True


@njit(cache=True, error_model="numpy")
def path_down(potential, start_column, start_row, seed_column, seed_row, max_cycles):
    """Returns (N, 2) float32 the path from a cell to the seed, column and row; empty if it fails.

    potential: (rows, columns) float32 from `spread_potential`; the cell was reached. A step goes
    half a cell down the slope; where a cell nearby was not reached, or the path oscillates, it goes
    to the lowest neighbour. Each step takes one of `max_cycles`. The path ends with the seed once
    the nearest cell's potential is less than NEUTRAL_COST. (NavFn::calcPath)
    """
    path = np.empty((max_cycles, 2), dtype=np.float32)
    failed = path[:0]
    columns = potential.shape[1]
    potential = potential.ravel()
    cell_count = potential.size
    cell, x, y = start_row * columns + start_column, ZERO, ZERO
    for count in range(max_cycles):
        nearest = cell + _rounded(x) + columns * _rounded(y)
        if potential[max(0, min(cell_count - 1, nearest))] < NEUTRAL_COST:
            path[count, 0], path[count, 1] = seed_column, seed_row
            return path[: count + 1]
        if cell < columns or cell > cell_count - columns:
            return failed
        path[count, 0] = np.float32(cell % columns) + x
        path[count, 1] = np.float32(cell // columns) + y
        oscillates = (
            count >= 2
            and path[count, 0] == path[count - 2, 0]
            and path[count, 1] == path[count - 2, 1]
        )
        if oscillates or _is_beside_unreached(potential, columns, cell):
            cell, x, y = _lowest_neighbour(potential, columns, cell), ZERO, ZERO
        else:
            cell, x, y, moved = _step_down(potential, columns, cell, x, y)
            if not moved:
                return failed
    return failed


@njit(cache=True, error_model="numpy")
def nearest_cell(x, y, origin_x, origin_y, resolution, columns, rows):
    """Returns (column, row, is_on_map) of the cell whose lower left corner is nearest to x, y m.

    The last half cell of the map on either axis rounds to one column or row too many.
    (NavfnPlanner::worldToMap)
    """
    if x < origin_x or y < origin_y:
        return -1, -1, False
    column = _rounded((x - origin_x) / resolution)
    row = _rounded((y - origin_y) / resolution)
    return column, row, column < columns and row < rows


@njit(cache=True, error_model="numpy")
def reached_point_near(potential, origin_x, origin_y, resolution, goal_x, goal_y, tolerance):
    """Returns (x, y, found): the point to which the path goes, m.

    The goal, if its cell was reached; else the nearest point whose cell was, on a lattice of the
    map's resolution over the square of +- tolerance around the goal, the first on ties.
    (NavfnPlanner::makePlan)
    """
    rows, columns = potential.shape
    column, row, is_on_map = nearest_cell(
        goal_x, goal_y, origin_x, origin_y, resolution, columns, rows
    )
    if is_on_map and potential[row, column] < UNREACHED:
        return goal_x, goal_y, True
    best_x, best_y, best_squared = goal_x, goal_y, math.inf
    y = goal_y - tolerance
    while y <= goal_y + tolerance:
        x = goal_x - tolerance
        while x <= goal_x + tolerance:
            column, row, is_on_map = nearest_cell(
                x, y, origin_x, origin_y, resolution, columns, rows
            )
            if is_on_map and potential[row, column] < UNREACHED:
                squared = (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y)
                if squared < best_squared:
                    best_x, best_y, best_squared = x, y, squared
            x += resolution
        y += resolution
    return best_x, best_y, best_squared < math.inf
