"""The dynamic window: which velocities DWB tries."""

import numpy as np
import pytest
from dwb_cases import parameters
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.controller import SpeedLimit
from drake_navbench.controllers.dwb.kinematics import Kinematics
from drake_navbench.controllers.dwb.trajectories import TrajectoryGenerator
from drake_navbench.controllers.dwb.velocity_samples import (
    is_valid_speed,
    project_velocity,
    sample_axis,
)


def axis(*, current=0.0, low=-1.0, high=1.0, accel=10.0, decel=-10.0, window_s=1.0, n=4):
    samples = np.empty(2 * max(2, n) + 1)
    return samples[: sample_axis(current, low, high, accel, decel, window_s, n, samples)]


def twists_of(p, *, twist=(0.0, 0.0, 0.0), period_s=0.05):
    generator = TrajectoryGenerator(p, period_s)
    return generator.generate((0.0, 0.0, 0.0), twist, Kinematics.from_parameters(p)).twists


def test_velocity_approaches_a_target_at_the_matching_limit():
    assert project_velocity(0.1, 2.0, -3.0, 0.1, 1.0) == pytest.approx(0.1 + 2.0 * 0.1)
    assert project_velocity(0.9, 2.0, -3.0, 0.1, 0.0) == pytest.approx(0.9 - 3.0 * 0.1)
    assert project_velocity(0.1, 2.0, -3.0, 10.0, 1.0) == 1.0
    assert project_velocity(0.9, 2.0, -3.0, 10.0, 0.0) == 0.0


def test_even_sample_count_on_a_symmetric_axis_gets_a_zero_in_between():
    np.testing.assert_allclose(axis(n=4), [-1.0, -1 / 3, 0.0, 1 / 3, 1.0], rtol=0, atol=1e-12)
    assert 0.0 in axis(n=4)


def test_rounded_middle_sample_stays_beside_the_exact_zero():
    # Repeated addition of 0.1 from -1 passes 0 at -1.39e-16: the exact 0 comes after it.
    samples = axis(n=21)
    assert len(samples) == 22
    np.testing.assert_allclose(samples[10:12], [-1.39e-16, 0.0], rtol=0, atol=1e-18)
    assert samples[11] == 0.0
    # With 18 intervals the sum passes 0 at +1.67e-16: the exact 0 comes before it.
    samples = axis(n=19)
    np.testing.assert_allclose(samples[9:11], [0.0, 1.67e-16], rtol=0, atol=1e-18)
    assert samples[9] == 0.0


def test_axis_spans_what_the_limits_reach_within_the_window():
    # From 0.2: up to min(0.26, 0.2 + 2.5 * 0.05) = 0.26, down to max(0, 0.2 - 2.5 * 0.05) = 0.075.
    samples = axis(current=0.2, low=0.0, high=0.26, accel=2.5, decel=-2.5, window_s=0.05, n=3)
    np.testing.assert_allclose(samples, [0.075, 0.1675, 0.26], rtol=0, atol=1e-12)


def test_measured_velocity_beyond_the_range_is_taken_to_its_end():
    samples = axis(current=5.0, low=0.0, high=1.0, accel=1.0, decel=-1.0, window_s=0.5, n=2)
    np.testing.assert_allclose(samples, [0.5, 1.0])


@pytest.mark.parametrize("n", [1, 0, -3])
def test_fewer_samples_than_two_are_two(n):
    # Nav2 takes the larger of 2 and the parameter, which its TurtleBot files set to 0.
    np.testing.assert_array_equal(axis(n=n), axis(n=2))


def test_axis_whose_ends_are_swapped_has_no_samples():
    assert len(axis(low=0.3, high=0.1)) == 0


def test_swapped_lateral_axis_is_read_once_but_a_forward_one_not_at_all():
    # At 20 % the range [0.1, 0.3] becomes [0.1, 0.06]: from rest it starts at 0.1.
    base = Kinematics.from_parameters(parameters())
    lateral = base._replace(min_vel_y=0.1, max_vel_y=0.06, max_speed_xy=-1.0)
    generator = TrajectoryGenerator(parameters(), 0.05)
    twists = generator.generate((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), lateral).twists
    assert set(twists[:, 1]) == {0.1}
    forward = base._replace(min_vel_x=0.1, max_vel_x=0.06)
    assert len(generator.generate((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), forward).twists) == 0


def test_axis_without_width_has_one_sample():
    np.testing.assert_array_equal(axis(low=0.0, high=0.0), [0.0])


def test_single_wanted_sample_counts_as_two():
    np.testing.assert_array_equal(axis(low=0.0, high=1.0, n=1), [0.0, 1.0])


def test_axis_barely_wider_than_the_tolerance_overshoots_it():
    # Width 1.9e-5 in 19 steps of 1e-6; samples go on to the end plus 1e-5: 20 + 10 of them.
    samples = axis(low=0.5, high=0.5 + 1.9e-5, n=20)
    assert len(samples) == pytest.approx(30, abs=1)
    assert samples[-1] <= 0.5 + 1.9e-5 + 1e-5


