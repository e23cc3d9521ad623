"""The shortest curves of a car, by hand-computed lengths and by what must hold for all of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.car_curves import (
    curve_knots,
    direction_changes,
    pose_on_curve,
    shortest_curve,
)
from drake_navbench.kernels.curve_pieces import LEFT, NONE, PIECES, RIGHT, STRAIGHT


def pose(numbers):
    """Returns x, y, yaw as the kernels take them."""
    return tuple(map(float, numbers))


def curve(start, end, *, radius=1.0, reverses=False):
    """Returns length, kinds and lengths of the pieces."""
    kinds, lengths = np.empty(PIECES, np.int64), np.empty(PIECES)
    length = shortest_curve(pose(start), pose(end), radius, reverses, kinds, lengths)
    return length, kinds, lengths


def pose_at(start, end, share, *, radius=1.0, reverses=False):
    _, kinds, lengths = curve(start, end, radius=radius, reverses=reverses)
    found = np.empty(3)
    knots = curve_knots(float(start[2]), kinds, lengths)
    pose_on_curve(pose(start), pose(end), radius, kinds, lengths, knots, share, found)
    return found


@pytest.mark.parametrize("reverses", [False, True])
def test_straight_ahead_is_a_line(reverses):
    length, kinds, _ = curve((1.0, 2.0, 0.5 * np.pi), (1.0, 5.0, 0.5 * np.pi), reverses=reverses)
    assert length == pytest.approx(3.0)
    assert STRAIGHT in kinds


def test_a_half_circle_is_as_long_as_its_arc():
    length, kinds, lengths = curve((0.0, 0.0, 0.0), (0.0, 4.0, np.pi), radius=2.0)
    assert length == pytest.approx(2.0 * np.pi)
    assert kinds[0] == LEFT
    assert lengths[0] + lengths[2] == pytest.approx(np.pi)


def test_who_cannot_reverse_goes_all_round_to_get_back_and_who_can_goes_straight():
    behind = (-1.0, 0.0, 0.0)
    dubins, _, _ = curve((0.0, 0.0, 0.0), behind)
    reversing, _, lengths = curve((0.0, 0.0, 0.0), behind, reverses=True)
    assert reversing == pytest.approx(1.0)
    assert lengths.min() == pytest.approx(-1.0)
    assert dubins > np.pi


def test_to_turn_on_the_spot_takes_three_arcs_with_two_changes():
    # The words of three arcs by Reeds and Shepp: pi / 3 each for a turn by pi.
    length, kinds, lengths = curve((0.0, 0.0, 0.0), (0.0, 0.0, np.pi), reverses=True)
    assert length == pytest.approx(np.pi)
    np.testing.assert_allclose(np.abs(lengths[:3]), np.pi / 3.0)
    assert {int(kind) for kind in kinds} == {LEFT, RIGHT, NONE}
    assert direction_changes(lengths) == 2


coordinates, angles = st.floats(-8.0, 8.0), st.floats(-3.1, 3.1)
poses = st.tuples(coordinates, coordinates, angles)


@given(start=poses, end=poses, radius=st.floats(0.3, 3.0), reverses=st.booleans())
def test_a_curve_ends_where_it_should_and_is_as_long_as_it_says(start, end, radius, reverses):
    length, _, lengths = curve(start, end, radius=radius, reverses=reverses)
    assert length == pytest.approx(radius * np.abs(lengths).sum())
    # At its very end it is the pose asked for; shortly before it must lie shortly before.
    near = pose_at(start, end, 1.0 - 1e-9, radius=radius, reverses=reverses)
    assert math.dist(near[:2], end[:2]) < 1e-5
    assert abs(math.remainder(near[2] - end[2], 2.0 * np.pi)) < 1e-5


@given(start=poses, end=poses, reverses=st.booleans())
def test_the_mirrored_curve_is_as_long(start, end, reverses):
    mirrored = [(x, -y, -yaw) for x, y, yaw in (start, end)]
    here, there = curve(start, end, reverses=reverses), curve(*mirrored, reverses=reverses)
    assert there[0] == pytest.approx(here[0], abs=1e-5)


@given(start=poses, end=poses)
def test_who_can_reverse_needs_no_longer_way_and_the_same_back(start, end):
    dubins = curve(start, end)[0]
    there, back = curve(start, end, reverses=True)[0], curve(end, start, reverses=True)[0]
    assert there <= dubins + 1e-6
    assert back == pytest.approx(there, abs=1e-6)
