"""Which controller is best at what, in words, and only where the intervals support it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.statistics import (
    CONFIDENCE,
    PairedComparison,
    paired_comparison,
    trials_needed,
)
from drake_navbench.log import Outcome

# A difference below this share of the larger mean is not worth a word, however certain.
RELEVANT_RATIO = 0.01
# Nothing measured in SI units here differs by less for another reason than rounding.
ROUNDING = 1e-9
SIGNIFICANT_DIGITS = 3


class Verdict(NamedTuple):
    """What can be said of one metric in one scenario.

    best: the controller whose mean is best and better than every other with 95% confidence in
    all comparisons together; None where the trials do not show one. text: one sentence.
    """

    scenario: str
    metric: str
    best: str | None
    text: str


def values_by_seed(trials: pd.DataFrame, scenario: str, metric: str) -> pd.DataFrame:
    """Returns one row a seed and one column a controller, in the order of the trials."""
    # These columns alone: selecting rows of a frame copies all that it has.
    narrow = trials[["scenario", "seed", "controller", metric]]
    own = narrow[narrow["scenario"] == scenario]
    table = own.pivot_table(
        index="seed", columns="controller", values=metric, aggfunc="mean", dropna=False
    )
    return table.reindex(columns=list(dict.fromkeys(own["controller"])))


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


def verdict(trials: pd.DataFrame, scenario: str, entry: Metric) -> Verdict | None:
    """Returns what the trials show about a metric; None where there is nothing to compare.

    The metric needs a good direction and a value for at least two controllers.
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
    comparisons = {
        other: paired_comparison(values[leader], values[other], confidence=confidence)
        for other in others
    }
    level = [other for other in others if not _is_shown(comparisons[other], means, leader, other)]
    note = _note_on_missing(values, list(means.index))
    if not level:
        runner_up = others[0]
        text = (
            f"{leader} is best: {_number(means[leader], entry.unit)}; "
            f"next {runner_up}, {_gap(comparisons[runner_up], entry.unit)}"
        )
        return Verdict(scenario, entry.name, leader, text + note)
    text = _undecided(means, level, comparisons, entry.unit)
    return Verdict(scenario, entry.name, None, text + note)


def _is_shown(comparison: PairedComparison, means: pd.Series, leader: str, other: str) -> bool:
    scale = max(abs(means[leader]), abs(means[other]))
    return _is_relevant(comparison, scale) and comparison.interval.excludes(0.0)


def _is_relevant(comparison: PairedComparison, scale: float) -> bool:
    return abs(comparison.difference) > max(RELEVANT_RATIO * scale, ROUNDING)


def _undecided(
    means: pd.Series, level: list[str], comparisons: dict[str, PairedComparison], unit: str
) -> str:
    leader = means.index[0]
    together = ", ".join([leader, *level])
    nearest = comparisons[level[0]]
    if nearest.pairs == 0:
        return f"not decided between {together}: no trial in which both have a value"
    if all(not _is_relevant(comparisons[name], abs(means[name])) for name in level):
        return f"level: {together} differ by less than {RELEVANT_RATIO:.0%}"
    text = f"not decided between {together}: {level[0]} {_gap(nearest, unit)}"
    if nearest.pairs > 1 and nearest.sd > 0.0 and nearest.difference != 0.0:
        needed = trials_needed(nearest.sd, abs(nearest.difference))
        text += f"; a difference of this size needs about {needed} trials"
    return text


def _gap(comparison: PairedComparison, unit: str) -> str:
    difference = f"{_number(comparison.difference, unit, signed=True)}"
    if not math.isfinite(comparison.interval.low):
        return f"{difference} in one trial"
    low, high = (_number(end, "", signed=True) for end in comparison.interval)
    return f"{difference} [{low}, {high}] in {comparison.pairs} trials"


def _note_on_missing(values: pd.DataFrame, compared: list[str]) -> str:
    missing = [name for name in values.columns if name not in compared]
    partly = [name for name in compared if values[name].isna().any()]
    note = ""
    if partly:
        note += (
            f"; only trials that succeeded and have a value count ({', '.join(partly)} lack some)"
        )
    if missing:
        note += f"; no value for {', '.join(missing)}"
    return note


def _number(value: float, unit: str, *, signed: bool = False) -> str:
    sign = "+" if signed else ""
    text = f"{value:{sign}.{SIGNIFICANT_DIGITS}g}"
    return f"{text} {unit}".rstrip()
