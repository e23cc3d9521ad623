"""What wheels make of a command, in numbers to be checked by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.wheels import obeyed, turned, wheel_speed_obeyed

SPEED = st.floats(-2.0, 2.0)


@given(SPEED, SPEED)
def test_perfect_wheels_do_as_they_are_told(v, w):
    assert obeyed(v, w, 0.5, 0.0, 0.0, 1.0, 1.0) == pytest.approx((v, w), abs=1e-12)


@pytest.mark.parametrize(
    ("speed", "turns"), [(0.04, 0.0), (-0.04, 0.0), (0.06, 0.06), (-0.05, -0.05)]
)
def test_a_wheel_stands_still_within_its_deadband(speed, turns):
    assert wheel_speed_obeyed(speed, 0.05, 0.0) == turns


@pytest.mark.parametrize(("speed", "turns"), [(0.26, 0.3), (0.24, 0.2), (-0.26, -0.3)])
def test_wheel_speeds_are_multiples_of_a_step(speed, turns):
    assert wheel_speed_obeyed(speed, 0.0, 0.1) == pytest.approx(turns)


def test_in_a_slow_turn_the_inner_wheel_stands_still():
    # Wheels at 0.25 -+ 0.2: 0.05, within the deadband, and 0.45.
    v, w = obeyed(0.25, 0.8, 0.5, 0.1, 0.0, 1.0, 1.0)
    assert (v, w) == pytest.approx((0.225, 0.9))


def test_a_larger_left_wheel_turns_it_to_the_right():
    # Wheels at 0.5 (1 +- 0.02) on 0.5 m: 0.5 m/s still, and -0.02 / 0.5 rad/s.
    v, w = obeyed(0.5, 0.0, 0.5, 0.0, 0.0, 1.02, 0.98)
    assert (v, w) == pytest.approx((0.5, -0.04))


@given(SPEED, SPEED, st.floats(0.1, 1.5), st.floats(0.1, 1.5))
def test_what_wheels_have_turned_is_what_they_were_told(v, w, left_gain, right_gain):
    over_floor = obeyed(v, w, 0.5, 0.0, 0.0, left_gain, right_gain)
    assert turned(*over_floor, 0.5, left_gain, right_gain) == pytest.approx((v, w), abs=1e-9)
