"""The leaves of the tree on a board that a test sets."""

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status
from scenes import straight_plan

from drake_navbench.navigation.behavior_tree.board import Board, TickInputs
from drake_navbench.navigation.behavior_tree.builder import build_tree
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.leaves import (
    COMPUTE_PATH,
    FOLLOW_PATH,
    REMAINING_PATH,
    SMOOTH_PATH,
    FollowPath,
    GlobalUpdatedGoal,
    GoalUpdated,
    IsGoalNearby,
    IsPathValid,
    RunBehavior,
    ValidatePath,
    WouldRecoveryHelp,
    nearest_index,
)
from drake_navbench.navigation.behavior_tree.planning_leaves import ComputePathToPose, SmoothPath
from drake_navbench.navigation.planner import NoValidPathCouldBeFound
from drake_navbench.navigation.smoother import SmoothingError
from drake_navbench.navigation.task import TaskState, TaskStatus


def plan_straight(start, goal, costmap):
    return straight_plan(goal[0], 0.1)


def smooth(path, costmap):
    """Moves a path by 1 m to the left; one that begins at x = 9 m is too hard."""
    if path[0, 0] == 9.0:
        raise SmoothingError("too hard")
    return path + np.array([0.0, 1.0, 0.0])


def board(path=None, **values) -> Board:
    made = Board(plan_straight, lambda path, costmap: True, smooth, lambda *_: 0)
    made.inputs = TickInputs(now_s=0.0, pose=np.zeros(3), global_costmap=None)
    made.write_path("path", path, goal_id=1, goal=np.array([6.0, 0.0, 0.0]), **values)
    return made


def see(shared: Board, **inputs) -> None:
    """Changes what the next tick sees."""
    shared.inputs = replace(shared.inputs, **inputs)


def tick(node) -> Status:
    node.tick_once()
    return node.status


def test_a_goal_is_new_at_first_and_when_it_changes():
    shared = board()
    node = GlobalUpdatedGoal("n", shared)
    assert [tick(node), tick(node)] == [Status.SUCCESS, Status.FAILURE]
    shared.write(goal_id=2)
    assert [tick(node), tick(node)] == [Status.SUCCESS, Status.FAILURE]


def test_a_goal_is_updated_only_while_the_node_is_active():
    shared = board()
    node = GoalUpdated("n", shared)
    assert tick(node) == Status.FAILURE
    shared.write(goal_id=2)
    assert tick(node) == Status.SUCCESS
    node.stop(Status.INVALID)
    shared.write(goal_id=3)
    assert tick(node) == Status.FAILURE


@pytest.mark.parametrize(
    ("x", "status"), [(1.9, Status.FAILURE), (2.1, Status.SUCCESS), (5.9, Status.SUCCESS)]
)
def test_the_goal_is_nearby_when_less_than_the_threshold_is_left_of_the_path(x, status):
    shared = board(path=straight_plan(6.0, 0.1))
    node = IsGoalNearby("n", shared, threshold_m=4.0, search_distance_m=10.0)
    see(shared, pose=np.array([x, 0.3, 0.0]))
    assert tick(node) == status


def test_the_robot_is_looked_for_from_where_it_was_last_found():
    # There and back again: 3 m out, 3 m home, 0.2 m to the side.
    out = straight_plan(3.0, 0.1)
    back = out[::-1] + np.array([0.0, 0.2, np.pi])
    shared = board(path=np.vstack([out, back]))
    node = IsGoalNearby("n", shared, threshold_m=4.0, search_distance_m=1.5)
    # 0.5 m from the start on the way out 5.7 m are left, on the way home only 0.5 m.
    see(shared, pose=np.array([0.5, 0.19, 0.0]))
    assert tick(node) == Status.FAILURE


def test_by_default_the_robot_is_looked_for_on_the_whole_path():
    out = straight_plan(3.0, 0.1)
    shared = board(path=np.vstack([out, out[::-1] + np.array([0.0, 0.2, np.pi])]))
    node = build_tree(NodeDescription(node="IsGoalNearby"), shared)
    see(shared, pose=np.array([0.5, 0.19, 0.0]))
    assert tick(node) == Status.SUCCESS
    see(shared, pose=np.array([0.5, 0.0, 0.0]))
    assert tick(node) == Status.FAILURE


def test_without_a_path_the_goal_is_not_nearby():
    node = IsGoalNearby("n", board(), threshold_m=4.0, search_distance_m=1.5)
    assert tick(node) == Status.FAILURE


def test_of_equally_near_poses_the_last_one_counts():
    path = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 0.0]])
    assert nearest_index(path, np.array([0.3, 0.0, 0.0])) == 3


def test_only_a_path_that_is_there_and_free_is_valid():
    shared = board()
    assert tick(ValidatePath("n", shared)) == Status.FAILURE
    shared.write_path(REMAINING_PATH, straight_plan(1.0, 0.1))
    assert tick(ValidatePath("n", shared)) == Status.SUCCESS
    shared.is_path_valid = lambda path, costmap, **limits: False
    assert tick(ValidatePath("n", shared)) == Status.FAILURE


@pytest.mark.parametrize(("node", "first_x"), [(ValidatePath, 0.0), (IsPathValid, 0.4)])
def test_before_lyrical_what_lies_behind_the_robot_is_not_checked(node, first_x):
    checked = []
    shared = board(path=straight_plan(1.0, 0.2))
    shared.inputs = replace(shared.inputs, pose=np.array([0.45, 0.1, 0.0]))
    shared.is_path_valid = lambda path, costmap, **limits: checked.append(path[0, 0]) is None
    assert tick(node("n", shared, source="path")) == Status.SUCCESS
    assert checked == [pytest.approx(first_x)]


