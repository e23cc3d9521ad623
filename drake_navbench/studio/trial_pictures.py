"""The pictures of trials: path and speed of this one, the one before, and the reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from bokeh.models import ColumnDataSource
from markupsafe import Markup

from drake_navbench.analysis.numbers import typeset
from drake_navbench.studio import style
from drake_navbench.studio.messages import Driven, MetricOf
from drake_navbench.studio.scene_items import Item, bounds_of
from drake_navbench.studio.style import MapView, coordinates, picture

MARGIN_M = 0.8
# As long as nothing is driven, oldest at the bottom.
ROLES = (("reference", style.REFERENCE), ("before", style.BEFORE), ("now", style.NOW))
# A change by a smaller share counts as none.
LEAST_SHARE = 1e-3


class TrialPictures:
    """Two figures: the floor with the paths, and the speed over time."""

    def __init__(self) -> None:
        self._map = MapView(height=400)
        self.floor = self._map.figure
        self.speed = picture(
            height=190,
            tools="xpan,xwheel_zoom,reset",
            x_axis_label="time [s]",
            y_axis_label="speed [m/s]",
        )
        self._shapes = ColumnDataSource({"xs": [], "ys": []})
        self._ends = ColumnDataSource({"x": [], "y": [], "color": []})
        self._plan = ColumnDataSource({"x": [], "y": []})
        self._outline = ColumnDataSource({"xs": [], "ys": []})
        self._paths: dict[str, ColumnDataSource] = {}
        self._speeds: dict[str, ColumnDataSource] = {}
        self._draw()

    def _draw(self) -> None:
        floor = self.floor
        floor.patches("xs", "ys", source=self._shapes, color=style.WALL, fill_alpha=0.75)
        floor.line("x", "y", source=self._plan, color=style.INK, line_dash="dashed")
        floor.scatter("x", "y", source=self._ends, color="color", size=10)
        for role, color in ROLES:
            path, speed = ColumnDataSource({"x": [], "y": []}), ColumnDataSource({"x": [], "y": []})
            width = 2.5 if role == "now" else 1.5
            floor.line("x", "y", source=path, color=color, line_width=width, legend_label=role)
            self.speed.line("x", "y", source=speed, color=color, line_width=width)
            self._paths[role], self._speeds[role] = path, speed
        floor.patches(
            "xs", "ys", source=self._outline, fill_alpha=0.15, color=style.NOW, line_width=1.5
        )
        floor.legend.update(
            background_fill_alpha=0.0,
            border_line_alpha=0.0,
            label_text_color=style.INK,
            location="top_left",
            orientation="horizontal",
            spacing=18,
        )

    def show_scene(self, items: Sequence[Item]) -> None:
        """Draws the obstacles, the start and the goals of a scenario."""
        walls = [item.outline for item in items if item.kind == "wall"]
        ends = [item for item in items if item.kind in ("start", "goal")]
        self._shapes.data = coordinates(walls)
        self._ends.data = {
            "x": [float(item.outline[0, 0]) for item in ends],
            "y": [float(item.outline[0, 1]) for item in ends],
            "color": [style.START if item.kind == "start" else style.GOAL for item in ends],
        }
        low_x, low_y, high_x, high_y = bounds_of(items)
        self._map.look_at(
            [low_x - MARGIN_M, low_y - MARGIN_M, high_x + MARGIN_M, high_y + MARGIN_M]
        )

    def show(self, trials: Mapping[str, Driven | None]) -> None:
        """Draws trials by their roles: 'now', 'before', 'reference'."""
        for (role, _), entry in zip(ROLES, self.floor.legend[0].items, strict=True):
            trial = trials.get(role)
            entry.visible = trial is not None
            poses = np.empty((0, 3)) if trial is None else trial.poses
            times = np.empty(0) if trial is None else trial.times_s
            speeds = np.empty((0, 2)) if trial is None else trial.speeds
            self._paths[role].data = {"x": poses[:, 0], "y": poses[:, 1]}
            self._speeds[role].data = {"x": times, "y": speeds[:, 0]}
        now = trials.get("now")
        if now is None:
            self._plan.data = {"x": [], "y": []}
            self._outline.data = coordinates([])
            return
        self._plan.data = {"x": now.plan[:, 0], "y": now.plan[:, 1]}
        body = placed(now.outline, now.poses[-1]) if len(now.poses) else np.empty((0, 2))
        self._outline.data = coordinates([body])


def placed(outline: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Returns an outline (K, 2) at a pose (3,), m."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(outline @ np.array([[c, s], [-s, c]]) + pose[:2])


def metrics_table(
    metrics: Sequence[MetricOf],
    now: Driven,
    before: Driven | None,
    reference: Driven | None,
) -> Markup:
    """Returns the metrics of a trial with their change since the one before and the reference."""
    others = {"change from before": before, "change from reference": reference}
    known = {title: other for title, other in others.items() if other is not None}
    rows: list[list[str | Markup]] = [
        ["Outcome", now.outcome, *(f"was {other.outcome}" for other in known.values())]
    ]
    for metric in metrics:
        value = now.metrics.get(metric.name, np.nan)
        rows.append(
            [
                metric.title,
                _with_unit(value, metric) if np.isfinite(value) else "–",
                *(_change(metric, value, other) for other in known.values()),
            ]
        )
    return style.table([now.column, "now", *known], rows)


def _change(metric: MetricOf, value: float, other: Driven) -> str | Markup:
    change = value - other.metrics.get(metric.name, np.nan)
    if not np.isfinite(change):
        return "–"
    if change == 0.0:
        return "="
    if abs(change) < LEAST_SHARE * abs(value):
        return "≈"
    is_good = (change > 0.0) == (metric.better == "higher")
    kind = "" if metric.better not in ("higher", "lower") else "good" if is_good else "bad"
    return Markup('<span class="{}">{}{}</span>').format(
        kind, "+" if change > 0 else "−", _with_unit(abs(change), metric)
    )


def _with_unit(value: float, metric: MetricOf) -> str:
    unit = f" {typeset(metric.unit)}" if metric.unit not in ("", "-") else ""
    return f"{number(value)}{unit}"


def number(value: float) -> str:
    """Returns a number with three significant digits, a large one as a whole number."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"
