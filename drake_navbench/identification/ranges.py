"""Where values lie in the ranges that are searched."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drake_navbench.tuning.search_space import DIGITS, Dimension

GRID_POINTS = 33


def grid_of(dimension: Dimension) -> list[Any]:
    """Returns values over the whole range of a dimension."""
    if dimension.choices:
        return list(dimension.choices)
    if dimension.is_whole and dimension.high - dimension.low < GRID_POINTS:
        return list(range(int(dimension.low), int(dimension.high) + 1))
    return [value_at(dimension, float(place)) for place in np.linspace(0.0, 1.0, GRID_POINTS)]


def place_of(dimension: Dimension, value: Any) -> float:
    """Returns where a value lies in its range, from 0 to 1; choices lie side by side."""
    if dimension.choices:
        return dimension.choices.index(value) / max(len(dimension.choices) - 1, 1)
    if dimension.is_logarithmic:
        return math.log(value / dimension.low) / math.log(dimension.high / dimension.low)
    return float((value - dimension.low) / (dimension.high - dimension.low))


def value_at(dimension: Dimension, place: float) -> Any:
    """Returns the value at a place from 0 to 1; of choices, each has as much room."""
    if dimension.choices:
        return dimension.choices[
            min(int(place * len(dimension.choices)), len(dimension.choices) - 1)
        ]
    low, high = dimension.low, dimension.high
    value = low * (high / low) ** place if dimension.is_logarithmic else low + (high - low) * place
    if dimension.is_whole:
        return round(value)
    return min(max(float(f"{value:.{DIGITS}g}"), low), high)
