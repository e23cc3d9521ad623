"""Changes of the controllers' ranks from a scenario to a harsher variant of it.

A controller's rank in a scenario is 1 + the number of controllers that beat it there. One beats
another if it reaches the goal in more trials, or in as many trials and faster: its mean time over
the trials that arrive is shorter by more than RELEVANT_RATIO.

Whether a change is shown is decided from the ranks in each single seed, which both scenarios share:
Wilcoxon's test of their changes, corrected for all controllers and scenarios together (`pairs`). So
fewer than six seeds show no change, unless nothing in the trials is random.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.paired_comparison import compare_differences
from drake_navbench.analysis.pairs import RELEVANT_RATIO, holm, smallest_p_value, values_by_seed
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.statistics import CONFIDENCE
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.kernels.arrays import Array


class Placing(NamedTuple):
    """The rank of a controller in a scenario, and the number of its trials that arrived."""

    arrived: int
    trials: int
    rank: int


class RankChange(NamedTuple):
    """A controller in a clean and in a harsher scenario.

    by_seed: (seeds,) the change of its rank in each seed alone. p_value: p-value of these changes,
    adjusted for all changes of a call; 0 or 1 where nothing in the trials is random.
    """

    clean_scenario: str
    scenario: str
    controller: str
    clean: Placing
    harsh: Placing
    by_seed: Array
    p_value: float

    @property
    def is_shown(self) -> bool:
        """Whether the change is shown: its p-value is small enough, and the ranks by seed agree.

        They agree if the sum of their changes has the sign of the change over all seeds.
        """
        is_same_way = (self.harsh.rank - self.clean.rank) * self.by_seed.sum() > 0.0
        return is_same_way and self.p_value < 1.0 - CONFIDENCE

    @property
    def words(self) -> str:
        """The change of the controller's place, as far as the trials show it."""
        if not self.is_shown:
            return "no change shown"
        return "falls" if self.harsh.rank > self.clean.rank else "rises"


def rank_changes(trials: pd.DataFrame, clean_of: Mapping[str, str]) -> list[RankChange]:
    """Returns the rank changes of all scenarios driven together with their clean scenario.

    trials: rows as in trials.parquet. clean_of: harsher scenario -> its clean scenario.
    """
    driven = set(trials["scenario"]) if len(trials) else set()
    changes = [
        change
        for scenario, clean in clean_of.items()
        if {scenario, clean} <= driven
        for change in _changes(trials, clean, scenario)
    ]
    smallest = [smallest_p_value(int(np.count_nonzero(change.by_seed)), 1) for change in changes]
    adjusted = holm([change.p_value for change in changes], smallest)
    return [c._replace(p_value=float(p)) for c, p in zip(changes, adjusted, strict=True)]


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
    """Returns the changes of all controllers of both scenarios, their p-values not yet adjusted."""
    names = (clean, scenario)
    rows = trials.assign(arrived=(~is_failed(trials)).astype(float))
    arrived = [values_by_seed(rows, name, "arrived") for name in names]
    controllers = [name for name in arrived[0] if name in arrived[1]]
    seeds = pd.concat([table[controllers] for table in arrived], axis=1).dropna().index
    if not controllers or seeds.empty:
        return []
    times_s = [values_by_seed(rows, name, "time_to_goal_s") for name in names]
    placings, single = [], []
    for came, time_s in zip(arrived, times_s, strict=True):
        came, time_s = (table.loc[seeds, controllers] for table in (came, time_s))
        ranks = ranks_of(came.mean().to_numpy(), time_s.mean().to_numpy())
        counts = came.sum().astype(int)
        placings.append(
            [Placing(n, len(seeds), int(r)) for n, r in zip(counts, ranks, strict=True)]
        )
        single.append(ranks_of(came.to_numpy(), time_s.to_numpy()))
    cells = {(name, controller) for name in names for controller in controllers}
    is_certain = cells <= repeated_cells(trials)
    return [
        RankChange(
            clean, scenario, controller, before, after, by_seed, _p_value(by_seed, is_certain)
        )
        for controller, before, after, by_seed in zip(
            controllers, *placings, (single[1] - single[0]).T.astype(float), strict=True
        )
    ]


def _p_value(by_seed: Array, is_certain: bool) -> float:
    """Returns the p-value of the changes of a rank; is_certain: nothing in them is random."""
    return float(not by_seed.any()) if is_certain else compare_differences(by_seed).p_value


def ranks_of(arrived: Array, time_s: Array) -> NDArray[np.int64]:
    """Returns (..., controllers) ranks from 1.

    arrived, time_s: (..., controllers), the share of trials that arrived and their mean time, NaN
    where none did.
    """
    # The last axes: the controller that may be beaten, the one that may beat it.
    own_share, other_share = arrived[..., :, None], arrived[..., None, :]
    is_quicker = time_s[..., None, :] < time_s[..., :, None] * (1.0 - RELEVANT_RATIO)
    beats = (other_share > own_share) | ((other_share == own_share) & is_quicker)
    return np.asarray(1 + beats.sum(axis=-1))
