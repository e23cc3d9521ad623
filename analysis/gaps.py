"""Gap between two controllers in one metric, over the trials that both drove.

Two thresholds say how large a difference matters: 1% of the larger mean, and `Metric.relevant`.
A controller is shown to be behind if the whole interval of the paired differences lies beyond both
thresholds. Two controllers are level if the whole interval lies within one of them. Everything else
is undecided.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.statistics import (
    CONFIDENCE,
    ROUNDING,
    Interval,
    PairedComparison,
    paired_comparison,
    student_interval,
)

Array = NDArray[np.float64]

# A difference below this share of the larger mean is not worth a word, however certain; neither is
# one below what a metric says that matters (`Metric.relevant`).
RELEVANT_RATIO = 0.01


class Gap(NamedTuple):
    """The gap between one controller and the leader.

    is_shown: the gap is larger than both thresholds. is_level: it is smaller than one of them.
    is_ahead: the interval of the difference leaves out 0, so the leader is ahead by some amount.
    """

    comparison: PairedComparison
    is_shown: bool
    is_level: bool
    is_ahead: bool


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
    """Returns the paired comparison of column `second` with column `first`; a row is a seed.

    repeated: the controllers whose trials are all equal. If both are in it, only one pair counts.
    """
    if repeated >= {first, second}:
        values = values.iloc[:1]
    return paired_comparison(values[first], values[second], confidence=confidence)


def gap_to(
    values: pd.DataFrame,
    means: pd.Series,
    other: str,
    *,
    entry: Metric,
    once: frozenset[str],
    confidence: float,
) -> Gap:
    """Returns the gap of controller `other` to the leader, the first one in `means`."""
    leader = means.index[0]
    is_once = once >= {leader, other}
    comparison = compare_columns(values, leader, other, repeated=once, confidence=confidence)
    if comparison.pairs == 0 or (comparison.pairs == 1 and not is_once):
        return Gap(comparison, is_shown=False, is_level=False, is_ahead=False)
    pairs = values[[leader, other]].to_numpy()
    pairs = pairs[np.isfinite(pairs).all(axis=1)][: 1 if is_once else None]
    sign = 1.0 if entry.better is Better.LOWER else -1.0
    gaps = sign * (pairs[:, 1] - pairs[:, 0])
    # 1% of the larger mean, pair by pair: the mean is as uncertain as the difference.
    bars = RELEVANT_RATIO * np.abs(pairs[:, int(abs(means[other]) > abs(means[leader]))])
    least = max(entry.relevant, ROUNDING)
    gap = _interval(gaps, confidence)
    return Gap(
        comparison,
        is_shown=gap.low > least and _interval(gaps - bars, confidence).low > 0.0,
        is_level=(-least <= gap.low and gap.high <= least)
        or (
            _interval(gaps - bars, confidence).high <= 0.0
            and _interval(gaps + bars, confidence).low >= 0.0
        ),
        is_ahead=gap.low > ROUNDING,
    )


def _interval(differences: Array, confidence: float) -> Interval:
    """Returns Student's interval of the mean; a single difference is its own interval."""
    mean = float(differences.mean())
    if len(differences) == 1:
        return Interval(mean, mean)
    sd = float(differences.std(ddof=1))
    return student_interval(mean, sd, len(differences), confidence=confidence)
