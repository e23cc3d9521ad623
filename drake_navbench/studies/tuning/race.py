"""A race of configurations: who is behind stops early, rarely by bad luck.

Evidence against a configuration is a Bayes factor: how many times more likely its wins and losses
against a rival are where losses prevail (every share from a half to one alike) than where both are
equally likely. Where no rival is better, its expectation never exceeds 1, pair after pair. The same
holds for a mean of it over rivals, so that the mean ever reaches 1 / ERROR with probability ERROR
at most (Ville 1939): for the race as a whole, however many rivals there are, however often it is
looked at, and however rivals and pairs of objectives depend on each other.

Source: A. Ramdas et al., "Game-Theoretic Statistics and Safe Anytime-Valid Inference", Statistical
Science 2023.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import special

from drake_navbench.kernels.arrays import Array

# The probability that a race drops a configuration that no rival beats.
ERROR = 0.05
# With fewer than seven pairs nobody is dropped, even if all pairs are lost to all rivals.
LOOK_EVERY = 8
# The baseline counts most among the rivals: it is half of the evidence, all others share the rest.
SHARE_OF_BASELINE = 0.5


def looks_until(most_pairs: int) -> list[int]:
    """Returns the numbers of pairs after which a race is judged: 8, 16, 24, ... and the last."""
    return [*range(LOOK_EVERY, most_pairs, LOOK_EVERY), most_pairs]


def evidence(wins: int, losses: int) -> float:
    """Returns the Bayes factor of "losses prevail" against "wins and losses are equally likely".

    Each pair at most doubles it. After n losses and no win it is 2^(n + 1) / (n + 1), less a share
    of 2^-(n + 1).
    """
    upper = special.betaincc(losses + 1.0, wins + 1.0, 0.5)
    logarithm = (wins + losses + 1.0) * np.log(2.0) + special.betaln(losses + 1.0, wins + 1.0)
    return float(np.exp(logarithm) * upper)


def evidence_against(own: Array, rival: Array) -> float:
    """Returns the evidence that a rival beats `own`, both (N, K) costs, in every objective at once.

    Lower is better. A pair is lost where the rival is no worse in any objective and better in one,
    won where it is the other way round, and counts for neither where each is better in something.
    A rival that has driven fewer pairs counts as far as it drove.
    """
    count = min(len(own), len(rival))
    own, rival = own[:count], rival[:count]
    return evidence(int(_dominates(own, rival).sum()), int(_dominates(rival, own).sum()))


def is_dropped(own: Array, rivals: Sequence[Array]) -> bool:
    """Returns whether a configuration with the differences (N, K) to the baseline is behind.

    rivals: the differences of every earlier configuration, as far as it drove. Dropped ones are
    among them: without these, only lucky configurations would be left as rivals.
    """
    against_baseline = evidence_against(own, np.zeros_like(own))
    if not rivals:
        return against_baseline >= 1.0 / ERROR
    against_rivals = float(np.mean([evidence_against(own, rival) for rival in rivals]))
    shared = SHARE_OF_BASELINE * against_baseline + (1.0 - SHARE_OF_BASELINE) * against_rivals
    return shared >= 1.0 / ERROR


def _dominates(first: Array, second: Array) -> NDArray[np.bool_]:
    return np.all(first <= second, axis=1) & np.any(first < second, axis=1)
