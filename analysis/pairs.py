"""Decisions between two columns by their paired trials, corrected for the number of decisions.

Every statement that one column is better than another is decided here. There are two rules:
- By the interval of the mean difference (`gap`, `compare_every_pair`, `shares_differ`). The
  intervals of all comparisons that are made together hold together with 95% confidence
  (Bonferroni), and a difference is shown if its whole interval lies beyond the bar. This rule can
  decide with few trials.
- By the p-value of a test (`holm`), corrected in families by `paired_tests`. This rule assumes
  nothing about the distribution of the values, and needs more pairs.

A difference must be larger than two bars to matter: 1% of the larger mean, and `Metric.relevant`.

Where a task has two ways past, or values are coarse as counts are, a few differences are equal or
nearly so by chance, and their interval has hardly any width. So no two pairs show a difference, and
differences that are all equal show one only from `fewest_alike` on. Why there are two rules:
docs/verdicts.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from drake_navbench.analysis.paired_comparison import (
    PairedComparison,
    compare_differences,
    paired_comparison,
    paired_differences,
)
from drake_navbench.analysis.statistics import (
    CONFIDENCE,
    ROUNDING,
    UNDEFINED_INTERVAL,
    Interval,
    share_interval,
    student_interval,
)
from drake_navbench.kernels.arrays import Array

# A difference below this share of the larger mean does not matter, however certain it is; nor does
# one up to `Metric.relevant`.
RELEVANT_RATIO = 0.01


class Gap(NamedTuple):
    """The gap of a column behind another one.

    Two bars say what matters: RELEVANT_RATIO of the larger mean, and `Metric.relevant`. is_shown:
    the whole interval of the gap lies above both bars. is_level: it lies within one of them.
    is_ahead: it lies above 0, so that the other column is ahead, by however little. fewest: the
    least number of pairs that may show a gap.
    """

    comparison: PairedComparison
    is_shown: bool
    is_level: bool
    is_ahead: bool
    fewest: int = 1


class ComparedPair(NamedTuple):
    """Two columns compared, second minus first, among all pairs of a call.

    comparison: comparison of this pair alone. interval: interval of the difference; the intervals
    of all pairs hold together with 95% confidence. p_holm: adjusted for all pairs. can_be_decided:
    whether this number of pairs of trials can bring p_holm below 5% at all.
    """

    first: str
    second: str
    comparison: PairedComparison
    interval: Interval
    p_holm: float
    can_be_decided: bool

    @property
    def is_shown(self) -> bool:
        """Whether the interval, which holds together with those of all pairs, excludes 0."""
        return self.interval.excludes(0.0)


def confidence_of_each(count: int) -> float:
    """Returns the confidence of each of `count` intervals that together hold with 95%."""
    return 1.0 - (1.0 - CONFIDENCE) / max(count, 1)


def fewest_alike(confidence: float) -> int:
    """Returns the least number of equal differences that are not 0 and no accident.

    Two independent values of one distribution differ by a given amount with a probability of 1/4 at
    most, and either of the two may be the larger one: 2 / 4^pairs is the chance of an accident.
    """
    return math.ceil(0.5 * math.log2(2.0 / (1.0 - confidence)) - ROUNDING)


def smallest_p_value(pairs: int, comparisons: int) -> float:
    """Returns the smallest p-value that Wilcoxon's two-sided test can give after Holm's correction.

    pairs: the number of pairs with a difference. Of their 2^pairs combinations of signs, 2 have all
    signs equal, so that p >= 2 / 2^pairs. comparisons: the number of tests corrected together.
    """
    return min(comparisons * 2.0 ** (1 - pairs), 1.0)


def holm(p_values: ArrayLike, smallest: ArrayLike | None = None) -> Array:
    """Returns p-values adjusted for their number (Holm 1979); NaN stays and does not count.

    smallest: the smallest p-value that each test could give with its own pairs, whatever their
    signs; None: 0 for all. A test whose smallest p-value is above p does not count in the
    adjustment of p (Tarone 1990; Hommel and Krummenauer 1998): equal trials in one scenario do not
    weaken the tests of others. The bound on the chance of any false alarm still holds.
    """
    given = np.asarray(p_values, dtype=float)
    adjusted = np.full_like(given, math.nan)
    known = np.flatnonzero(np.isfinite(given))
    order = known[np.argsort(given[known], kind="stable")]
    ordered = given[order]
    least = np.zeros(len(order)) if smallest is None else np.asarray(smallest, dtype=float)[order]
    could = np.sort(np.minimum(least, ordered))
    factors = np.searchsorted(could, ordered, side="right") - np.arange(len(order))
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * ordered), 1.0)
    return adjusted


def values_by_seed(trials: pd.DataFrame, scenario: str, metric: str) -> pd.DataFrame:
    """Returns one row a seed and one column a controller, in the order of the trials.

    The value is the mean over trials of the same seed.
    """
    # Called for every metric of every scenario; pandas' pivot table takes ten times as long.
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


def compare_every_pair(
    columns: Mapping[str, pd.Series], *, repeated: frozenset[str] = frozenset()
) -> list[ComparedPair]:
    """Returns every two of the columns, in order, corrected for their number.

    columns: a name and its values; equal index values make a pair. repeated: the columns whose
    trials are all equal.
    """
    names = list(combinations(columns, 2))
    found = [
        paired_comparison(columns[a], columns[b], is_one_trial=repeated >= {a, b}) for a, b in names
    ]
    confidence = confidence_of_each(len(names))
    tested = sum(comparison.pairs > 0 for comparison in found)
    # No adjusted p-value is below the adjusted smallest possible one.
    most_pairs = max((comparison.pairs for comparison in found), default=0)
    floor = smallest_p_value(most_pairs, tested)
    return [
        ComparedPair(
            *pair,
            comparison,
            _interval_of(comparison, confidence),
            float(p_value),
            max(floor, smallest_p_value(comparison.pairs, 1)) < 1.0 - CONFIDENCE,
        )
        for pair, comparison, p_value in zip(
            names, found, holm([comparison.p_value for comparison in found]), strict=True
        )
    ]


def _interval_of(comparison: PairedComparison, confidence: float) -> Interval:
    """Returns Student's interval; undefined where so few differences are alike by chance."""
    if comparison.difference and _is_by_chance(comparison, confidence):
        return UNDEFINED_INTERVAL
    return student_interval(
        comparison.difference, comparison.sd, comparison.pairs, confidence=confidence
    )


