"""The leaves of Nav2's NavigateToPose tree: conditions, and actions that talk to the servers.

The planner and the costmap services answer within the tick: no simulated time passes for them. The
controller server and the behaviours run on their own clocks and are asked at every tick.
Source: nav2_behavior_tree, branch lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode
from drake_navbench.navigation.task import (
    BehaviorGoal,
    ClearRequest,
    GlobalPlan,
    TaskState,
    TaskStatus,
)
from drake_navbench.plugins.releases import Release

REMAINING_PATH = "remaining_path"
"""The variable in which Nav2's default tree keeps what of the path lies before the robot."""
COMPUTE_PATH = "compute_path"
SMOOTH_PATH = "smooth_path"
FOLLOW_PATH = "follow_path"
INVALID_PATH = 103
RECOVERABLE_CODES: Mapping[str, frozenset[int]] = {
    COMPUTE_PATH: frozenset({200, 207, 208, 300, 307, 308}),
    FOLLOW_PATH: frozenset({100, 104, 105, 106}),
    SMOOTH_PATH: frozenset({500, 502, 503, 504}),
}
"""Codes of planner, controller and smoother after which Nav2 deems a recovery useful, unknown ones
first."""
THROUGH_POSES = 300
"""The codes of ComputePathThroughPoses begin here."""


class Leaf(TreeNode):
    """A leaf that reads and writes a board.

    source, result: names on the board of the path that it reads, and of the path that it writes.
    """

    def __init__(self, name: str, board: Board, *, source: str = PATH, result: str = PATH) -> None:
        super().__init__(name)
        self.board = board
        self._source = source
        self._result = result

    def _path(self) -> NDArray[np.float64] | None:
        return self.board.values.paths.get(self._source)


class GlobalUpdatedGoal(Leaf):
    """Success when the goal differs from the one at the last tick, and at the first tick."""

    MEMORY = ("goal_id",)
    goal_id: int | None = None

    def update(self) -> Status:
        """Tells whether the goal is new."""
        is_new = self.board.values.goal_id != self.goal_id
        self.goal_id = self.board.values.goal_id
        return Status.SUCCESS if is_new else Status.FAILURE


class GoalUpdated(Leaf):
    """Success when the goal has changed since the node was first ticked after being idle."""

    MEMORY = ("goal_id",)
    goal_id: int | None = None

    def update(self) -> Status:
        """Tells whether the goal is new."""
        is_new = self.is_active and self.board.values.goal_id != self.goal_id
        self.goal_id = self.board.values.goal_id
        return Status.SUCCESS if is_new else Status.FAILURE


class IsGoalNearby(Leaf):
    """Success when the rest of the path is shorter than a threshold.

    The robot's place on the path is searched from the last one found, over a limited length, or,
    with search_distance_m infinity, on the whole path.
    """

    MEMORY = ("path", "begin")

    def __init__(
        self,
        name: str,
        board: Board,
        *,
        threshold_m: float,
        search_distance_m: float,
        source: str = PATH,
    ) -> None:
        super().__init__(name, board, source=source)
        self._threshold_m = threshold_m
        self._search_distance_m = search_distance_m
        self.path: NDArray[np.float64] | None = None
        self.begin = 0

    def update(self) -> Status:
        """Finds the robot on the path and measures the rest."""
        path = self._path()
        if path is None:
            return Status.FAILURE
        if path is not self.path or math.isinf(self._search_distance_m):
            self.path, self.begin = path, 0
        steps_m = np.hypot(*np.diff(path[self.begin :, :2], axis=0).T)
        count = 1 + int(np.count_nonzero(np.cumsum(steps_m) <= self._search_distance_m))
        nearest = nearest_index(path[self.begin : self.begin + count], self.board.inputs.pose)
        self.begin += nearest
        is_near = steps_m[nearest:].sum() < self._threshold_m
        return Status.SUCCESS if is_near else Status.FAILURE


