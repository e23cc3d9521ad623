"""Controllers side by side: clearance, distributions over trials, compute time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from drake_navbench.analysis.figures.style import (
    INK,
    MUTED,
    Look,
    Margins,
    legend_below,
    new_figure,
)
from drake_navbench.analysis.metrics.compute import MS_PER_S, cycle_times_ms
from drake_navbench.analysis.metrics.definition import Metric, Undefined
from drake_navbench.analysis.metrics.safety import DANGER_DISTANCE_M
from drake_navbench.analysis.metrics.signals import column, positions
from drake_navbench.analysis.verdicts import is_failed, values_by_seed
from drake_navbench.log import TrialLog

Logs = Mapping[str, Sequence[TrialLog]]
BOX_COLUMNS = 3
BOX_SIZE_IN = (2.9, 1.6)
WIDE_IN = (7.2, 2.8)
LONGEST_TICK_LABEL = 9
COMPUTE_POINTS = 150
SPREAD = 0.16


def clearance_figure(logs: Logs, look: Look) -> Figure | None:
    """Returns the footprint's clearance over the driven length; None without obstacles in reach."""
    figure, (axes,) = new_figure(axes_size_in=WIDE_IN)
    anything = False
    for controller, own in logs.items():
        for log in own:
            clearance = column(log, "clearance_m")
            clearance = np.where(np.isfinite(clearance), clearance, np.nan)
            anything = anything or bool(np.isfinite(clearance).any())
            steps = np.hypot(*np.diff(positions(log), axis=0).T)
            driven = np.concatenate([[0.0], np.cumsum(steps)])
            axes.plot(driven, clearance, **look.line(controller), lw=1.2, alpha=0.85)
    if not anything:
        return None
    axes.axhspan(0.0, DANGER_DISTANCE_M, color="#f6d9d5", zorder=0, lw=0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("driven length [m]")
    axes.set_ylabel("clearance of the footprint [m]")
    axes.set_title(f"Clearance along the path (shaded: below {DANGER_DISTANCE_M} m)")
    legend_below(figure, look.line_keys(logs))
    return figure


def box_figure(
    trials: pd.DataFrame, scenario: str, metrics: Sequence[Metric], look: Look
) -> Figure | None:
    """Returns a box plot a metric with every single trial visible; None without any value.

    Trials that failed are hollow.
    """
    shown = []
    for entry in metrics:
        values = values_by_seed(trials, scenario, entry.name)
        if values.notna().any(axis=None):
            shown.append((entry, values))
    failed = values_by_seed(trials.assign(failed=is_failed(trials)), scenario, "failed")
    if not shown:
        return None
    rows = -(-len(shown) // BOX_COLUMNS)
    figure, axes = new_figure(
        rows, BOX_COLUMNS, axes_size_in=BOX_SIZE_IN, margins=Margins(bottom=0.3, between_rows=0.55)
    )
    for own, (entry, values) in zip(axes, shown, strict=False):
        _draw_boxes(own, entry, values, failed=failed.astype(bool), look=look)
    for unused in axes[len(shown) :]:
        unused.set_axis_off()
    hollow = Line2D(
        [], [], ls="none", marker="o", ms=7, mfc="white", mec=MUTED, label="hollow: trial failed"
    )
    keys = look.marker_keys(shown[0][1].columns)
    legend_below(figure, [*keys, hollow] if failed.any(axis=None) else keys)
    return figure


def compute_figure(logs: Logs, look: Look) -> Figure | None:
    """Returns the distribution of compute times of a control cycle; None without any cycle."""
    figure, (axes,) = new_figure(axes_size_in=WIDE_IN)
    period_ms = None
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
            quantiles = np.quantile(np.concatenate(found), 1.0 - share)
            axes.plot(quantiles, share, **look.line(controller), label=controller)
    if period_ms is None:
        return None
    axes.axvline(period_ms, color=INK, lw=0.9, ls=(0, (4, 3)), label="control period")
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    axes.set_xlabel("compute time of a control cycle [ms]")
    axes.set_ylabel("share of cycles at least as long")
    axes.set_title("Compute time, all cycles of all trials")
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, handles)
    return figure


def _draw_boxes(
    axes: Axes, entry: Metric, values: pd.DataFrame, *, failed: pd.DataFrame, look: Look
) -> None:
    names = list(values.columns)
    columns = [values[name].dropna() for name in names]
    boxes = axes.boxplot(
        [column.to_numpy() for column in columns],
        widths=0.55,
        showfliers=False,
        patch_artist=True,
        medianprops={"color": INK, "linewidth": 1.4},
        whiskerprops={"color": MUTED},
        capprops={"color": MUTED},
    )
    for place, (name, own, box) in enumerate(zip(names, columns, boxes["boxes"], strict=True), 1):
        color = look.line(name)["color"]
        box.set(facecolor=color, alpha=0.25, edgecolor=color)
        # Side by side, so that equal trials do not hide one another.
        offsets = np.linspace(-SPREAD, SPREAD, len(own)) if len(own) > 1 else np.zeros(len(own))
        is_hollow = failed.loc[own.index, name].to_numpy(dtype=bool)
        for chosen, edge in (
            (~is_hollow, {"mfc": color, "mec": "white"}),
            (is_hollow, {"mfc": "white", "mec": color}),
        ):
            axes.plot(
                place + offsets[chosen], own[chosen], look.marker(name), ms=4.5, mew=0.7, **edge
            )
        if len(own) == 0:
            axes.text(place, 0.5, "–", ha="center", transform=axes.get_xaxis_transform())
    is_short = max(map(len, names)) <= LONGEST_TICK_LABEL
    axes.set_xticks(range(1, len(names) + 1), names if is_short else [""] * len(names))
    axes.grid(visible=False, axis="x")
    unit = f" [{entry.unit}]" if entry.unit else ""
    axes.set_title(f"{entry.name}{unit}", fontsize=8.5)
    arrow = {"lower": "↓ lower is better", "higher": "↑ higher is better"}.get(entry.better, "")
    axes.set_ylabel(arrow, fontsize=7.5, color=MUTED)
