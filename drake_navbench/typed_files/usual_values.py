"""Marks the values of a field beyond which Nav2 starts, too, but hardly anybody means them.

Such a value is used as it is; the check of a Nav2 file tells its effect.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo


@dataclass(frozen=True)
class Usual:
    """The values that a number usually has, as a mark in the annotation of its field.

    effect: the effect of a value beyond them, in Nav2 as here. low, high: both are usual; with
    `is_open` neither is.
    """

    effect: str
    low: float = -math.inf
    high: float = math.inf
    is_open: bool = False

    def holds(self, value: float) -> bool:
        """Returns whether a value is usual."""
        if self.is_open:
            return self.low < value < self.high
        return self.low <= value <= self.high


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
        for known in {name, *getattr(field.validation_alias, "choices", ())}:
            yield f"{prefix}{known}", field
