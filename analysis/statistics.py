"""Statistics of a few trials: intervals first, tests second, words last.

Trials of one scenario are paired by seed: every controller meets the same noise. Every function
says how many trials or pairs it rests on and how many it had to leave out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import special

Array = NDArray[np.float64]

CONFIDENCE = 0.95
POWER = 0.8
MAX_TRIALS_NEEDED = 1_000_000
# Nothing measured in SI units here differs by less for another reason than rounding.
ROUNDING = 1e-9
# So many pairs with their ranks are few enough to count all signs; of more the normal
# approximation is good also far out.
EXACT_PAIRS = 64
# Values that differ by less than this share of the largest are equal in all but name.
SPREAD_RATIO = 1e-12


class Interval(NamedTuple):
    """A confidence interval; both ends NaN where there are too few values."""

    low: float
    high: float

    def excludes(self, value: float) -> bool:
        """Whether the value lies outside; False for an undefined interval."""
        return value < self.low or value > self.high


UNDEFINED_INTERVAL = Interval(math.nan, math.nan)


class Summary(NamedTuple):
    """The values of one metric over the trials of one cell.

    count: different trials with a value. left_out: trials without one. interval: of the mean, 95%.
    """

    count: int  # type: ignore[assignment]  # nobody counts in it as in a tuple
    left_out: int
    mean: float
    sd: float
    median: float
    interval: Interval


class PairedComparison(NamedTuple):
    """Differences second minus first over the seeds that both have a value for.

    pairs: how many. left_out: seeds where one of the two has no value. difference: mean.
    interval: of the mean difference, Student's t. p_value: Wilcoxon's signed-rank test, two-sided.
    effect: matched-pairs rank-biserial correlation, -1 to 1; positive where the second is larger.
    """

    pairs: int
    left_out: int
    difference: float
    sd: float
    interval: Interval
    p_value: float
    effect: float


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

    Undefined for fewer than two values; equal values give an interval without width. Student's and
    no bootstrap: of normal values it covers the mean as often as it says from two on, a bootstrap
    (BCa) 88% of the time with eight; of skewed ones it covers it more often, too, up to sixteen.
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
    # Without what rounding leaves of the ends.
    return Interval(low if successes else 0.0, high if successes < trials else 1.0)


def share_interval(share: float, count: int) -> Interval:
    """Returns Wilson's 95% interval of the mean of `count` independent shares from 0 to 1.

    For shares that are 0 or 1 it is that of a success rate. Shares between, of several trials each,
    vary less than those, so that the interval is wide enough for them as well.
    """
    if count == 0:
        return UNDEFINED_INTERVAL
    squared = float(special.ndtri(0.5 + 0.5 * CONFIDENCE)) ** 2
    centre = (share + squared / (2.0 * count)) / (1.0 + squared / count)
    spread = squared * (share * (1.0 - share) / count + squared / (4.0 * count**2))
    half = math.sqrt(spread) / (1.0 + squared / count)
    return Interval(max(0.0, float(centre - half)), min(1.0, float(centre + half)))


def paired_comparison(
    first: pd.Series, second: pd.Series, *, confidence: float = CONFIDENCE
) -> PairedComparison:
    """Returns the paired comparison of `second` with `first`; equal index values make a pair.

    The interval is Student's, since a bootstrap is too narrow for few pairs. Differences up to
    ROUNDING count as 0: a rounding error that repeats exactly would have an interval of width 0 and
    so seem certain.
    """
    return compare_differences((second - first).to_numpy(dtype=float), confidence=confidence)


def compare_differences(by_pair: Array, *, confidence: float = CONFIDENCE) -> PairedComparison:
    """Returns the comparison for given differences (N,), NaN where a pair has no value."""
    differences = by_pair[np.isfinite(by_pair)]
    differences = np.where(np.abs(differences) <= ROUNDING, 0.0, differences)
    count = len(differences)
    mean = float(differences.mean()) if count else math.nan
    sd = float(differences.std(ddof=1)) if count > 1 else math.nan
    ranks = signed_ranks(differences)
    return PairedComparison(
        pairs=count,
        left_out=len(by_pair) - count,
        difference=mean,
        sd=sd,
        interval=student_interval(mean, sd, count, confidence=confidence),
        p_value=_p_value_of_ranks(tuple(ranks.tolist())) if count else math.nan,
        effect=_effect_of_ranks(ranks) if count else math.nan,
    )


def student_interval(mean: float, sd: float, count: int, *, confidence: float) -> Interval:
    """Returns Student's interval of a mean; undefined for fewer than two values."""
    if count < 2:
        return UNDEFINED_INTERVAL
    half_width = _student_quantile(0.5 + 0.5 * confidence, count - 1) * sd / math.sqrt(count)
    return Interval(mean - half_width, mean + half_width)


# Asked for anew for every metric of every cell, each time with the few numbers of a campaign.
@lru_cache
def _student_quantile(probability: float, freedom: int) -> float:
    return float(special.stdtrit(freedom, probability))


def signed_ranks(differences: Array) -> Array:
    """Returns the signed ranks of |differences| without zeros, in rising order."""
    differences = differences[differences != 0.0]
    if len(differences) == 0:
        return differences
    _, places, counts = np.unique(np.abs(differences), return_inverse=True, return_counts=True)
    # Equal ones share the mean of their ranks.
    ranks = np.cumsum(counts) - 0.5 * (counts - 1)
    return np.sort(np.sign(differences) * ranks[places])


