"""A heap of cells lies in memory as the C++ standard library's would, ties included."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.cell_heap import (
    cell_of,
    depth_of,
    larger_heap,
    new_heap,
    push_cell,
    remove_top,
)

# Few keys, so that many are equal; None takes the top out.
ACTIONS = st.lists(st.one_of(st.none(), st.sampled_from([0.0, 0.5, 1.0, 7.25])), max_size=90)


def raised(entries, hole, entry):
    """std::__push_heap of GNU with `greater` of keys."""
    while hole > 0 and entries[(hole - 1) // 2][0] > entry[0]:
        entries[hole] = entries[(hole - 1) // 2]
        hole = (hole - 1) // 2
    entries[hole] = entry


def without_top(entries):
    """std::pop_heap of GNU (std::__adjust_heap): the hole sinks to the bottom, the last rises."""
    last = entries.pop()
    hole, child, size = 0, 0, len(entries)
    if size == 0:
        return
    while child < (size - 1) // 2:
        child = 2 * (child + 1)
        if entries[child][0] > entries[child - 1][0]:
            child -= 1
        entries[hole], hole = entries[child], child
    if size % 2 == 0 and child == (size - 2) // 2:
        child = 2 * (child + 1)
        entries[hole], hole = entries[child - 1], child - 1
    raised(entries, hole, last)


@given(ACTIONS)
def test_entries_lie_as_in_a_heap_of_the_standard_library(actions):
    heap, size, depth = new_heap(), np.uint64(0), 0
    expected: list[tuple[float, int]] = []
    for cell, key in enumerate(actions):
        if key is not None:
            push_cell(heap, size, key, cell)
            size += np.uint64(1)
            expected.append((key, cell))
            raised(expected, len(expected) - 1, (key, cell))
        elif expected:
            depth = depth_of(size, depth)
            remove_top(heap, size, depth)
            size -= np.uint64(1)
            without_top(expected)
        cells = [int(cell_of(entry)) for entry in heap[1 : 1 + int(size)]]
        assert cells == [cell for _, cell in expected]


@pytest.mark.parametrize(("size", "depth"), [(1, 0), (2, 1), (3, 1), (4, 2), (7, 2), (8, 3)])
def test_the_depth_of_a_heap_counts_the_levels_below_its_top(size, depth):
    assert depth_of(np.uint64(size), 3) == depth


def test_a_larger_heap_holds_the_same_entries_and_nothing_behind_them():
    heap = new_heap()
    push_cell(heap, np.uint64(0), 2.5, 7)
    larger = larger_heap(heap)
    assert larger.size == 2 * heap.size
    assert np.array_equal(larger[: heap.size], heap)
    assert set(larger[heap.size :]) == {heap[-1]}
