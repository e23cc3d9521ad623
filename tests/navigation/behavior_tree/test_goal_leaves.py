"""The leaves that plan through a list of goals and change it, on a board that a test sets."""

import numpy as np
import pytest
from py_trees.common import Status

from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.navigation.behavior_tree.board import GOALS, Board, TickInputs
from drake_navbench.navigation.behavior_tree.conditions import AlwaysEnds, ArePosesNear
from drake_navbench.navigation.behavior_tree.decorators import GoalUpdater
from drake_navbench.navigation.behavior_tree.goal_leaves import (
    AppendGoalPoseToGoals,
    GetCurrentPose,
    GetNextFewGoals,
    GetPoseFromPath,
    GoalLists,
    RemoveInCollisionGoals,
    RemovePassedGoals,
)
from drake_navbench.navigation.behavior_tree.leaves import (
    COMPUTE_PATH,
    GoalUpdated,
    WouldRecoveryHelp,
)
from drake_navbench.navigation.behavior_tree.planning_leaves import ComputePathThroughPoses
from drake_navbench.navigation.planner import NoValidPathCouldBeFound
from drake_navbench.navigation.task import PoseState, TaskPose
from drake_navbench.plugins.releases import Release

POSES = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]])


def straight(start, goal, costmap):
    """A plan of three poses; behind x = 5 m there is none."""
    if goal[0] > 5.0:
        raise NoValidPathCouldBeFound("behind the wall")
    return np.linspace(start, goal, 3)


def board(robot_x_m=0.0, costs=(), release=Release.LYRICAL, goals=POSES) -> Board:
    """Returns a board with goals; costs: those of the goals, in order of x."""
    of_goal = dict(zip(goals[:, 0], costs, strict=False))
    made = Board(
        straight,
        lambda *_: True,
        lambda path, _: path,
        lambda pose, *_: of_goal[pose[0]],
        release,
    )
    pose = np.array([robot_x_m, 0.0, 0.0])
    made.inputs = TickInputs(now_s=0.0, pose=pose, global_costmap=None)
    made.write_goals(GOALS, goals)
    made.write(task_poses=tuple(TaskPose(tuple(goal)) for goal in goals))
    return made


def tick(node) -> Status:
    node.tick_once()
    return node.status


def states(shared: Board) -> str:
    return "".join(pose.state.name[0] for pose in shared.values.task_poses)


@pytest.mark.parametrize(
    ("robot_x_m", "left"),
    [
        (0.2, 3),
        (0.5, 2),  # Exactly at the radius counts.
        (1.5, 1),  # Two poses in one tick.
        (2.0, 3),  # The first is too far behind, which stays, as in Nav2.
        (9.0, 3),
    ],
)
def test_poses_within_the_radius_are_passed_in_order(robot_x_m, left):
    shared = board(robot_x_m)
    assert tick(RemovePassedGoals("n", shared, GoalLists(), radius_m=0.5)) is Status.SUCCESS
    np.testing.assert_array_equal(shared.goals(GOALS), POSES[3 - left :])
    passed = [pose.state is PoseState.PASSED for pose in shared.values.task_poses]
    assert passed == [index < 3 - left for index in range(3)]


def test_the_last_pose_stays_however_near_it_is():
    shared = board(1.0, goals=POSES[:1])
    assert tick(RemovePassedGoals("n", shared, GoalLists(), radius_m=0.5)) is Status.SUCCESS
    assert len(shared.goals(GOALS)) == 1


def test_a_goal_that_is_no_pose_of_the_task_fails_a_tree_that_hands_the_statuses_on():
    lists = GoalLists(needs_statuses=True)
    shared = board(1.0)
    shared.write(task_poses=())
    assert tick(RemovePassedGoals("n", shared, lists, radius_m=0.5)) is Status.FAILURE
    assert tick(RemovePassedGoals("n", shared, GoalLists(), radius_m=0.5)) is Status.SUCCESS


