"""A race of configurations: who is behind stops early, by a sign test that knows its looks.

Looking at the same data several times finds differences that are none. Each of the planned looks
therefore tests at an equal share of the error (Bonferroni, which is a little more careful than
Pocock's boundary), so that a configuration that is as good as its rival is dropped for it with at
most that probability, however the looks depend on each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of dropping a configuration for a rival that is no better, over all looks.
ERROR = 0.05
FIRST_LOOK = 4


def looks_until(most_pairs: int) -> list[int]:
    """Returns after how many pairs the race is looked at: 4, 8, 16, ... and at the end."""
    looks = []
    pairs = FIRST_LOOK
    while pairs < most_pairs:
        looks.append(pairs)
        pairs *= 2
    return [*looks, most_pairs]


def sign_test(wins: int, losses: int) -> float:
    """Returns how likely so many losses or more are where wins and losses are equally likely."""
    count = wins + losses
    return sum(comb(count, k) for k in range(losses, count + 1)) / 2**count


def is_dominated(own: Array, rival: Array, *, looks: int) -> bool:
    """Tells whether a rival is shown to be better in every objective at once.

    own, rival: (N, K) costs of the same N pairs, lower is better. A pair is lost where the rival is
    no worse in any objective and better in one, won where it is the other way round, and counts for
    neither where each is better in something. looks: how often the race is looked at in all.
    """
    losses = int(_dominates(rival, own).sum())
    wins = int(_dominates(own, rival).sum())
    return losses > 0 and sign_test(wins, losses) < ERROR / looks


def is_dropped(own: Array, rivals: Iterable[Array], *, looks: int) -> bool:
    """Tells whether any rival that has driven all pairs of `own` is shown to be better."""
    count = len(own)
    return any(
        is_dominated(own, rival[:count], looks=looks) for rival in rivals if len(rival) >= count
    )


def _dominates(first: Array, second: Array) -> NDArray[np.bool_]:
    return np.all(first <= second, axis=1) & np.any(first < second, axis=1)
