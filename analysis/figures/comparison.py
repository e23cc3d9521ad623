"""Controllers side by side: clearance, distributions over trials, compute time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from drake_navbench.analysis.figures.style import (
    INK,
    MUTED,
    Look,
    Margins,
    legend_below,
    name_axes,
    new_figure,
)
from drake_navbench.analysis.metrics.compute import MS_PER_S, cycle_times_ms
from drake_navbench.analysis.metrics.definition import Metric, Undefined
from drake_navbench.analysis.metrics.safety import DANGER_DISTANCE_M
from drake_navbench.analysis.metrics.signals import column, is_carried, positions
from drake_navbench.analysis.numbers import typeset
from drake_navbench.analysis.pairs import values_by_seed
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

Logs = Mapping[str, Sequence[TrialLog]]
BOX_COLUMNS = 3
BOX_SIZE_IN = (2.9, 1.6)
BOX_HALF_WIDTH, CAP_HALF_WIDTH = 0.275, 0.1375
# Tukey: a whisker ends at the last value within this many box heights from the box.
WHISKER_REACH = 1.5
WIDE_IN = (7.2, 2.8)
LONGEST_TICK_LABEL = 9
COMPUTE_POINTS = 150
SPREAD = 0.16
# The most dots of a controller in a panel; the box is computed from all trials.
MOST_DOTS = 300


class ClearanceCurve(NamedTuple):
    """The footprint's clearance in one trial over the length driven so far.

    driven_m: (N,). clearance_m: (N,) NaN where no obstacle was in reach.
    """

    controller: str
    driven_m: Array
    clearance_m: Array


class Box(NamedTuple):
    """One metric of one controller: every trial, and Tukey's box around them.

    values: (N,) of the trials with a value. failed: (N,) whether the trial missed its goal. low,
    first, median, third, high: ends of the whiskers, quartiles; NaN without a value.
    """

    controller: str
    values: Array
    failed: np.ndarray
    low: float
    first: float
    median: float
    third: float
    high: float


class BoxPanel(NamedTuple):
    """One metric of all controllers."""

    metric: Metric
    boxes: list[Box]


class ComputeTimes(NamedTuple):
    """Distribution of the durations of control cycles, one curve a controller.

    curves: by controller (durations (Q,) ms, share of the cycles that took at least so long (Q,)).
    period_ms: the control period.
    """

    curves: dict[str, tuple[Array, Array]]
    period_ms: float


def clearance_curves(logs: Logs) -> list[ClearanceCurve]:
    """Returns a curve for each trial with clearances; [] if no obstacle was ever within reach."""
    curves = []
    for controller, own in logs.items():
        for log in own:
            if "clearance_m" in log.missing:
                continue
            clearance = column(log, "clearance_m")
            clearance = np.where(np.isfinite(clearance), clearance, np.nan)
            steps = np.hypot(*np.diff(positions(log), axis=0).T)
            steps[is_carried(log)] = 0.0
            driven = np.concatenate([[0.0], np.cumsum(steps)])
            curves.append(ClearanceCurve(controller, driven, clearance))
    return curves if any(np.isfinite(curve.clearance_m).any() for curve in curves) else []


def clearance_figure(curves: Sequence[ClearanceCurve], look: Look) -> Figure | None:
    """Returns the footprint's clearance over the driven length; None without a curve."""
    if not curves:
        return None
    figure, (axes,) = new_figure(axes_size_in=WIDE_IN)
    for controller, driven_m, clearance_m in curves:
        axes.plot(driven_m, clearance_m, **look.line(controller), lw=1.2, alpha=0.85)
    axes.axhspan(0.0, DANGER_DISTANCE_M, color="#f6d9d5", zorder=0, lw=0)
    axes.set_ylim(bottom=0.0)
    name_axes(axes, "clearance")
    axes.set_title(f"Clearance along the path (shaded: below {DANGER_DISTANCE_M} m)")
    legend_below(figure, look.line_keys(dict.fromkeys(curve.controller for curve in curves)))
    return figure


def box_panels(trials: pd.DataFrame, scenario: str, metrics: Sequence[Metric]) -> list[BoxPanel]:
    """Returns a panel for every metric that has a value for any trial."""
    failed = values_by_seed(trials.assign(failed=is_failed(trials)), scenario, "failed")
    panels = []
    for entry in metrics:
        values = values_by_seed(trials, scenario, entry.name)
        if values.notna().any(axis=None):
            boxes = [_box(name, values[name], failed[name]) for name in values]
            panels.append(BoxPanel(entry, boxes))
    return panels


def _box(controller: str, by_seed: pd.Series, failed: pd.Series) -> Box:
    values = by_seed.to_numpy(dtype=float)
    is_known = np.isfinite(values)
    values = values[is_known]
    is_failed_trial = failed.to_numpy()[is_known].astype(bool)
    if len(values) == 0:
        return Box(controller, values, is_failed_trial, *[np.nan] * 5)
    first, median, third = np.percentile(values, [25, 50, 75])
    reach = WHISKER_REACH * (third - first)
    low = min(values[values >= first - reach].min(), first)
    high = max(values[values <= third + reach].max(), third)
    return Box(controller, values, is_failed_trial, low, first, median, third, high)


