"""Metrics of smoothness against closed forms and the published oracle of SPARC."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined, smoothness
from drake_navbench.analysis.metrics.parabolas import parabola_derivatives


def minimum_jerk_speed(time_s, duration_s, length_m=1.0):
    """Speed of the minimum-jerk profile: 30 L/D (u^2 - 2 u^3 + u^4), u = t/D."""
    u = time_s / duration_s
    return 30.0 * length_m / duration_s * (u**2 - 2.0 * u**3 + u**4)


def test_sparc_and_ldlj_of_the_reference_bell():
    # The values that the authors' own program prints for this profile.
    bell = np.exp(-5.0 * np.arange(-1.0, 1.0, 0.01) ** 2)
    assert smoothness.sparc(bell, 0.01) == pytest.approx(-1.41403, abs=5e-6)
    jerk = smoothness.dimensionless_jerk(bell, 0.01)
    assert jerk == pytest.approx(-335.74684, abs=5e-6)
    assert -math.log(-jerk) == pytest.approx(-5.81636, abs=5e-6)


def test_dimensionless_jerk_of_the_minimum_jerk_profile_is_known():
    # integral (d2v/dt2)^2 dt = 720 L^2/D^5 and v_peak = 1.875 L/D: D^3/v_peak^2 * that = 204.8.
    period_s = 0.001
    speed = minimum_jerk_speed(np.arange(0.0, 2.0, period_s), 2.0)
    assert smoothness.dimensionless_jerk(speed, period_s) == pytest.approx(-204.8, rel=0.01)


def test_dimensionless_jerk_knows_neither_scale_nor_speed():
    fast = smoothness.dimensionless_jerk(minimum_jerk_speed(np.arange(0, 1, 0.002), 1.0), 0.002)
    slow = smoothness.dimensionless_jerk(
        minimum_jerk_speed(np.arange(0, 4, 0.008), 4.0, length_m=7.0), 0.008
    )
    assert slow == pytest.approx(fast)


def test_a_second_submovement_makes_the_spectrum_longer():
    time_s = np.arange(0.0, 4.0, 0.02)
    one = minimum_jerk_speed(time_s, 4.0)
    two = minimum_jerk_speed(np.mod(time_s, 2.0), 2.0)
    assert smoothness.sparc(two, 0.02) < smoothness.sparc(one, 0.02) < 0.0


def test_a_constant_speed_has_no_dimensionless_jerk():
    with pytest.raises(Undefined, match="constant"):
        smoothness.log_dimensionless_jerk(straight_log())


def test_standing_still_has_no_smoothness():
    log = make_log(log_times(2.0))
    with pytest.raises(Undefined, match="did not move"):
        smoothness.spectral_arc_length(log)
    with pytest.raises(Undefined, match="did not move"):
        smoothness.log_dimensionless_jerk(log)


def test_fitted_parabolas_have_the_published_weights():
    # A single 1 among zeros shows the weights of five samples: Savitzky & Golay 1964. The first two
    # samples lie on the first window's parabola.
    impulse = np.zeros(9)
    impulse[4] = 1.0
    value, first, second = parabola_derivatives(impulse, 5, period_s=0.5)
    np.testing.assert_allclose(value[:7] * 35.0, [3, -5, -3, 12, 17, 12, -3], atol=1e-12)
    np.testing.assert_allclose(first[2:7] * 0.5 * 10.0, [2, 1, 0, -1, -2], atol=1e-12)
    np.testing.assert_allclose(second[2:7] * 0.5**2 * 7.0, [2, -1, -2, -1, 2], atol=1e-12)
    # Of t from 0 to 4 that parabola has the slopes -0.371, -0.086 at 0 and 1, and 2/7 more each t.
    np.testing.assert_allclose(first[:2] * 0.5 * 70.0, [-26, -6], atol=1e-11)
    np.testing.assert_allclose(second[:2] * 0.5**2 * 7.0, [2, 2], atol=1e-12)
    np.testing.assert_allclose(
        [value[8], first[8], second[8]], [3 / 35, 26 / 35, 8 / 7], atol=1e-12
    )


def test_jerk_of_a_parabola_is_exact():
    time_s = log_times(2.0)
    log = make_log(time_s, v_mps=0.25 * time_s**2, w_radps=-0.5 * time_s**2)
    assert smoothness.jerk_rms_mps3(log) == pytest.approx(0.5)
    assert smoothness.jerk_max_mps3(log) == pytest.approx(0.5)
    assert smoothness.angular_jerk_rms_radps3(log) == pytest.approx(1.0)


def test_jerk_of_a_sine_is_that_of_a_sine():
    # v = 0.3 sin(t): j = -0.3 sin(t), r.m.s. 0.3/sqrt(2) over whole periods. The fit over 0.3 s
    # takes about 0.3^2/28 = 0.3% away.
    time_s = log_times(round(8.0 * math.pi, 2))
    log = make_log(time_s, v_mps=0.3 * np.sin(time_s))
    assert smoothness.jerk_rms_mps3(log) == pytest.approx(0.3 / math.sqrt(2.0), rel=0.01)


def test_jerk_hardly_depends_on_the_sampling_period():
    def log(period_s):
        time_s = period_s * np.arange(round(6.0 / period_s) + 1)
        # First-order response of the base to steps of the command: its acceleration jumps.
        speed = np.where(time_s < 2.0, 0.0, 0.5 * (1.0 - np.exp(-(time_s - 2.0) / 0.1)))
        return make_log(time_s, v_mps=speed)

    coarse, fine = smoothness.jerk_rms_mps3(log(0.02)), smoothness.jerk_rms_mps3(log(0.01))
    assert coarse == pytest.approx(fine, rel=0.1)


def test_a_log_of_few_samples_has_no_derivatives():
    with pytest.raises(Undefined, match="too few"):
        smoothness.jerk_rms_mps3(make_log([0.0, 0.02, 0.04]))


def test_an_uneven_last_sample_does_not_become_jerk():
    time_s = np.append(log_times(2.0), 2.001)
    log = make_log(time_s, v_mps=0.1 * time_s)
    assert smoothness.jerk_max_mps3(log) == pytest.approx(0.0, abs=1e-9)


def test_mean_acceleration_of_a_ramp():
    time_s = log_times(2.0)
    assert smoothness.acceleration_mean_mps2(
        make_log(time_s, v_mps=0.5 - 0.2 * time_s)
    ) == pytest.approx(0.2)


def test_command_variation_sums_every_step_up_and_down():
    time_s = log_times(3.0)
    command = np.select([time_s < 1.0, time_s < 2.0], [0.0, 0.5], 0.2)
    log = make_log(time_s, command_v_mps=command, command_w_radps=-2.0 * command)
    assert smoothness.command_v_variation_mps(log) == pytest.approx(0.8)
    assert smoothness.command_w_variation_radps(log) == pytest.approx(1.6)


def test_heading_change_on_a_circle_is_its_angle_and_per_metre_its_curvature():
    log = circle_log(radius_m=2.0, speed_mps=0.4, end_time_s=10.0)
    assert smoothness.heading_change_rad(log) == pytest.approx(2.0)
    assert smoothness.heading_change_per_metre_radpm(log) == pytest.approx(0.5, rel=1e-5)


def test_reversals_count_changes_of_sign_but_not_noise_around_zero():
    time_s = log_times(10.0)
    wave = np.sin(2 * np.pi * (time_s + 0.1) / 4.0)
    log = make_log(time_s, v_mps=0.2 * wave, w_radps=wave)
    # The wave crosses zero at 1.9, 3.9, 5.9, 7.9 and 9.9 s.
    assert smoothness.heading_reversal_count(log) == 5
    assert smoothness.direction_reversal_count(log) == 5
    quiet = make_log(time_s, v_mps=0.009 * wave, w_radps=0.04 * wave)
    assert smoothness.heading_reversal_count(quiet) == 0
    assert smoothness.direction_reversal_count(quiet) == 0


def test_a_straight_drive_turns_not_at_all():
    assert smoothness.heading_change_per_metre_radpm(straight_log()) == 0.0


def test_the_jerk_ends_with_the_trial():
    # The server's stop brakes within 20 ms behind the arrival; the log's last sample shows it.
    time_s = log_times(4.0)
    steady = make_log(time_s, x_m=0.5 * time_s, v_mps=0.5)
    braked = make_log(
        time_s,
        x_m=0.5 * time_s,
        v_mps=np.where(time_s > 3.99, 0.45, 0.5),
        info={"end_time_s": 3.99},
    )
    assert smoothness.jerk_rms_mps3(steady) == pytest.approx(0.0, abs=1e-9)
    assert smoothness.jerk_rms_mps3(braked) == pytest.approx(0.0, abs=1e-9)
