"""Verdicts in words: the best controller in a metric, where the intervals support it.

`pairs.gap` decides when a controller is behind another, and when two are level.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics, unrepeatable_names
from drake_navbench.analysis.numbers import DEGREE, counted, typeset
from drake_navbench.analysis.paired_comparison import PairedComparison, trials_needed
from drake_navbench.analysis.pairs import (
    RELEVANT_RATIO,
    Gap,
    confidence_of_each,
    gap,
    values_by_seed,
)
from drake_navbench.analysis.repeats import repeated_cells, repeated_controllers
from drake_navbench.analysis.statistics import ROUNDING
from drake_navbench.logs.outcome import Outcome

SIGNIFICANT_DIGITS = 3
# From this number of controllers on, a list of all of them tells less than their number.
MANY = 4
NOTHING_RANDOM = "n = 1: nothing in these trials is random"
NO_FAULTS: Mapping[str, str] = {}
EXTREMES = {Better.LOWER: "lowest", Better.HIGHER: "highest"}


class FirstPlace(StrEnum):
    """The state of the contest for the first place in a metric."""

    BEST = "best"
    LEVEL = "level"
    UNDECIDED = "not decided"
    FAULTY = "faulty"
    NO_CONTEST = "no contest"


class MetricVerdict(NamedTuple):
    """The verdict on one metric in one scenario.

    standing: BEST: every other controller is shown to be behind the leader by more than matters,
    with 95% confidence in all comparisons together (or, where nothing is random, in the one trial).
    LEVEL: the other leaders are shown to differ from the first by less than matters. FAULTY: the
    leader would be best, but has a fault of `faults_of`. NO_CONTEST: no controller reached the
    goal. order: the controllers with a value, best mean first. leaders: the first controller, and
    those that are not shown to be behind it. text: one sentence.
    """

    scenario: str
    metric: str
    standing: FirstPlace
    order: tuple[str, ...]
    leaders: tuple[str, ...]
    text: str

    @property
    def best(self) -> str | None:
        """The controller that is shown to be best; None where the trials do not show one."""
        return self.leaders[0] if self.standing is FirstPlace.BEST else None

    @property
    def named_leaders(self) -> str:
        """The leaders in words: their names, or 'all 6' where these would be a list of all."""
        return _named(self.leaders, len(self.order))


def is_failed(trials: pd.DataFrame) -> pd.Series:
    """Returns for each trial whether it did not reach its goal."""
    return trials["outcome"] != Outcome.SUCCEEDED


def touch_counts(trials: pd.DataFrame) -> dict[str, int]:
    """Returns the number of trials with a touch by controller; those without any are left out."""
    touched = trials.loc[trials["outcome"] == Outcome.COLLIDED, "controller"]
    return {str(name): int(count) for name, count in touched.value_counts(sort=False).items()}


def faults_of(trials: pd.DataFrame) -> dict[str, str]:
    """Returns by controller why it is best in nothing in a scenario; those without are left out.

    It touched something, ended as an error, or arrives in fewer of its trials than another: who
    gives up where the way is slow is not the quickest.
    """
    faults: dict[str, str] = {}
    arrived = {
        str(name): (int(own.sum()), len(own))
        for name, own in (~is_failed(trials)).groupby(trials["controller"], sort=False)
    }
    most = max(arrived, key=lambda name: arrived[name][0] / arrived[name][1], default="")
    for name, (count, of) in arrived.items():
        if count / of < arrived[most][0] / arrived[most][1]:
            best = " of ".join(map(str, arrived[most]))
            faults[name] = f"arrived in {count} of {counted(of, 'trial')}, {most} in {best}"
    errors = trials.loc[trials["outcome"] == Outcome.ERROR, "controller"].value_counts(sort=False)
    for name, count in errors.items():
        faults[str(name)] = f"ended as an error in {counted(int(count), 'trial')}"
    for name, count in touch_counts(trials).items():
        faults[name] = f"touched something in {counted(count, 'trial')}"
    return faults


def comparable_trials(trials: pd.DataFrame, metrics: Iterable[str]) -> pd.DataFrame:
    """Returns the trials of one scenario with the metrics of failed trials taken out.

    A controller that gives up at once is neither quick nor smooth nor safe. Compute times stay:
    every cycle must be computed in time. If no trial of the scenario reached its goal, all metrics
    stay: then the question is how the controllers gave up.
    """
    failed = is_failed(trials)
    if failed.all():
        return trials
    measured_anew = set(unrepeatable_names())
    kept = trials.copy()
    kept.loc[failed, [name for name in metrics if name not in measured_anew]] = math.nan
    return kept


def scenario_verdicts(
    trials: pd.DataFrame, scenario: str, names: Sequence[str]
) -> list[MetricVerdict]:
    """Returns the verdicts on these metrics in a scenario, in the order of the catalogue.

    trials: all trials of the scenario. A metric with nothing to compare has no verdict.
    """
    comparable = comparable_trials(trials, [name for name in names if name in trials])
    repeated = repeated_controllers(repeated_cells(trials), scenario)
    faults = faults_of(trials)
    anyone_arrived = not is_failed(trials).all()
    found = (
        verdict(
            comparable,
            scenario,
            entry,
            anyone_arrived=anyone_arrived,
            repeated=repeated,
            faults=faults,
        )
        for entry in all_metrics()
        if entry.name in names and entry.name in trials
    )
    return [one for one in found if one is not None]


def verdict(
    trials: pd.DataFrame,
    scenario: str,
    entry: Metric,
    *,
    anyone_arrived: bool = True,
    repeated: frozenset[str] = frozenset(),
    faults: Mapping[str, str] = NO_FAULTS,
) -> MetricVerdict | None:
    """Returns the verdict on a metric; None where there is nothing to compare.

    The metric needs a good direction and a value for at least two controllers. anyone_arrived:
    whether a trial of the scenario reached its goal; else no controller is best. repeated: the
    controllers whose trials are all equal. faults: as from `faults_of`; a controller with one is
    not best.
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
    # The confidence holds for all comparisons with the leader together.
    confidence = confidence_of_each(len(others))
    once = repeated if entry.is_repeatable else frozenset()
    gaps = {
        other: _gap_to(
            values, leader, other, entry, confidence, is_one_trial=once >= {leader, other}
        )
        for other in others
    }
    level = [other for other in others if gaps[other].is_level]
    leaders = [leader, *(other for other in others if not gaps[other].is_shown)]
    if len(leaders) == 1:
        fault = faults.get(leader, "") if anyone_arrived else ""
        standing = FirstPlace.FAULTY if fault else FirstPlace.BEST
        place = "first" if fault else "best" if anyone_arrived else EXTREMES[entry.better]
        note = f" ({NOTHING_RANDOM})" if once >= {leader, others[0]} else ""
        text = f"{leader} is {place}: {_number(means[leader], entry.unit)}; next {others[0]}, "
        text += f"{_gap(gaps[others[0]].comparison, entry.unit)}{note}"
        if fault:
            text += f"; but {leader} {fault}, so that nobody is best"
    elif leaders == [leader, *level]:
        standing = FirstPlace.LEVEL
        text = f"level: {', '.join(leaders)} {_how_close(gaps, means, level, entry)}"
    else:
        standing = FirstPlace.UNDECIDED
        text = _undecided(means, leaders, gaps, entry=entry, confidence=confidence)
        if level:
            close = _how_close(gaps, means, level, entry)
            text += f"; {', '.join([leader, *level])} {close}"
    if not anyone_arrived:
        standing = FirstPlace.NO_CONTEST
    text += _note_on_missing(values, list(means.index), anyone_arrived=anyone_arrived)
    return MetricVerdict(scenario, entry.name, standing, tuple(means.index), tuple(leaders), text)


