"""Whole trials through several poses by one plan (mode navigate_through_poses)."""

import numpy as np
import pytest
from navigation_scenes import box, scenario, statuses

from drake_navbench import run_trial
from drake_navbench.analysis.journey import legs_of
from drake_navbench.analysis.metrics.efficiency import path_efficiency_ratio, spl
from drake_navbench.analysis.metrics.mission import plans_of_legs
from drake_navbench.analysis.metrics.tracking import plan_progress_ratio
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

THROUGH = {"navigation_mode": "navigate_through_poses"}
ON_A_LINE = {"goal": [6.0, 0.0, 0.0], "waypoints": [[2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]}


def tree(**fields):
    """Returns the overrides of the behaviour tree."""
    return {"navigation": {"behavior_tree": fields}}


def drive(fields, **overrides) -> TrialLog:
    return run_trial(scenario(**(THROUGH | fields), robot_overrides=tree(**overrides)), "rpp")


@pytest.fixture(scope="module")
def line() -> TrialLog:
    """A drive through three poses on a line, looked at ten times a second."""
    return drive(ON_A_LINE, through_poses_hz=10.0, nav2_release="jazzy")


def speed_at(log, x_m):
    return np.interp(x_m, log.samples["x_m"], log.samples["v_mps"])


def test_the_robot_does_not_slow_down_at_a_pose_that_it_passes(line):
    assert line.outcome is Outcome.SUCCEEDED
    np.testing.assert_allclose(speed_at(line, [1.9, 2.0, 2.1, 3.9, 4.0, 4.1]), 0.5, atol=1e-6)


def test_one_task_of_the_controller_server_leads_through_all_poses(line):
    assert statuses(line, "FollowPath") == [("FollowPath", "running"), ("FollowPath", "success")]
    assert line.info["reason"] == "goal reached"


def test_a_pose_is_dropped_within_the_radius_by_one_period(line):
    first, second, last = line.info["legs"]
    for leg, x_m in ((first, 2.0), (second, 4.0)):
        driven_m = np.interp(leg["end_time_s"], line.samples["time_s"], line.samples["x_m"])
        # Within 0.7 m, and at most 0.1 s at 0.5 m/s later.
        assert 0.0 <= driven_m - (x_m - 0.7) <= 0.5 * 0.15
        assert leg["reason"] == "passed"
    assert last["reason"] == "goal reached"


def test_each_plan_leads_from_the_robot_through_the_poses_that_are_left(line):
    for plan in line.plans:
        assert plan.leg == 0
        np.testing.assert_allclose(plan.poses[-1, :2], [6.0, 0.0], atol=1e-6)
    assert path_length(line.plans[0].poses) == pytest.approx(6.0, abs=0.01)


def test_metrics_count_the_one_plan_and_journeys_the_nearest_approach(line):
    parts = plans_of_legs(line)
    assert [path_length(part.poses) for part in parts] == pytest.approx([2.0, 2.0, 2.0], abs=0.06)
    assert spl(line) == 1.0
    assert plan_progress_ratio(line) == pytest.approx(5.75 / 6.0, abs=0.01)
    assert path_efficiency_ratio(line) == pytest.approx(1.0, abs=1e-3)
    legs = legs_of(line)
    assert [leg.driven_m for leg in legs] == pytest.approx([2.0, 2.0, 1.75], abs=0.06)
    assert legs[0].reason == "passed, 0.00 m away"


def test_there_and_back_again_is_a_way_of_its_whole_length():
    """The last pose is the start, so the plan ends where it begins."""
    # Wide enough that the robot turns by an arc.
    way = {"goal": [0.0, 1.5, 3.14], "waypoints": [[3.0, 0.0, 0.0], [3.0, 1.5, 3.14]]}
    log = drive(way, through_poses_hz=5.0)
    assert log.outcome is Outcome.SUCCEEDED
    assert path_efficiency_ratio(log) > 0.9
    out, across, back = (leg.driven_m for leg in legs_of(log))
    assert (out, across, back) == pytest.approx((3.0, 1.5, 3.0), abs=0.6)


def test_a_pose_behind_walls_is_met_by_recoveries_and_then_the_task_is_given_up():
    walls = [
        box([2.9, -1.1], [3.0, 1.1]),
        box([5.0, -1.1], [5.1, 1.1]),
        box([3.0, -1.1], [5.0, -1.0]),
        box([3.0, 1.0], [5.0, 1.1]),
    ]
    log = drive(
        ON_A_LINE | {"world": {"obstacles": walls}},
        recovery_actions=["clear", "wait"],
        wait_duration=0.5,
        number_of_retries=2,
    )
    assert log.outcome is Outcome.ABORTED
    # Nav2's codes of ComputePathThroughPoses are those of ComputePathToPose and 100.
    assert 300 <= log.info["error_code"] < 400
    assert log.info["reason"].startswith("pose 1 of 3: ")
    assert [leg["outcome"] for leg in log.info["legs"]] == ["aborted"]


def test_poses_in_collision_are_left_out_by_a_tree_that_says_so():
    # The robot's outline would touch it at (4, 0), and not beside it.
    wall = box([4.3, -0.2], [6.0, 0.2])
    way = {"goal": [8.0, 0.0, 0.0], "waypoints": [[1.5, 0.0, 0.0], [4.0, 0.0, 0.0]]}
    plan = {
        "node": "Sequence",
        "children": [
            {"node": "RemoveInCollisionGoals"},
            {"node": "RemovePassedGoals", "attributes": {"radius": "0.5"}},
            {"node": "ComputePathThroughPoses"},
        ],
    }
    rate = {"node": "RateController", "attributes": {"hz": "2.0"}, "children": [plan]}
    own = {"node": "PipelineSequence", "children": [rate, {"node": "FollowPath"}]}
    log = drive(way | {"world": {"obstacles": [wall]}}, through_poses_tree=own)
    assert log.outcome is Outcome.SUCCEEDED
    assert [leg["outcome"] for leg in log.info["legs"]] == ["succeeded", "aborted", "succeeded"]
    assert log.info["details"] == {"missed_waypoints": [2]}
    assert spl(log) == 0.0
    first, second, _ = legs_of(log)
    assert (second.start_s, second.duration_s) == (first.start_s + first.duration_s, 0.0)
