"""The relations between controllers that the publication claims, as numbers that can be tested.

A relation is reduced to one margin: positive where it holds, negative where it does not, zero at a
tie. Of the differences that must all be positive, the margin is the smallest: the deciding one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PERCENT = 100.0
# The publication prints success rates and top speeds in whole per cent.
HALF_PRINTED_UNIT = 0.5
# Differences below this share of the larger mean are rounding, not a difference.
ROUNDING_RATIO = 1e-12

LOWER_THAN = "lower than"
HIGH_TO_LOW = "order high to low"
LOW_TO_HIGH = "order low to high"


class Relation(Protocol):
    """What a finding claims of the means of some controllers.

    controllers: those whose means it is about. margin_unit: '' for that of the metric.
    """

    margin_unit: ClassVar[str]

    @property
    def controllers(self) -> tuple[str, ...]: ...

    def margin(self, means: Array) -> Array:
        """Returns the margins (...) of means (..., C), one column each of `controllers`."""
        ...

    def deciding(self, means: Array) -> str:
        """Returns in words what the margin of means (C,) rests on."""
        ...


@dataclass(frozen=True)
class Equals:
    """Every mean is the value that was printed: its margin is what is left of half a unit."""

    controllers: tuple[str, ...]
    value: float
    margin_unit: ClassVar[str] = ""

    def margin(self, means: Array) -> Array:
        """Returns half a printed unit minus the largest deviation from the value."""
        return HALF_PRINTED_UNIT - np.abs(means - self.value).max(axis=-1)

    def deciding(self, means: Array) -> str:
        """Returns the controller that is farthest off."""
        farthest = self.controllers[int(np.abs(means - self.value).argmax())]
        return f"{farthest} = {self.value:g}"


@dataclass(frozen=True)
class Within:
    """The highest mean exceeds the lowest by at most so many per cent of the lowest."""

    controllers: tuple[str, ...]
    percent: float
    margin_unit: ClassVar[str] = "%"

    def margin(self, means: Array) -> Array:
        """Returns the allowed minus the actual spread, in per cent of the lowest mean."""
        return self.percent - PERCENT * (means.max(axis=-1) / means.min(axis=-1) - 1.0)

    def deciding(self, means: Array) -> str:
        """Returns the two controllers that are farthest apart."""
        low, high = self.controllers[int(means.argmin())], self.controllers[int(means.argmax())]
        return f"{low} and {high} within {self.percent:g}%"


@dataclass(frozen=True)
class Ordering:
    """Some means lie strictly below others.

    below: pairs (lower, higher). All rankings come down to this.
    """

    below: tuple[tuple[str, str], ...]
    margin_unit: ClassVar[str] = ""

    @property
    def controllers(self) -> tuple[str, ...]:
        """Those in any pair, in the order of their first appearance."""
        return tuple(dict.fromkeys(name for pair in self.below for name in pair))

    def margin(self, means: Array) -> Array:
        """Returns the smallest of the differences higher minus lower."""
        return self._differences(means).min(axis=-1)

    def deciding(self, means: Array) -> str:
        """Returns the pair with the smallest difference."""
        lower, higher = self.below[int(self._differences(means).argmin())]
        return f"{lower} < {higher}"

    def _differences(self, means: Array) -> Array:
        place = {name: index for index, name in enumerate(self.controllers)}
        lower = means[..., [place[name] for name, _ in self.below]]
        higher = means[..., [place[name] for _, name in self.below]]
        differences = higher - lower
        rounding = ROUNDING_RATIO * np.maximum(np.abs(lower), np.abs(higher))
        return np.where(np.abs(differences) <= rounding, 0.0, differences)


def parse_relation(relation: str, controllers: str, *, everyone: Sequence[str]) -> Relation:
    """Returns the relation that a row of findings.csv names.

    relation: 'equals 100', 'within 3%', 'lowest', 'highest', 'order high to low', 'order low to
    high' or 'lower than'. controllers: names separated by blanks, for 'lower than' with a '<'
    between the lower and the higher ones. everyone: those that 'lowest' and 'highest' are among.
    Raises ValueError where the relation is none of these.
    """
    names = tuple(controllers.split())
    if equals := re.fullmatch(r"equals (\S+)", relation):
        return Equals(names, float(equals[1]))
    if within := re.fullmatch(r"within (\S+)%", relation):
        return Within(names, float(within[1]))
    if relation in ("lowest", "highest"):
        (chosen,) = names
        others = [name for name in everyone if name != chosen]
        is_lowest = relation == "lowest"
        return Ordering(tuple((chosen, o) if is_lowest else (o, chosen) for o in others))
    if relation in (HIGH_TO_LOW, LOW_TO_HIGH):
        rising = names[::-1] if relation == HIGH_TO_LOW else names
        return Ordering(tuple(pairwise(rising)))
    if relation == LOWER_THAN:
        lower, higher = (side.split() for side in controllers.split("<"))
        return Ordering(tuple((low, high) for low in lower for high in higher))
    raise ValueError(
        f"relation {relation!r} is not known; expected 'equals N', 'within N%', 'lowest', "
        f"'highest', '{HIGH_TO_LOW}', '{LOW_TO_HIGH}' or '{LOWER_THAN}'"
    )