class ValidatePath(Leaf):
    """Success when a path is free of collisions on the global costmap.

    limits: further arguments of the validity service, those of
    `is_path_valid`.
    """

    def __init__(
        self, name: str, board: Board, *, source: str = REMAINING_PATH, **limits: int | bool
    ) -> None:
        super().__init__(name, board, source=source)
        self._limits = limits

    def update(self) -> Status:
        """Asks the planner's validity service; an empty path is not valid."""
        path = self._path()
        is_valid = path is not None and self.board.is_path_valid(
            self._checked(path), self.board.inputs.global_costmap, **self._limits
        )
        return Status.SUCCESS if is_valid else Status.FAILURE

    def _checked(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        """Returns the part of a path that must be free: all of it."""
        return path


class IsPathValid(ValidatePath):
    """ValidatePath of the releases before Lyrical: what lies behind the robot is not checked.

    The check begins at the pose nearest to the robot, the first of equals; Nav2 compares distances
    in single precision.
    """

    def _checked(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        pose = self.board.inputs.pose
        distances_m = np.hypot(path[:, 0] - pose[0], path[:, 1] - pose[1])
        return path[int(np.argmin(distances_m.astype(np.float32))) :]


class FollowPath(Leaf):
    """Follows the path by the controller server; a new path preempts the task.

    Halting the node cancels the task.
    """

    MEMORY = ("task_id",)
    task_id = 0

    def initialise(self) -> None:
        """Sends a new task to the controller server."""
        values, path = self.board.values, self._path()
        if path is None:
            return
        self.task_id = values.task_count + 1
        goal = GlobalPlan(values.plan_count, path, task_id=self.task_id)
        self.board.write(task_count=self.task_id, follow_path=goal)

    def update(self) -> Status:
        """Returns the status of the task; hands new paths on to the controller server."""
        board = self.board
        path, task = self._path(), board.values.follow_path
        if task is None or task.task_id != self.task_id:
            failure = TaskStatus(TaskState.ABORTED, INVALID_PATH, "the path is empty")
            board.write_result(FOLLOW_PATH, failure)
            return Status.FAILURE
        status = board.inputs.controller_status
        if status.task_id == self.task_id and status.state.is_final:
            board.write_result(FOLLOW_PATH, status)
            has_failed = status.state is TaskState.ABORTED
            return Status.FAILURE if has_failed else Status.SUCCESS
        if path is not None and self._is_new(path, task):
            plan_id = max(board.values.plan_count, task.plan_id + 1)
            board.write(follow_path=replace(task, plan_id=plan_id, poses=path), plan_count=plan_id)
        return Status.RUNNING

    def _is_new(self, path: NDArray[np.float64], task: GlobalPlan) -> bool:
        """Tells whether a path was planned or changed since the running task got its path.

        A path that is cut anew from the same plan may equal the task's. Nav2 compares paths by
        their stamps, which are those of the plan.
        """
        is_planned = self.board.values.plan_count != task.plan_id
        return path is not task.poses and (is_planned or not np.array_equal(path, task.poses))

    def terminate(self, new_status: Status) -> None:
        """Cancels the task where the node is halted."""
        task = self.board.values.follow_path
        if new_status == Status.INVALID and self.status == Status.RUNNING and task is not None:
            self.board.write(follow_path=replace(task, cancel_requested=True))


class CancelControl(Leaf):
    """Cancels the task of the controller server."""

    def update(self) -> Status:
        """Asks the controller server to bring the robot to rest."""
        task = self.board.values.follow_path
        if task is not None:
            self.board.write(follow_path=replace(task, cancel_requested=True))
        return Status.SUCCESS


class WouldRecoveryHelp(Leaf):
    """Success when an action's last error code is one after which a recovery is useful.

    key: COMPUTE_PATH (Nav2's WouldAPlannerRecoveryHelp), FOLLOW_PATH
    (WouldAControllerRecoveryHelp) or SMOOTH_PATH (WouldASmootherRecoveryHelp).
    """

    def __init__(self, name: str, board: Board, *, key: str) -> None:
        super().__init__(name, board)
        self._key = key

    def update(self) -> Status:
        """Looks the error code up among the recoverable ones."""
        code = self.board.values.results.get(self._key, TaskStatus()).error_code
        is_recoverable = code in RECOVERABLE_CODES[self._key]
        if self._key == COMPUTE_PATH and self.board.release is Release.IRON:
            # Iron's WouldAPlannerRecoveryHelp does not know the codes of ComputePathThroughPoses.
            is_recoverable &= code < THROUGH_POSES
        return Status.SUCCESS if is_recoverable else Status.FAILURE


class ClearEntireCostmap(Leaf):
    """Asks a costmap to forget its marks.

    field: the blackboard's field for the request.
    """

    def __init__(self, name: str, board: Board, *, field: str) -> None:
        super().__init__(name, board)
        self._field = field

    def update(self) -> Status:
        """Sends the request."""
        board = self.board
        request = ClearRequest(board.inputs.now_s)
        board.write(**{self._field: request}, recovery_count=board.values.recovery_count + 1)
        return Status.SUCCESS


class RunBehavior(Leaf):
    """Runs a behaviour of the behaviour server to its end; halting the node cancels it."""

    MEMORY = ("task_id",)
    task_id = 0

    def __init__(
        self, name: str, board: Board, *, behavior: str, arguments: Mapping[str, float]
    ) -> None:
        super().__init__(name, board)
        self._behavior = behavior
        self._arguments = arguments

    def initialise(self) -> None:
        """Sends the behaviour to the behaviour server."""
        values = self.board.values
        self.task_id = values.task_count + 1
        self.board.write(
            task_count=self.task_id,
            recovery_count=values.recovery_count + 1,
            behavior=BehaviorGoal(self.task_id, self._behavior, self._arguments),
        )

    def update(self) -> Status:
        """Returns the status of the behaviour."""
        status = self.board.inputs.behavior_status
        if status.task_id != self.task_id or not status.state.is_final:
            return Status.RUNNING
        self.board.write_result(self._behavior, status)
        return Status.SUCCESS if status.state is TaskState.SUCCEEDED else Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Cancels the behaviour where the node is halted."""
        goal = self.board.values.behavior
        if new_status == Status.INVALID and self.status == Status.RUNNING and goal is not None:
            self.board.write(behavior=replace(goal, cancel_requested=True))


def nearest_index(path: NDArray[np.float64], pose: NDArray[np.float64]) -> int:
    """Returns the index of the path's pose nearest to `pose`; the last of equals, as in Nav2."""
    distances_m = np.hypot(path[:, 0] - pose[0], path[:, 1] - pose[1])
    return len(path) - 1 - int(np.argmin(distances_m[::-1]))
