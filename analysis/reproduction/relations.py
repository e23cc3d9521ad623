"""The relations between controllers that the publication claims, as inequalities to be tested.

Every claim about means becomes inequalities `lower < factor * higher` between two of them, which
must all hold. A claim of equality with a value is about every single trial.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.percent import PERCENT

# Half of the printed unit: success rates and top speeds are printed in whole per cent.
HALF_PRINTED_UNIT = 0.5

LOWER_THAN = "lower than"
HIGH_TO_LOW = "order high to low"
LOW_TO_HIGH = "order low to high"


@dataclass(frozen=True)
class Inequality:
    """The mean of one controller is below `factor` times another's; factor 1 is an ordering."""

    lower: str
    higher: str
    factor: float = 1.0

    @property
    def is_ordering(self) -> bool:
        """Whether the two means are compared directly, with factor 1."""
        return self.factor == 1.0

    @property
    def text(self) -> str:
        """The inequality in words."""
        if self.is_ordering:
            return f"{self.lower} < {self.higher}"
        return f"{self.lower} < {self.factor:g} {self.higher}"

    def difference(self, lower: Array, higher: Array) -> Array:
        """Returns the inequality's margin, factor * higher - lower, in the unit of the metric."""
        return self.factor * higher - lower

    def size(self, lower: float, higher: float) -> float:
        """Returns the size of the effect, a ratio of the two means.

        For an ordering it is (higher - lower) / the larger mean: positive where the ordering holds,
        0 where both means are 0. Otherwise it is lower / higher, the ratio that the claim limits.
        """
        if not self.is_ordering:
            return lower / higher if higher != 0.0 else np.nan
        return relative_difference(lower, higher)


@dataclass(frozen=True)
class Equals:
    """Every trial of some controllers has the printed value."""

    controllers: tuple[str, ...]
    value: float

    def holds(self, values: Array) -> NDArray[np.bool_]:
        """Returns for each value whether it rounds to the printed one."""
        return np.abs(values - self.value) <= HALF_PRINTED_UNIT


@dataclass(frozen=True)
class Inequalities:
    """Inequalities between means, which must all hold."""

    parts: tuple[Inequality, ...]

    @property
    def controllers(self) -> tuple[str, ...]:
        """The controllers of all parts, in the order of their first appearance."""
        names = (name for part in self.parts for name in (part.lower, part.higher))
        return tuple(dict.fromkeys(names))


Relation = Equals | Inequalities


def relative_difference(lower: float, higher: float) -> float:
    """Returns higher minus lower as a share of the larger magnitude; 0 where both are 0.

    NaN where one of them is.
    """
    scale = max(abs(lower), abs(higher))
    return (higher - lower) / scale if scale != 0.0 else 0.0


def parse_relation(relation: str, controllers: str, *, everyone: Sequence[str]) -> Relation:
    """Returns the relation that a row of findings.csv names.

    relation: 'equals 100', 'within 3%' (the highest exceeds the lowest by at most so much), 'at
    most 35% of', 'lowest', 'highest', 'order high to low', 'order low to high' or 'lower than'.
    controllers: names separated by blanks; for 'lower than' and 'at most' a '<' separates the lower
    from the higher ones. everyone: all controllers, for 'lowest' and 'highest'. An ordering of more
    than two controllers is a claim about every two of them. Raises ValueError where the relation is
    none of these.
    """
    names = tuple(controllers.split())
    if equals := re.fullmatch(r"equals (\S+)", relation):
        return Equals(names, float(equals[1]))
    if within := re.fullmatch(r"within (\S+)%", relation):
        factor = 1.0 + float(within[1]) / PERCENT
        return Inequalities(tuple(Inequality(a, b, factor) for a, b in permutations(names, 2)))
    if relation in ("lowest", "highest"):
        (chosen,) = names
        others = [name for name in everyone if name != chosen]
        is_lowest = relation == "lowest"
        return Inequalities(
            tuple(Inequality(chosen, o) if is_lowest else Inequality(o, chosen) for o in others)
        )
    if relation in (HIGH_TO_LOW, LOW_TO_HIGH):
        rising = names[::-1] if relation == HIGH_TO_LOW else names
        return Inequalities(tuple(Inequality(a, b) for a, b in combinations(rising, 2)))
    at_most = re.fullmatch(r"at most (\S+)% of", relation)
    if relation == LOWER_THAN or at_most:
        factor = float(at_most[1]) / PERCENT if at_most else 1.0
        lower, higher = (side.split() for side in controllers.split("<"))
        return Inequalities(tuple(Inequality(a, b, factor) for a in lower for b in higher))
    raise ValueError(
        f"relation {relation!r} is not known; expected 'equals N', 'within N%', 'at most N% of', "
        f"'lowest', 'highest', '{HIGH_TO_LOW}', '{LOW_TO_HIGH}' or '{LOWER_THAN}'"
    )
