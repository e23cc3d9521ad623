"""Metrics of efficiency against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import straight_plan
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined, efficiency
from drake_navbench.logs.plans import Plan


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


def replanned(plan, *, at_s, speed_mps=0.5):
    """Returns a plan and what is left of it later, at the place where a robot on it would be."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(plan[:, :2], axis=0).T))])
    return [Plan(0.0, plan), *(Plan(t, plan[along >= speed_mps * t]) for t in at_s)]


def around_a_corner(speed_mps, end_time_s, **kwargs):
    """Returns a drive along x to (6, 0) and then along y, towards a goal at (6, 5)."""
    time_s = log_times(end_time_s)
    way_m = speed_mps * time_s
    legs = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 5.0, math.pi / 2]])
    plan = np.column_stack([np.interp(np.linspace(0, 11, 221), [0, 6, 11], c) for c in legs.T])
    return make_log(
        time_s,
        plan=plan,
        plans=replanned(plan, at_s=np.arange(1.0, 14.0), speed_mps=speed_mps),
        x_m=np.minimum(way_m, 6.0),
        y_m=np.maximum(way_m - 6.0, 0.0),
        v_mps=speed_mps,
        **kwargs,
    )


def test_barn_score_of_a_known_path_rests_on_the_first_plan_however_often_it_was_replanned():
    # 11 m: OT = 5.5 s. 0.25 m before the goal after 10.75 m / 0.5 m/s = 21.5 s; the clock starts
    # after 0.2 s: AT = 21.3 s, between 2 OT = 11 s and 8 OT = 44 s.
    log = around_a_corner(0.5, 21.5)
    assert len(log.plans) == 14
    assert efficiency.barn_score(log) == pytest.approx(5.5 / 21.3)
    # The last plan of 4.5 m would say OT = 2.25 s, 8 OT = 18 s, and score 2.25 / 18 = 0.125.
    last_only = make_log([0.0, 1.0], plan=log.plans[-1].poses)
    assert efficiency.first_plans_length_m(last_only) == pytest.approx(4.5)


def test_spl_rests_on_the_first_plan_however_often_it_was_replanned():
    assert efficiency.spl(around_a_corner(0.5, 21.5)) == 1.0
    # 12 m driven where the first plan is 11 m long.
    assert efficiency.spl(around_a_corner(0.5, 24.0)) == pytest.approx(11.0 / 12.0)


def leg(goal, end_time_s, outcome="succeeded"):
    return {"goal": goal, "outcome": outcome, "start_time_s": 0.0, "end_time_s": end_time_s}


def mission(*, outcome="succeeded", ended, end_time_s=16.0, plans=None):
    """Returns a drive along x at 0.5 m/s, by (2, 0) and (5, 0) to (8, 0); `ended`: of each leg."""
    goals = [[2.0, 0.0, 0.0], [5.0, 0.0, 0.0], [8.0, 0.0, 0.0]]
    if plans is None:
        # Each leg is planned as it begins, and once more a second later.
        plans = [
            Plan(time_s, straight_plan(goals[i][0] - 0.5 * time_s, x_m=0.5 * time_s), i)
            for i, begin_s in enumerate((0.0, 4.0, 10.0))
            for time_s in (begin_s, begin_s + 1.0)
        ]
    log = straight_log(end_time_s=end_time_s, outcome=outcome, plans=plans)
    log.info["scenario"] |= {"waypoints": goals[:-1], "goal": goals[-1]}
    ends = (4.0, 10.0, 16.0)
    log.info["legs"] = [leg(g, t, how) for g, t, how in zip(goals, ends, ended, strict=False)]
    return log


def test_the_shortest_way_of_a_mission_is_the_sum_of_the_first_plans_of_its_legs():
    log = mission(ended=["succeeded"] * 3)
    assert efficiency.first_plans_length_m(log) == pytest.approx(2.0 + 3.0 + 3.0)
    assert efficiency.spl(log) == pytest.approx(1.0)
    # OT = 4 s, AT = 16 - 0.2 s.
    assert efficiency.barn_score(log) == pytest.approx(4.0 / 15.8)


def test_a_mission_that_missed_a_waypoint_has_no_score():
    log = mission(ended=["succeeded", "aborted", "succeeded"])
    assert efficiency.spl(log) == efficiency.barn_score(log) == 0.0


@pytest.mark.parametrize("outcome", ["aborted", "error", "collided", "timed_out"])
def test_a_failure_scores_nothing_whether_or_not_it_had_a_plan(outcome):
    for plan in (straight_plan(5.0), []):
        log = straight_log(outcome=outcome, plan=plan)
        assert efficiency.spl(log) == efficiency.barn_score(log) == 0.0


@pytest.mark.parametrize(
    ("outcome", "ended", "left_m"),
    [
        # At 3 m, on the way to the second goal at 5 m: 2 m, and 3 m from there to the last.
        ("timed_out", ["succeeded"], 2.0 + 3.0),
        # It gave the second goal up there.
        ("aborted", ["succeeded", "aborted"], 2.0 + 3.0),
        # It gave it up and was on its way to the last goal.
        ("collided", ["succeeded", "aborted"], 5.0),
        ("succeeded", ["succeeded", "aborted", "aborted"], 5.0),
    ],
)
def test_what_is_left_of_a_mission_leads_through_the_goals_to_come(outcome, ended, left_m):
    log = mission(outcome=outcome, ended=ended, end_time_s=6.0)
    assert efficiency.goal_traversal_ratio(log) == pytest.approx(left_m / 8.0)


