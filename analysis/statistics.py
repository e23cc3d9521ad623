"""Statistics of a few trials of one column: means, shares and their intervals.

`paired_comparison` compares two columns, and `pairs` decides which of them is better.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from drake_navbench.kernels.arrays import Array

CONFIDENCE = 0.95
# Smaller differences are rounding errors, for all quantities measured here in SI units.
ROUNDING = 1e-9
# Values whose spread is a smaller share of the largest are equal except for rounding.
SPREAD_RATIO = 1e-12


class Interval(NamedTuple):
    """A confidence interval; both ends NaN where there are too few values."""

    low: float
    high: float

    def excludes(self, value: float) -> bool:
        """Whether the value lies outside the interval; False for an undefined interval."""
        return value < self.low or value > self.high


UNDEFINED_INTERVAL = Interval(math.nan, math.nan)


class Summary(NamedTuple):
    """The values of one metric over the trials of one cell.

    count: the number of different trials with a value. left_out: the number of trials without a
    value. interval: interval of the mean, 95%.
    """

    count: int  # type: ignore[assignment]  # nobody counts in it as in a tuple
    left_out: int
    mean: float
    sd: float
    median: float
    interval: Interval


def summarize(values: Sequence[float]) -> Summary:
    """Returns count, mean, sd (divisor n - 1), median and Student's interval of the mean.

    NaN counts as left out.
    """
    array = np.asarray(values, dtype=float)
    known = array[np.isfinite(array)]
    count, left_out = len(known), len(array) - len(known)
    if count == 0:
        return Summary(0, left_out, math.nan, math.nan, math.nan, UNDEFINED_INTERVAL)
    sd = float(known.std(ddof=1)) if count > 1 else math.nan
    median = float(np.median(known))
    return Summary(count, left_out, float(known.mean()), sd, median, mean_interval(known))


def mean_interval(values: Array, *, confidence: float = CONFIDENCE) -> Interval:
    """Returns Student's interval of the mean of values (N,) without NaN.

    Undefined for fewer than two values; equal values give an interval without width. Why Student's
    interval and no bootstrap: for normal values it covers the mean in 95% of cases from two values
    on, a bootstrap (BCa) in 88% with eight values; for skewed values it also covers the mean more
    often, up to sixteen values.
    """
    if len(values) < 2:
        return UNDEFINED_INTERVAL
    if np.ptp(values) <= SPREAD_RATIO * np.abs(values).max():
        return Interval(float(values[0]), float(values[0]))
    sd = float(values.std(ddof=1))
    return student_interval(float(values.mean()), sd, len(values), confidence=confidence)


def success_interval(successes: int, trials: int) -> Interval:
    """Returns Wilson's 95% interval of a success rate, shares from 0 to 1."""
    if trials == 0:
        return UNDEFINED_INTERVAL
    low, high = share_interval(successes / trials, trials)
    # The ends are exactly 0 and 1, without rounding errors.
    return Interval(low if successes else 0.0, high if successes < trials else 1.0)


def share_interval(share: float, count: int) -> Interval:
    """Returns Wilson's 95% interval of the mean of `count` independent shares from 0 to 1.

    For shares of 0 or 1 it is the interval of a success rate. Shares in between, each of several
    trials, vary less, so that the interval is wide enough for them, too.
    """
    if count == 0:
        return UNDEFINED_INTERVAL
    squared = float(special.ndtri(0.5 + 0.5 * CONFIDENCE)) ** 2
    centre = (share + squared / (2.0 * count)) / (1.0 + squared / count)
    spread = squared * (share * (1.0 - share) / count + squared / (4.0 * count**2))
    half = math.sqrt(spread) / (1.0 + squared / count)
    return Interval(max(0.0, float(centre - half)), min(1.0, float(centre + half)))


def exact_share_interval(count: int, of: int, *, confidence: float = CONFIDENCE) -> Interval:
    """Returns the exact interval of a share (Clopper and Pearson), from 0 to 1."""
    tail = 0.5 * (1.0 - confidence)
    low = float(special.betaincinv(count, of - count + 1.0, tail)) if count else 0.0
    high = float(special.betaincinv(count + 1.0, of - count, 1.0 - tail)) if count < of else 1.0
    return Interval(low, high)


def student_interval(mean: float, sd: float, count: int, *, confidence: float) -> Interval:
    """Returns Student's interval of a mean; undefined for fewer than two values."""
    if count < 2:
        return UNDEFINED_INTERVAL
    half_width = student_quantile(0.5 + 0.5 * confidence, count - 1) * sd / math.sqrt(count)
    return Interval(mean - half_width, mean + half_width)


# Cached: needed for every metric of every cell, always with the same few numbers of trials.
@lru_cache
def student_quantile(probability: float, freedom: int) -> float:
    """Returns the quantile of Student's distribution with `freedom` degrees of freedom."""
    return float(special.stdtrit(freedom, probability))


def pareto_front(costs: Array) -> NDArray[np.bool_]:
    """Returns flags (N,) of the rows on the Pareto front of costs (N, K); lower is better.

    A row is on the front unless another row is no worse in any column and better in one. A row with
    NaN is not on the front and does not count against other rows.
    """
    known = np.all(np.isfinite(costs), axis=1)
    no_worse = np.all(costs[:, None, :] <= costs[None, :, :], axis=2)
    better = np.any(costs[:, None, :] < costs[None, :, :], axis=2)
    return known & ~np.any(no_worse & better & known[:, None], axis=0)
