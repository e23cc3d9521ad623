"""Whole trials of waypoints, of the velocity smoother and of the collision monitor."""

from itertools import pairwise

import numpy as np
import pytest
from navigation_scenes import box, scenario, simulate_stub
from stub_controller import straight_ahead

from drake_navbench import run_trial
from drake_navbench.analysis.metrics import efficiency, tracking
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.outcome import Outcome


def test_waypoints_are_reached_in_order_with_a_pause_at_each():
    follower = {"wait_at_waypoint": {"waypoint_pause_duration": 1000}}
    task = scenario(
        waypoints=[[2.0, 0.0, 0.0], [3.5, 1.0, 1.57]],
        goal=[3.5, 3.0, 1.57],
        robot_overrides={"navigation": {"waypoint_follower": follower}},
    )
    log = run_trial(task, "rpp", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
    legs = log.info["legs"]
    assert [leg["outcome"] for leg in legs] == ["succeeded"] * 3
    for leg in legs:
        at_end = log.samples[log.samples["time_s"] <= leg["end_time_s"]].iloc[-1]
        assert np.hypot(at_end.x_m - leg["goal"][0], at_end.y_m - leg["goal"][1]) < 0.27
    for before, after in pairwise(legs):
        assert after["start_time_s"] - before["end_time_s"] == pytest.approx(1.0, abs=0.051)
    for plan, leg in zip(log.first_plans, legs, strict=True):
        np.testing.assert_allclose(plan.poses[-1], leg["goal"])
        assert plan.time_s == pytest.approx(leg["start_time_s"], abs=0.051)
    # The first plans begin where the robot is at the time, and leave no gap.
    assert efficiency.spl(log) > 0.95
    assert tracking.cross_track_error_mean_m(log) < 0.05


def test_a_waypoint_without_a_way_is_missed_and_the_others_are_reached():
    walls = [
        box((1.0, 2.0), (3.0, 2.1)),
        box((1.0, 4.0), (3.0, 4.1)),
        box((1.0, 2.0), (1.1, 4.1)),
        box((2.9, 2.0), (3.0, 4.1)),
    ]
    settings = {
        "waypoint_follower": {"stop_on_failure": False},
        "behavior_tree": {"recovery_actions": ["wait"], "wait_duration": 0.1},
    }
    task = scenario(
        waypoints=[[2.0, 3.0, 0.0]],
        world={"obstacles": walls},
        robot_overrides={"navigation": settings},
    )
    log = run_trial(task, "rpp", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
    assert [leg["outcome"] for leg in log.info["legs"]] == ["aborted", "succeeded"]
    assert log.info["details"] == {"missed_waypoints": [1]}


WALL = {"obstacles": [box((2.0, -2.0), (2.2, 2.0), known_to_planner=False)]}


def test_the_collision_monitor_stops_a_controller_that_drives_at_a_wall():
    approach = {"type": "polygon", "action_type": "approach", "min_points": 2}
    watched = {"navigation": {"collision_monitor": {"polygons": {"body": approach}}}}
    task = scenario(navigation_mode="follow_path", world=WALL, timeout_s=30.0)
    assert simulate_stub(straight_ahead, task).outcome is Outcome.COLLIDED
    task = task.model_copy(update={"robot_overrides": watched})
    log = simulate_stub(straight_ahead, task)
    assert log.info["error_code"] == 105
    last = log.samples.iloc[-1]
    assert last.v_mps == pytest.approx(0.0, abs=1e-3)
    # The front is 0.85 m ahead, and padded by 0.01 m.
    assert 0.0 < 2.0 - (last.x_m + 0.85) < 0.15


def test_the_velocity_smoother_limits_the_acceleration_of_the_command():
    smoother = {"max_accel": [0.5, 0.0, 3.2], "max_decel": [-0.5, 0.0, -3.2]}
    task = scenario(
        navigation_mode="follow_path",
        robot_overrides={"navigation": {"velocity_smoother": smoother}},
    )
    log = simulate_stub(straight_ahead, task)
    commands = log.samples.set_index("time_s")["command_v_mps"]
    # 0.5 m/s^2 / 20 Hz = 0.025 m/s a step: 0.5 m/s after 20 steps, a second.
    assert commands.diff().abs().max() == pytest.approx(0.025)
    assert commands.loc[0.9] < 0.5
    assert commands.loc[1.1] == pytest.approx(0.5)


def test_the_command_chain_works_under_a_behaviour_tree_too():
    navigation = {
        "velocity_smoother": {},
        "collision_monitor": {"polygons": {"body": {"type": "polygon", "action_type": "approach"}}},
    }
    task = load_scenario("dead_end")
    overrides = {"navigation": task.robot_overrides["navigation"] | navigation}
    log = run_trial(task.model_copy(update={"robot_overrides": overrides}), "rpp", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
