"""The compute times of control cycles, and how late these make the commands."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.errors import InputError
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings

# The wall-clock and the processor time of each cycle, ms.
ComputeTimes = Sequence[tuple[float, float]]
# A control period has this many ticks. After a cycle that missed its period the next cycle begins
# at the next tick; in Nav2 it begins at once.
TICKS_A_PERIOD = 4


class ComputeClock:
    """Computes how late a cycle's command is, by the rule `compute_time` of the robot's timing.

    logged: the times of all cycles of an earlier run of the trial, which replace measured ones.
    """

    def __init__(self, timing: Timeline[TimingSettings], logged: ComputeTimes | None) -> None:
        self._timing = timing
        self._logged = logged

    @property
    def is_needed(self) -> bool:
        """Whether any cycle takes time."""
        return self._timing.any(lambda timing: timing.compute_time != 0.0)

    def ticks_a_period(self, period_s: float) -> int:
        """Returns the number of ticks in a control period; at each tick a cycle may begin.

        It is 1 where no cycle can take longer than a period, else TICKS_A_PERIOD.
        """

        def is_short(timing: TimingSettings) -> bool:
            given = timing.compute_time
            return not isinstance(given, str) and 1e-3 * given < period_s

        return TICKS_A_PERIOD if self._timing.any(lambda timing: not is_short(timing)) else 1

    def known(self, cycle: int, measured: tuple[float, float]) -> tuple[float, float]:
        """Returns the wall-clock and processor time of a cycle, ms; raises InputError.

        cycle: counted from 0. measured: its times in this run; they are returned unless the trial
        repeats the times of a log.
        """
        if self._logged is None:
            return measured
        if cycle >= len(self._logged):
            raise InputError(
                f"compute times: the log has {len(self._logged)} cycles, this trial more; they "
                "are of another trial"
            )
        return self._logged[cycle]

    def late_s(self, now_s: float, wall_ms: float) -> float:
        """Returns the lateness, s, of a cycle that begins now and took `wall_ms` of wall clock."""
        timing = self._timing.at(now_s)
        if timing.compute_time == "measured":
            return 1e-3 * wall_ms
        if timing.compute_time == "scaled":
            return 1e-3 * wall_ms * timing.compute_time_scale
        return 1e-3 * float(timing.compute_time)
