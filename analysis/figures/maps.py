"""Plan, obstacles and driven paths seen from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.style import (
    OBSTACLE_EDGE,
    OBSTACLE_FACE,
    PLAN_COLOR,
    Look,
    legend_below,
    new_figure,
)
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.mission import goals
from drake_navbench.analysis.metrics.safety import obstacle_outlines
from drake_navbench.analysis.metrics.signals import Array, positions
from drake_navbench.kernels.poses import place_outline
from drake_navbench.log import TrialLog

MARGIN_M = 0.6
MAX_HEIGHT_IN, MIN_HEIGHT_IN, WIDTH_IN = 6.0, 1.8, 7.2


def draw_world(axes: Axes, log: TrialLog) -> None:
    """Draws obstacles, the first plan of each leg, waypoints and goal."""
    outlines = obstacle_outlines(log)
    axes.add_collection(
        PolyCollection(
            outlines,
            facecolor=OBSTACLE_FACE,
            edgecolor=OBSTACLE_EDGE,
            linewidth=0.8,
            label="obstacle" if outlines else None,
        ),
        autolim=False,
    )
    for plan in log.first_plans:
        label = "plan" if len(log.plans) == len(log.first_plans) else "first plan"
        axes.plot(
            *plan.poses[:, :2].T,
            color=PLAN_COLOR,
            lw=1.0,
            ls=(0, (4, 3)),
            label=label if plan is log.first_plans[0] else None,
        )
    *waypoints, goal = goals(log)
    mark: dict[str, Any] = {"mfc": "white", "mec": PLAN_COLOR, "ls": "none"}
    if waypoints:
        axes.plot(*np.array(waypoints)[:, :2].T, marker="D", ms=6, **mark, label="waypoint")
    axes.plot(*goal[:2], marker="*", ms=11, **mark, label="goal")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def draw_robot(axes: Axes, log: TrialLog, *, row: int, color: Any) -> None:
    """Draws the robot's outline at a row of the samples."""
    sample = log.samples.iloc[row]
    corners = place_outline(outline_of(log), (sample["x_m"], sample["y_m"], sample["yaw_rad"]))
    axes.fill(*corners.T, fill=False, edgecolor=color, linewidth=1.0, zorder=2.5)


def bounds(logs: Sequence[TrialLog]) -> tuple[Array, Array]:
    """Returns the lower left and the upper right corner of what happened, with a margin, m."""
    reach_m = np.hypot(*outline_of(logs[0]).T).max()
    points = np.vstack([part for log in logs for part in (positions(log), log.course[:, :2])])
    margin_m = reach_m + MARGIN_M
    return points.min(axis=0) - margin_m, points.max(axis=0) + margin_m


def paths_figure(logs_by_controller: Mapping[str, Sequence[TrialLog]], look: Look) -> Figure:
    """Returns the driven paths of all controllers, every trial, over one map."""
    logs = [log for own in logs_by_controller.values() for log in own]
    low, high = bounds(logs)
    height_in = WIDTH_IN * (high[1] - low[1]) / (high[0] - low[0])
    height_in = float(np.clip(height_in, MIN_HEIGHT_IN, MAX_HEIGHT_IN))
    figure, (axes,) = new_figure(axes_size_in=(WIDTH_IN, height_in))
    # One that planned all its legs, where there is one.
    draw_world(axes, max(logs, key=lambda log: len(log.first_plans)))
    for controller, own in logs_by_controller.items():
        for log in own:
            axes.plot(*positions(log).T, **look.line(controller), lw=1.3, alpha=0.85)
        draw_robot(axes, own[0], row=-1, color=look.line(controller)["color"])
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_title("Driven paths, all trials; outlines where the first trial of each ended")
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, [*look.line_keys(logs_by_controller), *handles])
    return figure
