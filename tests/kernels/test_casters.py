"""Casters roll where they point, and what they hold back costs the base its energy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.casters import (
    BEHIND,
    FIRST_ANGLE,
    TOLD_V,
    TOLD_W,
    advanced,
    caster_rates,
)
from drake_navbench.kernels.read_only import read_only

LIMITS = np.array([-0.5, 0.5, 2.0, 0.1, 2.5, 3.0])
BODY = np.array([150.0, 0.2, 30.0])
MOTORS = np.array([0.24, 0.27, 140.0, 280.0, 80.0, 2.0, 0.24])
# Motors that do nothing.
NO_MOTORS = np.array([0.24, 0.27, 0.0, 0.0, 80.0, 0.0, 0.24])
CASTERS = np.array([[0.46, 0.18, 0.03], [0.46, -0.18, 0.03]])
FRICTIONS = np.array([0.5, 4.0])


def state_of(*, v=0.0, w=0.0, yaw=0.0, angles=(0.0, 0.0)):
    state = np.zeros(FIRST_ANGLE + len(angles))
    state[2:5] = yaw, v, w
    state[TOLD_V], state[TOLD_W] = v, w
    state[FIRST_ANGLE:] = angles
    return state


def after(state, command, duration, *, motors=MOTORS, frictions=FRICTIONS, count=None):
    told = np.array([*command, 0.0])
    count = count or round(duration * 1000)
    return advanced(
        read_only(state), told, LIMITS, BODY, motors, CASTERS, frictions, (count, duration)
    )


def energy(state):
    """Returns the kinetic energy about the base origin, its centre of mass moving with w."""
    v, w = state[3:5]
    return 0.5 * BODY[0] * v**2 + 0.5 * BODY[2] * w**2


@pytest.mark.parametrize(
    ("v", "w", "angle", "swivelling", "rolling"),
    [
        # Straight ahead, trailing: it only rolls.
        (0.5, 0.0, 0.0, 0.0, 0.5),
        # Across, it swings back with all of the speed on 0.03 m.
        (0.5, 0.0, np.pi / 2, -0.5 / 0.03, 0.0),
        (0.5, 0.0, -np.pi / 2, 0.5 / 0.03, 0.0),
        # Reversed it stands on its crest.
        (0.5, 0.0, np.pi, 0.0, -0.5),
        # Turning in place, the swivel at (0.46, 0.18) moves with (-0.18, 0.46) m/s.
        (0.0, 1.0, 0.0, 0.46 / 0.03 - 1.0, -0.18),
        (0.0, 1.0, np.pi / 2, 0.18 / 0.03 - 1.0, 0.46),
    ],
)
def test_a_caster_turns_and_rolls_as_its_swivel_moves(v, w, angle, swivelling, rolling):
    found = caster_rates(v, w, 0.46, 0.18, angle, 0.03)
    assert found == pytest.approx((swivelling, rolling), abs=1e-12)


def test_a_caster_that_trails_on_a_circle_does_not_turn():
    # About (0, 1): the way of the swivel at (0.46, 0.18) and its distance from there.
    along, distance = np.arctan2(0.46, 1.0 - 0.18), np.hypot(0.46, 1.0 - 0.18)
    angle = along - np.arcsin(0.03 / distance)
    swivelling, rolling = caster_rates(0.5, 0.5, 0.46, 0.18, angle, 0.03)
    assert swivelling == pytest.approx(0.0, abs=1e-12)
    # Its wheel runs on a smaller circle than its swivel.
    assert rolling == pytest.approx(0.5 * np.sqrt(distance**2 - 0.03**2))


def test_the_angle_decays_as_the_tractrix_does():
    state = state_of(v=0.5, angles=(2.0, 2.0))
    frictionless = after(state, (0.5, 0.0), 0.1, frictions=np.zeros(2), motors=NO_MOTORS)
    # tan(e / 2) falls by exp(-speed * time / trail).
    expected = 2.0 * np.arctan(np.tan(1.0) * np.exp(-0.5 * 0.1 / 0.03))
    np.testing.assert_allclose(frictionless[FIRST_ANGLE:], expected, rtol=1e-3)


@settings(max_examples=60, deadline=None)
@given(
    v=st.floats(-0.5, 0.5),
    w=st.floats(-2.0, 2.0),
    left=st.floats(-np.pi, np.pi),
    right=st.floats(-np.pi, np.pi),
)
def test_without_motors_friction_takes_what_its_torque_by_its_rate_is(v, w, left, right):
    state = state_of(v=v, w=w, angles=(left, right))
    step = 1e-6
    lost = (energy(state) - energy(after(state, (0, 0), step, motors=NO_MOTORS, count=1))) / step
    power = 0.0
    for (x, y, trail), angle in zip(CASTERS, (left, right), strict=True):
        swivelling, rolling = caster_rates(v, w, x, y, angle, trail)
        power += FRICTIONS[0] * abs(swivelling) * min(abs(swivelling) / 0.1, 1.0)
        power += FRICTIONS[1] * abs(rolling) * min(abs(rolling) / 0.01, 1.0)
    assert lost == pytest.approx(power, rel=1e-2, abs=1e-3)
    assert power >= 0.0


@settings(max_examples=30, deadline=None)
@given(yaw=st.floats(-3.0, 3.0), v=st.floats(-0.5, 0.5), w=st.floats(-1.0, 1.0))
def test_a_turned_world_gives_the_turned_way(yaw, v, w):
    start = state_of(angles=(1.0, -2.0))
    turned = state_of(yaw=yaw, angles=(1.0, -2.0))
    here, there = (after(state, (v, w), 0.5) for state in (start, turned))
    cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
    x, y = here[:2]
    expected = [x * cos_yaw - y * sin_yaw, x * sin_yaw + y * cos_yaw, here[2] + yaw]
    np.testing.assert_allclose(there[:3], expected, atol=1e-9)
    np.testing.assert_allclose(there[3:], here[3:], atol=1e-9)


def test_an_argument_is_not_changed():
    state = state_of(v=0.3, angles=(1.0, 2.0))
    before = state.copy()
    after(state, (0.5, 0.5), 0.1)
    np.testing.assert_array_equal(state, before)


def test_what_the_motors_are_told_keeps_to_the_limits():
    told = after(state_of(), (9.0, -9.0), 0.1)
    # 2.5 m/s^2 and 3 rad/s^2 for a tenth of a second.
    assert told[TOLD_V] == pytest.approx(0.25)
    assert told[TOLD_W] == pytest.approx(-0.3)
    later = after(state_of(), (9.0, -9.0), 5.0)
    assert later[TOLD_V] == pytest.approx(0.5, abs=1e-6)
    assert later[TOLD_W] == pytest.approx(-2.0, abs=1e-6)


def test_the_integral_part_counts_how_far_a_wheel_is_behind():
    loaded = after(state_of(), (0.5, 0.0), 6.0)
    assert loaded[3] == pytest.approx(0.5, abs=1e-6)
    # Rolling casters hold back 8 N, half of it by 0.24 m on each wheel, and its gear 2 N m more.
    np.testing.assert_allclose(280.0 * loaded[BEHIND:FIRST_ANGLE], 0.24 * 4.0 + 2.0, rtol=1e-3)
