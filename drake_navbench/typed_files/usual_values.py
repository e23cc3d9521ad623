"""Marks of numbers with which Nav2 starts, although hardly anybody means them.

`Usual`: a value beyond the usual ones is used as it is; the check of a Nav2 file tells its effect.
`TakenAs`: Nav2 itself changes a value; in a Nav2 file it is changed likewise, in files of ours it
is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo


@dataclass(frozen=True)
class Usual:
    """The values that a number usually has, as a mark in the annotation of its field.

    effect: the effect of a value beyond them, in Nav2 as here. low, high: both are usual; with
    `is_open` neither is. others: further usual values.
    """

    effect: str
    low: float = -math.inf
    high: float = math.inf
    is_open: bool = False
    others: tuple[float, ...] = ()

    def holds(self, value: float) -> bool:
        """Returns whether a value is usual."""
        if self.is_open:
            return self.low < value < self.high
        return self.low <= value <= self.high or value in self.others


@dataclass(frozen=True)
class TakenAs:
    """The change that Nav2 makes to any value of a number, as a mark in its field's annotation."""

    change: Callable[[Any], Any]


def clamped(low: int, high: int) -> TakenAs:
    """Returns the mark of a number that Nav2 brings between two bounds."""
    return TakenAs(lambda value: min(max(value, low), high))


def unsigned_up_to(high: int) -> TakenAs:
    """Returns the mark of a number that Nav2 keeps without a sign, and brings down to a bound."""
    return TakenAs(lambda value: value if 0 <= value <= high else high)


def one_of(choices: tuple[int, ...], other: int) -> TakenAs:
    """Returns the mark of a number in whose place Nav2 takes `other` if it is no choice."""
    return TakenAs(lambda value: value if value in choices else other)


def as_byte() -> TakenAs:
    """Returns the mark of a whole number of which Nav2 keeps the last 8 bits."""
    return TakenAs(lambda value: value % 256 if isinstance(value, int) else value)


def with_sign(sign: int) -> TakenAs:
    """Returns the mark of a number of which Nav2 takes the size alone, with the sign +1 or -1."""
    return TakenAs(lambda value: sign * abs(value))


def not_negative(effect: str) -> Usual:
    """Returns the mark of a number whose negative values have an effect that nobody means."""
    return Usual(effect, low=0.0)


def positive(effect: str) -> Usual:
    """Returns the mark of a number of which 0 and less have an effect that nobody means."""
    return Usual(effect, low=0.0, is_open=True)


def doubt_about(field: FieldInfo, value: Any) -> str:
    """Returns the value with its effect where it is beyond the usual ones, else ''."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    marks = (mark for mark in field.metadata if isinstance(mark, Usual))
    return next((f"{value:g}: {m.effect}" for m in marks if not m.holds(value)), "")


def as_taken(field: FieldInfo, value: Any) -> Any:
    """Returns a value as Nav2 takes it; one that is no number stays as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    for mark in field.metadata:
        value = mark.change(value) if isinstance(mark, TakenAs) else value
    return value


def unusual_values(model: type[BaseModel], values: Mapping[str, Any]) -> dict[str, str]:
    """Returns the doubts about values by their names; blocks within the model are looked into.

    values: by dotted name, or by another name that a field takes.
    """
    doubts = ((name, doubt_about(field, values[name])) for name, field in _fields(model, "")
              if name in values)  # fmt: skip
    return {name: doubt for name, doubt in doubts if doubt}


def _fields(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, FieldInfo]]:
    """Yields the fields of a model by dotted name, under each of their names."""
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _fields(inner, f"{prefix}{name}.")
            continue
        for known in dict.fromkeys((name, *getattr(field.validation_alias, "choices", ()))):
            yield f"{prefix}{known}", field
