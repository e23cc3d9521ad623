"""Metrics of path tracking against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_logs import circle_log, log_times, make_log, straight_log, straight_plan

from drake_navbench.analysis.metrics import Undefined, tracking


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
