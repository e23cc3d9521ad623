"""The factories of a behaviour tree's nodes, by Nav2's names.

Attributes have the names and defaults of Nav2's nodes. Source: nav2_behavior_tree, branches humble
to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from py_trees.common import Status

from drake_navbench.kernels.grid import LETHAL
from drake_navbench.navigation.behavior_tree.board import GOAL, GOALS, Board
from drake_navbench.navigation.behavior_tree.conditions import (
    AlwaysEnds,
    DistanceTraveled,
    PathExpiringTimer,
    TimeExpired,
)
from drake_navbench.navigation.behavior_tree.control_nodes import (
    FallbackNode,
    InverterNode,
    NonblockingSequence,
    PipelineSequence,
    ReactiveFallbackNode,
    ReactiveSequenceNode,
    RecoveryNode,
    RoundRobinNode,
    SequenceNode,
)
from drake_navbench.navigation.behavior_tree.decorators import (
    FOR_EVER,
    ForceFailure,
    ForceSuccess,
    GoalUpdater,
    KeepRunningUntilFailure,
    Repeat,
    RetryUntilSuccessful,
    SequenceStar,
    SequenceWithMemory,
)
from drake_navbench.navigation.behavior_tree.leaves import (
    COMPUTE_PATH,
    FOLLOW_PATH,
    SMOOTH_PATH,
    CancelControl,
    ClearEntireCostmap,
    FollowPath,
    GlobalUpdatedGoal,
    GoalUpdated,
    IsGoalNearby,
    IsPathValid,
    RunBehavior,
    ValidatePath,
    WouldRecoveryHelp,
)
from drake_navbench.navigation.behavior_tree.node_attributes import Attributes, NodeKind
from drake_navbench.navigation.behavior_tree.pacing import (
    ODOMETRY_WINDOW_S,
    DistanceController,
    GoalUpdatedController,
    PathLongerOnApproach,
    RateController,
    SingleTrigger,
    SpeedController,
)
from drake_navbench.navigation.behavior_tree.path_leaves import (
    ConcatenatePaths,
    TruncatePath,
    TruncatePathLocal,
)
from drake_navbench.navigation.behavior_tree.planning_leaves import (
    ComputePathLeaf,
    ComputePathThroughPoses,
    ComputePathToPose,
    SmoothPath,
)
from drake_navbench.navigation.behavior_tree.pose_node_kinds import POSE_NODE_KINDS
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode
from drake_navbench.plugins.releases import Release

COSTMAPS = ("local", "global")


def _recovery(name: str, a: Attributes, children: Sequence[TreeNode], _: Board) -> TreeNode:
    return RecoveryNode(name, children, number_of_retries=a.count("number_of_retries", 1))


def _rate(name: str, a: Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    hz = a.number("hz", 10.0)
    if hz <= 0.0:
        raise a.fault(f"hz: expected a number above 0, got {hz:g}")
    return RateController(name, children[0], hz=hz, now_s=lambda: board.inputs.now_s)


def _goal_updated_controller(
    name: str, _: Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    return GoalUpdatedController(name, children[0], goal_id=lambda: board.values.goal_id)


def _distance_controller(
    name: str, a: Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    distance_m = a.number("distance", 1.0)
    return DistanceController(name, children[0], board, distance_m=distance_m)


def _speed_controller(
    name: str, a: Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    rates_hz = a.number("min_rate", 0.1), a.number("max_rate", 1.0)
    speeds_mps = a.number("min_speed", 0.0), a.number("max_speed", 0.5)
    if min(rates_hz) <= 0.0:
        raise a.fault(f"min_rate and max_rate: expected rates above 0, got {rates_hz}")
    if speeds_mps[0] == speeds_mps[1]:
        raise a.fault(f"min_speed and max_speed: expected two speeds, got {speeds_mps[0]:g} twice")
    return SpeedController(
        name,
        children[0],
        board,
        rates_hz=rates_hz,
        speeds_mps=speeds_mps,
        window_s=a.number("filter_duration", ODOMETRY_WINDOW_S),
    )


def _path_longer(name: str, a: Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    near_m, factor = a.number("prox_len", 3.0), a.number("length_factor", 2.0)
    return PathLongerOnApproach(
        name, children[0], board, near_m=near_m, factor=factor, source=a.source("path")
    )


def _goal_updater(name: str, a: Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    goal = ("", "")
    if a.has("output_goal"):
        goal = a.source("input_goal", GOAL, is_needed=True), a.result("output_goal", GOAL)
    goals = ("", "")
    if a.has("output_goals"):
        goals = a.source("input_goals", GOALS, is_needed=True), a.result("output_goals", GOALS)
    for attribute in ("input_goal", "input_goals"):
        a.text(attribute)
    return GoalUpdater(name, children[0], board, goal=goal, goals=goals)


def _again(node: Callable[..., TreeNode], attribute: str) -> NodeKind:
    """Returns the factory of a node that ticks its child again.

    attribute: the name of the limit's attribute.
    """

    def make(name: str, a: Attributes, children: Sequence[TreeNode], _: Board) -> TreeNode:
        limit = a.count(attribute, 0)
        if limit < FOR_EVER or limit == 0:
            raise a.fault(f"{attribute}: expected -1 or at least 1, got {limit}")
        return node(name, children[0], limit=limit)

    return NodeKind(make, 1)


def _time_expired(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return TimeExpired(name, board, period_s=a.number("seconds", 1.0))


def _path_expired(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    period_s = a.number("seconds", 1.0)
    return PathExpiringTimer(name, board, period_s=period_s, source=a.source("path"))


def _distance_traveled(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return DistanceTraveled(name, board, distance_m=a.number("distance", 1.0))


def _always(result: Status) -> NodeKind:
    return NodeKind(lambda name, a, _, board: AlwaysEnds(name, result))


def _round_robin(name: str, a: Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    # Before Lyrical the node always wraps around.
    wraps = a.flag("wrap_around", board.release < Release.LYRICAL)
    return RoundRobinNode(name, children, wrap_around=wraps)


def _is_goal_nearby(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    threshold_m = a.number("proximity_threshold", 1.0)
    search_distance_m = a.number("max_robot_pose_search_dist", -1.0)
    if search_distance_m < 0.0:
        search_distance_m = math.inf
    return IsGoalNearby(
        name,
        board,
        threshold_m=threshold_m,
        search_distance_m=search_distance_m,
        source=a.source("path"),
    )


def _truncate(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return TruncatePath(
        name,
        board,
        distance_m=a.number("distance", 1.0),
        source=a.source("input_path"),
        result=a.result("output_path"),
    )


def _truncate_local(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    for attribute in ("robot_frame", "transform_tolerance"):
        a.text(attribute)
    return TruncatePathLocal(
        name,
        board,
        forward_m=a.number("distance_forward", 8.0),
        backward_m=a.number("distance_backward", 4.0),
        angle_weight_m=a.number("angular_distance_weight", 0.0),
        search_distance_m=a.number("max_robot_pose_search_dist", math.inf),
        source=a.source("input_path"),
        result=a.result("output_path"),
    )


def _compute_path(node: type[ComputePathLeaf], attribute: str, variable: str) -> NodeKind:
    """Returns the factory of a node that plans; attribute: the name of its goal's, or goals'."""

    def make(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
        # A start that no node writes is the robot's pose.
        start = a.optional_source("start")
        if not a.flag("use_start", True):
            start = ""
        goal = a.source(attribute, variable, is_needed=True)
        return node(name, board, goal=goal, start=start, result=a.result("path"))

    return NodeKind(make)


def _concatenate(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    one, other = (a.source(path, path, is_needed=True) for path in ("input_path1", "input_path2"))
    return ConcatenatePaths(name, board, sources=(one, other), result=a.result("output_path"))


def _answer(result: Status, *attributes: str) -> NodeKind:
    """Returns the factory of a condition whose answer never changes here; see `docs/nav2_files.md`.

    attributes: the names of those that have no effect.
    """

    def make(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
        for attribute in attributes:
            a.text(attribute)
        return AlwaysEnds(name, result)

    return NodeKind(make)


def _smooth(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    if a.flag("check_for_collisions", False):
        raise a.fault("check_for_collisions: a smoothed path is not checked here")
    source, result = a.source("unsmoothed_path"), a.result("smoothed_path")
    return SmoothPath(name, board, source=source, result=result)


def _follow(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    a.text("goal")
    return FollowPath(name, board, source=a.source("path"))


def _validate(node: type[ValidatePath]) -> NodeKind:
    def make(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
        return node(
            name,
            board,
            source=a.source("path"),
            max_cost=a.count("max_cost", LETHAL),
            consider_unknown_as_obstacle=a.flag("consider_unknown_as_obstacle", False),
        )

    return NodeKind(make)


def _clear(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    service = a.text("service_name")
    for costmap in COSTMAPS:
        if f"{costmap}_costmap" in service:
            return ClearEntireCostmap(name, board, field=f"clear_{costmap}")
    raise a.fault(f"service_name: expected the local or the global costmap's, got {service!r}")


def _would_help(key: str) -> NodeKind:
    return NodeKind(lambda name, a, _, board: WouldRecoveryHelp(name, board, key=key))


def _behavior(behavior: str, names: Mapping[str, tuple[str, float]]) -> NodeKind:
    """Returns the factory of a node that runs a behaviour.

    names: maps its attributes to (our argument, default).
    """

    def make(name: str, a: Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
        arguments = {ours: a.number(theirs, default) for theirs, (ours, default) in names.items()}
        if a.flag("disable_collision_checks", False):
            raise a.fault("disable_collision_checks: collisions are always checked")
        return RunBehavior(name, board, behavior=behavior, arguments=arguments)

    return NodeKind(make)


def _plain(node: Callable[[str, Sequence[TreeNode]], TreeNode], children: int | None) -> NodeKind:
    return NodeKind(lambda name, a, below, board: node(name, below), children)


def _leaf(node: Callable[[str, Board], TreeNode]) -> NodeKind:
    return NodeKind(lambda name, a, below, board: node(name, board))


_ALLOWANCE = {"time_allowance": ("time_allowance", 10.0)}
NODE_KINDS: Mapping[str, NodeKind] = {
    **POSE_NODE_KINDS,
    "Sequence": _plain(SequenceNode, None),
    "Fallback": _plain(FallbackNode, None),
    "ReactiveSequence": _plain(ReactiveSequenceNode, None),
    "ReactiveFallback": _plain(ReactiveFallbackNode, None),
    "PipelineSequence": _plain(PipelineSequence, None),
    "NonblockingSequence": _plain(NonblockingSequence, None),
    "Inverter": _plain(InverterNode, 1),
    "RecoveryNode": NodeKind(_recovery, 2),
    "RoundRobin": NodeKind(_round_robin, None),
    "RateController": NodeKind(_rate, 1),
    "DistanceController": NodeKind(_distance_controller, 1),
    "SpeedController": NodeKind(_speed_controller, 1),
    "SingleTrigger": NodeKind(lambda name, a, below, board: SingleTrigger(name, below[0]), 1),
    "PathLongerOnApproach": NodeKind(_path_longer, 1),
    "GoalUpdater": NodeKind(_goal_updater, 1),
    "KeepRunningUntilFailure": _plain(KeepRunningUntilFailure, 1),
    "ForceSuccess": _plain(ForceSuccess, 1),
    "ForceFailure": _plain(ForceFailure, 1),
    "Repeat": _again(Repeat, "num_cycles"),
    "RetryUntilSuccessful": _again(RetryUntilSuccessful, "num_attempts"),
    "SequenceWithMemory": _plain(SequenceWithMemory, None),
    "SequenceStar": _plain(SequenceStar, None),
    "AlwaysSuccess": _always(Status.SUCCESS),
    "AlwaysFailure": _always(Status.FAILURE),
    "TimeExpired": NodeKind(_time_expired),
    "PathExpiringTimer": NodeKind(_path_expired),
    "DistanceTraveled": NodeKind(_distance_traveled),
    "GoalUpdatedController": NodeKind(_goal_updated_controller, 1),
    "ComputePathToPose": _compute_path(ComputePathToPose, "goal", GOAL),
    "ComputePathThroughPoses": _compute_path(ComputePathThroughPoses, "goals", GOALS),
    "ConcatenatePaths": NodeKind(_concatenate),
    # The robot is localized, and all frames are there, from the start of a trial on.
    "InitialPoseReceived": _answer(Status.SUCCESS, "initial_pose_received"),
    "TransformAvailable": _answer(Status.SUCCESS, "child", "parent"),
    # No battery reports its charge, and then Nav2's answer is no.
    "IsBatteryLow": _answer(Status.FAILURE, "min_battery", "battery_topic", "is_voltage"),
    "IsBatteryCharging": _answer(Status.FAILURE, "battery_topic"),
    "SmoothPath": NodeKind(_smooth),
    "FollowPath": NodeKind(_follow),
    "CancelControl": _leaf(CancelControl),
    "GoalUpdated": _leaf(GoalUpdated),
    "GlobalUpdatedGoal": _leaf(GlobalUpdatedGoal),
    "IsGoalNearby": NodeKind(_is_goal_nearby),
    "TruncatePath": NodeKind(_truncate),
    "TruncatePathLocal": NodeKind(_truncate_local),
    "ValidatePath": _validate(ValidatePath),
    "IsPathValid": _validate(IsPathValid),
    "ClearEntireCostmap": NodeKind(_clear),
    "WouldAPlannerRecoveryHelp": _would_help(COMPUTE_PATH),
    "WouldAControllerRecoveryHelp": _would_help(FOLLOW_PATH),
    "WouldASmootherRecoveryHelp": _would_help(SMOOTH_PATH),
    "Spin": _behavior("spin", {"spin_dist": ("target_yaw", 1.57)} | _ALLOWANCE),
    "Wait": _behavior("wait", {"wait_duration": ("time", 1.0)}),
    "DriveOnHeading": _behavior(
        "drive_on_heading",
        {"dist_to_travel": ("target_x", 0.15), "speed": ("speed", 0.025)} | _ALLOWANCE,
    ),
    "BackUp": _behavior(
        "backup",
        {"backup_dist": ("target_x", 0.15), "backup_speed": ("speed", 0.025)} | _ALLOWANCE,
    ),
}
