"""What a lift carries the robot counts as no motion: metrics of missions, leg by leg and whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mission_scenes import small_mission

from drake_navbench import run_trial
from drake_navbench.analysis.figures.maps import drawn_path
from drake_navbench.analysis.invariants import violations_of
from drake_navbench.analysis.journey import actions_of, legs_of
from drake_navbench.analysis.metrics.efficiency import (
    driven_length_m,
    goal_traversal_ratio,
    lift_time_s,
    path_efficiency_ratio,
)
from drake_navbench.analysis.metrics.mission import goals, leg_lengths_m
from drake_navbench.analysis.metrics.signals import poses_at
from drake_navbench.analysis.metrics.smoothness import heading_change_rad
from drake_navbench.analysis.metrics.tracking import (
    cross_track_error_max_m,
    goal_position_error_m,
    plan_progress_ratio,
)
from drake_navbench.analysis.report_sections import legs_table
from drake_navbench.analysis.reproduction.published import energy, path_length
from drake_navbench.analysis.scenario_analysis import read_trials
from drake_navbench.logs.log import TrialLog

# From the start to the lift 0.8 m, from there to the goal 1 m.
RIDE = {"travel_s": 3.0, "door_s": 1.0}


@pytest.fixture(scope="module")
def log() -> TrialLog:
    return run_trial(small_mission(RIDE), "rpp")


def test_the_driven_length_is_that_on_both_floors(log):
    v_mps = log.samples["v_mps"].to_numpy()
    driven_m = np.trapezoid(np.abs(v_mps), log.samples["time_s"])
    assert driven_length_m(log) == pytest.approx(driven_m, abs=2e-3)
    # Its samples end up to 0.115 s before the trial does.
    assert path_length(log) == pytest.approx(driven_m, abs=0.07)
    # At half a metre a second the squared speed never exceeds 0.25.
    assert energy(log) < 0.25 * log.end_time_s


def test_a_lift_that_turns_the_robot_is_no_turning_of_its_own(log):
    yaw_rad = log.samples["yaw_rad"] + 1.5 * log.samples["floor"]
    turned = replace(log, samples=log.samples.assign(yaw_rad=yaw_rad))
    assert heading_change_rad(turned) == pytest.approx(heading_change_rad(log))


def test_the_time_at_the_lift_is_that_of_the_ride(log):
    assert lift_time_s(log) == pytest.approx(4.0)
    assert "one floor" in lift_time_s.measure(run_trial("restricted_small", "rpp")).reason


def test_the_straight_way_goes_to_the_lift_and_on_from_where_it_stops(log):
    np.testing.assert_allclose(goals(log)[:, :2], [[0.8, 0.0], [13.0, 3.0]])
    np.testing.assert_allclose(leg_lengths_m(log), [0.8, 1.0], atol=0.25)
    assert 0.9 < path_efficiency_ratio(log) <= 1.0 + 1e-9
    assert goal_traversal_ratio(log) < 0.2
    assert plan_progress_ratio(log) > 0.7
    assert goal_position_error_m(log) < 0.25
    assert cross_track_error_max_m(log) < 0.2


def test_a_mission_that_ends_downstairs_has_its_whole_way_upstairs_left():
    log = run_trial(small_mission({"refused_probability": 1.0}), "rpp")
    # Within the goal's tolerance of the lift, and 1 m upstairs.
    left_m = goal_traversal_ratio(log) * 1.8
    assert 1.0 <= left_m <= 1.25
    assert "another floor" in goal_position_error_m.measure(log).reason
    assert plan_progress_ratio(log) < 0.6


def test_legs_are_told_with_floor_lift_and_times(log):
    first, second = legs_of(log)
    assert (first.floor, first.lift, second.floor, second.lift) == ("ground", "main", "upper", "")
    assert (first.lift_s, second.lift_s) == (pytest.approx(4.0), 0.0)
    assert first.driven_m + second.driven_m == pytest.approx(driven_length_m(log), abs=0.1)
    # The wall is 1 m to the left of the way, the half width of the chair 0.3 m.
    assert first.clearance_m == pytest.approx(0.7, abs=0.05)
    assert second.clearance_m == np.inf
    told = [action.text for action in actions_of(log)]
    assert [text for text in told if "lift" in text] == [
        "lift main requested",
        "lift main came",
        "lift main arrived",
    ]


def test_no_line_is_drawn_to_where_the_lift_carried_the_robot(log):
    path = drawn_path(log)
    assert len(path) == len(log.samples) + 1
    assert np.nanmax(np.hypot(*np.diff(path, axis=0).T)) < 0.02


def test_between_two_floors_the_robot_is_where_it_comes_to(log):
    row = int(np.flatnonzero(np.diff(log.samples["floor"]))[0])
    before, after = log.samples.iloc[row], log.samples.iloc[row + 1]
    middle = 0.5 * (before["time_s"] + after["time_s"])
    x_m, y_m, _ = poses_at(log, [middle])[0]
    assert (x_m, y_m) == (after["x_m"], after["y_m"])


def test_nothing_impossible_is_found_in_a_mission(log, tmp_path):
    log.write(tmp_path / "log.parquet")
    assert violations_of(TrialLog.read(tmp_path / "log.parquet")) == []


def test_the_table_of_legs_has_a_row_for_each(log, tmp_path):
    log.write(tmp_path / "log.parquet")
    _, entries, _ = read_trials([tmp_path / "log.parquet"], tmp_path, {})
    table = legs_table(entries)
    assert list(table["leg"]) == [1, 2]
    assert list(table["floor"]) == ["ground", "upper"]
    assert list(table["lift_s"]) == pytest.approx([4.0, 0.0])
