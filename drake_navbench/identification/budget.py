"""How long the searches may take: so many evaluations, or so much time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from drake_navbench.errors import InputError

# Half of them say where to look, the others look there; with less there is no search.
LEAST_EVALUATIONS = 8
# To fit a surrogate to more of them would take longer than to drive them.
MOST_EVALUATIONS = 400
LEAST_SECONDS = 1.0
UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
OPTION = "--budget"


@dataclass(frozen=True)
class Budget:
    """Of all searches together: evaluations or seconds, the other one is None."""

    evaluations: int | None = None
    seconds: float | None = None

    def __str__(self) -> str:
        return f"{self.evaluations} evaluations" if self.evaluations else f"{self.seconds:g} s"


@dataclass(frozen=True)
class Share:
    """Of one search; at least `LEAST_EVALUATIONS` are made in any case."""

    evaluations: int
    seconds: float | None = None

    def is_used_up(self, evaluations: int, seconds: float) -> bool:
        """Whether a search that has used so much is over."""
        if evaluations < LEAST_EVALUATIONS:
            return False
        return evaluations >= self.evaluations or (
            self.seconds is not None and seconds >= self.seconds
        )


def parse_budget(text: str) -> Budget:
    """Returns the budget of a text such as 600, 90s, 40min or 2.5h; raises InputError."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)(s|min|h)?", text)
    number = float(found[1]) if found else 0.0
    if found is None or number <= 0.0 or (found[2] is None and "." in found[1]):
        raise InputError(
            f"{OPTION} {text!r}: expected a number of evaluations such as 600, or a time such as "
            "90s, 40min or 2.5h"
        )
    if found[2] is None:
        return Budget(evaluations=int(number))
    return Budget(seconds=number * UNITS_S[found[2]])


def shares(budget: Budget, weights: Sequence[int]) -> list[Share]:
    """Divides a budget among searches: evaluations alike, time by how much each has to drive.

    Raises InputError where it is too small for them.
    """
    count = len(weights)
    if budget.evaluations is not None:
        each = budget.evaluations // count
        if each < LEAST_EVALUATIONS:
            raise InputError(
                f"{OPTION} {budget.evaluations}: expected at least {count * LEAST_EVALUATIONS}, "
                f"{LEAST_EVALUATIONS} for each of {count} searches"
            )
        return [Share(min(each, MOST_EVALUATIONS))] * count
    seconds = budget.seconds or 0.0
    if seconds < count * LEAST_SECONDS:
        raise InputError(
            f"{OPTION} {seconds:g}s: expected at least {count * LEAST_SECONDS:g}s, "
            f"{LEAST_SECONDS:g} s for each of {count} searches"
        )
    return [Share(MOST_EVALUATIONS, seconds * weight / sum(weights)) for weight in weights]
