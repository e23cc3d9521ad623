"""Figures of a tuning study: the Pareto front, and each objective over each parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from drake_navbench.analysis.figures.style import (
    INK,
    MUTED,
    Margins,
    legend_below,
    new_figure,
)
from drake_navbench.kernels.percent import PERCENT

PANELS_ABREAST = 3
DROPPED: dict[str, Any] = {"marker": ".", "color": MUTED, "ms": 4, "alpha": 0.5, "ls": "none"}
TOUCHED: dict[str, Any] = {"marker": "x", "color": "#b91c1c", "ms": 4, "ls": "none"}
THROUGH: dict[str, Any] = {"marker": "o", "color": "#3b78b4", "ms": 4.5, "ls": "none"}
ON_FRONT: dict[str, Any] = {"marker": "D", "color": "#c2410c", "ms": 5.5, "ls": "none"}
# The ending of a race in tuning.json -> its name in the legend, and its marker.
ENDINGS = {
    "dropped": ("dropped in the race", DROPPED),
    "touched": ("touched something", TOUCHED),
    "through": ("came through", THROUGH),
}

# The marker of a point beyond the axis; a failed trial, which counts 100% worse, may lie there.
BEYOND: dict[str, Any] = {"marker": "^", "color": "#a3261b", "ms": 5, "ls": "none"}
# As in a box plot, the axis ends SPREADS_ABOVE spreads above the MOST-th percentile.
MOST, SPREADS_ABOVE = 75.0, 2.0

Point = Mapping[str, Any]


def front_figure(
    configurations: Sequence[Point], front: Sequence[Point], objectives: Sequence[str]
) -> Figure:
    """Returns one panel for every two objectives: relative differences from the baseline, percent.

    configurations, front: as in tuning.json. A single objective is drawn over the order of the
    search.
    """
    pairs = list(combinations(range(len(objectives)), 2)) or [(-1, 0)]
    rows = -(-len(pairs) // PANELS_ABREAST)
    columns = min(len(pairs), PANELS_ABREAST)
    figure, axes = new_figure(
        rows, columns, axes_size_in=(2.9, 2.4), margins=Margins(between_columns=0.8)
    )
    limits = _limits(configurations, len(objectives))
    for (across, down), place in zip(pairs, axes, strict=False):
        for ending, (_, look) in ENDINGS.items():
            chosen = [entry for entry in configurations if entry["ending"] == ending]
            _plot(place, _differences(chosen, "means", across, down), look, limits, across, down)
        _plot(place, _differences(front, "tuning", across, down), ON_FRONT, limits, across, down)
        place.axhline(0.0, color=INK, lw=0.7)
        if across >= 0:
            place.axvline(0.0, color=INK, lw=0.7)
        place.set_xlabel("configuration" if across < 0 else f"{objectives[across]} [%]")
        place.set_ylabel(f"{objectives[down]} [%]")
    for unused in axes[len(pairs) :]:
        unused.remove()
    keys = [
        Line2D([], [], label=label, **look)
        for label, look in (
            *ENDINGS.values(),
            ("front", ON_FRONT),
            *([("beyond the axis", BEYOND)] if any(map(np.isfinite, limits)) else []),
        )
    ]
    legend_below(figure, keys)
    return figure


def slices_figure(
    configurations: Sequence[Point], parameter: str, objectives: Sequence[str]
) -> Figure:
    """Returns one panel an objective: its relative difference over one parameter."""
    figure, axes = new_figure(
        1, len(objectives), axes_size_in=(2.9, 1.7), margins=Margins(between_columns=0.8)
    )
    values = [entry["parameters"][parameter] for entry in configurations]
    is_number = not any(isinstance(value, (bool, str)) for value in values)
    names = sorted(set(map(str, values)))
    places = values if is_number else [names.index(str(value)) for value in values]
    limits = _limits(configurations, len(objectives))
    for index, (name, place) in enumerate(zip(objectives, axes, strict=True)):
        for ending, (_, look) in ENDINGS.items():
            chosen = [
                (x, PERCENT * entry["means"][index])
                for x, entry in zip(places, configurations, strict=True)
                if entry["ending"] == ending
            ]
            _plot(place, chosen, look, limits, -1, index)
        place.axhline(0.0, color=INK, lw=0.7)
        if not is_number:
            place.set_xticks(range(len(names)), names)
        place.set_xlabel(parameter)
        place.set_ylabel(f"{name} [%]")
    return figure


def _limits(configurations: Sequence[Point], count: int) -> list[float]:
    """Returns the upper end of each objective's axis, percent; infinity where all points fit.

    One failed trial, which counts 100% worse, would press all others together.
    """
    limits = []
    for index in range(count):
        values = [PERCENT * entry["means"][index] for entry in configurations]
        most = float(np.percentile(values, MOST)) if values else 0.0
        limit = max(0.0, most) + SPREADS_ABOVE * (most - min(values, default=0.0))
        limits.append(limit if values and max(values) > limit > most else np.inf)
    return limits


def _differences(
    points: Sequence[Point], key: str, across: int, down: int
) -> list[tuple[float, float]]:
    """Returns x and y of points; across: an objective, or -1 for the order of the search."""
    return [
        (p["number"] if across < 0 else PERCENT * p[key][across], PERCENT * p[key][down])
        for p in points
    ]


def _plot(
    axes: Axes,
    places: Sequence[tuple[float, float]],
    look: Mapping[str, Any],
    limits: Sequence[float],
    across: int,
    down: int,
) -> None:
    """Plots points; a point beyond an axis is marked at its end. across: -1 for no objective."""
    ends = np.inf if across < 0 else limits[across], limits[down]
    inside = [place for place in places if place[0] <= ends[0] and place[1] <= ends[1]]
    beyond = [tuple(np.minimum(place, ends)) for place in places if place not in inside]
    for chosen, own in ((inside, look), (beyond, BEYOND)):
        if chosen:
            axes.plot(*zip(*chosen, strict=True), **own)
