"""Nav2's default tree navigate_to_pose_w_replanning_and_recovery, branch lyrical.

The selectors of plugins, which choose nothing here, are left out.
"""

from __future__ import annotations

from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.control_nodes import (
    FallbackNode,
    InverterNode,
    PipelineSequence,
    RateController,
    ReactiveFallbackNode,
    ReactiveSequenceNode,
    RecoveryNode,
    RoundRobinNode,
    SequenceNode,
    TreeNode,
)
from drake_navbench.navigation.behavior_tree.leaves import (
    COMPUTE_PATH,
    FOLLOW_PATH,
    ClearEntireCostmap,
    ComputePathToPose,
    FollowPath,
    GlobalUpdatedGoal,
    GoalUpdated,
    IsGoalNearby,
    RunBehavior,
    TruncatePathLocal,
    ValidatePath,
    WouldRecoveryHelp,
)
from drake_navbench.navigation.behavior_tree.settings import BehaviorTreeSettings

LOCAL = "clear_local"
GLOBAL = "clear_global"


def navigate_to_pose_tree(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the root of the tree; its leaves read and write `board`."""
    planning = RateController(
        "RateController",
        _compute_path(board, settings),
        hz=settings.hz,
        now_s=lambda: board.inputs.now_s,
    )
    navigate = PipelineSequence("NavigateWithReplanning", [planning, _follow_path(board)])
    recover = SequenceNode(
        "Recovery",
        [
            FallbackNode(
                "WouldARecoveryHelp",
                [
                    WouldRecoveryHelp("WouldAControllerRecoveryHelp", board, key=FOLLOW_PATH),
                    WouldRecoveryHelp("WouldAPlannerRecoveryHelp", board, key=COMPUTE_PATH),
                ],
            ),
            ReactiveFallbackNode(
                "RecoveryFallback",
                [GoalUpdated("GoalUpdated", board), _recovery_actions(board, settings)],
            ),
        ],
    )
    return RecoveryNode(
        "NavigateRecovery", [navigate, recover], number_of_retries=settings.number_of_retries
    )


def _compute_path(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the branch that keeps the path while it is short and valid, or plans anew."""
    keep = ReactiveSequenceNode(
        "CheckIfNewPathNeeded",
        [
            InverterNode("Inverter", [GlobalUpdatedGoal("GlobalUpdatedGoal", board)]),
            IsGoalNearby(
                "IsGoalNearby",
                board,
                threshold_m=settings.proximity_threshold,
                search_distance_m=settings.max_robot_pose_search_dist,
            ),
            TruncatePathLocal("TruncatePathLocal", board),
            ValidatePath("ValidatePath", board),
        ],
    )
    plan = FallbackNode(
        "FallbackComputePathToPose", [keep, ComputePathToPose("ComputePathToPose", board)]
    )
    clear = SequenceNode(
        "PlannerContext",
        [
            WouldRecoveryHelp("WouldAPlannerRecoveryHelp-Context", board, key=COMPUTE_PATH),
            ClearEntireCostmap("ClearGlobalCostmap-Context", board, field=GLOBAL),
        ],
    )
    return RecoveryNode("ComputePathRecovery", [plan, clear], number_of_retries=1)


def _follow_path(board: Board) -> TreeNode:
    """Returns the branch that follows the path, with one more try on a cleared local costmap."""
    clear = SequenceNode(
        "ControllerContext",
        [
            WouldRecoveryHelp("WouldAControllerRecoveryHelp-Context", board, key=FOLLOW_PATH),
            ClearEntireCostmap("ClearLocalCostmap-Context", board, field=LOCAL),
        ],
    )
    return RecoveryNode(
        "FollowPathRecovery", [FollowPath("FollowPath", board), clear], number_of_retries=1
    )


def _recovery_actions(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    allowance = {"time_allowance": settings.time_allowance}
    backup = {"target_x": settings.backup_dist, "speed": settings.backup_speed} | allowance
    actions = {
        "clear": lambda: SequenceNode(
            "ClearingActions",
            [
                ClearEntireCostmap("ClearLocalCostmap-Subtree", board, field=LOCAL),
                ClearEntireCostmap("ClearGlobalCostmap-Subtree", board, field=GLOBAL),
            ],
        ),
        "spin": lambda: RunBehavior(
            "Spin",
            board,
            behavior="spin",
            arguments={"target_yaw": settings.spin_dist} | allowance,
        ),
        "wait": lambda: RunBehavior(
            "Wait", board, behavior="wait", arguments={"time": settings.wait_duration}
        ),
        "backup": lambda: RunBehavior("BackUp", board, behavior="backup", arguments=backup),
    }
    return RoundRobinNode(
        "RecoveryActions",
        [actions[name]() for name in settings.recovery_actions],
        wrap_around=settings.wrap_around,
    )
