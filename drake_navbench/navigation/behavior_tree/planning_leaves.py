"""Leaves that ask the planner and the smoother, which answer within the tick.

Source: nav2_behavior_tree (ComputePathToPose, ComputePathThroughPoses, SmoothPath) and
nav2_planner, branches humble to lyrical.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from py_trees.common import Status

from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.behavior_tree.board import GOAL, GOALS, PATH, Board, Pose
from drake_navbench.navigation.behavior_tree.leaves import COMPUTE_PATH, SMOOTH_PATH, Leaf
from drake_navbench.navigation.planner import NoViapointsGiven, PlanningError, UnknownFrame
from drake_navbench.navigation.smoother import SmoothingError
from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.plugins.releases import Release


class ComputePathLeaf(Leaf):
    """Asks the planner for a path; failure empties the path.

    goal: name on the board of the goal, or of the list of goals. start: name of the pose at which
    the path begins; '' or a pose that was not written: the robot's.
    """

    # Added to the planner's codes, which are those of ComputePathToPose.
    CODE_OFFSET: ClassVar[int] = 0

    def __init__(
        self, name: str, board: Board, *, goal: str, start: str = "", result: str = PATH
    ) -> None:
        super().__init__(name, board, result=result)
        self._goal = goal
        self._start = start

    def update(self) -> Status:
        """Plans a path and writes it, or empties the path's variable."""
        board = self.board
        start = board.pose(self._start) if self._start else None
        try:
            path = self._plan(board.inputs.pose if start is None else start)
        except PlanningError as error:
            code = error.code + self.CODE_OFFSET
            board.write_path(self._result, None)
            board.write_result(COMPUTE_PATH, TaskStatus(TaskState.ABORTED, code, str(error)))
            return Status.FAILURE
        plan_count = board.values.plan_count + 1
        board.write_path(self._result, read_only(path), plan_count=plan_count)
        board.write_result(COMPUTE_PATH, TaskStatus(TaskState.SUCCEEDED))
        return Status.SUCCESS

    def _plan(self, start: Pose) -> NDArray[np.float64]:
        raise NotImplementedError


class ComputePathToPose(ComputePathLeaf):
    """Asks the planner for a path to the goal."""

    def __init__(
        self, name: str, board: Board, *, goal: str = GOAL, start: str = "", result: str = PATH
    ) -> None:
        super().__init__(name, board, goal=goal, start=start, result=result)

    def _plan(self, start: Pose) -> NDArray[np.float64]:
        goal = self.board.pose(self._goal)
        if goal is None:
            raise UnknownFrame(f"{{{self._goal}}} was not written yet")
        return self.board.make_plan(start, goal, self.board.inputs.global_costmap)


class ComputePathThroughPoses(ComputePathLeaf):
    """Asks the planner for a path through a list of goals: paths from goal to goal, joined.

    Each begins at the end of the one before. Up to Iron the joined path has that pose twice.
    """

    CODE_OFFSET = 100

    def __init__(
        self, name: str, board: Board, *, goal: str = GOALS, start: str = "", result: str = PATH
    ) -> None:
        super().__init__(name, board, goal=goal, start=start, result=result)

    def _plan(self, start: Pose) -> NDArray[np.float64]:
        board = self.board
        path = np.empty((0, 3))
        repeats_joint = board.release <= Release.IRON
        for goal in board.goals(self._goal):
            part = board.make_plan(start, goal, board.inputs.global_costmap)
            path = np.vstack([path, part if repeats_joint or not len(path) else part[1:]])
            start = path[-1]
        if not len(path):
            raise NoViapointsGiven("there is no pose to plan through")
        return path


class SmoothPath(Leaf):
    """Smooths a path with the smoother server.

    It fails for an empty path, and for a path that the smoother cannot smooth. If the result goes
    to another variable, a path is smoothed only once: the result would be the same again.
    """

    MEMORY = ("smoothed",)
    smoothed: NDArray[np.float64] | None = None

    def update(self) -> Status:
        """Smooths the path and writes the result."""
        board, path = self.board, self._path()
        is_kept = self._result != self._source
        if is_kept and path is not None and path is self.smoothed:
            return Status.SUCCESS
        try:
            if path is None:
                raise SmoothingError("there is no path to smooth")
            smoothed = read_only(board.smooth_path(path, board.inputs.global_costmap))
        except PlanningError as error:
            board.write_result(SMOOTH_PATH, TaskStatus(TaskState.ABORTED, error.code, str(error)))
            return Status.FAILURE
        self.smoothed = path
        board.write_path(self._result, smoothed, plan_count=board.values.plan_count + 1)
        board.write_result(SMOOTH_PATH, TaskStatus(TaskState.SUCCEEDED))
        return Status.SUCCESS
