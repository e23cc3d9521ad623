"""A heap of pairs gives them back in order."""

from __future__ import annotations

import heapq

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.pair_heap import pop_pair, push_pair

# Few keys, so that many are equal; None takes one out.
PAIRS = st.tuples(st.sampled_from([0.0, 0.5, 1.0, 7.25]), st.integers(0, 9))


@given(st.lists(st.one_of(st.none(), PAIRS), max_size=60))
def test_pairs_come_out_as_of_heapq_with_tuples(actions):
    keys, values, size = np.empty(2), np.empty(2, dtype=np.int64), 0
    expected: list[tuple[float, int]] = []
    for pair in actions:
        if pair is not None:
            keys, values = push_pair(keys, values, size, *pair)
            heapq.heappush(expected, pair)
            size += 1
        elif size > 0:
            assert pop_pair(keys, values, size) == heapq.heappop(expected)[1]
            size -= 1
    while size > 0:
        assert pop_pair(keys, values, size) == heapq.heappop(expected)[1]
        size -= 1
