"""Leaves that change lists of goals, and those that write a pose.

Source: nav2_behavior_tree (RemovePassedGoals, RemoveInCollisionGoals, AppendGoalPoseToGoals,
GetNextFewGoals, GetCurrentPose, GetPoseFromPath), branches humble to lyrical.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from py_trees.common import Status

from drake_navbench.kernels.grid import NO_INFORMATION
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.behavior_tree.board import GOALS, Board, Poses
from drake_navbench.navigation.behavior_tree.leaves import Leaf
from drake_navbench.navigation.task import PoseState


class GoalLists(NamedTuple):
    """The lists that a leaf reads and writes, by their names on the board.

    needs_statuses: whether the leaf fails where a goal that it takes out is no pending pose of the
    task, as in trees of Nav2 that hand `waypoint_statuses` on.
    """

    source: str = GOALS
    result: str = GOALS
    needs_statuses: bool = False


class GoalsLeaf(Leaf):
    """A leaf that reads one list of goals and writes another."""

    def __init__(self, name: str, board: Board, lists: GoalLists) -> None:
        super().__init__(name, board, source=lists.source, result=lists.result)
        self._needs_statuses = lists.needs_statuses

    def _take_out(self, goals: Poses, state: PoseState) -> bool:
        """Gives goals a state on the board; gives none of them one if a status is missing.

        Returns False in that case, in which the node fails.
        """
        before = self.board.values.task_poses
        for goal in goals:
            if not self.board.mark(goal, state) and self._needs_statuses:
                self.board.write(task_poses=before)
                return False
        return True


class RemovePassedGoals(GoalsLeaf):
    """Takes out the first goals, up to one that is farther from the robot than `radius_m`.

    The last goal stays. Only the distance counts, not the heading, nor the side on which the robot
    is: a goal that the robot passed between two ticks stays, too.
    """

    def __init__(self, name: str, board: Board, lists: GoalLists, *, radius_m: float) -> None:
        super().__init__(name, board, lists)
        self._radius_m = radius_m

    def update(self) -> Status:
        """Writes the goals that are left."""
        goals = self.board.goals(self._source)
        pose = self.board.inputs.pose
        count = 0
        while count < len(goals) - 1 and math.dist(goals[count, :2], pose[:2]) <= self._radius_m:
            count += 1
        if not self._take_out(goals[:count], PoseState.PASSED):
            return Status.FAILURE
        self.board.write_goals(self._result, goals[count:])
        return Status.SUCCESS


class RemoveInCollisionGoals(GoalsLeaf):
    """Takes out the goals whose cost on the global costmap is at least `cost_threshold`.

    uses_outline: the cost is the largest one under the robot's outline, else that of one cell. A
    goal with unknown cells counts as free unless `unknown_blocks`. Without the outline, a goal off
    the map makes the node fail, and all goals stay.
    """

    def __init__(
        self,
        name: str,
        board: Board,
        lists: GoalLists,
        *,
        cost_threshold: float,
        uses_outline: bool,
        unknown_blocks: bool,
    ) -> None:
        super().__init__(name, board, lists)
        self._cost_threshold = cost_threshold
        self._uses_outline = uses_outline
        self._unknown_blocks = unknown_blocks

    def update(self) -> Status:
        """Writes the goals that are free."""
        board, goals = self.board, self.board.goals(self._source)
        costmap = board.inputs.global_costmap
        costs = [board.pose_cost(goal, costmap, self._uses_outline) for goal in goals]
        if None in costs:
            board.write_goals(self._result, goals)
            return Status.FAILURE
        is_free = np.array([self._is_free(cost) for cost in costs], dtype=bool)
        if not self._take_out(goals[~is_free], PoseState.SKIPPED):
            return Status.FAILURE
        board.write_goals(self._result, goals[is_free])
        return Status.SUCCESS

    def _is_free(self, cost: int | None) -> bool:
        assert cost is not None
        if cost == NO_INFORMATION and not self._unknown_blocks:
            return True
        return cost < self._cost_threshold


class AppendGoalPoseToGoals(GoalsLeaf):
    """Appends a pose, by its name on the board, to a list of goals."""

    def __init__(self, name: str, board: Board, lists: GoalLists, *, pose: str) -> None:
        super().__init__(name, board, lists)
        self._pose = pose

    def update(self) -> Status:
        """Writes the longer list; fails before the pose is written."""
        pose = self.board.pose(self._pose)
        if pose is None:
            return Status.FAILURE
        goals = np.vstack([self.board.goals(self._source), pose])
        self.board.write_goals(self._result, read_only(goals))
        return Status.SUCCESS


class GetNextFewGoals(GoalsLeaf):
    """Writes the first `count` goals of a list; fails for an empty one."""

    def __init__(self, name: str, board: Board, lists: GoalLists, *, count: int) -> None:
        super().__init__(name, board, lists)
        self._count = count

    def update(self) -> Status:
        """Writes the first goals."""
        goals = self.board.goals(self._source)
        if not len(goals):
            return Status.FAILURE
        self.board.write_goals(self._result, goals[: self._count])
        return Status.SUCCESS


class GetCurrentPose(Leaf):
    """Writes the robot's estimated pose to a variable."""

    def update(self) -> Status:
        """Writes the pose."""
        self.board.write_pose(self._result, self.board.inputs.pose)
        return Status.SUCCESS


class GetPoseFromPath(Leaf):
    """Writes the pose of a path at an index, counted from the end where it is negative."""

    def __init__(self, name: str, board: Board, *, index: int, source: str, result: str) -> None:
        super().__init__(name, board, source=source, result=result)
        self._index = index

    def update(self) -> Status:
        """Writes the pose; fails where the path has no such pose."""
        path = self._path()
        if path is None or not -len(path) <= self._index < len(path):
            return Status.FAILURE
        self.board.write_pose(self._result, path[self._index])
        return Status.SUCCESS
