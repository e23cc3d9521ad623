"""The two rules without skill of identification.md: `python studies/identification_baselines.py`.

Both foretell numbers of the published tables from other numbers of them, and drive nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from drake_navbench.analysis.reproduction.concordance import EXCLUDED_METRICS
from drake_navbench.analysis.reproduction.findings import is_published_tie
from drake_navbench.analysis.reproduction.publication import (
    PUBLISHED_CONTROLLERS,
    published_table,
    published_units,
)


class Votes(NamedTuple):
    """Number of published orderings that other scenarios predict; undecided votes count half."""

    right: float
    orderings: int


def rows() -> Iterator[tuple[str, str, dict[str, float]]]:
    """Yields scenario, metric and the printed numbers by controller, of the metrics that count."""
    for row in published_table().to_dict("records"):
        if row["metric"] not in EXCLUDED_METRICS:
            numbers = {name: float(row[name]) for name in PUBLISHED_CONTROLLERS}
            yield row["scenario"], row["metric"], numbers


def errors_of_row_means() -> list[float]:
    """Returns the relative error of every number that is not 0, foretold by its row.

    Foretold is the mean of the other three controllers in the same scenario and metric.
    """
    found = []
    for _, _, numbers in rows():
        for name, number in numbers.items():
            if number != 0.0:
                others = [value for other, value in numbers.items() if other != name]
                found.append(abs(float(np.mean(others)) / number - 1.0))
    return found


def votes_of_other_scenarios(*, ties_vote: bool) -> Votes:
    """Returns the share of pairs of controllers ordered as in most of the other scenarios.

    ties_vote: numbers that are printed too near to each other to be an ordering have a vote, too.
    """
    signs, orderings = {}, []
    for scenario, metric, numbers in rows():
        for first, second in combinations(PUBLISHED_CONTROLLERS, 2):
            a, b = numbers[first], numbers[second]
            is_tie = is_published_tie(a, b, printed_unit=published_units()[scenario, metric])
            if ties_vote or not is_tie:
                signs[scenario, metric, first, second] = float(np.sign(b - a))
            if not is_tie:
                orderings.append((scenario, metric, first, second))
    right = 0.0
    for scenario, *pair in orderings:
        elsewhere = sum(
            sign for (other, *its), sign in signs.items() if other != scenario and its == pair
        )
        right += 0.5 + 0.5 * signs[scenario, *pair] * float(np.sign(elsewhere))
    return Votes(right, len(orderings))


def main() -> None:
    """Prints both."""
    errors = errors_of_row_means()
    print(f"mean of the other three controllers: {np.median(errors):.1%} in the median", end="")
    print(f" of {len(errors)} numbers")
    for ties_vote in (True, False):
        right, count = votes_of_other_scenarios(ties_vote=ties_vote)
        told = "every row votes" if ties_vote else "only rows with an order vote"
        print(f"majority of the other scenarios, {told}: {right:g} of {count}", end="")
        print(f" orderings, {right / count:.1%}")


if __name__ == "__main__":
    main()
