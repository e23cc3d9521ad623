"""Tasks and settings of the navigation stack that make no sense are refused."""

import numpy as np
import pytest
from navigation_scenes import box, scenario, simulate_stub

from drake_navbench.controller import Decision
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.task_check import check_task
from drake_navbench.logs.outcome import Outcome


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"navigation_mode": "navigate"},
            "navigation_mode: .*'navigate_to_pose' or 'navigate_through_poses'",
        ),
        (
            {"navigation_mode": "follow_path", "waypoints": [[1.0, 0.0, 0.0]]},
            "waypoints: expected navigation_mode navigate_to_pose",
        ),
        (
            {"plan": {"type": "polyline", "points": [[0.0, 0.0], [1.0, 0.0]]}},
            "plan must be of type planner, got polyline",
        ),
        ({"waypoints": [[1.0, 0.0]]}, r"waypoints\[0\]"),
    ],
)
def test_a_task_that_makes_no_sense_is_refused_in_one_line(fields, message):
    with pytest.raises(InputError, match=message) as caught:
        scenario(**fields)
    assert "\n" not in str(caught.value)


def test_a_waypoint_inside_an_obstacle_is_refused_by_its_number():
    task = scenario(
        waypoints=[[1.0, 0.0, 0.0], [2.1, 0.0, 0.0]],
        world={"obstacles": [box((2.0, -0.2), (2.4, 0.2))]},
    )
    with pytest.raises(InputError, match=r"waypoints\[1\]: \[2.1, 0.0\] lies inside an obstacle"):
        check_task(task, load_robot("wheelchair"))


@pytest.mark.parametrize(
    ("navigation", "message"),
    [
        ({"behavior_tree": {"recovery_actions": ["spinn"]}}, "unknown behaviour 'spinn'.*'spin'"),
        ({"behavior_tree": {"recovery_actions": []}}, "recovery_actions: .*at least 1 item"),
        ({"goal_checker": {"plugin": "nav2_controller::SimpleGoalCheck"}}, "did you mean"),
        (
            {"progress_checker": {"plugin": "nav2_controller::Pose"}},
            "progress_checker: unknown plugin",
        ),
        ({"behavior_server": {"backup": {"deceleration_limit": 2.5}}}, "backup.deceleration_limit"),
    ],
)
def test_settings_that_make_no_sense_are_refused_in_one_line(navigation, message):
    with pytest.raises(InputError, match=message) as caught:
        load_robot("wheelchair", {"navigation": navigation})
    assert "\n" not in str(caught.value)


def test_checkers_are_chosen_by_nav2s_plugin_type():
    never_stands = {
        "plugin": "nav2_controller::StoppedGoalChecker",
        "trans_stopped_velocity": 0.01,
    }
    task = scenario(
        goal=[0.1, 0.0, 0.0],
        navigation_mode="follow_path",
        timeout_s=1.0,
        robot_overrides={"navigation": {"goal_checker": never_stands}},
    )

    def rolls_slowly(observation, memory):
        return Decision(np.array([0.05, 0.0]), memory)

    # It starts at rest within the tolerance; a goal that it only rolls past is never reached.
    assert simulate_stub(rolls_slowly, task).outcome is Outcome.SUCCEEDED
    far = task.model_copy(update={"goal": (0.4, 0.0, 0.0), "timeout_s": 6.0})
    assert simulate_stub(rolls_slowly, far).outcome is Outcome.TIMED_OUT
    turning = {"progress_checker": {"plugin": "nav2_controller::PoseProgressChecker"}}
    task = scenario(
        navigation_mode="follow_path", timeout_s=12.0, robot_overrides={"navigation": turning}
    )
    log = simulate_stub(lambda o, m: Decision(np.array([0.0, 0.3]), m), task)
    assert log.outcome is Outcome.TIMED_OUT
