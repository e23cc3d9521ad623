"""Faults found in other benchmarks' metric code, each as a test that ours passes.

Every test names the benchmark in which executed or read code gave the wrong answer.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest
from scenes import straight_plan
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined, efficiency, safety, smoothness, tracking
from drake_navbench.analysis.metrics.registry import all_metrics, measure_all
from drake_navbench.analysis.reproduction import published
from drake_navbench.analysis.tables import scenario_table
from drake_navbench.analysis.trial_rows import trial_row


@pytest.mark.parametrize("period_s", [0.02, 0.1, 0.4])
def test_arena_constant_jerk_reads_the_same_at_every_sampling_period(period_s):
    # Arena: differences never divided by the period.
    time_s = period_s * np.arange(round(4.0 / period_s) + 1)
    log = make_log(time_s, v_mps=0.25 * time_s**2)
    assert smoothness.jerk_rms_mps3(log) == pytest.approx(0.5)


def test_arena_a_second_is_a_second():
    # Arena: clock built as seconds times 1e10.
    assert efficiency.duration_s(straight_log(end_time_s=7.0)) == pytest.approx(7.0)


def test_arena_how_far_from_the_goal_a_success_ended_is_told():
    # Arena: "goal reached" without a look at the goal.
    log = straight_log(plan=straight_plan(6.0))
    assert tracking.goal_position_error_m(log) == pytest.approx(1.0)


@pytest.mark.parametrize("period_s", [0.02, 0.1])
def test_hunav_constant_acceleration_has_no_jerk(period_s):
    # HuNavSim: "jerk" = |dv|/dt^2 reads 49.5 and 9.5.
    time_s = period_s * np.arange(round(2.0 / period_s) + 1)
    assert smoothness.jerk_rms_mps3(make_log(time_s, v_mps=time_s)) == pytest.approx(0.0, abs=1e-9)


def test_hunav_fast_turning_to_the_right_and_backing_are_not_standing():
    # HuNavSim: abs(w < 0.02), and no abs of the speed.
    time_s = log_times(2.0)
    assert efficiency.stopped_time_s(make_log(time_s, w_radps=-5.0)) == 0.0
    assert efficiency.stopped_time_s(make_log(time_s, v_mps=-0.3)) == 0.0


def moved(log, dx, dy):
    """Returns the same trial on a map with another origin."""
    shift = np.array([dx, dy, 0.0])
    samples = log.samples.assign(
        x_m=log.samples["x_m"] + dx,
        y_m=log.samples["y_m"] + dy,
        estimated_x_m=log.samples["estimated_x_m"] + dx,
        estimated_y_m=log.samples["estimated_y_m"] + dy,
    )
    scenario = dict(log.info["scenario"])
    for name in ("start", "goal"):
        scenario[name] = list(np.array(scenario[name]) + shift)
    scenario["world"] = {
        "obstacles": [
            box
            | {
                "min": list(np.array(box["min"]) + shift[:2]),
                "max": list(np.array(box["max"]) + shift[:2]),
            }
            for box in scenario["world"]["obstacles"]
        ]
    }
    plans = tuple(dataclasses.replace(plan, poses=plan.poses + shift) for plan in log.plans)
    return type(log)(samples=samples, plans=plans, info=dict(log.info) | {"scenario": scenario})


def test_socnav_and_barn_no_metric_depends_on_where_the_map_has_its_origin():
    # SocNavBench: positions taken for headings and for speeds. BARN 2022: plan and obstacles in
    # frames 0.15 m apart.
    log = circle_log(clearance_m=1.0, obstacle_cell_distance_m=1.3, obstacle_corner_distance_m=1.3)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [2.5, 1.0], "max": [3.5, 3.0]}
    ]
    here, there = measure_all(log), measure_all(moved(log, -31.0, 17.0))
    for entry in all_metrics():
        assert there[entry.name].value == pytest.approx(
            here[entry.name].value, rel=1e-6, abs=1e-6, nan_ok=True
        ), entry.name


def test_socnav_a_straight_line_is_regular_at_every_rate():
    # SocNavBench: irregularity in radians a sample, 0.03 to 2.92 for one straight line.
    assert smoothness.heading_change_per_metre_radpm(straight_log()) == 0.0
    dense, sparse = (
        make_log(t, x_m=np.sin(t), y_m=1.0 - np.cos(t), yaw_rad=t)
        for t in (np.linspace(0.0, 1.0, 401), np.linspace(0.0, 1.0, 101))
    )
    assert smoothness.heading_change_per_metre_radpm(dense) == pytest.approx(
        smoothness.heading_change_per_metre_radpm(sparse), rel=1e-4
    )


def test_socnav_time_to_collision_knows_the_body_and_has_no_sentinel():
    # SocNavBench: no radii, speed along the line of centres, -1 averaged in.
    log = straight_log(end_time_s=2.0)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [3.85, -1.0], "max": [5.0, 1.0]}
    ]
    # After 2 s: front at 1.85 m, 2 m to go at 0.5 m/s.
    assert safety.time_to_collision_min_s(log) == pytest.approx(4.0)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [2.0, 0.4], "max": [3.0, 1.0]}
    ]
    with pytest.raises(Undefined):
        safety.time_to_collision_min_s(log)


def test_mrpb_danger_that_lasts_to_the_end_or_for_one_sample_counts():
    # MRPB: an open interval and single samples are dropped, both read 0%.
    time_s = np.arange(101.0)
    second_half = np.where(time_s < 50.0, 1.0, 0.1)
    alternating = np.where(time_s % 2 == 0, 1.0, 0.1)
    assert safety.danger_share(time_s, second_half) == pytest.approx(0.5)
    assert safety.danger_share(time_s, alternating) == pytest.approx(0.5)


def test_barn_the_score_of_a_success_depends_on_its_time_on_every_course():
    # DynaBARN: a negative reference length made every success score 0.125.
    plan = straight_plan(8.0) * [-1.0, 1.0, 1.0]
    quick = straight_log(speed_mps=-0.5, end_time_s=16.2, plan=plan)
    slow = straight_log(speed_mps=-0.4, end_time_s=20.25, plan=plan)
    assert efficiency.barn_score(quick) == pytest.approx(0.25)
    assert efficiency.barn_score(slow) == pytest.approx(0.2, rel=0.01)


def test_barn_a_score_computed_again_from_the_written_log_is_the_same(tmp_path):
    # BARN: run and report computed different scores for two years.
    log = circle_log()
    log.write(tmp_path / "trial.parquet")
    read = type(log).read(tmp_path / "trial.parquet")
    assert {name: m.reason for name, m in measure_all(read).items()} == {
        name: m.reason for name, m in measure_all(log).items()
    }
    assert [m.value for m in measure_all(read).values()] == pytest.approx(
        [m.value for m in measure_all(log).values()], nan_ok=True
    )


def test_rosnavbench_giving_up_early_is_neither_short_nor_quick():
    # ROSNavBench: means mix failed and successful trials without a word.
    quitter = straight_log(end_time_s=1.0, outcome="aborted", plan=straight_plan(5.0))
    measured = measure_all(quitter)
    assert math.isnan(measured["time_to_goal_s"].value)
    assert measured["time_to_goal_s"].reason == "the trial did not reach its goal (aborted)"
    assert measured["spl"].value == 0.0
    table = scenario_table(pd.DataFrame([trial_row(quitter), trial_row(straight_log())]), "empty")
    assert table.loc[("aborted", "trials"), "rpp"] == 1


def test_rosnavbench_deviation_does_not_grow_with_duration():
    # ROSNavBench: deviation is a sum over samples.
    fast = straight_log(speed_mps=0.5, end_time_s=10.0, y_m=0.1)
    slow = straight_log(speed_mps=0.25, end_time_s=20.0, y_m=0.1)
    assert tracking.cross_track_error_mean_m(slow) == pytest.approx(
        tracking.cross_track_error_mean_m(fast)
    )


def test_rosnavbench_clearance_is_that_of_the_footprint():
    # ROSNavBench: smallest raw lidar range.
    log = straight_log(clearance_m=0.4, obstacle_cell_distance_m=1.25)
    assert safety.min_clearance_m(log) == pytest.approx(0.4)


def test_sutera_an_error_on_one_axis_is_an_error():
    # controller_benchmarking: x and y errors joined by `and`.
    log = make_log(log_times(1.0), y_m=0.7, plan=straight_plan(0.0))
    assert tracking.goal_position_error_m(log) == pytest.approx(0.7)


def test_benchmr_a_maximum_of_negative_numbers_is_negative():
    # bench-mr: max() starts from the smallest positive double.
    backing = straight_log(speed_mps=-0.2, plan=[[0.0, 0.0, 0.0]])
    assert published.max_velocity(backing) == pytest.approx(-40.0)
    assert safety.min_clearance_m(straight_log(clearance_m=-0.1)) == pytest.approx(-0.1)
