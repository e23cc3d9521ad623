"""Changes of the controllers' ranks from a scenario to a harsher variant of it.

A controller's rank in a scenario is 1 + the number of controllers that beat it there. One beats
another if it reaches the goal in more trials, or in as many trials and faster: its mean time over
the trials that arrive is shorter by more than RELEVANT_RATIO. The intervals come from a bootstrap
over the seeds. Each resample draws the same seeds in both scenarios, so that trials stay paired.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


class MeanRankChange(NamedTuple):
    """A controller's rank in the mean over some scenarios and over others.

    arrived, trials: numbers in `scenarios`, then in `others`. change: of the mean rank, 95%
    interval.
    """

    controller: str
    mean_ranks: tuple[float, float]
    arrived: tuple[int, int]
    trials: tuple[int, int]
    change: Interval

    @property
    def is_shown(self) -> bool:
        """Whether the trials show that the mean rank changes."""
        return self.change.excludes(0.0)


def mean_rank_changes(
    trials: pd.DataFrame, scenarios: Sequence[str], others: Sequence[str]
) -> list[MeanRankChange]:
    """Returns the change of each controller's mean rank from `scenarios` to `others`.

    trials: rows as in trials.parquet. Only controllers that drove in all these scenarios count.
    Each scenario has its own seeds, so the bootstrap draws seeds in each scenario separately. The
    result is empty if no controller counts, or if a scenario has no seed that all of them drove.
    """
    names = [*scenarios, *others]
    driven = trials[trials["scenario"].isin(names)]
    counts = driven.groupby("controller", sort=False)["scenario"].nunique()
    controllers = [str(name) for name, count in counts.items() if count == len(names)]
    if not controllers:
        return []
    generator = np.random.default_rng(0)
    ranks, spread, arrivals, trial_counts = [], [], [], []
    for name in names:
        tables = _by_seed(driven[driven["scenario"] == name], controllers)
        arrived, times = (table.to_numpy(dtype=float)[None] for table in tables)
        count = arrived.shape[1]
        if count == 0:
            return []
        everyone = np.arange(count)[None]
        drawn = np.broadcast_to(everyone, (RESAMPLES, count))
        if count >= MIN_SEEDS:
            drawn = generator.integers(count, size=(RESAMPLES, count))
        ranks.append(_ranks(arrived, times, everyone)[0, 0])
        spread.append(_ranks(arrived, times, drawn)[0])
        arrivals.append(arrived[0].sum(axis=0))
        trial_counts.append(count)
    parts = (slice(len(scenarios)), slice(len(scenarios), None))
    means = [np.mean(ranks[part], axis=0) for part in parts]
    changes = np.mean(spread[parts[1]], axis=0) - np.mean(spread[parts[0]], axis=0)
    came = [np.sum(arrivals[part], axis=0) for part in parts]
    return [
        MeanRankChange(
            name,
            (float(means[0][i]), float(means[1][i])),
            (int(came[0][i]), int(came[1][i])),
            (sum(trial_counts[parts[0]]), sum(trial_counts[parts[1]])),
            _interval(changes[:, i]),
        )
        for i, name in enumerate(controllers)
    ]


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
    tables = [_by_seed(both[both["scenario"] == name], controllers) for name in (clean, scenario)]
    seeds = tables[0][0].index.intersection(tables[1][0].index)
    if seeds.empty:
        return []
    arrived, times = (
        np.stack([table[part].loc[seeds].to_numpy(dtype=float) for table in tables])
        for part in (0, 1)
    )
    everyone = np.arange(len(seeds))[None]
    ranks = _ranks(arrived, times, everyone)[:, 0]
    drawn = everyone
    if len(seeds) >= MIN_SEEDS:
        drawn = np.random.default_rng(0).integers(len(seeds), size=(RESAMPLES, len(seeds)))
    spread = _ranks(arrived, times, drawn)
    placings = [
        [
            Placing(
                int(arrived[which, :, i].sum()),
                len(seeds),
                int(ranks[which, i]),
                _interval(spread[which, :, i]),
            )
            for i in range(len(controllers))
        ]
        for which in (0, 1)
    ]
    return [
        RankChange(clean, scenario, name, placings[0][i], placings[1][i], change)
        for i, name in enumerate(controllers)
        for change in [_interval(spread[1, :, i] - spread[0, :, i])]
    ]


def _by_seed(rows: pd.DataFrame, controllers: list[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Returns arrivals (0 or 1) and times, s: two tables, a row a seed, a column a controller.

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


def _ranks(
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


def _interval(values: NDArray[np.int64] | NDArray[np.float64]) -> Interval:
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(values, [tail, 100.0 - tail], method="nearest")
    return Interval(float(low), float(high))
