"""Every two of several columns compared, corrected for the number of pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import combinations
from typing import NamedTuple

from drake_navbench.analysis.statistics import PairedComparison, holm


class ComparedPair(NamedTuple):
    """Two columns compared, second minus first; p_holm: adjusted for all pairs of the same call."""

    first: str
    second: str
    comparison: PairedComparison
    p_holm: float


def compare_every_pair(
    names: Iterable[str], compared: Callable[[str, str], PairedComparison]
) -> list[ComparedPair]:
    """Returns every two of the names, in order, by `compared(first, second)`."""
    pairs = list(combinations(map(str, names), 2))
    found = [compared(*pair) for pair in pairs]
    adjusted = holm([comparison.p_value for comparison in found])
    return [
        ComparedPair(*pair, comparison, float(p_value))
        for pair, comparison, p_value in zip(pairs, found, adjusted, strict=True)
    ]
