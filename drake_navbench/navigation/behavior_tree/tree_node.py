"""The nodes that others build on: status, memory, and how children are run and made idle.

py_trees' own Sequence and Selector are not used: when they end, their children keep their last
status, and Nav2's nodes would take a kept `RUNNING` for a child that still runs. BehaviorTree.CPP
makes the children idle when the parent ends, and so do these nodes. Idle is `Status.INVALID` here.

Everything that a node remembers beyond its status is named in its `MEMORY`, so that a snapshot can
take it (see `drake_navbench.navigation.behavior_tree.snapshot`).
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

    def tick_anew(self) -> Iterator[Behaviour]:
        """Ticks a node as if it had been idle; reports its status only where it is another one."""
        before, listener = self.status, self.on_change
        self.on_change = _ignore
        try:
            self.stop(Status.INVALID)
            yield from self.tick()
        finally:
            self.on_change = listener
        if self.status != before:
            listener(self.name, self.status)

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
            make_idle(child)


def make_idle(node: Behaviour) -> None:
    """Makes a node idle, which halts it if it runs."""
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
