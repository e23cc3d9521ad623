"""The states of Hybrid-A*: one pose, cell by cell and bin by bin, and whether a robot fits there.

A state is a cell and a heading bin; the first pose that comes to lie in it says whether it is free,
and the cheapest way there which pose it keeps. Positions are in cells, headings in bins, float32.
Source: nav2_smac_planner (NodeHybrid, GridCollisionChecker).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Grid

F32 = np.float32
HALF = F32(0.5)
UNREACHED = F32(np.finfo(np.float32).max)
NO_STATE, NO_MOTION, NO_INDEX = -1, -1, -1
INITIAL_CAPACITY = 4096


class Body(NamedTuple):
    """How a robot's collisions are told.

    grid: of uint8 costs. outlines: (B, K, 2) m, the footprint by heading bin; K = 0: the centre's
    inflated cost tells. possible_cost: of a centre from which the outline may touch something; less
    is free, 0 or less tells nothing. allow_unknown: whether unknown cells are free.
    """

    grid: Grid
    outlines: NDArray[np.float64]
    possible_cost: float
    allow_unknown: bool


class Graph(NamedTuple):
    """The states met so far, in the order in which they were met; arrays have room for more.

    slots: (columns * rows * bins,) int32 number of a state, from 1 on; 0: not met. counts: (1,) how
    many were. x, y, heading: poses. cost: of the cell under the centre, NaN before it is looked at.
    is_free. way: cost from the start. parent: state, NO_STATE for none. motion: by which it was
    come to, NO_MOTION for none. is_visited. place: in `slots`; NO_INDEX for one that has none.
    """

    slots: NDArray[np.int32]
    counts: NDArray[np.int64]
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    heading: NDArray[np.float32]
    cost: NDArray[np.float32]
    is_free: NDArray[np.bool_]
    way: NDArray[np.float32]
    parent: NDArray[np.int64]
    motion: NDArray[np.int64]
    is_visited: NDArray[np.bool_]
    place: NDArray[np.int64]


@njit(cache=True)
def new_graph(slots):
    """Returns a graph without states. slots: (columns * rows * bins,) int32, all 0."""
    n = INITIAL_CAPACITY
    return Graph(
        slots,
        np.zeros(1, np.int64),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, np.bool_),
        np.zeros(n, np.float32),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.bool_),
        np.zeros(n, np.int64),
    )


@njit(cache=True)
def with_room(graph, more):
    """Returns the graph with room for some states more."""
    capacity, count = graph.x.size, graph.counts[0]
    if count + more <= capacity:
        return graph
    n = max(2 * capacity, count + more)
    return Graph(
        graph.slots,
        graph.counts,
        _longer(graph.x, n),
        _longer(graph.y, n),
        _longer(graph.heading, n),
        _longer(graph.cost, n),
        _longer(graph.is_free, n),
        _longer(graph.way, n),
        _longer(graph.parent, n),
        _longer(graph.motion, n),
        _longer(graph.is_visited, n),
        _longer(graph.place, n),
    )


@njit(cache=True)
def _longer(array, size):
    longer = np.zeros(size, array.dtype)
    longer[: array.size] = array
    return longer


@njit(cache=True)
def new_state(graph, index):
    """Adds a state at the end and returns it; there must be room."""
    state = graph.counts[0]
    graph.counts[0] = state + 1
    graph.x[state] = graph.y[state] = graph.heading[state] = F32(0.0)
    graph.cost[state] = F32(np.nan)
    graph.is_free[state] = graph.is_visited[state] = False
    graph.way[state] = UNREACHED
    graph.parent[state], graph.motion[state] = NO_STATE, NO_MOTION
    graph.place[state] = index
    return state


@njit(cache=True)
def index_of(x, y, heading, columns, bins):
    """Returns where a pose belongs in `slots`; -1 where a coordinate is -1 or less.

    A column beyond the last one belongs to the next row, as in Nav2; the check of the pose refuses
    it.
    """
    column, row = int(x), int(y)
    if column < 0 or row < 0:
        return NO_INDEX
    return int(heading) + column * bins + row * columns * bins


@njit(cache=True)
def state_at(graph, index):
    """Returns the state of an index, met now or before; NO_STATE off the map."""
    if not 0 <= index < graph.slots.size:
        return NO_STATE
    if graph.slots[index] == 0:
        graph.slots[index] = new_state(graph, index) + 1
    return graph.slots[index] - 1


@njit(cache=True)
def set_pose(graph, state, x, y, heading):
    """Gives a state another pose."""
    graph.x[state], graph.y[state], graph.heading[state] = x, y, heading


@njit(cache=True)
def is_free(graph, body, state):
    """Tells whether a state is free; only its first pose is ever looked at."""
    if np.isnan(graph.cost[state]):
        x, y = graph.x[state], graph.y[state]
        cost, free = look_at(body, x, y, graph.heading[state])
        graph.cost[state], graph.is_free[state] = cost, free
    return graph.is_free[state]


@njit(cache=True)
def look_at(body, x, y, heading):
    """Returns the cost under the centre of a pose, and whether the robot is free there."""
    grid = body.grid
    rows, columns = grid.costs.shape
    if x < 0.0 or x > columns or y < 0.0 or y > rows:
        return F32(LETHAL), False
    # Nav2 reads on into the next row at the right border, and beyond the map at the upper one.
    flat = int(F32(y + HALF)) * columns + int(F32(x + HALF))
    centre = int(grid.costs.ravel()[flat]) if flat < grid.costs.size else LETHAL
    if body.outlines.shape[1] == 0:
        if centre == NO_INFORMATION and body.allow_unknown:
            return F32(centre), True
        return F32(centre), centre < INSCRIBED
    if centre < body.possible_cost and body.possible_cost > 0.0:
        return F32(centre), True
    if centre == NO_INFORMATION and not body.allow_unknown:
        return F32(centre), False
    if centre in (INSCRIBED, LETHAL):
        return F32(centre), False
    world_x = grid.origin_x + (int(x) + 0.5) * grid.resolution
    world_y = grid.origin_y + (int(y) + 0.5) * grid.resolution
    # A heading just below a full turn is rounded up to it; Nav2 then reads beyond its outlines.
    outline = body.outlines[int(heading) % body.outlines.shape[0]]
    worst = footprint_cost(grid, outline, world_x, world_y, 0.0, True)
    if worst == NO_INFORMATION and body.allow_unknown:
        return F32(centre), True
    return F32(centre), worst < LETHAL
