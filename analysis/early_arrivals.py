"""Columns that count as arrived far before the goal, as by a wide tolerance of a goal checker."""

from __future__ import annotations

import pandas as pd

from drake_navbench.analysis.numbers import number
from drake_navbench.logs.outcome import EARLY_M, Outcome

ERROR = "goal_position_error_m"


def early_arrivals(trials: pd.DataFrame) -> list[str]:
    """Returns a sentence on each controller whose arrivals end EARLY_M or more before the goal.

    trials: a row a trial. The mean over all arrivals counts.
    """
    if ERROR not in trials:
        return []
    arrived = trials[(trials["outcome"] == Outcome.SUCCEEDED) & trials[ERROR].notna()]
    found = arrived.groupby("controller", sort=False)[ERROR].mean()
    return [
        f"{name} counts as arrived {number(mean_m, 2)} m before the goal on average, by its goal "
        "checker and its estimated pose: its times and lengths are those of a shorter way."
        for name, mean_m in found.items()
        if mean_m >= EARLY_M
    ]
