"""Decorators that limit when, and how often, their only child is ticked.

Source: nav2_behavior_tree (RateController, DistanceController, SpeedController, SingleTrigger,
GoalUpdatedController, PathLongerOnApproach), branches humble to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.tree_node import (
    NANOSECOND_DIGITS,
    ControlNode,
    TreeNode,
    make_idle,
)
from drake_navbench.plugins.releases import Release

Run = Generator[Behaviour, None, Status]
# The time over which Nav2's navigator averages the odometry, s.
ODOMETRY_WINDOW_S = 0.3


class RateController(ControlNode):
    """Ticks its child at first, while it runs, and once 1/hz has passed since its success.

    In between the node reports that it runs. Nav2 measures the period on the wall clock, even in a
    simulation; here it is simulated time.
    """

    MEMORY = ("is_first", "last_success_s")

    def __init__(
        self, name: str, child: TreeNode, *, hz: float, now_s: Callable[[], float]
    ) -> None:
        super().__init__(name, [child])
        self._period_s = 1.0 / hz
        self._now_s = now_s
        self.is_first = True
        self.last_success_s = 0.0

    def _run(self) -> Generator[Behaviour, None, Status]:
        (child,) = self.children
        elapsed_s = round(self._now_s() - self.last_success_s, NANOSECOND_DIGITS)
        if self.is_first or child.status == Status.RUNNING or elapsed_s >= self._period_s:
            self.is_first = False
            yield from child.tick()
            if child.status == Status.SUCCESS:
                self.last_success_s = self._now_s()
            return child.status
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Ticks the child at once after the node was idle."""
        if new_status == Status.INVALID:
            self.is_first = True


class GoalUpdatedController(ControlNode):
    """Ticks its child at first, while it runs, and whenever the goal is another one.

    In between the node reports that it runs.
    """

    MEMORY = ("last_goal_id",)

    def __init__(self, name: str, child: TreeNode, *, goal_id: Callable[[], int]) -> None:
        super().__init__(name, [child])
        self._goal_id = goal_id
        self.last_goal_id: int | None = None

    def _run(self) -> Generator[Behaviour, None, Status]:
        (child,) = self.children
        is_new = self._goal_id() != self.last_goal_id
        self.last_goal_id = self._goal_id()
        if is_new or child.status == Status.RUNNING:
            yield from child.tick()
            return child.status
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Ticks the child at once after the node was idle."""
        if new_status == Status.INVALID:
            self.last_goal_id = None


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
    the node succeeds; a child that runs then is neither ticked nor halted, as in Nav2. Its memory
    survives a halt, except in Iron. source: the path's variable.
    """

    MEMORY = ("path", "is_first", "plan_id")

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
        self.plan_id = 0

    def _run(self) -> Run:
        (child,), values = self.children, self._board.values
        before, path = self.path, values.paths.get(self._source)
        is_iron = self._board.release is Release.IRON
        same_goal = before is not None and path is not None and np.array_equal(before[-1], path[-1])
        self.is_first |= not self.is_active if is_iron else not same_goal
        if before is not None and path is not None and same_goal and not self.is_first:
            # Iron compares whole paths, with the stamp of the plan; the others numbers of poses.
            is_planned = values.plan_count != self.plan_id
            is_updated = len(before) != len(path) or (is_iron and is_planned)
            if is_updated and self._is_much_longer(before, path):
                yield from child.tick()
                if child.status == Status.RUNNING:
                    return Status.RUNNING
                self.path, self.plan_id = path, values.plan_count
                return child.status
        self.path, self.is_first, self.plan_id = path, False, values.plan_count
        return Status.SUCCESS

    def _is_much_longer(self, before: NDArray[np.float64], path: NDArray[np.float64]) -> bool:
        before_m = arc_length(before)
        return before_m < self._near_m and arc_length(path) > self._factor * before_m

    def _reset_children(self) -> None:
        """Makes the child idle unless it runs."""
        if self.children[0].status != Status.RUNNING:
            super()._reset_children()

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Halts the child only while the node itself runs."""
        if self.status == Status.RUNNING:
            super().stop(new_status)
        else:
            self.status = new_status

    def halt(self) -> None:
        """Halts the child with the whole tree."""
        make_idle(self.children[0])


def _position(board: Board) -> tuple[float, float]:
    return float(board.inputs.pose[0]), float(board.inputs.pose[1])
