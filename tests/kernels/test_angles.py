"""Angles wrap into (-pi, pi]."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.angles import wrap


@pytest.mark.parametrize(
    ("turns", "expected"),
    [(0.0, 0.0), (0.75, -0.25), (-0.75, 0.25), (1.0, 0.0), (2.25, 0.25), (-3.4, -0.4)],
)
def test_whole_turns_are_dropped(turns, expected):
    assert wrap(2 * math.pi * turns) == pytest.approx(2 * math.pi * expected, abs=1e-12)


@pytest.mark.parametrize("half_turns", [1, -1, 3, -3])
def test_half_a_turn_is_positive(half_turns):
    assert wrap(half_turns * math.pi) == math.pi


@given(st.floats(-math.pi, math.pi, exclude_min=True))
def test_angle_inside_is_returned_bit_for_bit(angle):
    assert wrap(angle) == angle


@settings(deadline=None)
@given(st.floats(-1e6, 1e6))
@example(math.nextafter(math.pi, 4.0))
@example(math.nextafter(-math.pi, -4.0))
def test_wrapped_angle_lies_in_range_and_points_the_same_way(angle):
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)
