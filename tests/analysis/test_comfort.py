"""Metrics of comfort against closed forms and the tables of ISO 2631-1."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import comfort


def test_lateral_acceleration_on_a_circle_is_v_squared_over_r():
    assert comfort.lateral_acceleration_max_mps2(circle_log()) == pytest.approx(0.4**2 / 2.0)


def test_peaks_of_acceleration_have_their_direction():
    time_s = log_times(3.0)
    speed = np.where(time_s < 2.0, 0.2 * time_s, 0.4 - 0.35 * (time_s - 2.0))
    log = make_log(time_s, v_mps=speed)
    assert comfort.acceleration_max_mps2(log) == pytest.approx(0.2)
    assert comfort.deceleration_max_mps2(log) == pytest.approx(0.35)
    assert comfort.deceleration_max_mps2(make_log(time_s, v_mps=0.1 * time_s)) == 0.0


def test_discomfort_of_a_straight_drive_at_constant_speed_is_its_duration():
    assert comfort.gulati_kuipers_discomfort_s(straight_log()) == pytest.approx(10.0)


def test_discomfort_of_a_circle_is_that_of_its_centripetal_jerk():
    # j_t = -v w^2 = -0.4 * 0.2^2 = -0.016, j_n = 0: 10 + 0.016^2 * 10.
    discomfort_s = comfort.gulati_kuipers_discomfort_s(circle_log())
    assert discomfort_s == pytest.approx(10.0 + 10.0 * 0.016**2)


def test_discomfort_of_steady_turning_while_speeding_up_has_normal_jerk():
    # v = 0.1 t, w = 0.2: j_n = 2 * 0.2 * 0.1 = 0.04, j_t = -0.1 t * 0.04.
    time_s = log_times(3.0)
    log = make_log(time_s, v_mps=0.1 * time_s, w_radps=0.2)
    expected = 3.0 + 0.04**2 * 3.0 + 0.004**2 * 3.0**3 / 3.0
    assert comfort.gulati_kuipers_discomfort_s(log) == pytest.approx(expected)


def test_weighting_is_that_of_the_standards_table():
    frequencies_hz = np.array([0.1, 0.2, 0.4, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
    factors = [0.0624, 0.243, 0.713, 0.853, 1.011, 0.890, 0.512, 0.253, 0.125]
    assert comfort.weighting_wd(frequencies_hz) == pytest.approx(factors, abs=6e-4)


def test_weighted_rms_of_a_long_sine_is_its_rms_times_the_weight():
    time_s = 0.02 * np.arange(10_000)
    acceleration = 0.3 * np.sin(2.0 * np.pi * time_s)
    expected = 0.3 / math.sqrt(2.0) * 1.011
    assert comfort.weighted_rms(acceleration, 0.02) == pytest.approx(expected, rel=2e-3)


def test_slow_turning_lies_below_the_band():
    log = circle_log(end_time_s=60.0)
    # 0.08 m/s^2 throughout, but constant: nearly nothing passes the weighting.
    assert comfort.iso_2631_av_mps2(log) < 0.1 * 0.08


def test_both_axes_add_as_squares():
    time_s = log_times(40.0)
    wave = np.sin(2.0 * np.pi * time_s)
    forward = make_log(time_s, v_mps=-0.1 / (2.0 * np.pi) * np.cos(2.0 * np.pi * time_s))
    sideways = make_log(time_s, v_mps=1.0, w_radps=0.1 * wave)
    both = 0.1 / math.sqrt(2.0) * 1.011
    assert comfort.iso_2631_av_mps2(forward) == pytest.approx(both, rel=0.01)
    assert comfort.iso_2631_av_mps2(sideways) == pytest.approx(both, rel=0.01)


def circling(heading_rad):
    """Returns a drive on a circle of 2 m at 0.5 m/s that looks so far to the left of its course."""
    time_s = log_times(10.0)
    return make_log(
        time_s,
        v_mps=0.5 * np.cos(heading_rad),
        vy_mps=-0.5 * np.sin(heading_rad),
        w_radps=0.25,
    )


def test_comfort_on_a_circle_does_not_depend_on_where_the_robot_looks():
    # The acceleration is v^2 / r = 0.125 m/s^2 towards the centre, the jerk 0.125 / 4 s along.
    for heading_rad in (0.0, 0.6, -1.2):
        log = circling(heading_rad)
        sideways = 0.125 * np.cos(heading_rad)
        assert comfort.lateral_acceleration_max_mps2(log) == pytest.approx(sideways)
        expected = 10.0 + 10.0 * (0.125 * 0.25) ** 2
        assert comfort.gulati_kuipers_discomfort_s(log) == pytest.approx(expected, rel=1e-3)
