"""The states of Hybrid-A*: one pose, cell by cell and bin by bin, and whether a robot fits there.

A state is a cell and a heading bin. The first pose found in it decides whether it is free; it keeps
the pose of the cheapest way to it. Before Jazzy each pose decides anew. Positions are in cells,
headings in bins, float32.
Source: nav2_smac_planner (NodeHybrid, GridCollisionChecker).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.hybrid_releases import JAZZY

F32 = np.float32
HALF = F32(0.5)
UNREACHED = F32(np.finfo(np.float32).max)
NO_STATE, NO_MOTION, NO_INDEX = -1, -1, -1
INITIAL_CAPACITY = 4096


class Body(NamedTuple):
    """The robot's body, as collisions are checked.

    grid: grid of uint8 costs. outlines: (B, K, 2) m, the footprint by heading bin; K = 0: the
    centre's inflated cost decides. possible_cost: the least cost of the centre's cell at which the
    outline may touch something; a robot on a cheaper cell is free. 0 or less: no cost alone makes a
    pose free. allow_unknown: whether unknown cells are free. release: the release of Nav2 that
    checks: before Jazzy the centre's cell is that of the pose, and a state costs what the outline
    does where it is looked at.
    """

    grid: Grid
    outlines: NDArray[np.float64]
    possible_cost: float
    allow_unknown: bool
    release: int


# One record, so that a state is one place in memory, and one array is handed from kernel to kernel.
STATE = np.dtype(
    [
        ("x", np.float32),
        ("y", np.float32),
        ("heading", np.float32),
        ("cost", np.float32),
        ("way", np.float32),
        ("ahead", np.float32),
        ("parent", np.int32),
        ("place", np.int32),
        ("motion", np.int8),
        ("is_free", np.bool_),
        ("is_visited", np.bool_),
    ],
    align=True,
)


class Graph(NamedTuple):
    """The states met so far, in the order in which they were met; the array has room for more.

    slots: (columns * rows * bins,) int32 number of a state, from 1 on; 0: not met. counts: (1,)
    number of states. states: x, y, heading: the pose; cost: of the cell under the centre, NaN
    before it is read; is_free; way: cost from the start; ahead: the heuristic's cost to the goal,
    NaN before it is computed; parent: state, NO_STATE for none; motion: the one from the parent,
    NO_MOTION for none; is_visited; place: index in `slots`, NO_INDEX for none.
    """

    slots: NDArray[np.int32]
    counts: NDArray[np.int64]
    states: NDArray[np.void]


@njit(cache=True)
def new_graph(slots):
    """Returns a graph without states. slots: (columns * rows * bins,) int32, all 0."""
    return Graph(slots, np.zeros(1, np.int64), np.empty(INITIAL_CAPACITY, STATE))


@njit(cache=True)
def with_room(graph, more):
    """Returns the graph with room for some states more."""
    capacity, count = graph.states.size, graph.counts[0]
    if count + more <= capacity:
        return graph
    states = np.empty(max(2 * capacity, count + more), STATE)
    # One by one: a slice would have numba compile its strings, for an error message.
    for number in range(count):
        states[number] = graph.states[number]
    return Graph(graph.slots, graph.counts, states)


@njit(cache=True)
def new_state(graph, index):
    """Adds a state at the end and returns its number; there must be room."""
    number = graph.counts[0]
    graph.counts[0] = number + 1
    state = graph.states[number]
    state.x = state.y = state.heading = F32(0.0)
    state.cost = state.ahead = F32(np.nan)
    state.is_free = state.is_visited = False
    state.way = UNREACHED
    state.parent, state.motion = NO_STATE, NO_MOTION
    state.place = index
    return number


@njit(cache=True)
def index_of(x, y, heading, columns, bins):
    """Returns the index of a pose in `slots`; -1 where a coordinate is -1 or less.

    A column beyond the last one belongs to the next row, as in Nav2; the check of the pose refuses
    it.
    """
    column, row = int(x), int(y)
    if column < 0 or row < 0:
        return NO_INDEX
    return int(heading) + column * bins + row * columns * bins


@njit(cache=True)
def state_at(graph, index):
    """Returns the state of an index, a new one if it was not met before; NO_STATE off the map."""
    if not 0 <= index < graph.slots.size:
        return NO_STATE
    if graph.slots[index] == 0:
        graph.slots[index] = new_state(graph, index) + 1
    return graph.slots[index] - 1


@njit(cache=True)
def set_pose(graph, number, x, y, heading):
    """Gives a state another pose."""
    state = graph.states[number]
    state.x, state.y, state.heading = x, y, heading


@njit(cache=True)
def parent_of(graph, number):
    """Returns the state from which the search reached a state; NO_STATE for none."""
    return np.int64(graph.states[number].parent)


@njit(cache=True)
def is_free(graph, body, number):
    """Tells whether a state is free; since Jazzy only its first pose is ever checked."""
    state = graph.states[number]
    if np.isnan(state.cost) or body.release < JAZZY:
        check(body, state)
    return state.is_free


@njit(cache=True)
def check(body, state):
    """Writes whether a state is free where it is, and its cost; before Jazzy only a free one's."""
    cost, state.is_free = look_at(body, state.x, state.y, state.heading)
    if state.is_free or body.release >= JAZZY:
        state.cost = cost


@njit(cache=True)
def look_at(body, x, y, heading):
    """Returns the cost of a pose, and whether the robot is free there.

    The cost is that under the centre, before Jazzy that of the outline where it is looked at.
    """
    rows, columns = body.grid.costs.shape
    if x < 0.0 or x > columns or y < 0.0 or y > rows:
        return F32(LETHAL), False
    shift = HALF if body.release >= JAZZY else F32(0.0)
    column, row = int(F32(x + shift)), int(F32(y + shift))
    # Nav2 reads on into the next row at the right border, and beyond the map at the upper one.
    if column == columns:
        column, row = 0, row + 1
    centre = int(body.grid.costs[row, column]) if row < rows else LETHAL
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
    worst = _outline_cost(body, int(x), int(y), int(heading))
    fits = worst < LETHAL or (worst == NO_INFORMATION and body.allow_unknown)
    return F32(centre if body.release >= JAZZY else worst), fits


@njit(cache=True)
def _outline_cost(body, column, row, heading):
    """Returns the largest cost under the outline about a cell's centre."""
    x = body.grid.origin_x + (column + 0.5) * body.grid.resolution
    y = body.grid.origin_y + (row + 0.5) * body.grid.resolution
    # A heading just below a full turn is rounded up to it; Nav2 then reads beyond its outlines.
    outline = body.outlines[heading % body.outlines.shape[0]]
    return footprint_cost(body.grid, outline, x, y, 0.0, True)
