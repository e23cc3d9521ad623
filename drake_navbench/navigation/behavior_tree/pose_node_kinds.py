"""The factories of the nodes that deal with poses and lists of goals, by Nav2's names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drake_navbench.kernels.grid import LETHAL
from drake_navbench.navigation.behavior_tree.board import GOAL, GOALS, Board
from drake_navbench.navigation.behavior_tree.conditions import ArePosesNear, GoalReached
from drake_navbench.navigation.behavior_tree.goal_leaves import (
    AppendGoalPoseToGoals,
    GetCurrentPose,
    GetNextFewGoals,
    GetPoseFromPath,
    GoalLists,
    RemoveInCollisionGoals,
    RemovePassedGoals,
)
from drake_navbench.navigation.behavior_tree.node_attributes import Attributes, NodeKind
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode


def _goal_lists(a: Attributes) -> GoalLists:
    """Returns the lists that a node reads and writes."""
    needs_statuses = a.has("input_waypoint_statuses")
    for attribute in ("input_waypoint_statuses", "output_waypoint_statuses"):
        a.text(attribute)
    source = a.source("input_goals", GOALS, is_needed=True)
    return GoalLists(source, a.result("output_goals", GOALS), needs_statuses)


def _remove_passed(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return RemovePassedGoals(name, board, _goal_lists(a), radius_m=a.number("radius", 0.5))


def _remove_blocked(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    a.text("service_name")
    return RemoveInCollisionGoals(
        name,
        board,
        _goal_lists(a),
        cost_threshold=a.number("cost_threshold", LETHAL),
        uses_outline=a.flag("use_footprint", True),
        unknown_blocks=a.flag("consider_unknown_as_obstacle", False),
    )


def _append_goal(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    pose = a.source("goal_pose", GOAL, is_needed=True)
    return AppendGoalPoseToGoals(name, board, _goal_lists(a), pose=pose)


def _current_pose(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return GetCurrentPose(name, board, result=a.result("current_pose", "current_pose"))


def _pose_from_path(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    index, source = a.count("index", 0), a.source("path")
    result = a.result("pose", "pose")
    return GetPoseFromPath(name, board, index=index, source=source, result=result)


def _poses_near(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    one, other = (a.source(pose, pose, is_needed=True) for pose in ("ref_pose", "target_pose"))
    return ArePosesNear(name, board, poses=(one, other), tolerance_m=a.number("tolerance", 0.5))


def _goal_reached(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    # In Nav2 a parameter of bt_navigator, which the reader of its file makes an attribute.
    tolerance_m = a.number("goal_reached_tol", 0.25)
    goal = a.source("goal", GOAL, is_needed=True)
    return GoalReached(name, board, goal=goal, tolerance_m=tolerance_m)


def _next_goals(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    count = a.count("num_goals", 0)
    if count < 1:
        raise a.fault(f"num_goals: expected at least 1, got {count}")
    return GetNextFewGoals(name, board, _goal_lists(a), count=count)


POSE_NODE_KINDS: Mapping[str, NodeKind] = {
    "RemovePassedGoals": NodeKind(_remove_passed),
    "RemoveInCollisionGoals": NodeKind(_remove_blocked),
    "AppendGoalPoseToGoals": NodeKind(_append_goal),
    "GetNextFewGoals": NodeKind(_next_goals),
    "GetCurrentPose": NodeKind(_current_pose),
    "GetPoseFromPath": NodeKind(_pose_from_path),
    "ArePosesNear": NodeKind(_poses_near),
    "GoalReached": NodeKind(_goal_reached),
}
