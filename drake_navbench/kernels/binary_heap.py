"""A binary heap of float32 keys with int64 values, smallest key first, in plain arrays.

Ties are broken as the C++ standard library's heap functions (GNU) break them with a comparison of
keys alone: a hole sinks along the smaller child, the right one on ties, and the entry rises from
the bottom past parents that are larger. Nav2's planners depend on it.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def heap_push(keys, values, size, key, value):
    """Adds an entry to a heap of `size` entries; the arrays must have room for it."""
    _rise(keys, values, size, 0, key, value)


@njit(cache=True)
def heap_pop(keys, values, size):
    """Removes the smallest of `size` entries and returns its value; the rest is a heap."""
    top = values[0]
    last = size - 1
    if last > 0:
        _sink(keys, values, 0, last, keys[last], values[last])
    return top


@njit(cache=True)
def heap_make(keys, values, size):
    """Makes a heap of the first `size` entries."""
    for parent in range(size // 2 - 1, -1, -1):
        _sink(keys, values, parent, size, keys[parent], values[parent])


@njit(cache=True)
def _sink(keys, values, top, size, key, value):
    """Replaces the entry at `top` of a heap that is in order below it, and sinks the new one."""
    hole = child = top
    while child < (size - 1) // 2:
        child = 2 * (child + 1)
        # Which child is smaller no processor can guess: chosen without a branch.
        child -= np.int64(keys[child] > keys[child - 1])
        keys[hole], values[hole] = keys[child], values[child]
        hole = child
    if size % 2 == 0 and child == (size - 2) // 2:
        child = 2 * child + 1
        keys[hole], values[hole] = keys[child], values[child]
        hole = child
    _rise(keys, values, hole, top, key, value)


@njit(cache=True)
def _rise(keys, values, hole, top, key, value):
    """Puts an entry in at `hole` or above, not above `top`, below a parent that is not larger."""
    while hole > top:
        parent = (hole - 1) >> 1
        if not keys[parent] > key:
            break
        keys[hole], values[hole] = keys[parent], values[parent]
        hole = parent
    keys[hole], values[hole] = key, value
