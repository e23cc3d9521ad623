"""The most trials that a search can drive, and the time that they take at the baseline's speed."""

from __future__ import annotations

import math
from typing import NamedTuple

from drake_navbench.studies.tuning.guards import WORLDS_IN_SEARCH, Guards
from drake_navbench.studies.tuning.request import TuningRequest

MINUTE_S, HOUR_S = 60.0, 3600.0


class Forecast(NamedTuple):
    """The largest number of trials that a search can drive.

    each: trials of the baseline and of each configuration. judgement: trials of the front and the
    baseline, on fresh seeds. A configuration that is dropped drives fewer.
    """

    configurations: int
    each: int
    judgement: int

    @property
    def trials(self) -> int:
        """The number of all trials, those of the baseline included."""
        return (self.configurations + 1) * self.each + self.judgement

    @property
    def text(self) -> str:
        """The number of trials in a sentence."""
        search = self.trials - self.judgement
        judged = f" and {self.judgement} to judge the front" if self.judgement else ""
        return (
            f"At most {self.trials} trials: {search} for the baseline and "
            f"{self.configurations} configurations{judged}. Ctrl-C stops; the same command goes on."
        )

    def time_text(self, baseline_s: float, known: int) -> str:
        """Returns a sentence with an upper bound of the remaining time.

        baseline_s: duration of the baseline's trials, which load the kernels as well. known:
        configurations of the study that were driven before.
        """
        left = max(self.configurations - known, 0) * self.each + self.judgement
        return (
            f"The baseline's {self.each} trials took {baseline_s:.0f} s: the rest takes at most "
            f"about {duration_text(left * baseline_s / self.each)}."
        )


def forecast_of(request: TuningRequest, guards: Guards) -> Forecast:
    """Returns the forecast of a search; request: with the tasks on its map drawn."""
    has_worlds = bool(guards.worlds)
    each = request.most_pairs + len(guards.closed) + WORLDS_IN_SEARCH * has_worlds
    if request.search_only:
        return Forecast(request.configurations, each, 0)
    columns = min(request.most_front_points, request.configurations) + 1
    seen, held_out = (
        len(scenarios) * request.trials_in(scenarios)
        for scenarios in (request.scenarios, request.held_out)
    )
    touches = request.fresh * (len(guards.closed) + has_worlds)
    return Forecast(request.configurations, each, columns * (seen + held_out + touches))


def duration_text(seconds: float) -> str:
    """Returns a time as minutes, from an hour and a half on as hours: '1 min', '2.5 h'."""
    if seconds < 1.5 * HOUR_S:
        return f"{max(math.ceil(seconds / MINUTE_S), 1)} min"
    return f"{seconds / HOUR_S:.1f} h"
