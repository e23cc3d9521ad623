"""Driven paths seen from above, drawn over the course: obstacles, plans and goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.course import (
    MARGIN_M,
    MAX_HEIGHT_IN,
    MIN_HEIGHT_IN,
    WIDTH_IN,
    Course,
    draw_course,
    draw_outlines,
)
from drake_navbench.analysis.figures.style import Look, legend_below, new_figure
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.mission import goals
from drake_navbench.analysis.metrics.movers import is_there, movers_of
from drake_navbench.analysis.metrics.moving import look_times
from drake_navbench.analysis.metrics.safety import obstacle_outlines
from drake_navbench.analysis.metrics.signals import positions, stretches
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import TrialLog


class DrivenPaths(NamedTuple):
    """The driven path (N, 2) of each trial of a controller, and outlines (K, 2) along them, m."""

    controller: str
    paths: list[Array]
    outlines: list[Array]


class PathsMap(NamedTuple):
    """The content of a scenario's map. low, high: the lower left and upper right corner, (2,) m."""

    course: Course
    driven: list[DrivenPaths]
    low: Array
    high: Array


def course_of(log: TrialLog) -> Course:
    """Returns the course of a trial."""
    *waypoints, goal = goals(log)[:, :2]
    moved = movers_of(log)
    poses = moved.poses_at(look_times(log)) if moved.body_count else np.empty((1, 0, 3))
    there = is_there(poses)
    first = [
        (outline, pose[own][0])
        for outline, pose, own in zip(moved.outlines, poses.swapaxes(0, 1), there.T, strict=True)
        if own.any()
    ]
    poses[~there] = np.nan
    return Course(
        obstacle_outlines(log),
        [plan.poses[:, :2] for plan in log.first_plans],
        len(log.plans) != len(log.first_plans),
        np.array(waypoints).reshape(-1, 2),
        goal,
        [poses[:, body, :2] for body in np.flatnonzero(there.any(axis=0))],
        [place_outline(outline, pose) for outline, pose in first],
        [
            (floor["name"], np.array([floor["bounds_m"][0], floor["bounds_m"][3]]))
            for floor in log.info.get("floors", [])
        ],
    )


def outline_at(log: TrialLog, row: int) -> Array:
    """Returns the corners (K, 2) m of the robot's outline at a row of the samples."""
    sample = log.samples.iloc[row]
    return place_outline(outline_of(log), (sample["x_m"], sample["y_m"], sample["yaw_rad"]))


def bounds(logs: Sequence[TrialLog]) -> tuple[Array, Array]:
    """Returns the lower left and upper right corner of task and paths, with a margin, m."""
    reach_m = np.hypot(*outline_of(logs[0]).T).max()
    points = np.vstack([part for log in logs for part in (positions(log), log.course[:, :2])])
    floors = [np.reshape(one["bounds_m"], (2, 2)) for one in logs[0].info.get("floors", [])]
    points = np.vstack([points, *floors])
    margin_m = reach_m + MARGIN_M
    return points.min(axis=0) - margin_m, points.max(axis=0) + margin_m


def drawn_path(log: TrialLog) -> Array:
    """Returns the driven path, (N, 2) m, with a row of NaN where a lift carried the robot."""
    parts = [np.vstack([part, np.full((1, 2), np.nan)]) for part in stretches(log)]
    return np.vstack(parts)[:-1]


def paths_map(logs_by_controller: Mapping[str, Sequence[TrialLog]]) -> PathsMap:
    """Returns the map with the driven paths of every trial of all controllers."""
    logs = [log for own in logs_by_controller.values() for log in own]
    driven = [
        DrivenPaths(controller, [drawn_path(log) for log in own], [outline_at(own[0], -1)])
        for controller, own in logs_by_controller.items()
    ]
    # Show the course of a trial that planned all its legs, if there is one.
    course = course_of(max(logs, key=lambda log: len(log.first_plans)))
    return PathsMap(course, driven, *bounds(logs))


def paths_figure(shown: PathsMap, look: Look) -> Figure:
    """Returns the driven paths of all controllers, every trial, over one map."""
    low, high = shown.low, shown.high
    height_in = WIDTH_IN * (high[1] - low[1]) / (high[0] - low[0])
    height_in = float(np.clip(height_in, MIN_HEIGHT_IN, MAX_HEIGHT_IN))
    figure, (axes,) = new_figure(axes_size_in=(WIDTH_IN, height_in))
    draw_course(axes, shown.course)
    for own in shown.driven:
        line = look.line(own.controller)
        for path in own.paths:
            axes.plot(*path.T, **line, lw=1.3, alpha=0.85)
        draw_outlines(axes, own.outlines, line["color"])
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_title("Driven paths, all trials; outlines where the first trial of each ended")
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, [*look.line_keys([own.controller for own in shown.driven]), *handles])
    return figure