def test_a_mission_that_ends_where_it_began_is_as_straight_as_its_legs():
    time_s = log_times(10.0)
    log = make_log(time_s, x_m=0.5 * np.minimum(time_s, 10.0 - time_s), v_mps=0.5)
    log.info["scenario"] |= {"waypoints": [[2.5, 0.0, 0.0]], "goal": [0.0, 0.0, 0.0]}
    log.info["legs"] = [leg([2.5, 0.0, 0.0], 5.0), leg([0.0, 0.0, 0.0], 10.0)]
    assert efficiency.path_efficiency_ratio(log) == pytest.approx(1.0)
    # The whole way is 5 m though the goal is the start.
    assert efficiency.goal_traversal_ratio(log) == pytest.approx(0.0)


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
    # A uniform box of the outline's 1.1 m x 0.6 m.
    inertia_kgm2 = 180.0 * (1.1**2 + 0.6**2) / 12.0
    assert efficiency.mechanical_energy_j(log) == pytest.approx(0.5 * inertia_kgm2, rel=1e-3)


def test_energy_of_a_round_robot_that_spins_is_that_of_a_disc():
    log = make_log(time_s := log_times(4.0), w_radps=0.25 * time_s)
    log.info["robot"] |= {"footprint": None, "robot_radius": 0.2}
    # 180 kg * 0.2^2 / 2 * 1^2 / 2.
    assert efficiency.mechanical_energy_j(log) == pytest.approx(1.8, rel=1e-3)


def test_energy_grows_with_the_mass_in_the_robot_file():
    log = straight_log()
    # 0.015 * 100 * 9.81 = 14.715 N of rolling resistance; that of the air stays 0.12 N.
    log.info["robot"]["mass_kg"] = 100.0
    assert efficiency.mechanical_energy_j(log) == pytest.approx((14.715 + 0.12) * 5.0)
    log.info["robot"]["rolling_resistance_ratio"] = 0.03
    log.info["robot"]["drag_area_m2"] = 0.0
    assert efficiency.mechanical_energy_j(log) == pytest.approx(29.43 * 5.0)
    log.info["robot"]["mass_kg"] = None
    with pytest.raises(Undefined, match="gives no mass_kg"):
        efficiency.mechanical_energy_j(log)


def test_the_energy_of_a_robot_that_goes_sideways_is_that_of_one_that_goes_ahead():
    time_s = log_times(4.0)
    ahead = make_log(time_s, v_mps=0.1 * time_s)
    sideways = make_log(time_s, vy_mps=0.1 * time_s)
    diagonal = make_log(time_s, v_mps=0.06 * time_s, vy_mps=0.08 * time_s)
    expected = efficiency.mechanical_energy_j(ahead)
    # At least the kinetic energy m v^2 / 2 at 0.4 m/s, and the rolling resistance over 0.8 m.
    least = 180.0 * 0.5 * 0.4**2 + 0.015 * 180.0 * 9.80665 * 0.8
    assert expected == pytest.approx(least, rel=0.02)
    assert efficiency.mechanical_energy_j(sideways) == pytest.approx(expected)
    assert efficiency.mechanical_energy_j(diagonal) == pytest.approx(expected)
    assert efficiency.mean_speed_mps(diagonal) == pytest.approx(0.2)


def test_a_robot_that_goes_sideways_does_not_stand():
    assert efficiency.stopped_time_s(make_log(log_times(3.0), vy_mps=-0.2)) == 0.0


def in_suite(log, **suite):
    """Puts a log's scenario into a suite with a goal 8 m ahead."""
    log.info["scenario"] |= {"goal": [8.0, 0.0, 0.0], "suite": {"name": "BARN", **suite}}
    return log


def test_barns_own_worlds_take_their_reference_path_and_arrival_within_a_metre():
    # 8 m of reference: OT = 4 s, 4 OT = 16 s. At 0.5 m/s the robot is within 1 m of the goal after
    # 14 s, of which 0.2 s do not count, whatever became of the trial after that.
    log = straight_log(end_time_s=15.0, plan=straight_plan(20.0), outcome="collided")
    log = in_suite(log, reference_length_m=8.0, arrival_radius_m=1.0)
    assert efficiency.barn_score(log) == pytest.approx(4.0 / 13.8, rel=1e-3)
    # Where it ends before that, it has not arrived.
    short = straight_log(end_time_s=13.9, outcome="collided")
    assert efficiency.barn_score(in_suite(short, reference_length_m=8.0, arrival_radius_m=1.0)) == 0


def test_suites_without_a_rule_of_their_own_score_as_everything_else():
    log = in_suite(straight_log(end_time_s=16.2, plan=straight_plan(8.0)))
    assert efficiency.barn_score(log) == pytest.approx(4.0 / 16.0)
