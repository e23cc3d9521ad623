"""Metrics of path tracking against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import straight_plan
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined, tracking
from drake_navbench.logs.plans import Plan


def test_projection_finds_the_foot_on_a_bent_line():
    line = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    found = tracking.project_on_polyline(np.array([[1.0, 0.5], [2.5, 1.0], [-3.0, 4.0]]), line)
    assert found.distance_m == pytest.approx([0.5, 0.5, 5.0])
    assert found.arc_m == pytest.approx([1.0, 3.0, 0.0])
    assert found.tangent_rad == pytest.approx([0.0, math.pi / 2, 0.0])


def test_cross_track_errors_of_a_parallel_line_are_its_offset():
    log = straight_log(y_m=0.2)
    for metric in (
        tracking.cross_track_error_mean_m,
        tracking.cross_track_error_rms_m,
        tracking.cross_track_error_max_m,
    ):
        assert metric(log) == pytest.approx(0.2)


def test_cross_track_errors_of_a_sine_are_those_of_a_sine():
    time_s = log_times(10.0)
    log = straight_log(y_m=0.1 * np.sin(2 * np.pi * time_s / 10.0))
    assert tracking.cross_track_error_mean_m(log) == pytest.approx(0.2 / math.pi, rel=1e-4)
    assert tracking.cross_track_error_rms_m(log) == pytest.approx(0.1 / math.sqrt(2), rel=1e-4)
    assert tracking.cross_track_error_max_m(log) == pytest.approx(0.1, rel=1e-5)


def test_cross_track_error_has_no_floor_from_the_spacing_of_samples():
    assert tracking.cross_track_error_mean_m(straight_log()) == pytest.approx(0.0, abs=1e-12)


def test_heading_error_keeps_the_sign_that_the_published_one_folds_away():
    plan = straight_plan(5.0) @ np.array(
        [[math.cos(-0.5), math.sin(-0.5), 0], [-math.sin(-0.5), math.cos(-0.5), 0], [0, 0, 1]]
    )
    log = straight_log(yaw_rad=0.5, plan=plan)
    assert tracking.heading_error_mean_deg(log) == pytest.approx(math.degrees(1.0))
    assert tracking.heading_error_max_deg(log) == pytest.approx(math.degrees(1.0))


def test_heading_error_wraps():
    log = straight_log(yaw_rad=2.0 * math.pi - 0.1)
    assert tracking.heading_error_mean_deg(log) == pytest.approx(math.degrees(0.1))


def test_heading_error_on_a_circle_is_at_most_half_the_turn_between_plan_poses():
    # Plan poses 0.004 rad apart; the polyline's tangent differs by at most that.
    assert tracking.heading_error_max_deg(circle_log()) <= math.degrees(0.0041)


def test_each_time_is_measured_against_the_plan_in_force_then():
    # 0.1 m beside the first plan; the second, from 6 s on, lies 0.3 m to the other side.
    plans = [
        Plan(0.0, straight_plan(5.0, y_m=-0.1)),
        Plan(6.0, straight_plan(2.0, x_m=3.0, y_m=0.3)),
    ]
    log = straight_log(plans=plans)
    # The sample at 6 s counts as the second's; half an interval of 0.02 s lies between the two.
    mean_m = (0.1 * 5.98 + 0.5 * (0.1 + 0.3) * 0.02 + 0.3 * 4.0) / 10.0
    assert tracking.cross_track_error_mean_m(log) == pytest.approx(mean_m)
    assert tracking.cross_track_error_max_m(log) == pytest.approx(0.3)
    squares = (0.01 * 5.98 + 0.5 * (0.01 + 0.09) * 0.02 + 0.09 * 4.0) / 10.0
    assert tracking.cross_track_error_rms_m(log) == pytest.approx(math.sqrt(squares))


def test_replanning_from_where_the_robot_is_leaves_no_error_behind_it():
    # What is left of the plan a second; the robot drives on its line all the time.
    plans = [Plan(float(t), straight_plan(5.0)[10 * t :]) for t in range(10)]
    log = straight_log(plans=plans)
    assert tracking.cross_track_error_max_m(log) == pytest.approx(0.0, abs=1e-12)
    # Against the last one alone it would be 4.5 m.
    last_only = straight_log(plans=[Plan(0.0, plans[-1].poses)])
    assert tracking.cross_track_error_max_m(last_only) == pytest.approx(4.5)


def test_heading_errors_are_those_to_the_plan_in_force():
    # A robot that drives along x, its second plan at a right angle to that.
    turned = np.column_stack([np.full(101, 2.5), 0.05 * np.arange(101), np.full(101, math.pi / 2)])
    log = straight_log(plans=[Plan(0.0, straight_plan(5.0)), Plan(5.0, turned)])
    assert tracking.heading_error_max_deg(log) == pytest.approx(90.0)
    assert tracking.heading_error_mean_deg(log) == pytest.approx(90.0 * 0.501)


def test_times_without_a_line_to_follow_are_left_out():
    # Nothing before 4 s, then 0.2 m beside the plan, and from 8 s on a plan of one pose.
    plans = [Plan(4.0, straight_plan(5.0)), Plan(8.0, straight_plan(5.0)[-1:])]
    log = straight_log(plans=plans, y_m=0.2)
    assert tracking.cross_track_error_mean_m(log) == pytest.approx(0.2)
    assert tracking.cross_track_error_max_m(log) == pytest.approx(0.2)
    assert tracking.heading_error_max_deg(log) == 0.0
    with pytest.raises(Undefined, match="no length"):
        tracking.cross_track_error_mean_m(straight_log(plans=plans[1:]))


def test_progress_is_measured_on_the_first_plan():
    # Stuck after 5 of 20 m, and planning on: what is left begins at the robot.
    plans = [Plan(0.0, straight_plan(20.0)), Plan(9.0, straight_plan(20.0)[100:])]
    log = straight_log(plan=straight_plan(20.0), plans=plans, outcome="aborted")
    assert tracking.plan_progress_ratio(log) == pytest.approx(0.25)


def test_progress_of_a_mission_counts_all_its_legs():
    # 3 m to the waypoint, planned with a detour of 1 m; then 6 m, of which 2 m are driven; the
    # last goal, 4 m further, has no plan yet.
    detour = np.array([[0.0, 0.0, 0.0], [1.5, 1.3228756555322954, 0.0], [3.0, 0.0, 0.0]])
    second = straight_plan(6.0, x_m=3.0)
    log = straight_log(plans=[Plan(0.0, detour), Plan(6.0, second, 1)], outcome="timed_out")
    log.info["scenario"] |= {
        "waypoints": [[3.0, 0.0, 0.0], [9.0, 0.0, 0.0]],
        "goal": [9.0, 4.0, 0.0],
    }
    log.info["legs"] = [{"outcome": "succeeded", "end_time_s": 6.0}]
    assert tracking.plan_progress_ratio(log) == pytest.approx((4.0 + 2.0) / (4.0 + 6.0 + 4.0))


def test_goal_errors_of_a_mission_are_to_its_last_goal():
    log = make_log(log_times(1.0), x_m=1.0, plan=[[1.0, 2.0, 0.5]])
    log.info["scenario"]["waypoints"] = [[1.0, 0.0, 0.0]]
    assert tracking.goal_position_error_m(log) == pytest.approx(2.0)
    assert tracking.goal_heading_error_deg(log) == pytest.approx(math.degrees(0.5))


def test_plan_progress_is_the_share_behind_the_robot():
    log = straight_log(plan=straight_plan(20.0), outcome="aborted")
    assert tracking.plan_progress_ratio(log) == pytest.approx(0.25)


def test_a_trial_stalls_from_where_it_no_longer_gets_on():
    # 0.4 m/s for 5 s, then 3 s of standing; the last 0.05 m take 0.125 s.
    time_s = log_times(8.0)
    x_m = 0.4 * np.minimum(time_s, 5.0)
    log = make_log(time_s, x_m=x_m, plan=straight_plan(8.0), outcome="aborted")
    assert tracking.stall_time_s(log) == pytest.approx(3.12, abs=0.021)
    # Backing and wriggling are no progress.
    x_m = np.where(time_s > 6.0, x_m - 0.5 * np.abs(np.sin(time_s)), x_m)
    log = make_log(time_s, x_m=x_m, plan=straight_plan(8.0), outcome="aborted")
    assert tracking.stall_time_s(log) == pytest.approx(3.12, abs=0.021)


def test_who_arrives_does_not_stall():
    with pytest.raises(Undefined, match="reached its goal"):
        tracking.stall_time_s(straight_log())


def test_goal_errors_are_those_of_the_last_pose():
    log = make_log(log_times(1.0), x_m=1.0, y_m=1.0, yaw_rad=-3.0, plan=[[4.0, 5.0, 3.0]])
    assert tracking.goal_position_error_m(log) == pytest.approx(5.0)
    assert tracking.goal_heading_error_deg(log) == pytest.approx(math.degrees(2 * math.pi - 6.0))


def test_without_a_plan_tracking_is_undefined():
    with pytest.raises(Undefined, match="no plan"):
        tracking.cross_track_error_mean_m(straight_log(plan=[]))
    with pytest.raises(Undefined, match="no length"):
        tracking.cross_track_error_mean_m(straight_log(plan=[[0.0, 0.0, 0.0]] * 3))
    with pytest.raises(Undefined, match="no length"):
        tracking.plan_progress_ratio(straight_log(plan=straight_plan(5.0)[:1]))