def test_a_failed_plan_empties_the_path_and_keeps_the_code():
    shared = board(path=straight_plan(1.0, 0.1))

    def no_way(start, goal, costmap):
        raise NoValidPathCouldBeFound("no way")

    shared.make_plan = no_way
    assert tick(ComputePathToPose("n", shared)) == Status.FAILURE
    assert shared.values.path is None
    assert shared.values.results[COMPUTE_PATH].error_code == 208


@pytest.mark.parametrize(
    ("key", "code", "status"),
    [
        (FOLLOW_PATH, 106, Status.SUCCESS),
        (FOLLOW_PATH, 105, Status.SUCCESS),
        (FOLLOW_PATH, 104, Status.SUCCESS),
        (FOLLOW_PATH, 100, Status.SUCCESS),
        (FOLLOW_PATH, 103, Status.FAILURE),
        (FOLLOW_PATH, 107, Status.FAILURE),
        (COMPUTE_PATH, 208, Status.SUCCESS),
        (COMPUTE_PATH, 207, Status.SUCCESS),
        (COMPUTE_PATH, 206, Status.FAILURE),
        (COMPUTE_PATH, 0, Status.FAILURE),
        (SMOOTH_PATH, 504, Status.SUCCESS),
        (SMOOTH_PATH, 501, Status.FAILURE),
    ],
)
def test_a_recovery_helps_after_nav2s_recoverable_codes_only(key, code, status):
    shared = board()
    shared.write_result(key, TaskStatus(TaskState.ABORTED, code))
    assert tick(WouldRecoveryHelp("n", shared, key=key)) == status


def test_a_new_path_preempts_the_task_and_the_same_path_does_not():
    shared = board(path=straight_plan(6.0, 0.1), plan_count=1)
    node = FollowPath("n", shared)
    assert tick(node) == Status.RUNNING
    first = shared.values.follow_path
    assert tick(node) == Status.RUNNING
    assert shared.values.follow_path is first
    shared.write_path("path", straight_plan(6.0, 0.1), plan_count=2)
    tick(node)
    assert (shared.values.follow_path.task_id, shared.values.follow_path.plan_id) == (1, 2)


def test_the_status_of_an_older_task_is_not_the_present_ones():
    shared = board(path=straight_plan(6.0, 0.1), task_count=4)
    node = FollowPath("n", shared)
    see(shared, controller_status=TaskStatus(TaskState.ABORTED, 106, task_id=4))
    assert tick(node) == Status.RUNNING
    see(shared, controller_status=TaskStatus(TaskState.ABORTED, 106, task_id=5))
    assert tick(node) == Status.FAILURE
    assert shared.values.results[FOLLOW_PATH].error_code == 106


def test_halting_cancels_what_runs_at_a_server():
    shared = board(path=straight_plan(6.0, 0.1))
    follow = FollowPath("n", shared)
    spin = RunBehavior("n", shared, behavior="spin", arguments={"target_yaw": 1.0})
    for node in (follow, spin):
        tick(node)
        node.stop(Status.INVALID)
    assert shared.values.follow_path.cancel_requested
    assert shared.values.behavior.cancel_requested
    assert shared.values.behavior.task_id == 2


def test_a_path_is_smoothed_in_place_or_beside_itself():
    path = straight_plan(2.0, 0.1)
    shared = board(path=path)
    node = SmoothPath("n", shared, result="path")
    assert [tick(node), tick(node)] == [Status.SUCCESS, Status.SUCCESS]
    # Ticked again it is smoothed again, as in Nav2.
    assert shared.values.path[0].tolist() == [0.0, 2.0, 0.0]
    shared = board(path=path)
    node = SmoothPath("n", shared, result="mine")
    assert tick(node) == Status.SUCCESS
    first = shared.values.paths["mine"]
    assert (shared.values.path is path, first[0, 1]) == (True, 1.0)
    assert tick(node) == Status.SUCCESS
    assert shared.values.paths["mine"] is first


@pytest.mark.parametrize("path", [None, straight_plan(10.0, 1.0)[9:]])
def test_what_cannot_be_smoothed_is_a_failure(path):
    shared = board(path=path)
    assert tick(SmoothPath("n", shared, result="path")) == Status.FAILURE
    assert shared.values.results["smooth_path"].error_code == SmoothingError.code
    assert shared.values.path is path


def test_the_robot_follows_the_path_that_the_tree_names():
    path = straight_plan(2.0, 0.1)
    shared = board(path=path)
    SmoothPath("n", shared, result="mine").tick_once()
    assert tick(FollowPath("n", shared, source="mine")) == Status.RUNNING
    assert shared.values.follow_path.poses is shared.values.paths["mine"]
    assert tick(FollowPath("n", shared)) == Status.RUNNING
    assert shared.values.follow_path.poses is path


def test_a_path_that_is_cut_anew_is_a_new_plan_only_where_it_changed():
    shared = board(path=straight_plan(6.0, 0.1), plan_count=1)
    node = FollowPath("n", shared)
    tick(node)
    shared.write_path("path", straight_plan(6.0, 0.1))
    tick(node)
    assert shared.values.follow_path.plan_id == 1
    shared.write_path("path", straight_plan(5.0, 0.1))
    tick(node)
    assert (shared.values.follow_path.plan_id, shared.values.plan_count) == (2, 2)
    assert shared.values.follow_path.poses is shared.values.path
