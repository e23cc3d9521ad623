"""The fewest of several changes that suffice together."""

from __future__ import annotations

import math

import pytest

from drake_navbench.studies.doctor.fewest import fewest


@pytest.mark.parametrize(
    ("needed", "found"),
    [
        ({6}, [6]),
        ({3, 11}, [3, 11]),
        ({0, 1, 15}, [0, 1, 15]),
        # 16 is not among the parts.
        ({2, 16}, []),
    ],
)
def test_the_needed_parts_are_found_in_their_order_with_few_calls(needed, found):
    calls = []

    def suffices(parts):
        calls.append(parts)
        return needed <= {*parts}

    assert fewest(range(16), suffices) == found
    assert len(calls) <= 2 + len(needed) * (2 + math.log2(16))


def test_of_parts_that_do_the_same_the_earlier_one_is_found():
    # Either 2 or 5, and 9.
    assert fewest(range(12), lambda parts: 9 in parts and (2 in parts or 5 in parts)) == [2, 9]


def test_nothing_is_found_among_no_parts():
    assert fewest([], lambda parts: True) == []
