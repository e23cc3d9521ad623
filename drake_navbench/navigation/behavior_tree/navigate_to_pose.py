"""Nav2's default tree navigate_to_pose_w_replanning_and_recovery, of every release from humble on.

The selectors of plugins, which choose nothing here, are left out.
"""

from __future__ import annotations

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.control_nodes import (
    ControlNode,
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
    Leaf,
    RunBehavior,
    ValidatePath,
    WouldRecoveryHelp,
)
from drake_navbench.navigation.behavior_tree.path_leaves import TruncatePathLocal
from drake_navbench.navigation.behavior_tree.settings import TREE_NODES, BehaviorTreeSettings
from drake_navbench.navigation.behavior_tree.snapshot import nodes_of

LOCAL = "clear_local"
GLOBAL = "clear_global"


def navigate_to_pose_tree(board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    """Returns the root of the tree; its leaves read and write `board`.

    Raises InputError where a node that is not ours cannot be made, or has no place.
    """
    planning = RateController(
        "RateController",
        _compute_path(board, settings),
        hz=settings.hz,
        now_s=lambda: board.inputs.now_s,
    )
    navigate = PipelineSequence("NavigateWithReplanning", [planning, _follow_path(board, settings)])
    root = RecoveryNode(
        "NavigateRecovery",
        [navigate, _recover(board, settings)],
        number_of_retries=settings.number_of_retries,
    )
    replace_leaves(root, board, settings)
    return root


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


def replace_leaves(root: TreeNode, board: Board, settings: BehaviorTreeSettings) -> None:
    """Puts the nodes that are not built in into the places of the leaves of their names.

    Raises InputError where there is no such leaf.
    """
    leaves = {node.name: node for node in nodes_of(root) if isinstance(node, Leaf)}
    for name in settings.plugin_blocks:
        if name in settings.recovery_actions:
            continue
        if name not in leaves:
            raise InputError(
                f"navigation.behavior_tree.{name}: found no place for it, expected a name in "
                f"recovery_actions or that of a leaf{nearest_name_hint(name, leaves)}"
            )
        parent = leaves[name].parent
        assert isinstance(parent, ControlNode)  # Every leaf has one.
        parent.replace_child(leaves[name], _plugin_node(name, board, settings))


def _plugin_node(name: str, board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    parameters = settings.plugin_blocks[name]
    return TREE_NODES.make(parameters.plugin, name, board, parameters)


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

    def action(name: str) -> TreeNode:
        if name in settings.plugin_blocks:
            return _plugin_node(name, board, settings)
        if name in actions:
            return actions[name]()
        return RunBehavior(name, board, behavior=name, arguments=allowance)

    return RoundRobinNode(
        "RecoveryActions",
        [action(name) for name in settings.recovery_actions],
        wrap_around=settings.wrap_around,
    )
