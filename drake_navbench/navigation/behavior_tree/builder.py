"""Builds a behaviour tree from its description, where all of its nodes are ours.

Attributes have the names and defaults of Nav2's nodes. What only names plugins, servers, topics or
variables has no effect: there is one planner, one controller a column, one path. The selectors of
plugins choose nothing and are left out. Source: nav2_behavior_tree, branches humble to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from py_trees.common import Status

from drake_navbench.errors import nearest_name_hint
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.conditions import (
    AlwaysEnds,
    DistanceTraveled,
    GoalReached,
    PathExpiringTimer,
    TimeExpired,
)
from drake_navbench.navigation.behavior_tree.control_nodes import (
    FallbackNode,
    GoalUpdatedController,
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
from drake_navbench.navigation.behavior_tree.decorators import (
    FOR_EVER,
    DistanceController,
    ForceFailure,
    ForceSuccess,
    KeepRunningUntilFailure,
    PassedOn,
    PathLongerOnApproach,
    Repeat,
    RetryUntilSuccessful,
    SequenceWithMemory,
    SingleTrigger,
    SpeedController,
)
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.leaves import (
    COMPUTE_PATH,
    FOLLOW_PATH,
    CancelControl,
    ClearEntireCostmap,
    ComputePathToPose,
    FollowPath,
    GlobalUpdatedGoal,
    GoalUpdated,
    IsGoalNearby,
    RunBehavior,
    SmoothPath,
    TruncatePathLocal,
    ValidatePath,
    WouldRecoveryHelp,
)

# They choose among plugins of which one is loaded.
SELECTORS = (
    "ControllerSelector",
    "GoalCheckerSelector",
    "PathHandlerSelector",
    "PlannerSelector",
    "ProgressCheckerSelector",
    "SmootherSelector",
)
# Of any node: which plugin, server or variable; how long to wait for an answer.
WITHOUT_EFFECT = frozenset(
    {
        "controller_id",
        "error_code",
        "error_code_id",
        "error_msg",
        "footprint",
        "goal",
        "goal_checker_id",
        "goals",
        "is_recovery",
        "output_path",
        "path",
        "path_handler_id",
        "planner_id",
        "progress_checker_id",
        "server_name",
        "server_timeout",
        "max_smoothing_duration",
        "smoother_id",
        "smoothing_duration",
        "was_completed",
        "start",
        "tracking_feedback",
        "wait_for_service_timeout",
    }
)
COSTMAPS = ("local", "global")
# The path's name on the blackboard, and what is in that of a smoothed one that is kept apart.
PATH, SMOOTHED = "path", "smooth"


class NotOurs(ValueError):
    """A node that is not there, or an attribute that it cannot have here; line: in its file."""

    def __init__(self, text: str, line: int | None) -> None:
        super().__init__(text)
        self.line = line


class _Attributes:
    """The attributes of one node; each is read once, what is left is refused."""

    def __init__(self, description: NodeDescription) -> None:
        self._node = description.node
        self._line = description.line
        self._left = dict(description.attributes)

    def text(self, name: str, default: str = "") -> str:
        return self._left.pop(name, default)

    def number(self, name: str, default: float) -> float:
        text = self.text(name, str(default))
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.fault(f"{name}: expected a number, got {text!r}")
        return value

    def count(self, name: str, default: int) -> int:
        value = self.number(name, default)
        if not value.is_integer():
            raise self.fault(f"{name}: expected a whole number, got {value:g}")
        return int(value)

    def flag(self, name: str, default: bool) -> bool:
        text = self.text(name, str(default)).lower()
        if text not in ("true", "false", "1", "0"):
            raise self.fault(f"{name}: expected true or false, got {text!r}")
        return text in ("true", "1")

    def fault(self, text: str) -> NotOurs:
        return NotOurs(f"{self._node}: {text}", self._line)

    def finish(self) -> None:
        for name in self._left:
            if name not in WITHOUT_EFFECT:
                raise self.fault(f"{name}: is not heeded here")


@dataclass(frozen=True)
class _Kind:
    """How a node is made. children: how many it takes; None stands for any from one on."""

    make: Callable[[str, _Attributes, Sequence[TreeNode], Board], TreeNode]
    children: int | None = 0


def build_tree(description: NodeDescription, board: Board) -> TreeNode:
    """Returns the root of a tree whose leaves read and write `board`.

    Raises NotOurs where a node, a number of children or an attribute is not.
    """
    kind = _KINDS.get(description.node)
    if kind is None:
        hint = nearest_name_hint(description.node, _KINDS)
        raise NotOurs(f"{description.node}: no such node here{hint}", description.line)
    children = [
        build_tree(child, board) for child in description.children if child.node not in SELECTORS
    ]
    wanted = kind.children
    if (wanted is None and not children) or (wanted is not None and len(children) != wanted):
        count = "at least 1 child" if wanted is None else f"{wanted} children"
        raise NotOurs(
            f"{description.node}: expected {count}, got {len(children)}", description.line
        )
    attributes = _Attributes(description)
    node = kind.make(description.name or description.node, attributes, children, board)
    attributes.finish()
    return node


def faults_of(description: NodeDescription) -> Iterator[NotOurs]:
    """Yields what of a tree is not ours: nothing where it can be built."""

    def plan_nothing(*_: object) -> None:
        raise AssertionError("a tree that is only looked at plans nothing")

    unknown = {n.node: n for n in description.iterate() if n.node not in (*_KINDS, *SELECTORS)}
    for node in unknown.values():
        hint = nearest_name_hint(node.node, _KINDS)
        yield NotOurs(f"{node.node}: no such node here{hint}", node.line)
    if unknown:
        return
    try:
        nobody: Any = plan_nothing
        build_tree(description, Board(nobody, nobody, nobody))
    except NotOurs as fault:
        yield fault


def _recovery(name: str, a: _Attributes, children: Sequence[TreeNode], _: Board) -> TreeNode:
    return RecoveryNode(name, children, number_of_retries=a.count("number_of_retries", 1))


def _rate(name: str, a: _Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    hz = a.number("hz", 10.0)
    if hz <= 0.0:
        raise a.fault(f"hz: expected a number above 0, got {hz:g}")
    return RateController(name, children[0], hz=hz, now_s=lambda: board.inputs.now_s)


def _goal_updated_controller(
    name: str, _: _Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    return GoalUpdatedController(name, children[0], goal_id=lambda: board.values.goal_id)


def _distance_controller(
    name: str, a: _Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    distance_m = a.number("distance", 1.0)
    return DistanceController(name, children[0], board, distance_m=distance_m)


def _speed_controller(
    name: str, a: _Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    rates_hz = a.number("min_rate", 0.1), a.number("max_rate", 1.0)
    speeds_mps = a.number("min_speed", 0.0), a.number("max_speed", 0.5)
    if min(rates_hz) <= 0.0:
        raise a.fault(f"min_rate and max_rate: expected rates above 0, got {rates_hz}")
    if speeds_mps[0] == speeds_mps[1]:
        raise a.fault(f"min_speed and max_speed: expected two speeds, got {speeds_mps[0]:g} twice")
    return SpeedController(name, children[0], board, rates_hz=rates_hz, speeds_mps=speeds_mps)


def _path_longer(name: str, a: _Attributes, children: Sequence[TreeNode], board: Board) -> TreeNode:
    near_m, factor = a.number("prox_len", 3.0), a.number("length_factor", 2.0)
    return PathLongerOnApproach(name, children[0], board, near_m=near_m, factor=factor)


def _goal_updater(
    name: str, a: _Attributes, children: Sequence[TreeNode], board: Board
) -> TreeNode:
    for attribute in ("input_goal", "output_goal", "input_goals", "output_goals"):
        a.text(attribute)
    return PassedOn(name, children)


def _again(node: Callable[..., TreeNode], attribute: str) -> _Kind:
    """Returns how a node that ticks its child again is made. attribute: with how often."""

    def make(name: str, a: _Attributes, children: Sequence[TreeNode], _: Board) -> TreeNode:
        limit = a.count(attribute, 0)
        if limit < FOR_EVER or limit == 0:
            raise a.fault(f"{attribute}: expected -1 or at least 1, got {limit}")
        return node(name, children[0], limit=limit)

    return _Kind(make, 1)


def _timed(node: Callable[..., TreeNode]) -> _Kind:
    return _Kind(lambda name, a, _, board: node(name, board, period_s=a.number("seconds", 1.0)))


def _distance_traveled(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    return DistanceTraveled(name, board, distance_m=a.number("distance", 1.0))


def _always(result: Status) -> _Kind:
    return _Kind(lambda name, a, _, board: AlwaysEnds(name, result))


def _round_robin(name: str, a: _Attributes, children: Sequence[TreeNode], _: Board) -> TreeNode:
    return RoundRobinNode(name, children, wrap_around=a.flag("wrap_around", False))


def _is_goal_nearby(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    threshold_m = a.number("proximity_threshold", 1.0)
    search_distance_m = a.number("max_robot_pose_search_dist", -1.0)
    if search_distance_m <= 0.0:
        raise a.fault("max_robot_pose_search_dist: expected a number above 0")
    return IsGoalNearby(name, board, threshold_m=threshold_m, search_distance_m=search_distance_m)


def _truncate(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    a.text("input_path")
    for attribute, all_of_it in (("distance_forward", -1.0), ("distance_backward", 0.0)):
        if a.number(attribute, 8.0 if attribute == "distance_forward" else 4.0) != all_of_it:
            raise a.fault(f"{attribute}: expected {all_of_it:g}, all that lies ahead")
    return TruncatePathLocal(name, board)


def _variable(a: _Attributes, name: str, default: str) -> str:
    """Returns the name of the variable of the blackboard that an attribute points to."""
    return a.text(name, default).strip("{} ")


def _smooth(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    if a.flag("check_for_collisions", False):
        raise a.fault("check_for_collisions: a smoothed path is not looked at here")
    source = _variable(a, "unsmoothed_path", PATH)
    result = _variable(a, "smoothed_path", PATH)
    if source != PATH or (result != PATH and SMOOTHED not in result):
        raise a.fault(
            f"unsmoothed_path, smoothed_path: expected {PATH} and {PATH}, or a name with "
            f"{SMOOTHED!r} for the second, got {source} and {result}"
        )
    return SmoothPath(name, board, keeps_path=result != PATH)


def _follow(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    # What SmoothPath keeps apart, or the path itself.
    return FollowPath(name, board, follows_smoothed=SMOOTHED in _variable(a, "path", PATH))


def _validate(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    # What TruncatePathLocal wrote, or all of the path; Nav2's trees call the first so.
    is_remaining = "remaining" in a.text("path", "{path}")
    return ValidatePath(
        name,
        board,
        remaining=is_remaining,
        max_cost=a.count("max_cost", LETHAL),
        consider_unknown_as_obstacle=a.flag("consider_unknown_as_obstacle", False),
    )


def _clear(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
    service = a.text("service_name")
    for costmap in COSTMAPS:
        if f"{costmap}_costmap" in service:
            return ClearEntireCostmap(name, board, field=f"clear_{costmap}")
    raise a.fault(f"service_name: expected the local or the global costmap's, got {service!r}")


def _would_help(key: str) -> _Kind:
    return _Kind(lambda name, a, _, board: WouldRecoveryHelp(name, board, key=key))


def _behavior(behavior: str, names: Mapping[str, tuple[str, float]]) -> _Kind:
    """Returns how a behaviour is made. names: of its attributes -> our argument and the default."""

    def make(name: str, a: _Attributes, _: Sequence[TreeNode], board: Board) -> TreeNode:
        arguments = {ours: a.number(theirs, default) for theirs, (ours, default) in names.items()}
        if a.flag("disable_collision_checks", False):
            raise a.fault("disable_collision_checks: collisions are always looked for")
        return RunBehavior(name, board, behavior=behavior, arguments=arguments)

    return _Kind(make)


def _plain(node: Callable[[str, Sequence[TreeNode]], TreeNode], children: int | None) -> _Kind:
    return _Kind(lambda name, a, below, board: node(name, below), children)


def _leaf(node: Callable[[str, Board], TreeNode]) -> _Kind:
    return _Kind(lambda name, a, below, board: node(name, board))


_ALLOWANCE = {"time_allowance": ("time_allowance", 10.0)}
_KINDS: Mapping[str, _Kind] = {
    "Sequence": _plain(SequenceNode, None),
    "Fallback": _plain(FallbackNode, None),
    "ReactiveSequence": _plain(ReactiveSequenceNode, None),
    "ReactiveFallback": _plain(ReactiveFallbackNode, None),
    "PipelineSequence": _plain(PipelineSequence, None),
    "Inverter": _plain(InverterNode, 1),
    "RecoveryNode": _Kind(_recovery, 2),
    "RoundRobin": _Kind(_round_robin, None),
    "RateController": _Kind(_rate, 1),
    "DistanceController": _Kind(_distance_controller, 1),
    "SpeedController": _Kind(_speed_controller, 1),
    "SingleTrigger": _Kind(lambda name, a, below, board: SingleTrigger(name, below[0]), 1),
    "PathLongerOnApproach": _Kind(_path_longer, 1),
    "GoalUpdater": _Kind(_goal_updater, 1),
    "KeepRunningUntilFailure": _plain(KeepRunningUntilFailure, 1),
    "ForceSuccess": _plain(ForceSuccess, 1),
    "ForceFailure": _plain(ForceFailure, 1),
    "Repeat": _again(Repeat, "num_cycles"),
    "RetryUntilSuccessful": _again(RetryUntilSuccessful, "num_attempts"),
    "SequenceWithMemory": _plain(SequenceWithMemory, None),
    "SequenceStar": _plain(SequenceWithMemory, None),
    "AlwaysSuccess": _always(Status.SUCCESS),
    "AlwaysFailure": _always(Status.FAILURE),
    "TimeExpired": _timed(TimeExpired),
    "PathExpiringTimer": _timed(PathExpiringTimer),
    "DistanceTraveled": _Kind(_distance_traveled),
    "GoalReached": _leaf(GoalReached),
    "GoalUpdatedController": _Kind(_goal_updated_controller, 1),
    "ComputePathToPose": _leaf(ComputePathToPose),
    "SmoothPath": _Kind(_smooth),
    "FollowPath": _Kind(_follow),
    "CancelControl": _leaf(CancelControl),
    "GoalUpdated": _leaf(GoalUpdated),
    "GlobalUpdatedGoal": _leaf(GlobalUpdatedGoal),
    "IsGoalNearby": _Kind(_is_goal_nearby),
    "TruncatePathLocal": _Kind(_truncate),
    "ValidatePath": _Kind(_validate),
    "IsPathValid": _Kind(_validate),
    "ClearEntireCostmap": _Kind(_clear),
    "WouldAPlannerRecoveryHelp": _would_help(COMPUTE_PATH),
    "WouldAControllerRecoveryHelp": _would_help(FOLLOW_PATH),
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
