"""Follows a goal by the status messages of the stack's action server."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple


class GoalState(IntEnum):
    """The states of action_msgs/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_active(self) -> bool:
        """Whether the stack still works on the goal."""
        return self in (GoalState.ACCEPTED, GoalState.EXECUTING, GoalState.CANCELING)


class GoalEntry(NamedTuple):
    """One goal of a status message; accepted_ns: the stack's time when it took the goal."""

    goal_id: bytes
    state: GoalState
    accepted_ns: int = 0


class GoalWatch:
    """Follows one goal in the stack's status messages, which name all recent goals.

    The goal is sent over a topic, so that its id is unknown: it is the first id that did not exist
    before. Where a later goal replaces it, the later one is followed.
    """

    def __init__(self) -> None:
        self._known: dict[bytes, GoalEntry] = {}
        self._before: frozenset[bytes] = frozenset()
        self._followed: bytes | None = None

    @property
    def is_taken(self) -> bool:
        """Whether the stack has taken the goal that was sent last."""
        return self._followed is not None

    @property
    def state(self) -> GoalState:
        """The state of the followed goal, UNKNOWN before there is one."""
        entry = None if self._followed is None else self._known.get(self._followed)
        return GoalState.UNKNOWN if entry is None else entry.state

    @property
    def has_ended(self) -> bool:
        """Whether the stack has reached, cancelled or aborted the followed goal."""
        return self.state in (GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED)

    @property
    def any_active(self) -> bool:
        """Whether the stack works on any goal."""
        return any(entry.state.is_active for entry in self._known.values())

    def expect(self) -> None:
        """Forgets the followed goal: the next new id is that of the goal which is sent now."""
        self._before = frozenset(self._known)
        self._followed = None

    def forget(self) -> None:
        """Forgets everything: the stack was started anew."""
        self._known, self._followed, self._before = {}, None, frozenset()

    def note(self, entries: Iterable[GoalEntry]) -> None:
        """Takes in a status message, which names all goals that the stack remembers."""
        self._known = {entry.goal_id: entry for entry in entries}
        new = [entry for entry in self._known.values() if entry.goal_id not in self._before]
        if new:
            self._followed = max(new, key=lambda entry: entry.accepted_ns).goal_id
