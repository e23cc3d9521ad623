"""How long control cycles take, and what follows from it."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.errors import InputError
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings

# Of each cycle: wall-clock and processor time, ms.
ComputeTimes = Sequence[tuple[float, float]]
# A cycle that missed its period is followed by the next one at the next of so many parts of it;
# Nav2 begins it at once.
TICKS_A_PERIOD = 4


class ComputeClock:
    """Tells how late the command of a cycle is, by the timing's `compute_time`.

    logged: the times of all cycles of an earlier run of the trial, in place of those measured.
    """

    def __init__(self, timing: Timeline[TimingSettings], logged: ComputeTimes | None) -> None:
        self._timing = timing
        self._logged = logged

    @property
    def is_needed(self) -> bool:
        """Whether any cycle takes time."""
        return self._timing.any(lambda timing: timing.compute_time != 0.0)

    def ticks_a_period(self, period_s: float) -> int:
        """Returns how often a period to look whether a cycle may begin: once where none is late."""

        def is_short(timing: TimingSettings) -> bool:
            given = timing.compute_time
            return not isinstance(given, str) and 1e-3 * given < period_s

        return TICKS_A_PERIOD if self._timing.any(lambda timing: not is_short(timing)) else 1

    def known(self, cycle: int, measured: tuple[float, float]) -> tuple[float, float]:
        """Returns the times, ms, that count for a cycle, the first being 0; raises InputError."""
        if self._logged is None:
            return measured
        if cycle >= len(self._logged):
            raise InputError(
                f"compute times: found those of {len(self._logged)} cycles, expected more; they "
                "are of another trial"
            )
        return self._logged[cycle]

    def late_s(self, now_s: float, wall_ms: float) -> float:
        """Returns how long a cycle that begins now takes, s, whose wall-clock time is known."""
        timing = self._timing.at(now_s)
        if timing.compute_time == "measured":
            return 1e-3 * wall_ms
        if timing.compute_time == "scaled":
            return 1e-3 * wall_ms * timing.compute_time_scale
        return 1e-3 * float(timing.compute_time)
