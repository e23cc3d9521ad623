"""Changes of the controllers' ranks from a scenario to a harsher variant of it.

A controller's rank in a scenario is 1 + the number of controllers that beat it there. One beats
another if it reaches the goal in more trials, or in as many trials and faster: its mean time over
the trials that arrive is shorter by more than RELEVANT_RATIO. The intervals come from a bootstrap
over the seeds. Each resample draws the same seeds in both scenarios, so that trials stay paired.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.pairs import RELEVANT_RATIO
from drake_navbench.analysis.statistics import CONFIDENCE, Interval
from drake_navbench.analysis.verdicts import is_failed

# More resamples do not move the ends of an interval of whole ranks.
RESAMPLES = 1000
MIN_SEEDS = 2


class Placing(NamedTuple):
    """The rank of a controller in a scenario, with its 95% interval."""

    arrived: int
    trials: int
    rank: int
    interval: Interval

    @property
    def text(self) -> str:
        """The rank with its interval."""
        low, high = (int(end) for end in self.interval)
        return f"{self.rank}" if low == high else f"{self.rank} ({low} to {high})"


class RankChange(NamedTuple):
    """A controller in a clean and in a harsher scenario; change: of the rank, 95% interval."""

    clean_scenario: str
    scenario: str
    controller: str
    clean: Placing
    harsh: Placing
    change: Interval

    @property
    def is_shown(self) -> bool:
        """Whether the trials show that the rank changes."""
        return self.change.excludes(0.0)

    @property
    def words(self) -> str:
        """The change of the controller's place, as far as the trials show it."""
        if not self.is_shown:
            return "no change shown"
        return "falls" if self.change.low > 0.0 else "rises"


def rank_changes(trials: pd.DataFrame, clean_of: Mapping[str, str]) -> list[RankChange]:
    """Returns the rank changes of all scenarios driven together with their clean scenario.

    trials: rows as in trials.parquet. clean_of: harsher scenario -> its clean scenario.
    """
    driven = set(trials["scenario"]) if len(trials) else set()
    changes = []
    for scenario, clean in clean_of.items():
        if {scenario, clean} <= driven:
            changes += _changes(trials, clean, scenario)
    return changes


def sentence(changes: list[RankChange]) -> str:
    """Returns a sentence on how the order changes from a clean scenario to a harsher one."""
    first = changes[0]
    moves = [
        f"{change.controller} {change.words} from rank {change.clean.rank} to {change.harsh.rank}"
        for change in changes
        if change.is_shown
    ]
    told = "; ".join(moves) if moves else "no change of a rank is shown"
    lost = sum(change.clean.arrived - change.harsh.arrived for change in changes)
    trials = sum(change.harsh.trials for change in changes)
    arrivals = f", and {lost} more of {trials} trials do not arrive" if lost > 0 else ""
    return f"From {first.clean_scenario} to {first.scenario} {told}{arrivals}."


def _changes(trials: pd.DataFrame, clean: str, scenario: str) -> list[RankChange]:
    both = trials[trials["scenario"].isin([clean, scenario])]
    controllers = [
        name
        for name in dict.fromkeys(both["controller"])
        if both.loc[both["controller"] == name, "scenario"].nunique() == 2
    ]
    if not controllers:
        return []
    tables = [by_seed(both[both["scenario"] == name], controllers) for name in (clean, scenario)]
    seeds = tables[0][0].index.intersection(tables[1][0].index)
    if seeds.empty:
        return []
    arrived, times = (
        np.stack([table[part].loc[seeds].to_numpy(dtype=float) for table in tables])
        for part in (0, 1)
    )
    everyone = np.arange(len(seeds))[None]
    ranks = ranks_of(arrived, times, everyone)[:, 0]
    drawn = everyone
    if len(seeds) >= MIN_SEEDS:
        drawn = np.random.default_rng(0).integers(len(seeds), size=(RESAMPLES, len(seeds)))
    spread = ranks_of(arrived, times, drawn)
    placings = [
        [
            Placing(
                int(arrived[which, :, i].sum()),
                len(seeds),
                int(ranks[which, i]),
                interval_of(spread[which, :, i]),
            )
            for i in range(len(controllers))
        ]
        for which in (0, 1)
    ]
    return [
        RankChange(clean, scenario, name, placings[0][i], placings[1][i], change)
        for i, name in enumerate(controllers)
        for change in [interval_of(spread[1, :, i] - spread[0, :, i])]
    ]


def by_seed(rows: pd.DataFrame, controllers: list[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Returns two tables, a row a seed and a column a controller: arrivals (0 or 1) and times, s.

    The time of a trial that did not arrive is NaN.
    """
    rows = rows.assign(arrived=(~is_failed(rows)).astype(float))
    rows["time"] = rows["time_to_goal_s"].where(rows["arrived"] > 0.0)
    tables = [
        rows.pivot_table(index="seed", columns="controller", values=name, dropna=False).reindex(
            columns=controllers
        )
        for name in ("arrived", "time")
    ]
    known = tables[0].dropna().index
    return tables[0].loc[known], tables[1].reindex(known)


def ranks_of(
    arrived: NDArray[np.float64], times: NDArray[np.float64], drawn: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Returns (scenarios, draws, controllers) ranks from 1.

    arrived, times: (scenarios, seeds, controllers). drawn: (draws, seeds) the indices of the seeds
    that count.
    """
    share = arrived[:, drawn].mean(axis=2)
    known = np.isfinite(times)[:, drawn]
    count = known.sum(axis=2)
    total = np.where(known, times[:, drawn], 0.0).sum(axis=2)
    mean = np.divide(total, count, out=np.full(total.shape, np.inf), where=count > 0)
    # Axes: scenario, draw, the controller that may be beaten, the one that may beat it.
    own_share, other_share = share[..., :, None], share[..., None, :]
    own_time, other_time = mean[..., :, None], mean[..., None, :]
    is_quicker = other_time < own_time * (1.0 - RELEVANT_RATIO)
    beats = (other_share > own_share) | ((other_share == own_share) & is_quicker)
    return np.asarray(1 + beats.sum(axis=3))


def interval_of(values: NDArray[np.int64] | NDArray[np.float64]) -> Interval:
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(values, [tail, 100.0 - tail], method="nearest")
    return Interval(float(low), float(high))
