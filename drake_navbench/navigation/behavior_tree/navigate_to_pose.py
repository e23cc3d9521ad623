"""Nav2's default tree navigate_to_pose_w_replanning_and_recovery, of every release from humble on.

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
    navigate = PipelineSequence("NavigateWithReplanning", [planning, _follow_path(board, settings)])
    return RecoveryNode(
        "NavigateRecovery",
        [navigate, _recover(board, settings)],
        number_of_retries=settings.number_of_retries,
    )


def _recover(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the branch that tries one recovery after another."""
    actions = ReactiveFallbackNode(
        "RecoveryFallback", [GoalUpdated("GoalUpdated", board), _recovery_actions(board, settings)]
    )
    if not settings.heeds_error_codes:
        return actions
    would_help = FallbackNode(
        "WouldARecoveryHelp",
        [
            WouldRecoveryHelp("WouldAControllerRecoveryHelp", board, key=FOLLOW_PATH),
            WouldRecoveryHelp("WouldAPlannerRecoveryHelp", board, key=COMPUTE_PATH),
        ],
    )
    return SequenceNode("Recovery", [would_help, actions])


def _compute_path(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the branch that plans, with one more try on a cleared global costmap."""
    plan: TreeNode = ComputePathToPose("ComputePathToPose", board)
    if settings.keeps_valid_path:
        plan = FallbackNode("FallbackComputePathToPose", [_keep_path(board, settings), plan])
    clear: TreeNode = ClearEntireCostmap("ClearGlobalCostmap-Context", board, field=GLOBAL)
    if settings.heeds_error_codes:
        would_help = WouldRecoveryHelp("WouldAPlannerRecoveryHelp-Context", board, key=COMPUTE_PATH)
        clear = SequenceNode("PlannerContext", [would_help, clear])
    return RecoveryNode("ComputePathRecovery", [plan, clear], number_of_retries=1)


def _keep_path(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the condition that the path is short, of this goal, and valid."""
    return ReactiveSequenceNode(
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


def _follow_path(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the branch that follows the path, with one more try on a cleared local costmap."""
    clear: TreeNode = ClearEntireCostmap("ClearLocalCostmap-Context", board, field=LOCAL)
    if settings.heeds_error_codes:
        would_help = WouldRecoveryHelp(
            "WouldAControllerRecoveryHelp-Context", board, key=FOLLOW_PATH
        )
        clear = SequenceNode("ControllerContext", [would_help, clear])
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
