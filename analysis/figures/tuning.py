"""What a search of parameters found: the front, and each objective along each parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

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

PERCENT = 100.0
PANELS_ABREAST = 3
DROPPED: dict[str, Any] = {"marker": ".", "color": MUTED, "ms": 4, "alpha": 0.5, "ls": "none"}
TOUCHED: dict[str, Any] = {"marker": "x", "color": "#b91c1c", "ms": 4, "ls": "none"}
THROUGH: dict[str, Any] = {"marker": "o", "color": "#3b78b4", "ms": 4.5, "ls": "none"}
ON_FRONT: dict[str, Any] = {"marker": "D", "color": "#c2410c", "ms": 5.5, "ls": "none"}
# How a race ended, as tuning.json says it: what it is called, and what it looks like.
ENDINGS = {
    "dropped": ("dropped in the race", DROPPED),
    "touched": ("touched something", TOUCHED),
    "through": ("came through", THROUGH),
}

Point = Mapping[str, Any]


def front_figure(
    configurations: Sequence[Point], front: Sequence[Point], objectives: Sequence[str]
) -> Figure:
    """Returns a panel for every two objectives: relative differences to the baseline, percent.

    configurations, front: as in tuning.json. With one objective it stands over the order of search.
    """
    pairs = list(combinations(range(len(objectives)), 2)) or [(-1, 0)]
    rows = -(-len(pairs) // PANELS_ABREAST)
    columns = min(len(pairs), PANELS_ABREAST)
    figure, axes = new_figure(
        rows, columns, axes_size_in=(2.9, 2.4), margins=Margins(between_columns=0.8)
    )
    for (across, down), place in zip(pairs, axes, strict=False):
        for ending, (_, look) in ENDINGS.items():
            chosen = [entry for entry in configurations if entry["ending"] == ending]
            _plot(place, chosen, "means", across, down, look)
        _plot(place, front, "tuning", across, down, ON_FRONT)
        place.axhline(0.0, color=INK, lw=0.7)
        if across >= 0:
            place.axvline(0.0, color=INK, lw=0.7)
        place.set_xlabel("configuration" if across < 0 else f"{objectives[across]} [%]")
        place.set_ylabel(f"{objectives[down]} [%]")
    for unused in axes[len(pairs) :]:
        unused.remove()
    keys = [
        Line2D([], [], label=label, **look)
        for label, look in (*ENDINGS.values(), ("front", ON_FRONT))
    ]
    legend_below(figure, keys)
    return figure


def slices_figure(
    configurations: Sequence[Point], parameter: str, objectives: Sequence[str]
) -> Figure:
    """Returns a panel an objective: its relative difference over one parameter."""
    figure, axes = new_figure(
        1, len(objectives), axes_size_in=(2.9, 1.7), margins=Margins(between_columns=0.8)
    )
    values = [entry["parameters"][parameter] for entry in configurations]
    is_number = not any(isinstance(value, (bool, str)) for value in values)
    names = sorted(set(map(str, values)))
    places = values if is_number else [names.index(str(value)) for value in values]
    for index, (name, place) in enumerate(zip(objectives, axes, strict=True)):
        for ending, (_, look) in ENDINGS.items():
            chosen = [
                (x, PERCENT * entry["means"][index])
                for x, entry in zip(places, configurations, strict=True)
                if entry["ending"] == ending
            ]
            if chosen:
                place.plot(*zip(*chosen, strict=True), **look)
        place.axhline(0.0, color=INK, lw=0.7)
        if not is_number:
            place.set_xticks(range(len(names)), names)
        place.set_xlabel(parameter)
        place.set_ylabel(f"{name} [%]")
    return figure


def _plot(
    axes: Axes, points: Sequence[Point], key: str, across: int, down: int, look: Mapping[str, Any]
) -> None:
    if points:
        x = [p["number"] if across < 0 else PERCENT * p[key][across] for p in points]
        axes.plot(x, [PERCENT * p[key][down] for p in points], **look)
