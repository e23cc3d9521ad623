"""The pace of the simulation: the wall clock's, or that of the stack's commands."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

# A simulation that is later than this does not try to catch up, s.
MOST_LATE_S = 0.2
SLACK_S = 1e-6
PERCENTILES = (50, 99)
MS_PER_S = 1000.0


class Pace:
    """Holds the simulation back at each step of its clock.

    rate: simulated seconds a second; None: each step in which a command is due waits for one, for
    `patience_s` at most. A stack that sends no command in its time, as while it plans, gets the
    wall clock's pace until it sends one again; so the simulation never outruns it.
    """

    def __init__(
        self,
        rate: float | None,
        *,
        command_period_s: float,
        patience_s: float,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._rate = rate
        self._command_period_s = command_period_s
        self._patience_s = patience_s
        self._now, self._sleep = now, sleep
        self._began: tuple[float, float] | None = None
        self._last_command_s = 0.0
        self._is_idle = False
        self.lateness_s: list[float] = []
        self.late_count = 0
        self.waited_count = 0
        self.missed_count = 0

    def begin(self, sim_s: float) -> None:
        """Starts counting from a simulated time."""
        self._began = sim_s, self._now()
        self._last_command_s = sim_s

    def hold(self, sim_s: float) -> None:
        """Sleeps until the step that ends at a simulated time is due."""
        rate = self._rate
        if rate is None:
            if not self._is_idle:
                return
            rate = 1.0
        if self._began is None:
            self.begin(sim_s)
            return
        began_sim_s, began_wall_s = self._began
        due_s = began_wall_s + (sim_s - began_sim_s) / rate
        left_s = due_s - self._now()
        if left_s > 0.0:
            self._sleep(left_s)
        late_s = self._now() - due_s
        self.lateness_s.append(late_s)
        if late_s > MOST_LATE_S:
            self.late_count += 1
            self._began = sim_s, self._now()

    def rest(self, sim_s: float) -> None:
        """Follows the wall clock until the next command, as the stack is gone."""
        if self._rate is None and not self._is_idle:
            self._is_idle = True
            self._began = sim_s, self._now()

    def patience_for_command_s(self, sim_s: float) -> float:
        """Returns the longest wait for a command in this step, s; 0 where none is due."""
        if self._rate is not None or self._is_idle:
            return 0.0
        is_due = sim_s - self._last_command_s >= self._command_period_s - SLACK_S
        return self._patience_s if is_due else 0.0

    def note_command(self, sim_s: float, *, has_come: bool) -> None:
        """Notes whether a step brought a command, after the wait for it."""
        was_asked = self.patience_for_command_s(sim_s) > 0.0
        if has_come:
            self.waited_count += was_asked
            self._last_command_s = sim_s
            self._is_idle = False
        elif was_asked:
            self.missed_count += 1
            self.rest(sim_s)

    def facts(self) -> dict[str, float]:
        """Returns the figures of the pace for the log, such as the lateness of steps in ms."""
        late = percentiles_ms(self.lateness_s)
        told = {f"clock_late_p{share}_ms": late[share] for share in PERCENTILES if share in late}
        return told | {
            "clock_stall_count": self.late_count,
            "awaited_command_count": self.waited_count,
            "missed_command_count": self.missed_count,
        }


def percentiles_ms(durations_s: Sequence[float]) -> dict[int, float]:
    """Returns percentiles of durations, ms, by share; empty without durations."""
    if not durations_s:
        return {}
    values = np.percentile(MS_PER_S * np.array(durations_s), PERCENTILES)
    return {share: round(float(value), 3) for share, value in zip(PERCENTILES, values, strict=True)}