def test_a_leaf_that_fails_at_the_second_goal_leaves_the_first_one_pending():
    lists = GoalLists(needs_statuses=True)
    shared = board(1.5, costs=(LETHAL,) * 3)
    shared.write(task_poses=(TaskPose(tuple(POSES[0])), TaskPose((9.0, 9.0, 0.0))))
    blocked = {"cost_threshold": 254.0, "uses_outline": False, "unknown_blocks": False}
    for leaf in (
        RemovePassedGoals("n", shared, lists, radius_m=0.5),
        RemoveInCollisionGoals("n", shared, lists, **blocked),
    ):
        assert tick(leaf) is Status.FAILURE
        assert {pose.state for pose in shared.values.task_poses} == {PoseState.PENDING}
        assert len(shared.goals(GOALS)) == 3


@pytest.mark.parametrize(
    ("costs", "more", "left"),
    [
        ((0, LETHAL, 0), {}, [0, 2]),
        ((0, INSCRIBED, 0), {}, [0, 1, 2]),
        ((0, INSCRIBED, 0), {"cost_threshold": 253.0}, [0, 2]),
        ((0, NO_INFORMATION, 0), {}, [0, 1, 2]),
        ((0, NO_INFORMATION, 0), {"unknown_blocks": True}, [0, 2]),
        ((LETHAL,) * 3, {}, []),
    ],
)
def test_goals_in_collision_are_taken_out(costs, more, left):
    shared = board(costs=costs)
    limits = {"cost_threshold": 254.0, "uses_outline": True, "unknown_blocks": False} | more
    assert tick(RemoveInCollisionGoals("n", shared, GoalLists(), **limits)) is Status.SUCCESS
    np.testing.assert_array_equal(shared.goals(GOALS), POSES[left])
    assert states(shared).count("S") == 3 - len(left)


def test_a_goal_off_the_map_keeps_all_goals_and_fails():
    shared = board(costs=(0, LETHAL, None))
    limits = {"cost_threshold": 254.0, "uses_outline": False, "unknown_blocks": False}
    assert tick(RemoveInCollisionGoals("n", shared, GoalLists(), **limits)) is Status.FAILURE
    assert len(shared.goals(GOALS)) == 3


@pytest.mark.parametrize(
    ("release", "x_m"),
    [
        (Release.LYRICAL, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]),
        (Release.JAZZY, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]),
        (Release.IRON, [0.0, 0.5, 1.0, 1.0, 1.5, 2.0, 2.0, 2.5, 3.0]),
    ],
)
def test_the_plans_from_pose_to_pose_are_joined_as_in_the_release(release, x_m):
    shared = board(release=release)
    assert tick(ComputePathThroughPoses("n", shared)) is Status.SUCCESS
    np.testing.assert_allclose(shared.values.path[:, 0], x_m)


@pytest.mark.parametrize(
    ("goals", "code", "helps"),
    [
        (np.array([[1.0, 0.0, 0.0], [6.0, 0.0, 0.0]]), 308, True),
        (np.empty((0, 3)), 309, False),
    ],
)
def test_a_pose_without_a_plan_empties_the_path_with_a_code_of_its_own(goals, code, helps):
    shared = board(goals=goals)
    assert tick(ComputePathThroughPoses("n", shared)) is Status.FAILURE
    assert shared.values.path is None
    assert shared.values.results[COMPUTE_PATH].error_code == code
    would_help = WouldRecoveryHelp("n", shared, key=COMPUTE_PATH)
    assert tick(would_help) is (Status.SUCCESS if helps else Status.FAILURE)


def test_irons_planner_recovery_does_not_know_these_codes():
    shared = board(release=Release.IRON, goals=np.array([[6.0, 0.0, 0.0]]))
    tick(ComputePathThroughPoses("n", shared))
    assert tick(WouldRecoveryHelp("n", shared, key=COMPUTE_PATH)) is Status.FAILURE


