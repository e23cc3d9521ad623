"""Decorators, nodes with one child: they limit when and how often it is ticked, or map its result.

Source: nav2_behavior_tree (DistanceController, SpeedController, SingleTrigger,
PathLongerOnApproach), branches humble to lyrical, and BehaviorTree.CPP 4.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.control_nodes import (
    NANOSECOND_DIGITS,
    ControlNode,
    InOrderNode,
    TreeNode,
)

Run = Generator[Behaviour, None, Status]
FOR_EVER = -1
# The time over which Nav2's navigator averages the odometry, s.
ODOMETRY_WINDOW_S = 0.3


class DistanceController(ControlNode):
    """Ticks its child at first, while it runs, and each time the robot has moved a distance.

    The distance is measured from where the node began, and then from where the child last
    succeeded. In between the node reports that it runs.
    """

    MEMORY = ("is_first", "start")

    def __init__(self, name: str, child: TreeNode, board: Board, *, distance_m: float) -> None:
        super().__init__(name, [child])
        self._board = board
        self._distance_m = distance_m
        self.is_first = False
        self.start: tuple[float, float] = (0.0, 0.0)

    def _run(self) -> Run:
        (child,) = self.children
        here = _position(self._board)
        if not self.is_active:
            self.start, self.is_first = here, True
        travelled_m = math.dist(self.start, here)
        is_due = self.is_first or travelled_m >= self._distance_m
        if not (is_due or child.status == Status.RUNNING):
            return Status.RUNNING
        self.is_first = False
        yield from child.tick()
        if child.status == Status.SUCCESS:
            self.start = here
        return child.status


class SpeedController(ControlNode):
    """Ticks its child at first, while it runs, and at a rate that grows with the robot's speed.

    The speed is the mean over the ticks of the last `window_s`. A new goal begins anew.
    """

    MEMORY = ("is_first", "goal_id", "period_s", "start_s", "speeds")

    def __init__(
        self,
        name: str,
        child: TreeNode,
        board: Board,
        *,
        rates_hz: tuple[float, float],
        speeds_mps: tuple[float, float],
        window_s: float = ODOMETRY_WINDOW_S,
    ) -> None:
        super().__init__(name, [child])
        self._board = board
        self._rates_hz = rates_hz
        self._speeds_mps = speeds_mps
        self._window_s = window_s
        self.is_first = False
        self.goal_id = 0
        self.period_s = 1.0
        self.start_s = 0.0
        self.speeds: tuple[tuple[float, float, float], ...] = ()

    def _run(self) -> Run:
        (child,) = self.children
        inputs = self._board.inputs
        entry = (inputs.now_s, float(inputs.twist[0]), float(inputs.twist[1]))
        recent = [e for e in self.speeds if inputs.now_s - e[0] <= self._window_s]
        self.speeds = (*recent, entry)
        goal_id = self._board.values.goal_id
        if not self.is_active or goal_id != self.goal_id:
            self.goal_id, self.period_s = goal_id, 1.0 / self._rates_hz[1]
            self.start_s, self.is_first = inputs.now_s, True
        elapsed_s = round(inputs.now_s - self.start_s, NANOSECOND_DIGITS)
        is_due = elapsed_s >= self.period_s
        if not (self.is_first or is_due or child.status == Status.RUNNING):
            return Status.RUNNING
        self.is_first = False
        if is_due:
            self.period_s, self.start_s = 1.0 / self._rate_hz(), inputs.now_s
        yield from child.tick()
        return child.status

    def _rate_hz(self) -> float:
        """Returns the rate at the mean of the speeds, between the least and the largest."""
        _, forward, lateral = np.mean(self.speeds, axis=0)
        (slowest, fastest), (least, most) = self._rates_hz, self._speeds_mps
        rate = (math.hypot(forward, lateral) - least) / (most - least) * (fastest - slowest)
        return max(min(rate + slowest, fastest), slowest)


class SingleTrigger(ControlNode):
    """Ticks its child until that ends, and then fails until the node was idle."""

    MEMORY = ("is_first",)

    def __init__(self, name: str, child: TreeNode) -> None:
        super().__init__(name, [child])
        self.is_first = True

    def _run(self) -> Run:
        (child,) = self.children
        if not self.is_active:
            self.is_first = True
        if not self.is_first:
            return Status.FAILURE
        yield from child.tick()
        self.is_first = child.status == Status.RUNNING
        return child.status


class PathLongerOnApproach(ControlNode):
    """Ticks its child where, near the goal, a new path to the same goal is much longer.

    Near: the path before was shorter than `near_m`; much longer: `factor` times as long. Otherwise
    the node succeeds. Its memory survives its being idle, as in Nav2. source: the path's variable.
    """

    MEMORY = ("path", "is_first")

    def __init__(
        self,
        name: str,
        child: TreeNode,
        board: Board,
        *,
        near_m: float,
        factor: float,
        source: str = PATH,
    ) -> None:
        super().__init__(name, [child])
        self._board = board
        self._source = source
        self._near_m = near_m
        self._factor = factor
        self.path: NDArray[np.float64] | None = None
        self.is_first = True

    def _run(self) -> Run:
        (child,) = self.children
        before, path = self.path, self._board.values.paths.get(self._source)
        if before is None or path is None or not np.array_equal(before[-1], path[-1]):
            self.is_first = True
        elif not self.is_first and self._is_much_longer(before, path):
            yield from child.tick()
            if child.status == Status.RUNNING:
                return Status.RUNNING
            self.path = path
            return child.status
        self.path, self.is_first = path, False
        return Status.SUCCESS

    def _is_much_longer(self, before: NDArray[np.float64], path: NDArray[np.float64]) -> bool:
        if len(before) == len(path):
            return False
        before_m = arc_length(before)
        return before_m < self._near_m and arc_length(path) > self._factor * before_m


class KeepRunningUntilFailure(ControlNode):
    """Runs for as long as its child, ticked again and again, does not fail."""

    def _run(self) -> Run:
        (child,) = self.children
        yield from child.tick()
        if child.status == Status.SUCCESS:
            self._reset_children()
            return Status.RUNNING
        return child.status


class ForcedNode(ControlNode):
    """Ends with `RESULT`, whatever the status with which its child ends."""

    RESULT: ClassVar[Status]

    def _run(self) -> Run:
        (child,) = self.children
        yield from child.tick()
        return Status.RUNNING if child.status == Status.RUNNING else self.RESULT


class ForceSuccess(ForcedNode):
    """Success however its child ends."""

    RESULT = Status.SUCCESS


class ForceFailure(ForcedNode):
    """Failure however its child ends."""

    RESULT = Status.FAILURE


class _Again(ControlNode):
    """Ticks its child again whenever it ends with AGAIN_AFTER; the `limit`th such end is its own.

    With any other final status of the child the node ends at once, with that status.
    """

    AGAIN_AFTER: ClassVar[Status]
    MEMORY = ("count",)

    def __init__(self, name: str, child: TreeNode, *, limit: int) -> None:
        super().__init__(name, [child])
        self._limit = limit
        self.count = 0

    def _run(self) -> Run:
        (child,) = self.children
        while self._limit == FOR_EVER or self.count < self._limit:
            yield from child.tick()
            if child.status != self.AGAIN_AFTER:
                return child.status
            self.count += 1
            self._reset_children()
            if self._limit == FOR_EVER:
                # Without this, a child that ends at its first tick would never let the tick of the
                # tree end.
                return Status.RUNNING
        return self.AGAIN_AFTER

    def terminate(self, new_status: Status) -> None:
        """Sets the count to 0."""
        self.count = 0


class Repeat(_Again):
    """Success after `limit` successes of its child (-1: never); failure at its first failure."""

    AGAIN_AFTER = Status.SUCCESS


class RetryUntilSuccessful(_Again):
    """Failure after `limit` failures of its child (-1: never); success at its first success."""

    AGAIN_AFTER = Status.FAILURE


class GoalUpdater(ControlNode):
    """Copies a goal and a list of goals to other variables, and ticks its child.

    Nobody sends a new goal here. goal, goals: names on the board (from, to); '' leaves one out.
    """

    def __init__(
        self,
        name: str,
        child: TreeNode,
        board: Board,
        *,
        goal: tuple[str, str] = ("", ""),
        goals: tuple[str, str] = ("", ""),
    ) -> None:
        super().__init__(name, [child])
        self._board = board
        self._goal = goal
        self._goals = goals

    def _run(self) -> Run:
        (child,), board = self.children, self._board
        source, result = self._goal
        pose = board.pose(source) if source else None
        if pose is not None:
            board.write_pose(result, pose)
        source, result = self._goals
        if source:
            board.write_goals(result, board.goals(source))
        yield from child.tick()
        return child.status


class SequenceWithMemory(InOrderNode):
    """A sequence that after a failure goes on with the child that failed."""

    GOES_ON_AFTER = Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child, but only after a success."""
        if new_status == Status.SUCCESS:
            self.index = 0


def _position(board: Board) -> tuple[float, float]:
    return float(board.inputs.pose[0]), float(board.inputs.pose[1])
