"""The Graceful Controller's control law, by hand.

With k_phi 2 and k_delta 1 the curvature is -[d + atan(2 p) + (1 + 2/(1 + (2 p)^2)) sin d] / r,
where p and d are the headings of target and robot from the line of sight, which points down
for a target to the left. The law works in single precision.
"""

from __future__ import annotations

import math

import pytest

from drake_navbench.controllers.graceful.control_law import Law, curvature_to, velocity_to

LAW = Law(2.0, 1.0, 0.4, 2.0, 1.5, 2.5, 0.1, 1.0)
SINGLE = 1e-6


def velocity(*target, law=LAW, max_v=0.5, pose=(0.0, 0.0, 0.0), backward=False):
    return velocity_to(law, max_v, target, pose, backward)


@pytest.mark.parametrize(
    ("target_angle", "robot_angle", "curvature"),
    [
        (0.0, 0.0, 0.0),
        (0.0, -math.pi / 2, math.pi / 2 + 3.0),
        # atan(1) = pi/4, and 1 + 2/(1 + 1) = 2 does not matter without delta.
        (0.5, 0.0, -math.pi / 4),
        (-0.5, -math.pi / 2, math.pi / 2 + math.pi / 4 + 2.0),
    ],
)
def test_the_curvature_is_that_of_the_formula_and_inverse_to_the_distance(
    target_angle, robot_angle, curvature
):
    assert curvature_to(LAW, 1.0, target_angle, robot_angle) == pytest.approx(curvature)
    assert curvature_to(LAW, 2.0, target_angle, robot_angle) == pytest.approx(curvature / 2.0)


def test_straight_ahead_it_slows_down_within_the_slowdown_radius():
    assert velocity(1.5, 0.0, 0.0) == (pytest.approx(0.5), 0.0)
    assert velocity(0.75, 0.0, 0.0) == (pytest.approx(0.25), 0.0)
    assert velocity(0.75, 0.0, 0.0, law=LAW._replace(slowdown_radius=0.5))[0] == 0.5


def test_it_can_brake_to_the_target():
    # sqrt(2 * 0.5 * 0.04) = 0.2, where the slowdown radius would allow 0.5 * 0.5 / 0.5.
    law = LAW._replace(slowdown_radius=0.5, deceleration_max=0.04)
    assert velocity(0.5, 0.0, 0.0, law=law)[0] == pytest.approx(0.2)


def test_it_is_never_slower_than_its_least_speed_in_a_tight_curve():
    # To (0, 1), facing on: curvature pi/2 + 3; 0.5/(1 + 0.4 * 20.89) = 0.053 is less than 0.1.
    curvature = math.pi / 2 + 3.0
    v, w = velocity(0.0, 1.0, math.pi / 2)
    assert (v, w) == (pytest.approx(0.1, abs=SINGLE), pytest.approx(0.1 * curvature, abs=SINGLE))


def test_a_curve_slows_it_down_by_beta_and_lambda():
    # phi 0.5, delta 0 at 1 m: curvature -pi/4.
    v, w = velocity(2.0, 0.0, 0.5, law=LAW._replace(v_linear_min=0.0))
    curvature = -math.pi / 8
    assert v == pytest.approx(0.5 / (1.0 + 0.4 * curvature**2), abs=SINGLE)
    assert w / v == pytest.approx(curvature, abs=SINGLE)
    v, _ = velocity(2.0, 0.0, 0.5, law=LAW._replace(v_linear_min=0.0, beta=1.0, lambda_=1.0))
    assert v == pytest.approx(0.5 / (1.0 - curvature), abs=SINGLE)


def test_where_the_turn_rate_is_limited_the_speed_keeps_the_curvature():
    curvature = math.pi / 2 + 3.0
    v, w = velocity(0.0, 1.0, math.pi / 2, law=LAW._replace(max_w=0.2))
    assert (v, w) == (pytest.approx(0.2 / curvature, abs=SINGLE), pytest.approx(0.2))


def test_backwards_is_forwards_seen_from_behind():
    v, w = velocity(1.0, 0.3, 0.2)
    back_v, back_w = velocity(-1.0, -0.3, 0.2, backward=True)
    assert (back_v, back_w) == (pytest.approx(-v, abs=SINGLE), pytest.approx(w, abs=SINGLE))


def test_only_where_the_target_lies_from_the_robot_counts():
    turned = velocity(1.0 - 0.3, 2.0 + 1.0, math.pi / 2 + 0.2, pose=(1.0, 2.0, math.pi / 2))
    assert turned == pytest.approx(velocity(1.0, 0.3, 0.2), abs=SINGLE)


def test_a_target_in_the_same_place_has_no_velocity():
    assert all(map(math.isnan, velocity(0.0, 0.0, 0.0)))
