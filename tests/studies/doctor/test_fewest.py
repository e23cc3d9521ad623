"""The fewest of several changes that suffice together."""

from __future__ import annotations

import math

import pytest

from drake_navbench.studies.doctor.fewest import fewest, without_harmful


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


def test_what_does_harm_is_dropped_first_then_each_other_one_is_left_out_then_half():
    # b does harm, d helps alone, of the others nothing is known.
    tried = ["".join(some) for some in without_harmful("abcd", [0.0, -0.5, 0.0, 0.4], most=2)]
    assert tried == ["abcd", "acd", "cd", "ad", "a"]


def test_several_harmful_parts_are_dropped_the_worst_first():
    effects = [-0.2, 0.0, -1.0, 0.0]
    tried = ["".join(some) for some in without_harmful("abcd", effects, most=1)]
    assert tried == ["abcd", "abd", "bd", "d", "b"]


def test_a_harmful_part_before_all_others_hides_no_cure():
    """Bisection alone would keep part 0, with which nothing suffices."""

    def suffices(parts):
        return {3, 11} <= {*parts} and 0 not in parts

    found = next(
        filter(None, (fewest(s, suffices) for s in without_harmful(range(16), [0.0] * 16, 8)))
    )
    assert found == [3, 11]