def _is_by_chance(comparison: PairedComparison, confidence: float) -> bool:
    return comparison.pairs < _fewest(comparison, confidence)


def _fewest(comparison: PairedComparison, confidence: float) -> int:
    """Returns the least number of differences that may show one: more where all are equal."""
    return fewest_alike(confidence if comparison.sd <= ROUNDING else CONFIDENCE)


def gap(
    leader: pd.Series,
    other: pd.Series,
    *,
    is_higher_better: bool,
    relevant: float = 0.0,
    confidence: float = CONFIDENCE,
    is_one_trial: bool = False,
) -> Gap:
    """Returns the gap of a column behind the leader; both are columns of one table.

    relevant: differences up to this one do not matter, whatever the means are. is_one_trial: the
    trials of each column are all equal; they count as one pair, whose difference is certain.
    """
    by_pair = paired_differences(leader, other, is_one_trial=is_one_trial)
    comparison = compare_differences(by_pair, confidence=confidence)
    if comparison.pairs == 0 or (comparison.pairs == 1 and not is_one_trial):
        return Gap(comparison, is_shown=False, is_level=False, is_ahead=False)
    is_pair = np.isfinite(by_pair)
    gaps = (-1.0 if is_higher_better else 1.0) * by_pair[is_pair]
    # The bar of 1% of the larger mean, for each pair: the mean is as uncertain as the difference.
    larger = other if abs(other.mean()) > abs(leader.mean()) else leader
    bars = RELEVANT_RATIO * np.abs(larger.to_numpy(dtype=float)[: len(by_pair)][is_pair])
    least = max(relevant, ROUNDING)
    found = _interval(gaps, confidence)
    by_chance = not is_one_trial and _is_by_chance(comparison, confidence)
    return Gap(
        comparison,
        is_shown=not by_chance
        and found.low > least
        and _interval(gaps - bars, confidence).low > 0.0,
        is_level=(-least <= found.low and found.high <= least)
        or (
            _interval(gaps - bars, confidence).high <= 0.0
            and _interval(gaps + bars, confidence).low >= 0.0
        ),
        is_ahead=not by_chance and found.low > ROUNDING,
        fewest=1 if is_one_trial else _fewest(comparison, confidence),
    )


def shares_differ(first: pd.Series, second: pd.Series, comparison: PairedComparison) -> bool:
    """Whether trials show that two columns of shares from 0 to 1 differ.

    comparison: comparison of the two columns. If every pair differs by the same amount, Student's
    interval has no width, even for two pairs; then Wilson's intervals of both columns must not
    overlap.
    """
    if not comparison.interval.excludes(0.0):
        return False
    if comparison.sd > 0.0:
        return True
    low, high = sorted(share_interval(float(own.mean()), len(own)) for own in (first, second))
    return low.high < high.low


def _interval(differences: Array, confidence: float) -> Interval:
    """Returns Student's interval of the mean; a single difference is its own interval."""
    mean = float(differences.mean())
    if len(differences) == 1:
        return Interval(mean, mean)
    sd = float(differences.std(ddof=1))
    return student_interval(mean, sd, len(differences), confidence=confidence)
