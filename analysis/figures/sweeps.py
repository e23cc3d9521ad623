"""Response curves and heat maps of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.style import (
    INK,
    MUTED,
    Look,
    Margins,
    legend_below,
    new_figure,
)
from drake_navbench.analysis.numbers import number
from drake_navbench.analysis.sweeps import HeatMap, Response

PANELS_ABREAST = 3
# With more values than this, intervals blur the figure: only the points are drawn.
MOST_INTERVALS = 24
# A grid with more cells has no room for numbers.
MOST_NUMBERS = 100


class ResponsePanel(NamedTuple):
    """One metric along a field; label: the metric with its unit."""

    label: str
    responses: Sequence[Response]


def response_figure(panels: Sequence[ResponsePanel], field: str, look: Look) -> Figure:
    """Returns one panel a metric: means with 95% intervals along a field, one line a controller."""
    rows = -(-len(panels) // PANELS_ABREAST)
    figure, axes = new_figure(
        rows,
        PANELS_ABREAST,
        axes_size_in=(2.9, 2.1),
        margins=Margins(between_columns=0.7, between_rows=0.9),
    )
    for panel, place in zip(panels, axes, strict=False):
        for response in panel.responses:
            _draw_response(place, response, look)
        place.set_title(panel.label)
        place.set_xlabel(field)
    for unused in axes[len(panels) :]:
        unused.remove()
    names = list(dict.fromkeys(r.controller for panel in panels for r in panel.responses))
    legend_below(figure, look.line_keys(names))
    return figure


def _draw_response(axes: Axes, response: Response, look: Look) -> None:
    if response.values == [None]:
        _draw_constant(axes, response, look)
        return
    is_number = all(isinstance(value, (int, float)) for value in response.values)
    places = np.array(response.values if is_number else range(len(response.values)), dtype=float)
    means = np.array(response.means)
    low, high = np.array([tuple(entry) for entry in response.intervals], dtype=float).T
    line = look.line(response.controller)
    if len(places) > MOST_INTERVALS:
        axes.plot(places, means, ls="none", marker=look.marker(response.controller), ms=3, **line)
        return
    axes.plot(places, means, marker=look.marker(response.controller), ms=4, **line)
    axes.fill_between(places, low, high, color=line["color"], alpha=0.15, lw=0)
    if not is_number:
        axes.set_xticks(places, [str(value) for value in response.values])


def _draw_constant(axes: Axes, response: Response, look: Look) -> None:
    """Draws a controller that the field does not change: a level line with its interval."""
    line = look.line(response.controller)
    if np.isfinite(response.means[0]):
        axes.axhline(response.means[0], **line)
    low, high = response.intervals[0]
    if np.isfinite(low) and np.isfinite(high):
        axes.axhspan(low, high, color=line["color"], alpha=0.1, lw=0)


def heat_map_figure(maps: Sequence[HeatMap], fields: Sequence[str], label: str) -> Figure:
    """Returns one map a controller, all with one scale; label: the metric with its unit.

    Each cell shows the mean, and half the width of its 95% interval where that is known.
    """
    figure, axes = new_figure(
        1,
        len(maps),
        axes_size_in=(3.2, 2.6),
        margins=Margins(bottom=0.55, between_columns=0.8, left=0.85),
    )
    known = np.concatenate([entry.means.ravel() for entry in maps])
    known = known[np.isfinite(known)]
    limits = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    for entry, place in zip(maps, axes, strict=True):
        low, high = limits
        place.imshow(
            entry.means, origin="lower", aspect="auto", cmap="viridis", vmin=low, vmax=high
        )
        place.grid(visible=False)
        place.set_xticks(range(len(entry.across)), [number(v) for v in entry.across])
        place.set_yticks(range(len(entry.down)), [number(v) for v in entry.down])
        place.set_xlabel(fields[0])
        place.set_ylabel(fields[1])
        place.set_title(f"{entry.controller}: {label}")
        if entry.means.size <= MOST_NUMBERS:
            _write_numbers(place, entry, limits)
    return figure


def _write_numbers(axes: Axes, entry: HeatMap, limits: tuple[float, float]) -> None:
    middle = 0.5 * (limits[0] + limits[1])
    for (row, column), mean in np.ndenumerate(entry.means):
        if not np.isfinite(mean):
            axes.text(column, row, "–", ha="center", va="center", color=MUTED)
            continue
        half_width = float(entry.half_widths[row, column])
        spread = f"\n±{number(half_width)}" if np.isfinite(half_width) else ""
        color = INK if mean > middle else "white"
        text = f"{number(float(mean))}{spread}"
        axes.text(column, row, text, ha="center", va="center", color=color, fontsize=7)