def _gap_to(
    values: pd.DataFrame,
    leader: str,
    other: str,
    entry: Metric,
    confidence: float,
    *,
    is_one_trial: bool,
) -> Gap:
    """Returns the gap of another controller to the leader. values: by seed and controller."""
    return gap(
        values[leader],
        values[other],
        is_higher_better=entry.better is Better.HIGHER,
        relevant=entry.relevant,
        confidence=confidence,
        is_one_trial=is_one_trial,
    )


def _how_close(
    gaps: Mapping[str, Gap], means: pd.Series, level: Sequence[str], entry: Metric
) -> str:
    differences = [abs(gaps[name].comparison.difference) for name in level]
    if all(difference <= ROUNDING for difference in differences):
        return "are equal"
    scales = [max(abs(means.iloc[0]), abs(means[name])) for name in level]
    if all(d <= RELEVANT_RATIO * scale for d, scale in zip(differences, scales, strict=True)):
        return f"differ by less than {RELEVANT_RATIO:.0%}"
    return f"differ by no more than {_number(entry.relevant, entry.unit)}"


def _undecided(
    means: pd.Series,
    leaders: Sequence[str],
    gaps: Mapping[str, Gap],
    *,
    entry: Metric,
    confidence: float,
) -> str:
    leader = leaders[0]
    text = f"not decided between {_named(leaders, len(means))}"
    open_ones = [
        name for name in leaders[1:] if not gaps[name].is_level and gaps[name].comparison.pairs > 0
    ]
    if not open_ones:
        return f"{text}: no trial in which both have a value"
    nearest = open_ones[0]
    found = gaps[nearest].comparison
    text += f": {nearest} {_gap(found, entry.unit, against=f' against {leader}')}"
    scale = max(abs(means[leader]), abs(means[nearest]))
    bar = max(RELEVANT_RATIO * scale, entry.relevant)
    if gaps[nearest].is_ahead:
        text += f", which may be less than {_number(bar, entry.unit)}"
        text += f" ({RELEVANT_RATIO:.0%})" if bar > entry.relevant else ""
    # Only the part of the difference beyond the bar must be shown.
    sign = 1.0 if entry.better is Better.LOWER else -1.0
    excess = sign * found.difference - bar
    if 1 < found.pairs < gaps[nearest].fewest:
        text += f"; so few may be alike by chance: at least {gaps[nearest].fewest} are needed"
    elif found.pairs > 1 and excess > 0.0:
        needed = trials_needed(found.sd, excess, confidence=confidence)
        if needed > found.pairs:
            text += f"; a difference of this size needs about {needed} trials"
    return text


def _named(leaders: Sequence[str], count: int) -> str:
    return f"all {count}" if MANY <= count == len(leaders) else ", ".join(leaders)


def _gap(comparison: PairedComparison, unit: str, *, against: str = "") -> str:
    difference = f"{_number(comparison.difference, unit, signed=True)}"
    if not math.isfinite(comparison.interval.low):
        return f"{difference}{against} in one trial"
    low, high = (_number(end, "", signed=True) for end in comparison.interval)
    return f"{difference} [{low}, {high}]{against} in {comparison.pairs} trials"


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
    printed = typeset(unit)
    return f"{text}{'' if printed == DEGREE else ' '}{printed}".rstrip()
