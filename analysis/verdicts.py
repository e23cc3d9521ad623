"""Which controller is best at what, in words, and only where the intervals support it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.numbers import typeset
from drake_navbench.analysis.statistics import (
    CONFIDENCE,
    ROUNDING,
    PairedComparison,
    paired_comparison,
    trials_needed,
)
from drake_navbench.log import Outcome

# A difference below this share of the larger mean is not worth a word, however certain; neither is
# one below what a metric says that matters (`Metric.relevant`).
RELEVANT_RATIO = 0.01
SIGNIFICANT_DIGITS = 3
NOTHING_RANDOM = "n = 1: nothing in these trials is random"
EXTREMES = {Better.LOWER: "lowest", Better.HIGHER: "highest"}


class Standing(StrEnum):
    """What the trials say of the first place in a metric."""

    BEST = "best"
    LEVEL = "level"
    UNDECIDED = "not decided"
    NO_CONTEST = "no contest"


class Verdict(NamedTuple):
    """What can be said of one metric in one scenario.

    standing: BEST where the leader's mean is better than every other with 95% confidence in all
    comparisons together, or in the one trial there is where nothing is random; LEVEL where the
    others in front differ from it by less than RELEVANT_RATIO; NO_CONTEST where nobody reached the
    goal. leaders: the controller with the best mean and those that are not shown to be worse, by
    their means. text: one sentence.
    """

    scenario: str
    metric: str
    standing: Standing
    leaders: tuple[str, ...]
    text: str

    @property
    def best(self) -> str | None:
        """The controller that is shown to be best; None where the trials do not show one."""
        return self.leaders[0] if self.standing is Standing.BEST else None


def values_by_seed(trials: pd.DataFrame, scenario: str, metric: str) -> pd.DataFrame:
    """Returns one row a seed and one column a controller, in the order of the trials.

    Of several trials with one seed the mean.
    """
    # Asked for every metric of every scenario; pandas' pivot table takes ten times as long.
    is_own = (trials["scenario"] == scenario).to_numpy()
    seeds, rows = np.unique(trials["seed"].to_numpy()[is_own], return_inverse=True)
    own = trials["controller"].to_numpy(dtype=object)[is_own]
    place = {name: index for index, name in enumerate(dict.fromkeys(own))}
    columns = np.array([place[name] for name in own], dtype=int)
    values = trials[metric].to_numpy(dtype=float)[is_own]
    is_known = ~np.isnan(values)
    cells = rows[is_known], columns[is_known]
    sums = np.zeros((len(seeds), len(place)))
    counts = np.zeros_like(sums)
    np.add.at(sums, cells, values[is_known])
    np.add.at(counts, cells, 1.0)
    means = np.divide(sums, counts, out=np.full_like(sums, math.nan), where=counts > 0.0)
    return pd.DataFrame(
        means, index=pd.Index(seeds, name="seed"), columns=pd.Index(place, name="controller")
    )


def compare_columns(
    values: pd.DataFrame,
    first: str,
    second: str,
    *,
    repeated: frozenset[str] = frozenset(),
    confidence: float = CONFIDENCE,
) -> PairedComparison:
    """Returns how the second column differs from the first over the seeds (rows).

    repeated: the controllers whose trials are all the same one; of two such only one pair counts.
    """
    if repeated >= {first, second}:
        values = values.iloc[:1]
    return paired_comparison(values[first], values[second], confidence=confidence)


def is_failed(trials: pd.DataFrame) -> pd.Series:
    """Returns which trials did not reach their goal."""
    return trials["outcome"] != Outcome.SUCCEEDED


def comparable_trials(trials: pd.DataFrame, metrics: Iterable[str]) -> pd.DataFrame:
    """Returns the trials of one scenario with the metrics of failed trials taken out.

    Who gives up at once is neither quick nor smooth nor safe. Where no trial of the scenario
    reached its goal, all are kept: then the question is how they gave up.
    """
    failed = is_failed(trials)
    if failed.all():
        return trials
    kept = trials.copy()
    kept.loc[failed, list(metrics)] = math.nan
    return kept


def verdict(
    trials: pd.DataFrame,
    scenario: str,
    entry: Metric,
    *,
    anyone_arrived: bool = True,
    repeated: frozenset[str] = frozenset(),
) -> Verdict | None:
    """Returns what the trials show about a metric; None where there is nothing to compare.

    The metric needs a good direction and a value for at least two controllers. anyone_arrived:
    whether a trial of the scenario reached its goal; else nobody is best, whatever the values.
    repeated: the controllers whose trials are all the same one.
    """
    if entry.better is Better.NEITHER:
        return None
    values = values_by_seed(trials, scenario, entry.name)
    means = (
        values.mean().dropna().sort_values(ascending=entry.better is Better.LOWER, kind="stable")
    )
    if len(means) < 2:
        return None
    leader, others = means.index[0], list(means.index[1:])
    # Bonferroni: all comparisons with the leader hold together at 95%.
    confidence = 1.0 - (1.0 - CONFIDENCE) / len(others)
    once = repeated if entry.is_repeatable else frozenset()
    comparisons = {
        other: compare_columns(values, leader, other, repeated=once, confidence=confidence)
        for other in others
    }
    equal = [
        other for other in others if _is_equal(comparisons[other], means, leader, other, entry)
    ]
    leaders = [leader]
    for other in others:
        is_certain = once >= {leader, other} or _is_behind(comparisons[other], entry.better)
        if other in equal or not is_certain:
            leaders.append(other)
    if len(leaders) == 1:
        standing = Standing.BEST
        place = "best" if anyone_arrived else EXTREMES[entry.better]
        text = f"{leader} is {place}: {_number(means[leader], entry.unit)}; "
        text += f"next {others[0]}, {_gap(comparisons[others[0]], entry.unit)}"
        if once >= {leader, others[0]}:
            text += f" ({NOTHING_RANDOM})"
    elif leaders == [leader, *equal]:
        standing = Standing.LEVEL
        text = f"level: {', '.join(leaders)} {_how_close(comparisons, means, equal, entry)}"
    else:
        standing = Standing.UNDECIDED
        text = _undecided(leaders, equal, comparisons, unit=entry.unit, confidence=confidence)
        if equal:
            close = _how_close(comparisons, means, equal, entry)
            text += f"; {', '.join([leader, *equal])} {close}"
    if not anyone_arrived:
        standing = Standing.NO_CONTEST
    text += _note_on_missing(values, list(means.index), anyone_arrived=anyone_arrived)
    return Verdict(scenario, entry.name, standing, tuple(leaders), text)


def _is_equal(
    comparison: PairedComparison, means: pd.Series, leader: str, other: str, entry: Metric
) -> bool:
    """Whether a difference is too small for a word; never without a pair."""
    return _is_ratio_small(comparison, means, leader, other) or (
        abs(comparison.difference) <= entry.relevant
    )


def _is_ratio_small(
    comparison: PairedComparison, means: pd.Series, leader: str, other: str
) -> bool:
    scale = max(abs(means[leader]), abs(means[other]))
    return abs(comparison.difference) <= max(RELEVANT_RATIO * scale, ROUNDING)


def _is_behind(comparison: PairedComparison, better: Better) -> bool:
    """Whether the pairs show it: where values are missing, they may contradict the means."""
    low, high = comparison.interval
    return low > 0.0 if better is Better.LOWER else high < 0.0


def _how_close(
    comparisons: Mapping[str, PairedComparison],
    means: pd.Series,
    equal: Sequence[str],
    entry: Metric,
) -> str:
    if all(abs(comparisons[name].difference) <= ROUNDING for name in equal):
        return "are equal"
    leader = means.index[0]
    if all(_is_ratio_small(comparisons[name], means, leader, name) for name in equal):
        return f"differ by less than {RELEVANT_RATIO:.0%}"
    return f"differ by no more than {_number(entry.relevant, entry.unit)}"


def _undecided(
    leaders: Sequence[str],
    equal: Sequence[str],
    comparisons: Mapping[str, PairedComparison],
    *,
    unit: str,
    confidence: float,
) -> str:
    text = f"not decided between {', '.join(leaders)}"
    paired = [name for name in leaders[1:] if name not in equal and comparisons[name].pairs > 0]
    if paired:
        nearest = comparisons[paired[0]]
        text += f": {paired[0]} {_gap(nearest, unit)}"
        if nearest.pairs > 1:
            needed = trials_needed(nearest.sd, abs(nearest.difference), confidence=confidence)
            if needed > nearest.pairs:
                text += f"; a difference of this size needs about {needed} trials"
    else:
        text += ": no trial in which both have a value"
    return text


def _gap(comparison: PairedComparison, unit: str) -> str:
    difference = f"{_number(comparison.difference, unit, signed=True)}"
    if not math.isfinite(comparison.interval.low):
        return f"{difference} in one trial"
    low, high = (_number(end, "", signed=True) for end in comparison.interval)
    return f"{difference} [{low}, {high}] in {comparison.pairs} trials"


def _note_on_missing(values: pd.DataFrame, compared: Sequence[str], *, anyone_arrived: bool) -> str:
    missing = [name for name in values.columns if name not in compared]
    partly = [name for name in compared if values[name].isna().any()]
    note = ""
    if partly:
        which = "that succeeded and have" if anyone_arrived else "that have"
        lack = "lacks" if len(partly) == 1 else "lack"
        note += f"; only trials {which} a value count ({', '.join(partly)} {lack} some)"
    if missing:
        note += f"; no value for {', '.join(missing)}"
    return note


def _number(value: float, unit: str, *, signed: bool = False) -> str:
    sign = "+" if signed else ""
    text = f"{value:{sign}.{SIGNIFICANT_DIGITS}g}" if abs(value) > ROUNDING else "0"
    return f"{text} {typeset(unit)}".rstrip()
