"""The open states of Hybrid-A*: a heap of poses with which states were queued, the cheapest on top.

A state is queued again whenever a cheaper way to it is found.
Source: nav2_smac_planner (AStarAlgorithm, NodeBasic).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.binary_heap import heap_pop, heap_push
from drake_navbench.kernels.hybrid_graph import set_pose

F32 = np.float32
INITIAL_QUEUE = 1 << 14


# A state as it was when it was queued.
ENTRY = np.dtype(
    [
        ("state", np.int32),
        ("x", np.float32),
        ("y", np.float32),
        ("heading", np.float32),
        ("motion", np.int8),
    ],
    align=True,
)


class Queue(NamedTuple):
    """The open states; arrays are longer than they need to be.

    keys, order: a heap of the entries' costs and indices. entries: all entries, in the order in
    which they were added. counts: (2,) number of entries in the heap, and of all entries.
    """

    keys: NDArray[np.float32]
    order: NDArray[np.int64]
    counts: NDArray[np.int64]
    entries: NDArray[np.void]


@njit(cache=True)
def new_queue(room):
    """Returns an empty queue with room for some entries."""
    return Queue(
        np.empty(room, np.float32),
        np.empty(room, np.int64),
        np.zeros(2, np.int64),
        np.empty(room, ENTRY),
    )


@njit(cache=True)
def with_queue_room(queue, more):
    """Returns the queue with room for some entries more."""
    count = queue.counts[1]
    if count + more <= queue.entries.size:
        return queue
    longer = new_queue(2 * queue.entries.size + more)
    longer.counts[0], longer.counts[1] = queue.counts[0], queue.counts[1]
    # One by one: slices would have numba compile its strings, for an error message.
    for i in range(count):
        longer.keys[i], longer.order[i] = queue.keys[i], queue.order[i]
        longer.entries[i] = queue.entries[i]
    return longer


@njit(cache=True)
def enqueue(queue, graph, number, key):
    """Adds a state as it is, with a key; there must be room."""
    entry, state = queue.counts[1], graph.states[number]
    queue.counts[1] = entry + 1
    queued = queue.entries[entry]
    queued.state, queued.motion = number, state.motion
    queued.x, queued.y, queued.heading = state.x, state.y, state.heading
    heap_push(queue.keys, queue.order, queue.counts[0], F32(key), entry)
    queue.counts[0] += 1


@njit(cache=True)
def dequeue(queue, graph):
    """Returns the state with the least key, in the pose it was queued with, unless visited."""
    queued = queue.entries[heap_pop(queue.keys, queue.order, queue.counts[0])]
    queue.counts[0] -= 1
    number = np.int64(queued.state)
    if not graph.states[number].is_visited:
        set_pose(graph, number, queued.x, queued.y, queued.heading)
        graph.states[number].motion = queued.motion
    return number


@njit(cache=True)
def queue_from(graph, first):
    """Returns a queue that has only the first state, which costs nothing."""
    queue = new_queue(INITIAL_QUEUE)
    graph.states[first].way = F32(0.0)
    enqueue(queue, graph, first, F32(0.0))
    return queue
