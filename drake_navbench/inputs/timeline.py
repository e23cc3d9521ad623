"""Settings that change during a trial."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from drake_navbench.kernels.immutable import Immutable

Settings = TypeVar("Settings")
# Event times are sums of floating-point numbers: an update due at 0.3 s may run a little earlier.
SLACK_S = 1e-9


@dataclass(frozen=True)
class Timeline(Immutable, Generic[Settings]):
    """The settings by time: settings[i] hold from starts_s[i] on, the first from 0 on."""

    starts_s: tuple[float, ...]
    settings: tuple[Settings, ...]

    @classmethod
    def constant(cls, settings: Settings) -> Timeline[Settings]:
        """Returns a timeline on which nothing changes."""
        return cls((0.0,), (settings,))

    def at(self, time_s: float) -> Settings:
        """Returns the settings at a time."""
        if len(self.settings) == 1:
            return self.settings[0]
        return self.settings[max(bisect_right(self.starts_s, time_s + SLACK_S) - 1, 0)]

    def any(self, test: Callable[[Settings], bool]) -> bool:
        """Returns whether `test` is true of the settings at any time."""
        return any(map(test, self.settings))


def timeline(
    usual: Settings, changes: Iterable[tuple[float, float, Callable[[Settings], Settings]]]
) -> Timeline[Settings]:
    """Returns the timeline of usual settings with changes (from s, until s, function).

    A function maps settings to changed settings. Where several changes hold at once, the later one
    in the list is applied last.
    """
    listed = list(changes)
    starts = sorted({0.0, *(time for begin, end, _ in listed for time in (begin, end))})
    settings = []
    for start in starts:
        now = usual
        for begin, end, change in listed:
            if begin <= start < end:
                now = change(now)
        settings.append(now)
    return Timeline(tuple(starts), tuple(settings))
