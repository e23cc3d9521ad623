"""A binary heap of pairs, a float64 key and an int64 value, in plain arrays.

The smallest pair comes first, of equal keys the one with the smaller value, as with `heapq` and
tuples; those take numba seconds to compile.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numba.extending import register_jitable


@njit(cache=True)
def push_pair(keys, values, size, key, value):
    """Adds a pair to a heap of `size`; returns the arrays, larger ones where they were full."""
    if size == keys.size:
        more_keys, more_values = np.empty(2 * size, np.float64), np.empty(2 * size, np.int64)
        for i in range(size):
            more_keys[i], more_values[i] = keys[i], values[i]
        keys, values = more_keys, more_values
    hole = size
    while hole > 0:
        parent = (hole - 1) // 2
        if not _is_before(key, value, keys[parent], values[parent]):
            break
        keys[hole], values[hole] = keys[parent], values[parent]
        hole = parent
    keys[hole], values[hole] = key, value
    return keys, values


@njit(cache=True)
def pop_pair(keys, values, size):
    """Removes the smallest of `size` pairs and returns its value."""
    top = values[0]
    last = size - 1
    key, value = keys[last], values[last]
    hole, child = 0, 1
    while child < last:
        if child + 1 < last and _is_before(
            keys[child + 1], values[child + 1], keys[child], values[child]
        ):
            child += 1
        if not _is_before(keys[child], values[child], key, value):
            break
        keys[hole], values[hole] = keys[child], values[child]
        hole, child = child, 2 * child + 1
    keys[hole], values[hole] = key, value
    return top


@register_jitable
def _is_before(key, value, other_key, other_value):
    return key < other_key or (key == other_key and value < other_value)