@given(
    current=st.floats(-2, 2),
    bound=st.floats(0, 2),
    accel=st.floats(0, 5),
    n=st.integers(1, 30),
)
def test_axis_is_ascending_within_reach_and_starts_at_its_low_end(current, bound, accel, n):
    window_s = 0.5
    samples = axis(
        current=current, low=-bound, high=bound, accel=accel, decel=-accel, window_s=window_s, n=n
    )
    start = min(max(current, -bound), bound)
    assert samples[0] == max(-bound, start - accel * window_s)
    assert samples[-1] <= min(bound, start + accel * window_s) + 1e-5
    assert (np.diff(samples) > 0.0).all()


def test_bringup_window_at_rest_has_419_twists():
    # 20 in x, 1 in y, 20 and the inserted zero in theta, less the full stop: 20 * 21 - 1.
    twists = twists_of(parameters())
    assert len(twists) == 419
    assert not (twists == 0.0).all(axis=1).any()


def test_twists_ascend_with_theta_fastest():
    p = parameters(vx_samples=2, vtheta_samples=3)
    np.testing.assert_allclose(
        twists_of(p),
        [[0, 0, -1], [0, 0, 1], [0.26, 0, -1], [0.26, 0, 0], [0.26, 0, 1]],
        rtol=0,
        atol=1e-12,
    )


def test_lateral_samples_lie_between_x_and_theta():
    p = parameters(
        vx_samples=2,
        vy_samples=2,
        vtheta_samples=2,
        min_vel_y=-0.1,
        max_vel_y=0.1,
        acc_lim_y=2.5,
        decel_lim_y=-2.5,
        max_speed_xy=-1.0,
    )
    twists = twists_of(p)
    # 2 in x, 2 and zero in y, 2 and zero in theta, less the full stop.
    assert len(twists) == 2 * 3 * 3 - 1
    np.testing.assert_allclose(twists[:4, 1], [-0.1, -0.1, -0.1, 0.0], rtol=0, atol=1e-12)


def test_default_planar_speed_limit_of_zero_leaves_pure_rotation():
    twists = twists_of(parameters(max_speed_xy=0.0))
    assert len(twists) == 20
    assert (twists[:, 0] == 0.0).all()


@pytest.mark.parametrize(
    ("release", "admits"), [("humble", True), ("iron", True), ("jazzy", False), ("lyrical", False)]
)
def test_up_to_iron_a_twist_may_be_a_little_faster(release, admits):
    # 0.3^2 + 0.002^2 = 0.090004: more than 0.09 by 4e-6, of which Iron lets 1e-5 pass.
    p = parameters(nav2_release=release, max_speed_xy=0.3)
    assert is_valid_speed(Kinematics.from_parameters(p), 0.3, 0.002, 0.0) is admits


def test_negative_planar_speed_limit_is_none():
    assert len(twists_of(parameters(max_speed_xy=-1.0))) == 419


def test_twist_too_slow_in_both_senses_is_left_out():
    p = parameters(
        vx_samples=2, vtheta_samples=3, min_speed_xy=0.1, min_speed_theta=0.5, max_vel_theta=0.4
    )
    # x = 0 turns at 0.4 at most: too slow. x = 0.26 is fast enough whatever it turns.
    np.testing.assert_allclose(twists_of(p)[:, 0], [0.26, 0.26, 0.26], rtol=0, atol=1e-12)
    assert len(twists_of(p.model_copy(update={"min_speed_theta": -1.0}))) == 5


def test_limited_accel_window_is_one_control_period_unless_set():
    p = parameters(trajectory_generator_name="dwb_plugins::LimitedAccelGenerator", vx_samples=2)
    # 2.5 m/s^2 for 0.05 s, or for 0.02 s.
    assert twists_of(p, period_s=0.05)[:, 0].max() == pytest.approx(0.125)
    p = p.model_copy(update={"sim_period": 0.02})
    assert twists_of(p, period_s=0.05)[:, 0].max() == pytest.approx(0.05)


class TestSpeedLimit:
    base = Kinematics.from_parameters(parameters(max_vel_x=0.4, max_speed_xy=0.45, min_vel_x=-0.1))

    def limited(self, *limits):
        kinematics = self.base
        for limit in limits:
            kinematics = kinematics.limited(self.base, limit)
        return kinematics

    def test_percentage_scales_the_upper_limits(self):
        limited = self.limited(SpeedLimit(50.0, is_percentage=True))
        assert (limited.max_vel_x, limited.max_vel_theta) == pytest.approx((0.2, 0.5))
        assert (limited.max_speed_xy, limited.min_vel_x) == pytest.approx((0.225, -0.1))

    def test_speed_below_the_planar_limit_scales_in_proportion(self):
        # 0.23 of 0.45 m/s; 0.45 * (0.23 / 0.45) would miss 0.23 by a rounding.
        limited = self.limited(SpeedLimit(0.23))
        assert limited.max_speed_xy == 0.23
        assert limited.max_vel_x == pytest.approx(0.4 * 0.23 / 0.45)
        assert limited.max_vel_theta == pytest.approx(0.23 / 0.45)

    def test_speed_at_or_above_the_planar_limit_leaves_the_present_limits(self):
        assert self.limited(SpeedLimit(0.6)) == self.base
        assert self.limited(SpeedLimit(0.1), SpeedLimit(0.5)) == self.limited(SpeedLimit(0.1))

    @pytest.mark.parametrize("end", [None, SpeedLimit(0.0), SpeedLimit(0.0, is_percentage=True)])
    def test_no_limit_restores_the_configured_ones(self, end):
        assert self.limited(SpeedLimit(0.1), end) == self.base
