"""The inner nodes of Nav2's behaviour trees, by the rules of BehaviorTree.CPP.

py_trees' own Sequence and Selector are not used: when they end, their children keep their last
status, and Nav2's nodes would take a kept `RUNNING` for a child that still runs. BehaviorTree.CPP
makes the children idle when the parent ends, and so do these nodes. Idle is `Status.INVALID` here.

Everything that a node remembers beyond its status is named in its `MEMORY`, so that a snapshot can
take it (see `drake_navbench.navigation.behavior_tree.snapshot`).
Source: nav2_behavior_tree (RecoveryNode, PipelineSequence, NonblockingSequence, RoundRobinNode,
RateController) of branch lyrical, and BehaviorTree.CPP 4.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, ClassVar

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

# Times are compared in whole nanoseconds, as ROS keeps them, so that 1.03 s - 0.03 s is 1 s.
NANOSECOND_DIGITS = 9

StatusListener = Callable[[str, Status], None]


def _ignore(name: str, status: Status) -> None:
    """Ignores a change of status."""


class TreeNode(Behaviour):
    """A node that reports every change of its status and can be put into a snapshot."""

    MEMORY: ClassVar[tuple[str, ...]] = ()

    def __init__(self, name: str) -> None:
        self._status = Status.INVALID
        self.on_change: StatusListener = _ignore
        super().__init__(name)

    @property
    def status(self) -> Status:
        """The status of the node; INVALID is idle."""
        return self._status

    @status.setter
    def status(self, status: Status) -> None:
        if status != self._status:
            self._status = status
            self.on_change(self.name, status)

    def recall(self) -> tuple[Any, ...]:
        """Returns the values of `MEMORY`."""
        return tuple([getattr(self, name) for name in self.MEMORY])

    def restore_status(self, status: Status) -> None:
        """Sets the status without reporting it."""
        self._status = status

    def halt(self) -> None:
        """Clears the memory that outlives the node's end; called when the whole tree has ended."""

    @property
    def is_active(self) -> bool:
        """Whether the node was ticked since it was last idle."""
        return self.status != Status.INVALID


class ControlNode(TreeNode, Composite):
    """Base of the inner nodes: a subclass says in `_run` in which order to tick the children."""

    def __init__(self, name: str, children: Sequence[TreeNode]) -> None:
        super().__init__(name)
        self.add_children(list(children))

    def tick(self) -> Iterator[Behaviour]:
        """Ticks the children as the node's rule says; yields every node that was ticked."""
        if self.status != Status.RUNNING:
            self.initialise()
        status = yield from self._run()
        if status != Status.RUNNING:
            self._reset_children()
            self.terminate(status)
        self.status = status
        yield self

    def _run(self) -> Generator[Behaviour, None, Status]:
        raise NotImplementedError

    def _reset_children(self) -> None:
        """Makes all children idle, which halts those that run."""
        for child in self.children:
            _reset(child)


def _reset(node: Behaviour) -> None:
    if node.status != Status.INVALID:
        node.stop(Status.INVALID)


class InOrderNode(ControlNode):
    """Ticks its children in order, one after the other; goes on where a child still runs.

    GOES_ON_AFTER: the status with which a child lets the next one begin, and with which the node
    ends after the last child. With any other final status of a child the node ends at once, with
    that status.
    """

    MEMORY = ("index",)
    GOES_ON_AFTER: ClassVar[Status]

    def __init__(self, name: str, children: Sequence[TreeNode]) -> None:
        super().__init__(name, children)
        self.index = 0

    def _run(self) -> Generator[Behaviour, None, Status]:
        while self.index < len(self.children):
            child = self.children[self.index]
            yield from child.tick()
            if child.status != self.GOES_ON_AFTER:
                return child.status
            self.index += 1
        return self.GOES_ON_AFTER

    def terminate(self, new_status: Status) -> None:
        """Makes the next run begin with the first child."""
        self.index = 0


class SequenceNode(InOrderNode):
    """Success when all children succeeded in order."""

    GOES_ON_AFTER = Status.SUCCESS


class FallbackNode(InOrderNode):
    """Success with the first child that succeeds."""

    GOES_ON_AFTER = Status.FAILURE


class ReactiveSequenceNode(ControlNode):
    """As a sequence, but begins with the first child at every tick."""

    def _run(self) -> Generator[Behaviour, None, Status]:
        for child in self.children:
            yield from child.tick()
            if child.status == Status.RUNNING:
                _halt_others(self.children, child)
            if child.status != Status.SUCCESS:
                return child.status
        return Status.SUCCESS


class ReactiveFallbackNode(ControlNode):
    """As a fallback, but begins with the first child at every tick."""

    def _run(self) -> Generator[Behaviour, None, Status]:
        for child in self.children:
            yield from child.tick()
            if child.status == Status.RUNNING:
                _halt_others(self.children, child)
            if child.status != Status.FAILURE:
                return child.status
        return Status.FAILURE


def _halt_others(children: Sequence[Behaviour], running: Behaviour) -> None:
    """Halts the other running children; conditions keep their status, to compare with next time."""
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
                _reset(main)
                self.is_recovering = True
            yield from recovery.tick()
            if recovery.status != Status.SUCCESS:
                return recovery.status
            _reset(recovery)
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
