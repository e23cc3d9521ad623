"""A binary heap of cells by float32 keys, smallest first, laid out as by the C++ standard library.

An entry is one int64: the bits of the key above, the cell's index below. Keys are never negative,
so that their bits sort like their values. Entries are compared by their keys alone: among equal
ones the right child rises before the left one, and a new entry never passes an equal parent (GNU's
heap functions, so the priority queue of Nav2's planners).

The top is at place 1 and the children of k at 2 k and 2 k + 1. Which of two entries is smaller no
processor can guess, so entries are chosen without a branch. For that the one at place 0 is smaller
than every other, those beyond the heap are larger, and the array's size is a power of two.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

KEY_SHIFT = 32
CELL_MASK = (1 << KEY_SHIFT) - 1
SMALLEST, LARGEST = np.int64(-(2**63)), np.int64(2**63 - 1)
INITIAL_CAPACITY = 8192

# Places in the heap are unsigned: of a signed index numba asks at every access whether it counts
# from the end. A plain number beside an unsigned one would make both floating.
ZERO, ONE, TWO, THREE = (np.uint64(number) for number in range(4))
TOP = ONE
# A kernel that makes and returns no array need not count the references to those that it gets. The
# option is numba's own; its types do not name it.
UNCOUNTED: Any = {"cache": True, "_nrt": False}


@njit(cache=True)
def new_heap():
    """Returns an array for a heap of no entries."""
    heap = np.full(INITIAL_CAPACITY, LARGEST)
    heap[ZERO] = SMALLEST
    return heap


@njit(cache=True)
def larger_heap(heap):
    """Returns a copy of a heap with twice the room."""
    larger = np.full(2 * heap.size, LARGEST)
    for k in range(heap.size):
        larger[k] = heap[k]
    return larger


@njit(**UNCOUNTED)
def cell_of(entry):
    """Returns the cell of an entry, unsigned."""
    return np.uint64(entry & CELL_MASK)


@njit(forceinline=True, **UNCOUNTED)
def push_cell(heap, size, key, cell):
    """Adds a cell to a heap of `size` entries, which has room for it."""
    entry = (np.int64(np.float32(key).view(np.int32)) << KEY_SHIFT) | np.int64(cell)
    _rise(heap, size + ONE, entry)


@njit(forceinline=True, **UNCOUNTED)
def remove_top(heap, size, depth):
    """Removes the top of a heap of `size` entries. depth: `depth_of` them.

    The hole sinks to the bottom, perhaps beyond the last entry, which rises from there.
    """
    entry = heap[size]
    heap[size] = LARGEST
    hole = _sunk(heap, depth)
    # How far it rises no processor can guess, so two levels are looked at without a branch.
    for _ in range(2):
        parent = hole >> ONE
        above = heap[parent]
        rises = _is_larger(above, entry)
        heap[hole] = _chosen(rises, above, entry)
        hole = np.uint64(_chosen(rises, np.int64(parent), np.int64(hole)))
    _rise(heap, hole, entry)


@njit(forceinline=True, **UNCOUNTED)
def depth_of(size, depth):
    """Returns the levels below the top of a heap. depth: those of about the same size."""
    while size >> np.uint64(depth + 1):
        depth += 1
    while depth > 0 and not size >> np.uint64(depth):
        depth -= 1
    return depth


@njit(forceinline=True, **UNCOUNTED)
def _rise(heap, hole, entry):
    """Puts an entry into the heap at `hole` or above, below the first parent that is not larger."""
    while heap[hole >> ONE] > (entry | CELL_MASK):
        heap[hole] = heap[hole >> ONE]
        hole >>= ONE
    heap[hole] = entry


@njit(forceinline=True, **UNCOUNTED)
def _sunk(heap, depth):
    """Moves the hole at the top down by `depth` levels, along the smaller children.

    Two levels at once: the children of both children are compared before it is known whose count.
    Returns its place.
    """
    hole = TOP
    for _ in range(depth >> 1):
        beside, below = hole << ONE, hole << TWO
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
    if depth & 1:
        child = (hole << ONE) + ONE
        child -= np.uint64(_is_larger(heap[child], heap[child - ONE]))
        heap[hole] = heap[child]
        hole = child
    return hole


@njit(forceinline=True, **UNCOUNTED)
def _is_larger(entry, other):
    """Returns 1 where the key of an entry is larger than that of another, else 0."""
    return np.int64(entry > (other | CELL_MASK))


@njit(forceinline=True, **UNCOUNTED)
def _chosen(is_first, first, second):
    """Returns the first of two whole numbers for 1, the second for 0, without a branch."""
    return second ^ ((first ^ second) & -is_first)
