"""Confidence interval of the difference of two shares over the same pairs, such as arrivals."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import special

from drake_navbench.analysis.statistics import CONFIDENCE, UNDEFINED_INTERVAL, Interval

# The number of quantiles in the sum over one of two distributions; with twice as many no end moves
# by 0.001.
STEPS = 400
# The number of halvings of an interval of length 1: its ends are right to 1e-6.
HALVINGS = 20


@lru_cache(maxsize=4096)
def paired_share_interval(wins: int, losses: int, pairs: int) -> Interval:
    """Returns the interval of the difference of two shares, second minus first, from -1 to 1.

    wins, losses: the numbers of pairs in which only the second, or only the first, side arrived.
    The interval excludes zero if and only if the exact sign test gives p < 5%; if all
    pairs agree, it is Clopper and Pearson's interval of 0 of n. Source: Fay and Lumbard 2021, which
    melds Clopper and Pearson's limits of the share of pairs that differ with those of the share of
    wins among these.
    """
    if not 0 <= wins + losses <= pairs:
        raise ValueError(f"expected at most {pairs} pairs that differ, got {wins} + {losses}")
    if pairs == 0:
        return UNDEFINED_INTERVAL
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = _lower_end(wins, losses, pairs, tail)
    # The upper end is that of the swapped sides, with the opposite sign; adding 0 turns -0 into 0.
    return Interval(low, 0.0 - _lower_end(losses, wins, pairs, tail))


def _lower_end(wins: int, losses: int, pairs: int, tail: float) -> float:
    """Returns the difference below which the melded distribution has a share of `tail`."""
    differing = wins + losses
    probabilities = (np.arange(STEPS) + 0.5) / STEPS
    # Clopper and Pearson's lower limit of a share is a quantile of this Beta distribution.
    won = special.betaincinv(wins, losses + 1, probabilities) if wins else np.zeros(STEPS)
    advantage = 2.0 * won - 1.0

    def below(difference: float) -> float:
        """Returns the chance that advantage times share of differing pairs <= `difference`."""
        if difference >= 0.0:
            share = np.clip(difference / np.where(advantage > 0.0, advantage, 1.0), 0.0, 1.0)
            chance = _beta_cdf(differing, pairs - differing + 1, share)
            return float(np.where(advantage > 0.0, chance, 1.0).mean())
        share = np.clip(difference / np.where(advantage < 0.0, advantage, -1.0), 0.0, 1.0)
        chance = 1.0 - _beta_cdf(differing + 1, pairs - differing, share)
        return float(np.where(advantage < 0.0, chance, 0.0).mean())

    # Whether the interval excludes zero is decided by the sign test, to the last bit.
    is_above_zero = bool(wins) and special.betainc(wins, losses + 1, 0.5) < tail
    low, high = (0.0, 1.0) if is_above_zero else (-1.0, 0.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if below(middle) > tail else (middle, high)
    return high if is_above_zero else low


def _beta_cdf(first: float, second: float, values: np.ndarray) -> np.ndarray:
    """Returns Beta's distribution function; with a parameter of 0 all its weight is at 0 or 1."""
    if first == 0.0:
        return np.ones_like(values)
    if second == 0.0:
        return np.where(values >= 1.0, 1.0, 0.0)
    return special.betainc(first, second, values)
