"""Messages on their way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drake_navbench.inputs.timeline import SLACK_S
from drake_navbench.kernels.immutable import Immutable


@dataclass(frozen=True)
class Mailbox(Immutable):
    """Messages that have arrived last or are on their way: (due s, message), as they were sent."""

    messages: tuple[tuple[float, Any], ...] = ()

    def newest(self, now_s: float) -> tuple[float, Any] | None:
        """Returns the message sent last of those that have arrived, None where none has."""
        for entry in reversed(self.messages):
            if entry[0] <= now_s + SLACK_S:
                return entry
        return None

    def with_message(self, message: Any, due_s: float, now_s: float) -> Mailbox:
        """Returns the mailbox with one more message, and without those that are outdated."""
        last = self.newest(now_s)
        kept = [one for one in self.messages if one is last or one[0] > now_s + SLACK_S]
        return Mailbox((*kept, (due_s, message)))