def evenly_chosen(count: int, most: int) -> NDArray[np.intp]:
    """Returns at most `most` indices below `count`, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def box_figure(panels: Sequence[BoxPanel], look: Look) -> Figure | None:
    """Returns a box plot a metric with every single trial visible; None without a panel.

    Dots of failed trials are hollow.
    """
    if not panels:
        return None
    rows = -(-len(panels) // BOX_COLUMNS)
    figure, axes = new_figure(
        rows, BOX_COLUMNS, axes_size_in=BOX_SIZE_IN, margins=Margins(bottom=0.3, between_rows=0.55)
    )
    for own, panel in zip(axes, panels, strict=False):
        _draw_boxes(own, panel, look)
    for unused in axes[len(panels) :]:
        unused.set_axis_off()
    keys = look.marker_keys(box.controller for box in panels[0].boxes)
    if any(box.failed.any() for panel in panels for box in panel.boxes):
        hollow: dict[str, Any] = {"marker": "o", "ms": 7, "mfc": "white", "mec": MUTED}
        keys.append(Line2D([], [], ls="none", label="hollow: trial failed", **hollow))
    legend_below(figure, keys)
    return figure


def compute_times(logs: Logs) -> ComputeTimes | None:
    """Returns the distribution of compute times of a control cycle; None without any cycle."""
    curves = {}
    period_ms = 0.0
    for controller, own in logs.items():
        found = []
        for log in own:
            try:
                found.append(cycle_times_ms(log))
            except Undefined:
                continue
            settings = log.info["robot"]["navigation"]["controller_server"]
            period_ms = MS_PER_S / settings["controller_frequency"]
        if found:
            share = np.geomspace(1.0, 1.0 / sum(map(len, found)), COMPUTE_POINTS)
            curves[controller] = np.quantile(np.concatenate(found), 1.0 - share), share
    return ComputeTimes(curves, period_ms) if curves else None


def compute_figure(times: ComputeTimes | None, look: Look) -> Figure | None:
    """Returns the distribution of compute times of a control cycle; None without any cycle."""
    if times is None:
        return None
    figure, (axes,) = new_figure(axes_size_in=WIDE_IN)
    for controller, (times_ms, share) in times.curves.items():
        axes.plot(times_ms, share, **look.line(controller))
    period = axes.axvline(times.period_ms, color=INK, lw=0.9, ls=(0, (4, 3)))
    period.set_label("control period")
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    name_axes(axes, "compute")
    axes.set_title("Compute time, all cycles")
    legend_below(figure, [*look.line_keys(times.curves), period])
    return figure


def _draw_boxes(axes: Axes, panel: BoxPanel, look: Look) -> None:
    names = [box.controller for box in panel.boxes]
    _draw_outlines(axes, panel.boxes, look)
    for place, box in enumerate(panel.boxes, 1):
        color = look.line(box.controller)["color"]
        shown = evenly_chosen(len(box.values), MOST_DOTS)
        values, failed, count = box.values[shown], box.failed[shown], len(shown)
        # Dots are spread sideways, so that equal trials do not hide one another.
        offsets = np.linspace(-SPREAD, SPREAD, count) if count > 1 else np.zeros(count)
        for chosen, edge in (
            (~failed, {"mfc": color, "mec": "white"}),
            (failed, {"mfc": "white", "mec": color}),
        ):
            if chosen.any():
                marker = look.marker(box.controller)
                axes.plot(place + offsets[chosen], values[chosen], marker, ms=4.5, mew=0.7, **edge)
        if count == 0:
            axes.text(place, 0.5, "–", ha="center", transform=axes.get_xaxis_transform())
    is_short = max(map(len, names)) <= LONGEST_TICK_LABEL
    axes.set_xticks(range(1, len(names) + 1), names if is_short else [""] * len(names))
    axes.set_xlim(0.5, len(names) + 0.5)
    axes.grid(visible=False, axis="x")
    entry = panel.metric
    unit = f" [{typeset(entry.unit)}]" if entry.unit else ""
    axes.set_title(f"{entry.title}{unit}", fontsize=8.5)
    arrow = {"lower": "↓ lower is better", "higher": "↑ higher is better"}.get(entry.better, "")
    axes.set_ylabel(arrow, fontsize=7.5, color=MUTED)


def _draw_outlines(axes: Axes, boxes: Sequence[Box], look: Look) -> None:
    """Draws boxes, medians and whiskers, all of one kind in one call, which is quicker."""
    outlines, colors, medians = [], [], []
    whiskers: list[list[tuple[float, float]]] = []
    for place, box in enumerate(boxes, 1):
        if len(box.values) == 0:
            continue
        left, right = place - BOX_HALF_WIDTH, place + BOX_HALF_WIDTH
        outlines.append(
            [(left, box.first), (right, box.first), (right, box.third), (left, box.third)]
        )
        colors.append(look.line(box.controller)["color"])
        medians.append([(left, box.median), (right, box.median)])
        for end, start in ((box.low, box.first), (box.high, box.third)):
            whiskers.append([(place, start), (place, end)])
            whiskers.append([(place - CAP_HALF_WIDTH, end), (place + CAP_HALF_WIDTH, end)])
    axes.add_collection(PolyCollection(outlines, facecolor=colors, edgecolor=colors, alpha=0.25))
    axes.add_collection(LineCollection(whiskers, color=MUTED, linewidth=1.0))
    axes.add_collection(LineCollection(medians, color=INK, linewidth=1.4))
