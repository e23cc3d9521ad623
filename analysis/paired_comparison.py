"""Differences of paired trials: their mean with its interval, tests, and how many pairs are needed.

Trials of one scenario are paired by seed: every controller meets the same noise. `pairs` corrects
the tests for their number and decides by them.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import special

from drake_navbench.analysis.statistics import (
    CONFIDENCE,
    ROUNDING,
    Interval,
    student_interval,
    student_quantile,
)
from drake_navbench.kernels.arrays import Array

POWER = 0.8
MAX_TRIALS_NEEDED = 1_000_000
# Up to this many pairs, the distribution of the signed ranks is counted exactly. For more, the
# normal approximation is good even far out in the tails.
EXACT_PAIRS = 64


class PairedComparison(NamedTuple):
    """Differences, second minus first, over the seeds for which both have a value.

    pairs: number of pairs. left_out: seeds where one of the two has no value. difference: mean.
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


def paired_differences(first: pd.Series, second: pd.Series, *, is_one_trial: bool = False) -> Array:
    """Returns second minus first, (N,); equal index values make a pair; NaN where one has no value.

    is_one_trial: whether all trials of each are equal, so that only the first pair counts.
    """
    by_pair = (second - first).to_numpy(dtype=float)
    return by_pair[:1] if is_one_trial else by_pair


def paired_comparison(
    first: pd.Series,
    second: pd.Series,
    *,
    confidence: float = CONFIDENCE,
    is_one_trial: bool = False,
) -> PairedComparison:
    """Returns the comparison of `second` with `first`, paired as in `paired_differences`.

    The interval is Student's, since a bootstrap is too narrow for few pairs. Differences up to
    ROUNDING count as 0: a rounding error that repeats exactly would give an interval of width 0,
    which would seem certain.
    """
    return compare_differences(
        paired_differences(first, second, is_one_trial=is_one_trial), confidence=confidence
    )


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


def signed_ranks(differences: Array) -> Array:
    """Returns the signed ranks of |differences| without zeros, in rising order."""
    differences = differences[differences != 0.0]
    if len(differences) == 0:
        return differences
    _, places, counts = np.unique(np.abs(differences), return_inverse=True, return_counts=True)
    # Equal differences share the mean of their ranks.
    ranks = np.cumsum(counts) - 0.5 * (counts - 1)
    return np.sort(np.sign(differences) * ranks[places])


# Cached: few pairs have few different signed ranks, and a report needs hundreds of p-values.
@lru_cache(maxsize=4096)
def _p_value_of_ranks(own_ranks: tuple[float, ...]) -> float:
    """Returns the p-value of differences with these signed ranks, which determine it."""
    if not own_ranks:
        return 1.0
    ranks = np.array(own_ranks)
    if len(ranks) > EXACT_PAIRS:
        return _normal_p_value(ranks)
    # The mean of two ranks may end in one half.
    doubled = np.rint(2.0 * np.abs(ranks)).astype(int)
    # chances[t]: the probability that the ranks with a plus add up to t / 2, if both signs are
    # equally likely.
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

    The variance is corrected for equal ranks; there is no correction for continuity.
    """
    count = len(ranks)
    positive = float(ranks[ranks > 0.0].sum())
    _, ties = np.unique(np.abs(ranks), return_counts=True)
    variance = (
        count * (count + 1.0) * (2.0 * count + 1.0) / 24.0 - float((ties**3 - ties).sum()) / 48.0
    )
    distance = abs(positive - count * (count + 1.0) / 4.0) / math.sqrt(variance)
    return float(2.0 * special.ndtr(-distance))


def sign_test_p_value(wins: int, losses: int) -> float:
    """Returns the two-sided p-value of the exact sign test (McNemar's, for outcomes of yes or no).

    wins, losses: the numbers of pairs in which only the one, or only the other, side has a yes.
    Pairs that agree do not count; the value is 1 if no pairs differ.
    """
    changed = wins + losses
    return min(2.0 * float(special.bdtr(min(wins, losses), changed, 0.5)), 1.0)


def _effect_of_ranks(ranks: Array) -> float:
    """Returns the matched-pairs rank-biserial correlation, (W+ - W-)/(W+ + W-); 0 without ranks."""
    return float(ranks.sum() / np.abs(ranks).sum()) if len(ranks) else 0.0


def trials_needed(sd: float, difference: float, *, confidence: float = CONFIDENCE) -> int:
    """Returns the number of pairs that show a mean difference with 80% power.

    The test is a two-sided paired t-test. sd: standard deviation of the paired differences.
    confidence: confidence of the
    interval that is to exclude zero. The number is at least 2, at most
    MAX_TRIALS_NEEDED.
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

    sd: standard deviation of the differences. level: significance level of the test. NaN for fewer
    than two pairs.
    """
    if pairs < 2:
        return math.nan
    quantile = student_quantile(1.0 - 0.5 * level, pairs - 1) + float(special.ndtri(POWER))
    return quantile * sd / math.sqrt(pairs)


def _power(count: int, effect: float, confidence: float) -> float:
    freedom = count - 1
    critical = student_quantile(0.5 + 0.5 * confidence, freedom)
    shift = effect * math.sqrt(count)
    below = special.nctdtr(freedom, shift, [-critical, critical])
    return float(1.0 - below[1] + below[0])