def test_a_shorter_list_is_a_new_goal_and_an_equal_one_is_none():
    shared = board(0.2)
    updated = GoalUpdated("n", shared)
    assert tick(updated) is Status.FAILURE
    remove = RemovePassedGoals("n", shared, GoalLists(), radius_m=0.5)
    tick(remove)
    assert tick(updated) is Status.FAILURE
    shared.inputs = TickInputs(now_s=0.0, pose=POSES[0], global_costmap=None)
    tick(remove)
    assert tick(updated) is Status.SUCCESS


def test_lists_grow_and_are_cut_under_other_names():
    shared = board()
    shared.write_pose("dock", np.array([9.0, 9.0, 0.0]))
    lists = GoalLists(GOALS, "longer")
    assert tick(AppendGoalPoseToGoals("n", shared, lists, pose="dock")) is Status.SUCCESS
    assert shared.goals("longer")[:, 0].tolist() == [1.0, 2.0, 3.0, 9.0]
    assert tick(GetNextFewGoals("n", shared, GoalLists("longer", "few"), count=2)) is Status.SUCCESS
    assert shared.goals("few")[:, 0].tolist() == [1.0, 2.0]
    assert tick(GetNextFewGoals("n", shared, GoalLists("none", "few"), count=2)) is Status.FAILURE


def test_the_robots_pose_and_a_pose_of_a_path_are_written_and_compared():
    shared = board(0.4)
    shared.write_path("path", POSES)
    assert tick(GetCurrentPose("n", shared, result="here")) is Status.SUCCESS
    first = GetPoseFromPath("n", shared, index=0, source="path", result="there")
    assert tick(first) is Status.SUCCESS
    # Nav2 compares squares.
    for tolerance_m, expected in (
        (0.6, Status.SUCCESS),
        (-0.6, Status.SUCCESS),
        (0.5, Status.FAILURE),
    ):
        near = ArePosesNear("n", shared, poses=("here", "there"), tolerance_m=tolerance_m)
        assert tick(near) is expected
    last = GetPoseFromPath("n", shared, index=-1, source="path", result="there")
    assert tick(last) is Status.SUCCESS
    assert shared.pose("there")[0] == 3.0
    unwritten = ArePosesNear("n", shared, poses=("here", "nowhere"), tolerance_m=9.0)
    assert tick(unwritten) is Status.FAILURE


def test_poses_as_far_apart_as_the_tolerance_are_near_if_their_squares_say_so():
    shared = board()
    shared.write_pose("here", np.zeros(3))
    # 0.20^2 + 0.21^2 is 0.29^2, but more by the last bit in double precision.
    shared.write_pose("there", np.array([0.2, 0.21, 0.0]))
    for tolerance_m, expected in ((0.29, Status.FAILURE), (0.2901, Status.SUCCESS)):
        near = ArePosesNear("n", shared, poses=("here", "there"), tolerance_m=tolerance_m)
        assert tick(near) is expected


@pytest.mark.parametrize("index", [3, -4])
def test_a_pose_beyond_a_path_is_none(index):
    shared = board()
    shared.write_path("path", POSES)
    node = GetPoseFromPath("n", shared, index=index, source="path", result="there")
    assert tick(node) is Status.FAILURE
    assert tick(GetPoseFromPath("n", shared, index=0, source="no", result="to")) is Status.FAILURE


def test_a_plan_begins_at_the_pose_that_is_given_once_it_is_written():
    shared = board()
    node = ComputePathThroughPoses("n", shared, start="dock")
    tick(node)
    assert shared.values.path[0, 0] == 0.0
    shared.write_pose("dock", np.array([0.5, 0.0, 0.0]))
    tick(node)
    assert shared.values.path[0, 0] == 0.5


def test_the_goal_updater_copies_goals_that_nobody_changes():
    shared = board()
    child = AlwaysEnds("n", Status.SUCCESS)
    assert tick(GoalUpdater("n", child, shared, goals=(GOALS, "kept"))) is Status.SUCCESS
    np.testing.assert_array_equal(shared.goals("kept"), POSES)
