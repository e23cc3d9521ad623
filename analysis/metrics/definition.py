"""Defines a metric: a documented function from a trial's log to one number."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from drake_navbench.errors import one_line
from drake_navbench.logs.log import TrialLog


class Better(StrEnum):
    """The direction in which a metric's values are better."""

    LOWER = "lower"
    HIGHER = "higher"
    NEITHER = "neither"


class Undefined(ValueError):
    """Raised by a metric that has no value for a trial; the text is the reason that users see."""


class Measurement(NamedTuple):
    """A metric's value for one trial; NaN with a reason where it has no value."""

    value: float
    reason: str = ""


@dataclass(frozen=True)
class Metric:
    """A metric: call it with a `TrialLog` to get its value.

    name: column name, with the unit where the publication does not prescribe the name. unit: as
    shown in tables. better: the good direction. function: the computation; raises Undefined where a
    trial has no value. is_repeatable: False if the value depends on the machine. title: its common
    name, else the column name in words. relevant: differences up to this size, in the metric's
    unit, do not matter, even where they are certain.
    """

    name: str
    unit: str
    better: Better
    function: Callable[[TrialLog], float]
    is_repeatable: bool = True
    title: str = ""
    relevant: float = 0.0

    def __post_init__(self) -> None:
        if not self.title:
            words = self.name.replace("_", " ")
            object.__setattr__(self, "title", words[:1].upper() + words[1:])

    def __call__(self, log: TrialLog) -> float:
        """Returns the value; raises Undefined where the trial has none."""
        value = float(self.function(log))
        if not math.isfinite(value):
            raise Undefined(f"the computation gave {value}")
        return value

    def measure(self, log: TrialLog, known: float | None = None) -> Measurement:
        """Returns the value, or NaN with the reason; never raises.

        known: the value, if it was measured before; NaN is measured again, to find the reason.
        """
        if known is not None and math.isfinite(known):
            return Measurement(known)
        try:
            return Measurement(self(log))
        except Undefined as undefined:
            return Measurement(math.nan, str(undefined))
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            # A user's metric may raise any error: its cell stays empty, and the analysis goes on.
            return Measurement(math.nan, one_line(error))

    @property
    def description(self) -> str:
        """The function's docstring: a summary, then `Formula:` and `Source:` paragraphs."""
        return inspect.getdoc(self.function) or ""

    @property
    def summary(self) -> str:
        """The first line of the description."""
        return self.description.partition("\n")[0]


def metric(
    *,
    unit: str,
    better: Better | str,
    name: str | None = None,
    is_repeatable: bool = True,
    title: str = "",
    relevant: float = 0.0,
) -> Callable[[Callable[[TrialLog], float]], Metric]:
    """Turns a function from a `TrialLog` to a number into a `Metric`.

    unit: as shown in tables, '' for a pure number. better: 'lower', 'higher' or 'neither'. name:
    column name; that of the function if not given. is_repeatable: False for values that depend on
    the machine, such as compute times. title: its common name. relevant: the largest difference, in
    the unit, that does not matter.
    """

    def decorate(function: Callable[[TrialLog], float]) -> Metric:
        return Metric(
            name=name or function.__name__,
            unit=unit,
            better=Better(better),
            function=function,
            is_repeatable=is_repeatable,
            title=title,
            relevant=relevant,
        )

    return decorate
