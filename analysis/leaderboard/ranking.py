"""Ranks of controllers over all scenarios of a suite; undecided controllers share a rank.

A controller beats another if it is shown to be better. Three quantities are compared in turn, each
only where the one before is not shown to differ: arrivals, touches, and the time to the goal where
both arrive. A controller that touches something more often than another cannot beat it: an honest
stop may be expected, a touch never is. Arrivals come before touches, since a robot that stands
still touches nothing.

The compared value is the mean over the scenarios, paired by trial: trial 3 of one seed in all
scenarios is one pair. All intervals hold together with 95% confidence (Bonferroni). A controller's
interval of ranks follows from them: its lower end is 1 + the number of controllers that beat it,
its upper end the number of controllers that it does not beat, itself included.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.paired_comparison import PairedComparison, paired_comparison
from drake_navbench.analysis.pairs import confidence_of_each, gap, shares_differ
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.statistics import (
    Interval,
    Summary,
    share_interval,
    summarize,
)
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.logs.outcome import Outcome

# The column that tells apart the runs of a suite's seeds in a table of their trials.
RUN_SEED = "run_seed"
PAIRED_BY = [RUN_SEED, "trial"]
QUANTITIES = 3


class Standing(NamedTuple):
    """The place of a controller on the leaderboard, with the numbers behind it.

    interval: interval of the rank. success: the share of trials that arrived, with Wilson's
    interval.
    touched: the number of trials that ended at a touch. time_s: the time to the goal of the
    trials that arrived, as the mean over the scenarios.
    """

    controller: str
    rank: int
    interval: Interval
    arrived: int
    touched: int
    trials: int
    success: float
    success_interval: Interval
    time_s: Summary


class Duel(NamedTuple):
    """The comparison of two controllers, second minus first; winner: '' where undecided.

    decided_by: 'arrivals', 'touches', 'time', or '' without a winner. denied: the controller that
    would have won, had it not touched something more often than the other.
    """

    first: str
    second: str
    arrivals: PairedComparison
    touches: PairedComparison
    time_s: PairedComparison
    winner: str
    decided_by: str
    denied: str = ""


class Ranking(NamedTuple):
    """All controllers by their ranks, and the comparison of every two of them."""

    standings: tuple[Standing, ...]
    duels: tuple[Duel, ...]

    @property
    def groups(self) -> list[tuple[int, list[Standing]]]:
        """The ranks with the controllers that share each."""
        ranks = sorted({standing.rank for standing in self.standings})
        return [(rank, [s for s in self.standings if s.rank == rank]) for rank in ranks]


def rank(trials: pd.DataFrame) -> Ranking:
    """Returns the ranking of the controllers in a table of trials.

    trials: rows as from `trial_row` with the column RUN_SEED; every controller has the same
    scenarios, seeds and trials.
    """
    controllers = list(dict.fromkeys(trials["controller"]))
    scenarios = list(dict.fromkeys(trials["scenario"]))
    repeated = repeated_cells(trials.drop(columns=RUN_SEED))
    once = {name for name in controllers if all((s, name) in repeated for s in scenarios)}
    rows = trials.assign(arrived=(~is_failed(trials)).astype(float))
    rows["touched"] = (rows["outcome"] == Outcome.COLLIDED).astype(float)
    rows["time"] = rows["time_to_goal_s"].where(rows["arrived"] > 0.0)
    arrived, touched, time_s = (
        rows.set_index([*PAIRED_BY, "scenario", "controller"])[name].unstack("controller")
        for name in ("arrived", "touched", "time")
    )
    pairs = list(combinations(controllers, 2))
    confidence = confidence_of_each(QUANTITIES * len(pairs))
    duels = tuple(
        _duel(
            arrived[[first, second]],
            touched[[first, second]],
            time_s[[first, second]],
            confidence=confidence,
            is_one_trial=once >= {first, second},
        )
        for first, second in pairs
    )
    standings = [
        _standing(
            name,
            arrived[name],
            touched[name],
            time_s[name],
            duels,
            controllers=len(controllers),
            is_once=name in once,
        )
        for name in controllers
    ]
    standings.sort(key=lambda entry: (entry.rank, entry.interval.high, -entry.success))
    return Ranking(tuple(standings), duels)


def _duel(
    arrived: pd.DataFrame,
    touched: pd.DataFrame,
    time_s: pd.DataFrame,
    *,
    confidence: float,
    is_one_trial: bool,
) -> Duel:
    first, second = arrived.columns
    shares, touches = (found.groupby(level=PAIRED_BY).mean() for found in (arrived, touched))
    # A time counts only in pairs in which both arrive; else a controller that fails in long trials
    # would seem quick.
    times = time_s.dropna().groupby(level=PAIRED_BY).mean()
    if is_one_trial:
        shares, touches, times = shares.iloc[:1], touches.iloc[:1], times.iloc[:1]
    arrivals, contacts, duration = (
        paired_comparison(found[first], found[second], confidence=confidence)
        for found in (shares, touches, times)
    )

    def better_of(comparison: PairedComparison, *, is_shown: bool, is_less_better: bool) -> str:
        if comparison.difference == 0.0 or not (is_one_trial or is_shown):
            return ""
        return second if (comparison.difference < 0.0) == is_less_better else first

    by_arrivals = better_of(
        arrivals,
        is_shown=shares_differ(shares[first], shares[second], arrivals),
        is_less_better=False,
    )
    by_touches = better_of(
        contacts,
        is_shown=shares_differ(touches[first], touches[second], contacts),
        is_less_better=True,
    )
    quicker, slower = times.mean().sort_values(kind="stable").index
    is_behind = gap(
        times[quicker],
        times[slower],
        is_higher_better=False,
        confidence=confidence,
        is_one_trial=is_one_trial,
    ).is_shown
    by_time = quicker if is_behind else ""
    found = ((by_arrivals, "arrivals"), (by_touches, "touches"), (by_time, "time"))
    winner, decided_by = next(((name, by) for name, by in found if name), ("", ""))
    denied = winner if by_touches and by_touches != winner else ""
    if denied:
        winner, decided_by = "", ""
    return Duel(first, second, arrivals, contacts, duration, winner, decided_by, denied)


def _standing(
    name: str,
    arrived: pd.Series,
    touched: pd.Series,
    time_s: pd.Series,
    duels: tuple[Duel, ...],
    *,
    controllers: int,
    is_once: bool,
) -> Standing:
    own = [duel for duel in duels if name in (duel.first, duel.second) and duel.winner]
    won = sum(duel.winner == name for duel in own)
    shares = arrived.groupby(level=PAIRED_BY).mean()
    times = time_s.groupby(level=PAIRED_BY).mean()
    if is_once:
        shares, times = shares.iloc[:1], times.iloc[:1]
    success = float(shares.mean())
    beaten = len(own) - won
    return Standing(
        controller=name,
        rank=1 + beaten,
        interval=Interval(1.0 + beaten, float(controllers - won)),
        arrived=int(arrived.sum()),
        touched=int(touched.sum()),
        trials=len(arrived),
        success=success,
        success_interval=share_interval(success, len(shares)),
        time_s=summarize(times.to_numpy(dtype=float)),
    )
