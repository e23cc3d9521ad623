"""Decorators that map the result of their only child, or tick it again; SequenceWithMemory.

Those that limit when a child is ticked are in `pacing`. Source: BehaviorTree.CPP 4, and of
GoalUpdater nav2_behavior_tree.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import ClassVar

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.tree_node import (
    ControlNode,
    InOrderNode,
    TreeNode,
)

Run = Generator[Behaviour, None, Status]
FOR_EVER = -1


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
    """Ticks its child again when it ends with AGAIN_AFTER; ends itself so after `limit` times.

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
    """A sequence that after a failure or a halt goes on with the child that did not succeed.

    It goes on there even after the end of the whole tree, as in BehaviorTree.CPP 4.
    """

    GOES_ON_AFTER = Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child, but only after a success."""
        if new_status == Status.SUCCESS:
            self.index = 0


class SequenceStar(SequenceWithMemory):
    """SequenceWithMemory of BehaviorTree.CPP 3 (up to Iron), which forgets when it is halted."""

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child, but not after a failure."""
        super().terminate(new_status)
        if new_status == Status.INVALID and self.status == Status.RUNNING:
            self.halt()

    def halt(self) -> None:
        """Makes the next run begin with the first child."""
        self.index = 0
