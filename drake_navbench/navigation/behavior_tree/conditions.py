"""Conditions that look at the clock, the way driven, the path and the goal.

Source: nav2_behavior_tree (TimeExpired, DistanceTraveled, PathExpiringTimer, GoalReached,
ArePosesNear), branches humble to lyrical, and BehaviorTree.CPP 4.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.leaves import Leaf
from drake_navbench.navigation.behavior_tree.tree_node import NANOSECOND_DIGITS, TreeNode
from drake_navbench.navigation.goal_check import squared_distance


class AlwaysEnds(TreeNode):
    """Ends at its first tick, always with the same status."""

    def __init__(self, name: str, result: Status) -> None:
        super().__init__(name)
        self._result = result

    def update(self) -> Status:
        """Returns the status that the node was made with."""
        return self._result


class TimeExpired(Leaf):
    """Success once in a period, failure in between; a node that was idle begins a new period."""

    MEMORY = ("start_s",)
    start_s = 0.0

    def __init__(self, name: str, board: Board, *, period_s: float) -> None:
        super().__init__(name, board)
        self._period_s = period_s

    def update(self) -> Status:
        """Tells whether the period is over; begins the next one."""
        now_s = self.board.inputs.now_s
        elapsed_s = round(now_s - self.start_s, NANOSECOND_DIGITS)
        if not self.is_active:
            self.start_s = now_s
            return Status.FAILURE
        if elapsed_s < self._period_s:
            return Status.FAILURE
        self.start_s = now_s
        return Status.SUCCESS


class PathExpiringTimer(Leaf):
    """Success once a path is older than `period_s`; another path begins the time anew.

    A new plan is another path, also where all poses are equal: it has another stamp. The memory
    survives the node's being idle, as in Nav2.
    """

    MEMORY = ("is_first", "start_s", "path", "plan_id")
    is_first = True
    start_s = 0.0
    path: NDArray[np.float64] | None = None
    plan_id = 0

    def __init__(self, name: str, board: Board, *, period_s: float, source: str = PATH) -> None:
        super().__init__(name, board, source=source)
        self._period_s = period_s

    def update(self) -> Status:
        """Tells whether the path is too old."""
        now_s, path, plan_id = self.board.inputs.now_s, self._path(), self.board.values.plan_count
        is_planned = plan_id != self.plan_id
        is_new = path is not self.path and (is_planned or not _are_equal(path, self.path))
        self.path, self.plan_id = path, plan_id
        if self.is_first:
            self.is_first, self.start_s = False, now_s
            return Status.FAILURE
        if is_new:
            self.start_s = now_s
        if round(now_s - self.start_s, NANOSECOND_DIGITS) < self._period_s:
            return Status.FAILURE
        self.start_s = now_s
        return Status.SUCCESS


class DistanceTraveled(Leaf):
    """Success whenever the robot has moved a distance since the last success, else failure."""

    MEMORY = ("start",)
    start = (0.0, 0.0)

    def __init__(self, name: str, board: Board, *, distance_m: float) -> None:
        super().__init__(name, board)
        self._distance_m = distance_m

    def update(self) -> Status:
        """Tells whether the robot is far enough from the place of the last success."""
        x, y, _ = self.board.inputs.pose
        here = (float(x), float(y))
        if not self.is_active:
            self.start = here
            return Status.FAILURE
        if math.dist(self.start, here) < self._distance_m:
            return Status.FAILURE
        self.start = here
        return Status.SUCCESS


class ArePosesNear(Leaf):
    """Success where two poses, by their names on the board, are within a distance of each other."""

    def __init__(self, name: str, board: Board, *, poses: tuple[str, str], tolerance_m: float):
        super().__init__(name, board)
        self._poses = poses
        self._tolerance_m = tolerance_m

    def update(self) -> Status:
        """Compares the distance; fails before both poses are written."""
        one, other = map(self.board.pose, self._poses)
        if one is None or other is None:
            return Status.FAILURE
        is_near = squared_distance(one, other) <= self._tolerance_m * self._tolerance_m
        return Status.SUCCESS if is_near else Status.FAILURE


class GoalReached(Leaf):
    """Success where the robot is within a distance of the goal, a pose by its name on the board."""

    def __init__(self, name: str, board: Board, *, goal: str, tolerance_m: float) -> None:
        super().__init__(name, board)
        self._goal = goal
        self._tolerance_m = tolerance_m

    def update(self) -> Status:
        """Tells whether the robot is near enough to the goal; not before the goal is written."""
        goal = self.board.pose(self._goal)
        if goal is None:
            return Status.FAILURE
        distance_squared = squared_distance(goal, self.board.inputs.pose)
        is_near = distance_squared <= self._tolerance_m * self._tolerance_m
        return Status.SUCCESS if is_near else Status.FAILURE


def _are_equal(path: NDArray[np.float64] | None, other: NDArray[np.float64] | None) -> bool:
    return path is not None and other is not None and np.array_equal(path, other)
