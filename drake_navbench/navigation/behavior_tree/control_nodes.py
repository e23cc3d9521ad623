"""The inner nodes of Nav2's behaviour trees, by the rules of BehaviorTree.CPP.

Source: nav2_behavior_tree (RecoveryNode, PipelineSequence, NonblockingSequence, RoundRobinNode) of
branch lyrical, and BehaviorTree.CPP 4.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import ClassVar

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.tree_node import (
    ControlNode,
    InOrderNode,
    TreeNode,
    make_idle,
)


class SequenceNode(InOrderNode):
    """Success when all children succeeded in order."""

    GOES_ON_AFTER = Status.SUCCESS


class FallbackNode(InOrderNode):
    """Success with the first child that succeeds."""

    GOES_ON_AFTER = Status.FAILURE


class ReactiveNode(ControlNode):
    """Ticks its children in order, from the first on at every tick; ends as `InOrderNode` does.

    A child that ended beside one that runs is idle at the next tick, as since BehaviorTree.CPP
    3.8.6: GoalUpdated never succeeds there, TimeExpired and RateController begin anew.
    """

    GOES_ON_AFTER: ClassVar[Status]

    def _run(self) -> Generator[Behaviour, None, Status]:
        for child in self.children:
            assert isinstance(child, TreeNode)  # A tree has no others.
            has_ended = child.status in (Status.SUCCESS, Status.FAILURE)
            yield from child.tick_anew() if has_ended else child.tick()
            if child.status == Status.RUNNING:
                _halt_others(self.children, child)
            if child.status != self.GOES_ON_AFTER:
                return child.status
        return self.GOES_ON_AFTER


class ReactiveSequenceNode(ReactiveNode):
    """As a sequence, but begins with the first child at every tick."""

    GOES_ON_AFTER = Status.SUCCESS


class ReactiveFallbackNode(ReactiveNode):
    """As a fallback, but begins with the first child at every tick."""

    GOES_ON_AFTER = Status.FAILURE


def _halt_others(children: Sequence[Behaviour], running: Behaviour) -> None:
    """Halts the other running children."""
    for child in children:
        if child is not running and child.status == Status.RUNNING:
            child.stop(Status.INVALID)


class InverterNode(ControlNode):
    """Success where its only child fails, failure where the child succeeds."""

    def _run(self) -> Generator[Behaviour, None, Status]:
        (child,) = self.children
        yield from child.tick()
        inverted = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}
        return inverted.get(child.status, Status.RUNNING)


class RecoveryNode(ControlNode):
    """Ticks the first child; where it fails, ticks the second, and then the first again.

    number_of_retries: successes of the second child that are allowed before the node ends; the
    count starts anew only when the node ends or is halted, whatever the first child achieved in
    between. A failure of the second child ends the node at once.
    """

    MEMORY = ("is_recovering", "retry_count")

    def __init__(self, name: str, children: Sequence[TreeNode], *, number_of_retries: int) -> None:
        super().__init__(name, children)
        self.number_of_retries = number_of_retries
        self.is_recovering = False
        self.retry_count = 0

    def _run(self) -> Generator[Behaviour, None, Status]:
        main, recovery = self.children
        while True:
            if not self.is_recovering:
                yield from main.tick()
                if main.status != Status.FAILURE:
                    return main.status
                if self.retry_count >= self.number_of_retries:
                    return Status.FAILURE
                make_idle(main)
                self.is_recovering = True
            yield from recovery.tick()
            if recovery.status != Status.SUCCESS:
                return recovery.status
            make_idle(recovery)
            self.retry_count += 1
            self.is_recovering = False

    def terminate(self, new_status: Status) -> None:
        """Forgets the retries."""
        self.is_recovering = False
        self.retry_count = 0


class PipelineSequence(ControlNode):
    """Ticks every child from the first on at every tick, as far as it has ever got.

    A running child before the farthest one is ticked but does not hold up the others. Any failure
    halts all children; success when the last child succeeds.
    """

    MEMORY = ("farthest",)

    def __init__(self, name: str, children: Sequence[TreeNode]) -> None:
        super().__init__(name, children)
        self.farthest = 0

    def _run(self) -> Generator[Behaviour, None, Status]:
        for index, child in enumerate(self.children):
            yield from child.tick()
            if child.status == Status.FAILURE:
                return Status.FAILURE
            if child.status == Status.RUNNING and index >= self.farthest:
                self.farthest = index
                return Status.RUNNING
        return Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child."""
        self.farthest = 0


class NonblockingSequence(ControlNode):
    """Ticks all children at every tick; success when all succeed in one tick.

    Any failure halts all children.
    """

    def _run(self) -> Generator[Behaviour, None, Status]:
        result = Status.SUCCESS
        for child in self.children:
            yield from child.tick()
            if child.status == Status.FAILURE:
                return Status.FAILURE
            if child.status == Status.RUNNING:
                result = Status.RUNNING
        return result


class RoundRobinNode(ControlNode):
    """Ticks one child after another, and goes on with the next one when it is ticked again.

    When a child fails, the next one is ticked in the same tick. When a child succeeds, the node
    succeeds, and its next run begins with the child behind that one. The run after a failure of the
    node, or after it was halted while it ran, begins with the first child.

    wrap_around: the first child follows the last one, and the node fails when all children failed
    in a row. Without it, as in Nav2's lyrical tree, the node fails when the last child ends, even
    if that child succeeds (navigation2 issues 5033 and 5308).
    """

    MEMORY = ("index", "failure_count")

    def __init__(
        self, name: str, children: Sequence[TreeNode], *, wrap_around: bool = False
    ) -> None:
        super().__init__(name, children)
        self.wrap_around = wrap_around
        self.index = 0
        self.failure_count = 0

    def _run(self) -> Generator[Behaviour, None, Status]:
        while self.failure_count < len(self.children):
            child = self.children[self.index]
            yield from child.tick()
            if child.status == Status.RUNNING:
                return Status.RUNNING
            self.index += 1
            if self.index == len(self.children):
                if not self.wrap_around:
                    break
                self.index = 0
            if child.status == Status.SUCCESS:
                self.failure_count = 0
                return Status.SUCCESS
            self.failure_count += 1
        return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child after a failure or a halt."""
        is_halted = new_status == Status.INVALID and self.status == Status.RUNNING
        if is_halted or new_status == Status.FAILURE:
            self.halt()

    def halt(self) -> None:
        """Makes the next run begin with the first child."""
        self.index = 0
        self.failure_count = 0
