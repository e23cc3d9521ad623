"""Metrics of efficiency against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_logs import circle_log, log_times, make_log, straight_log, straight_plan

from drake_navbench.analysis.metrics import Undefined, efficiency


def test_time_to_goal_belongs_to_successes_only():
    assert efficiency.time_to_goal_s(straight_log(info={"start_time_s": 0.5})) == 9.5
    with pytest.raises(Undefined, match="did not reach its goal"):
        efficiency.time_to_goal_s(straight_log(outcome="aborted"))


def test_duration_is_known_for_every_outcome():
    assert efficiency.duration_s(straight_log(outcome="collided")) == 10.0


def test_driven_length_of_a_circle_is_radius_times_angle():
    log = circle_log(radius_m=2.0, speed_mps=0.4, end_time_s=10.0)
    assert efficiency.driven_length_m(log) == pytest.approx(4.0, rel=1e-5)


def test_path_efficiency_of_half_a_circle_is_two_over_pi():
    log = circle_log(radius_m=1.0, speed_mps=math.pi / 10.0, end_time_s=10.0)
    assert efficiency.path_efficiency_ratio(log) == pytest.approx(2 / math.pi, rel=1e-4)
    assert efficiency.path_efficiency_ratio(straight_log()) == pytest.approx(1.0)


def test_path_efficiency_of_standing_still_is_undefined():
    with pytest.raises(Undefined, match="did not move"):
        efficiency.path_efficiency_ratio(make_log(log_times(1.0)))


def test_goal_traversal_ratio_is_the_share_of_the_way_that_is_left():
    log = straight_log(plan=straight_plan(20.0), outcome="aborted")
    # 5 of 20 m driven.
    assert efficiency.goal_traversal_ratio(log) == pytest.approx(0.75)


def test_spl_compares_the_driven_length_with_the_plan():
    # 5 m driven where the plan is 4 m long.
    assert efficiency.spl(straight_log(plan=straight_plan(4.0))) == pytest.approx(0.8)
    assert efficiency.spl(straight_log(plan=straight_plan(5.2))) == 1.0
    assert efficiency.spl(straight_log(outcome="aborted")) == 0.0


def test_barn_score_follows_the_rule_of_2024():
    # Plan 8 m: OT = 4 s. At 0.5 m/s the clock starts after 0.2 s: AT = 16.2 - 0.2 = 16 s.
    log = straight_log(end_time_s=16.2, plan=straight_plan(8.0))
    assert efficiency.barn_score(log) == pytest.approx(4.0 / 16.0)
    # AT = 3 s lies below 2 OT = 8 s, AT = 40 s above 8 OT = 32 s.
    quick = straight_log(speed_mps=5.0, end_time_s=3.02, plan=straight_plan(8.0))
    slow = straight_log(speed_mps=0.25, end_time_s=40.4, plan=straight_plan(8.0))
    assert efficiency.barn_score(quick) == pytest.approx(0.5)
    assert efficiency.barn_score(slow) == pytest.approx(0.125)
    assert efficiency.barn_score(straight_log(outcome="timed_out")) == 0.0


def test_mean_speed_counts_driving_backwards_as_driving():
    time_s = log_times(10.0)
    log = make_log(time_s, v_mps=0.4 * np.sin(2 * np.pi * time_s / 10.0))
    assert efficiency.mean_speed_mps(log) == pytest.approx(0.4 * 2 / math.pi, rel=1e-4)


def test_stopped_time_needs_both_velocities_to_be_small():
    time_s = log_times(4.0)
    # 1 s driving, 1 s turning on the spot, 2 s standing.
    v = np.where(time_s < 1.0, 0.5, 0.0)
    w = np.where((time_s >= 1.0) & (time_s < 2.0), 1.0, 0.0)
    assert efficiency.stopped_time_s(make_log(time_s, v_mps=v, w_radps=w)) == pytest.approx(2.0)


def test_energy_at_constant_speed_is_rolling_and_air_resistance_times_length():
    # 0.015 * 180 * 9.81 = 26.487 N and 0.5 * 0.96 * 0.5^2 = 0.12 N over 5 m.
    energy_j = efficiency.mechanical_energy_j(straight_log())
    assert energy_j == pytest.approx((26.487 + 0.12) * 5.0)


def test_energy_of_speeding_up_is_the_kinetic_energy_and_braking_gives_nothing_back():
    time_s = log_times(4.0)
    up = make_log(time_s, v_mps=0.1 * time_s)
    kinetic_j, rolling_j = 0.5 * 180.0 * 0.4**2, 26.487 * 0.8
    # Air: integral of 0.48 (0.1 t)^3 dt from 0 to 4 = 0.48e-3 * 64.
    assert efficiency.mechanical_energy_j(up) == pytest.approx(
        kinetic_j + rolling_j + 0.48e-3 * 64, rel=1e-3
    )
    # Braking at 0.5 m/s^2 gives 90 N, more than resistance takes.
    down = make_log(log_times(0.8), v_mps=0.4 - 0.5 * log_times(0.8))
    assert efficiency.mechanical_energy_j(down) == pytest.approx(0.0, abs=1e-9)


def test_energy_of_spinning_up_is_half_inertia_times_rate_squared():
    time_s = log_times(4.0)
    log = make_log(time_s, w_radps=0.25 * time_s)
    assert efficiency.mechanical_energy_j(log) == pytest.approx(0.5 * 180.0 * 0.131, rel=1e-3)


def test_energy_grows_with_the_mass_in_the_robot_file():
    log = straight_log()
    # 0.015 * 100 * 9.81 = 14.715 N of rolling resistance; that of the air stays 0.12 N.
    log.info["robot"]["mass_kg"] = 100.0
    assert efficiency.mechanical_energy_j(log) == pytest.approx((14.715 + 0.12) * 5.0)
    log.info["robot"]["mass_kg"] = None
    assert efficiency.mechanical_energy_j(log) == pytest.approx((26.487 + 0.12) * 5.0)
