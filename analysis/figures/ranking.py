"""Controllers ranked: diagram of places and Pareto plot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.style import (
    INK,
    MUTED,
    Look,
    Margins,
    legend_below,
    name_axes,
    new_figure,
)
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.statistics import pareto_front
from drake_navbench.analysis.verdicts import MetricVerdict
from drake_navbench.logs.outcome import Outcome

RANK_ROW_IN = 0.36
PATCH_WIDTH = 0.9
MIN_MARKER_AREA, MAX_MARKER_AREA = 50.0, 330.0


class ParetoPoints(NamedTuple):
    """Means of three metrics, over each controller's trials that have all three values.

    names: (N,). values: (N, 3) time s, clearance m, jerk m/s^3. is_on_front: (N,).
    """

    names: list[str]
    values: np.ndarray
    is_on_front: np.ndarray


class RankRow(NamedTuple):
    """The places of the controllers in one metric.

    places: 1 is the best mean. in_front: the best controller and those that the verdict on the
    metric does not show to be behind it.
    """

    metric: Metric
    places: dict[str, int]
    in_front: tuple[str, ...]


def rank_rows(verdicts: Sequence[MetricVerdict], metrics: Sequence[Metric]) -> list[RankRow]:
    """Returns the places in every metric that has a verdict, in the order of `metrics`.

    The words of the report rest on the same verdicts, so that the two cannot contradict each other.
    """
    found = {verdict.metric: verdict for verdict in verdicts}
    return [
        RankRow(
            entry,
            {name: place for place, name in enumerate(found[entry.name].order, start=1)},
            found[entry.name].leaders,
        )
        for entry in metrics
        if entry.name in found
    ]


def rank_figure(rows: Sequence[RankRow], look: Look) -> Figure | None:
    """Returns a diagram of places, one line a metric; None without a row.

    A grey patch marks the controllers that are not shown to be behind the first one.
    """
    if not rows:
        return None
    figure, (axes,) = new_figure(
        axes_size_in=(5.4, RANK_ROW_IN * len(rows)), margins=Margins(left=2.2)
    )
    names = list(dict.fromkeys(name for row in rows for name in row.places))
    for height, row in enumerate(rows):
        for name, place in row.places.items():
            if name in row.in_front:
                ends = [place - 0.5 * PATCH_WIDTH, place + 0.5 * PATCH_WIDTH]
                axes.plot(
                    ends, [height, height], color=MUTED, lw=14, alpha=0.25, solid_capstyle="butt"
                )
            axes.plot(
                place,
                height,
                look.marker(name),
                color=look.line(name)["color"],
                ms=8,
                mec="white",
            )
    axes.set_yticks(range(len(rows)), [row.metric.title for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0.4, len(names) + 0.6)
    axes.set_xticks(range(1, len(names) + 1))
    axes.set_xlabel("place by the mean, 1 is best")
    axes.set_title("Places; grey: not shown to be more than 1% behind the first", x=-0.4)
    legend_below(figure, look.marker_keys(names))
    return figure


def pareto_points(trials: pd.DataFrame, scenario: str) -> ParetoPoints:
    """Returns time to goal, clearance and jerk of the controllers that reached the goal.

    Only successful trials count: stopping early must not count as quick. Clearance counts as
    unlimited where no obstacle came within reach.
    """
    own = trials[(trials["scenario"] == scenario) & (trials["outcome"] == Outcome.SUCCEEDED)]
    columns = ["time_to_goal_s", "min_clearance_m", "jerk_rms_mps3"]
    order = list(dict.fromkeys(own["controller"]))
    means = own.groupby("controller")[columns].mean().reindex(order)
    means = means.dropna(subset=["time_to_goal_s", "jerk_rms_mps3"])
    values = means.to_numpy()
    costs = values * [1.0, -1.0, 1.0]
    costs[:, 1] = np.where(np.isnan(costs[:, 1]), -math.inf, costs[:, 1])
    costs[:, 1] = np.maximum(costs[:, 1], -np.finfo(float).max)
    return ParetoPoints(list(means.index), values, pareto_front(costs))


def pareto_figure(points: ParetoPoints, look: Look) -> Figure | None:
    """Returns time against clearance, with smoothness as size; None if none reached the goal."""
    if len(points.names) == 0 or np.isnan(points.values[:, 1]).all():
        return None
    figure, (axes,) = new_figure(axes_size_in=(5.8, 3.3))
    jerk = points.values[:, 2]
    span = np.ptp(jerk) or 1.0
    areas = MIN_MARKER_AREA + (MAX_MARKER_AREA - MIN_MARKER_AREA) * (jerk - jerk.min()) / span
    middle_s = 0.5 * (points.values[:, 0].min() + points.values[:, 0].max())
    for name, value, is_best, area in zip(*points, areas, strict=True):
        is_right = value[0] > middle_s
        axes.scatter(
            value[0],
            value[1],
            s=area,
            marker=look.marker(name),
            color=look.line(name)["color"],
            edgecolor=INK if is_best else "white",
            linewidth=1.6 if is_best else 0.6,
            alpha=1.0 if is_best else 0.55,
        )
        axes.annotate(
            f"{name}\n{value[2]:.2f} m/s³",
            value[:2],
            xytext=(-11 if is_right else 11, 0),
            ha="right" if is_right else "left",
            textcoords="offset points",
            fontsize=8,
            va="center",
        )
    axes.margins(0.25)
    name_axes(axes, "pareto")
    axes.set_title("Time, clearance, jerk (size); ringed: no other is better in all three")
    return figure