# Kept, as few pairs have few different signed ranks, and a report asks for hundreds of p-values.
@lru_cache(maxsize=4096)
def _p_value_of_ranks(own_ranks: tuple[float, ...]) -> float:
    """Returns the p-value of differences with these signed ranks; it depends on nothing else."""
    if not own_ranks:
        return 1.0
    ranks = np.array(own_ranks)
    if len(ranks) > EXACT_PAIRS:
        return _normal_p_value(ranks)
    # The average of two ranks may end in a half.
    doubled = np.rint(2.0 * np.abs(ranks)).astype(int)
    # chances[t]: that the ranks with a plus sum to t / 2, each sign being as likely as the other.
    chances = np.zeros(doubled.sum() + 1)
    chances[0] = 1.0
    for rank in doubled:
        with_plus = chances[: len(chances) - rank].copy()
        chances *= 0.5
        chances[rank:] += 0.5 * with_plus
    positive = int(doubled[ranks > 0.0].sum())
    smaller_tail = min(positive, len(chances) - 1 - positive)
    return min(2.0 * float(chances[: smaller_tail + 1].sum()), 1.0)


def _normal_p_value(ranks: Array) -> float:
    """Returns Wilcoxon's two-sided p-value of very many signed ranks by the normal approximation.

    The variance is corrected for equal ranks; no correction for continuity.
    """
    count = len(ranks)
    positive = float(ranks[ranks > 0.0].sum())
    _, ties = np.unique(np.abs(ranks), return_counts=True)
    variance = (
        count * (count + 1.0) * (2.0 * count + 1.0) / 24.0 - float((ties**3 - ties).sum()) / 48.0
    )
    distance = abs(positive - count * (count + 1.0) / 4.0) / math.sqrt(variance)
    return float(2.0 * special.ndtr(-distance))


def smallest_p_value(pairs: int, comparisons: int) -> float:
    """Returns the smallest p-value that Wilcoxon's two-sided test can give after Holm's correction.

    pairs: the number of pairs with a difference. Of their 2^pairs combinations of signs, 2 have all
    signs equal, so that p >= 2 / 2^pairs. comparisons: the number of tests corrected together.
    """
    return min(comparisons * 2.0 ** (1 - pairs), 1.0)


def sign_test_p_value(wins: int, losses: int) -> float:
    """Returns the two-sided p-value of the exact sign test (McNemar's, for outcomes of yes or no).

    wins, losses: pairs of which one side alone has it. Pairs that agree say nothing; 1 without any
    that differ.
    """
    changed = wins + losses
    return min(2.0 * float(special.bdtr(min(wins, losses), changed, 0.5)), 1.0)


def _effect_of_ranks(ranks: Array) -> float:
    """Returns the matched-pairs rank-biserial correlation, (W+ - W-)/(W+ + W-); 0 without ranks."""
    return float(ranks.sum() / np.abs(ranks).sum()) if len(ranks) else 0.0


def holm(p_values: ArrayLike, smallest: ArrayLike | None = None) -> Array:
    """Returns p-values adjusted for their number (Holm 1979); NaN stays and does not count.

    smallest: the smallest p-value that each test could have given with its own pairs, whatever
    their signs; 0 for all where not given. A test that could not have fallen to a p-value does not
    count in its adjustment (Tarone 1990; Hommel and Krummenauer 1998): trials that are equal in
    one scenario take nothing from the others. The chance of any false alarm is held all the same.
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


def trials_needed(sd: float, difference: float, *, confidence: float = CONFIDENCE) -> int:
    """Returns the number of pairs that show a mean difference with 80% power.

    The test is a two-sided paired t-test. sd: of the paired differences. confidence: of the
    interval that shall exclude zero. The number is at least 2, at most MAX_TRIALS_NEEDED.
    """
    if not (sd >= 0.0 and difference > 0.0):
        raise ValueError(f"expected sd >= 0 and difference > 0, got {sd} and {difference}")
    if sd == 0.0:
        return 2
    effect = difference / sd
    # The normal approximation is at most a few trials off.
    quantiles = float(special.ndtri(0.5 + 0.5 * confidence) + special.ndtri(POWER))
    count = max(math.ceil((quantiles / effect) ** 2), 2)
    if count > MAX_TRIALS_NEEDED:
        return MAX_TRIALS_NEEDED
    while _power(count, effect, confidence) < POWER:
        count += 1
    while count > 2 and _power(count - 1, effect, confidence) >= POWER:
        count -= 1
    return count


def detectable_difference(sd: float, pairs: int, level: float) -> float:
    """Returns the mean difference that a two-sided paired t-test shows with 80% power.

    sd: of the differences. level: of the test. NaN for fewer than two pairs.
    """
    if pairs < 2:
        return math.nan
    quantile = _student_quantile(1.0 - 0.5 * level, pairs - 1) + float(special.ndtri(POWER))
    return quantile * sd / math.sqrt(pairs)


def pareto_front(costs: Array) -> NDArray[np.bool_]:
    """Returns flags (N,) of the rows on the Pareto front of costs (N, K); lower is better.

    A row is on the front unless another row is no worse in any column and better in one. A row with
    NaN is not on the front and keeps no other row off it.
    """
    known = np.all(np.isfinite(costs), axis=1)
    no_worse = np.all(costs[:, None, :] <= costs[None, :, :], axis=2)
    better = np.any(costs[:, None, :] < costs[None, :, :], axis=2)
    return known & ~np.any(no_worse & better & known[:, None], axis=0)


def _power(count: int, effect: float, confidence: float) -> float:
    freedom = count - 1
    critical = _student_quantile(0.5 + 0.5 * confidence, freedom)
    shift = effect * math.sqrt(count)
    below = special.nctdtr(freedom, shift, [-critical, critical])
    return float(1.0 - below[1] + below[0])
