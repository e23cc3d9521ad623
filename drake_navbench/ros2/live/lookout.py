"""Watches the other participants of a domain: whether the stack is there, and no other robot."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.ros2.live.domain import LiveDomain
from drake_navbench.ros2.live.endpoints import (
    Endpoint,
    OwnTopic,
    may_be_robots,
    mismatches,
    publishers_of,
    robots_there,
)
from drake_navbench.ros2.live.parameters import LiveParameters
from drake_navbench.ros2.live.stack_topics import StackTopics

# The time to hear of everybody in a domain before anything is published, s.
LISTEN_S = 1.0
# The time between two looks at the endpoints, s.
LOOK_PERIOD_S = 0.2


class StackMissing(NavbenchError):
    """There is no stack in the domain, it took no goal, or it went away."""


class Lookout:
    """Looks at the endpoints of others, again and again.

    own: our topics, as others must have them. signs: the topics that only a robot publishes.
    faults: sentences on endpoints that cannot match ours. restart_count: how often the stack came
    back.
    """

    def __init__(
        self,
        domain: LiveDomain,
        parameters: LiveParameters,
        stack: StackTopics,
        *,
        own: Sequence[OwnTopic],
        signs: Sequence[str],
    ) -> None:
        self._domain, self._parameters, self._stack = domain, parameters, stack
        self._own = (*own, *stack.own)
        self._signs = signs
        self._looked_at = -math.inf
        self._gone_since: float | None = None
        self._known: set[bytes] = set()
        self.faults: list[str] = []
        self.restart_count = 0

    @property
    def is_stack_gone(self) -> bool:
        """Whether the stack was there and went away."""
        return self._gone_since is not None

    def listen(self) -> list[Endpoint]:
        """Listens before anything is published; returns the endpoints of others.

        Raises InputError where another robot is among them.
        """
        found = self._domain.wait_until(lambda found: bool(self._robots(found)), LISTEN_S)
        self._refuse(self._robots(found))
        return found

    def settle(self) -> None:
        """Remembers the stack that has taken the goal; raises InputError for another robot."""
        found = self._domain.endpoints()
        self._refuse(self._robots(found))
        self._known |= self._status_keys(found)

    def look(self) -> list[Endpoint] | None:
        """Returns the endpoints of others, once in LOOK_PERIOD_S; None in between."""
        now = time.monotonic()
        if now - self._looked_at < LOOK_PERIOD_S:
            return None
        self._looked_at = now
        found = self._domain.endpoints()
        self._stack.follow(found)
        for fault in mismatches(found, self._own):
            if fault not in self.faults:
                self.faults.append(fault)
        return found

    def is_new_stack(self, found: Sequence[Endpoint]) -> bool:
        """Returns whether the stack came back, or another process took its place.

        Raises StackMissing where it is gone for longer than the parameters allow.
        """
        missing = self._stack.missing(found)
        now = time.monotonic()
        if missing:
            self._gone_since = now if self._gone_since is None else self._gone_since
            gone_s = now - self._gone_since
            if gone_s > self._parameters.restart_timeout_s:
                raise StackMissing(f"live: the stack went away: {missing[0]} for {gone_s:.0f} s")
            return False
        keys = self._status_keys(found)
        if self._gone_since is None and keys <= self._known:
            return False
        self._gone_since = None
        self._known |= keys
        self.restart_count += 1
        return True

    def why_no_stack(self) -> str:
        """Returns the sentence for a stack that is missing or takes no goal."""
        parameters = self._parameters
        waited = f"within {parameters.start_timeout_s:g} s"
        missing = self._stack.missing(self._domain.endpoints())
        if missing:
            what = f"no stack in domain {parameters.domain} {waited}: {missing[0]}"
        else:
            goal = parameters.topic("goal_pose")
            what = f"the stack in domain {parameters.domain} took no goal of {goal} {waited}"
        return "; ".join([f"live: {what}", *self.faults[:1]])

    def _robots(self, found: Sequence[Endpoint]) -> list[str]:
        signs = robots_there(found, self._signs)
        if not self._parameters.allows_listeners:
            signs += may_be_robots(found, self._parameters.topic("cmd_vel"))
        return signs

    def _refuse(self, signs: Sequence[str]) -> None:
        if signs:
            raise InputError(
                f"live: domain {self._parameters.domain} is in use by another robot: {signs[0]}; "
                "expected a domain without one"
            )

    def _status_keys(self, found: Sequence[Endpoint]) -> set[bytes]:
        topic = self._parameters.topic("goal_status")
        return {one.key for one in publishers_of(found, topic)}
