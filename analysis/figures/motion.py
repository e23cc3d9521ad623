"""The publication's figures of one controller in one scenario, on one sheet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.integrate import cumulative_trapezoid

from drake_navbench.analysis.figures.course import draw_course, draw_outlines
from drake_navbench.analysis.figures.maps import (
    DrivenPaths,
    PathsMap,
    bounds,
    course_of,
    drawn_path,
    outline_at,
)
from drake_navbench.analysis.figures.style import (
    MUTED,
    Look,
    Margins,
    clear_data,
    legend_above,
    new_figure,
    place_labels,
)
from drake_navbench.analysis.metrics.body import Body, body_of
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.efficiency import spent_power_w
from drake_navbench.analysis.metrics.signals import Motion, column, motion, times
from drake_navbench.analysis.numbers import counted
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

Line = dict[str, Any]

PANEL_SIZE_IN = (3.2, 2.1)
SECOND_LINE: Line = {"color": MUTED, "lw": 1.0}


class FittedCurves(NamedTuple):
    """The curves that need derivatives of the velocities; all (M,), at evenly spaced times."""

    time_s: Array
    v_mps: Array
    acceleration_mps2: Array
    jerk_mps3: Array
    energy_j: Array


class MotionCurves(NamedTuple):
    """The curves of a sheet over the time of a trial; all (N,) except `fitted`.

    fitted: the curves from derivatives, or the reason why there are none.
    """

    time_s: Array
    command_v_mps: Array
    v_mps: Array
    command_w_radps: Array
    w_radps: Array
    centripetal_mps2: Array
    fitted: FittedCurves | str


class Sheet(NamedTuple):
    """The content of a controller's sheet: a map of all its trials, and the curves of one trial."""

    title: str
    controller: str
    map: PathsMap
    curves: MotionCurves


def shown_trial(logs: Sequence[TrialLog]) -> TrialLog:
    """Returns the trial whose curves are shown: the first that succeeded, else the first."""
    return next((log for log in logs if log.outcome is Outcome.SUCCEEDED), logs[0])


def sheet_of(logs: Sequence[TrialLog], controller: str) -> Sheet:
    """Returns the content of a controller's sheet; logs: its trials that have samples."""
    shown = shown_trial(logs)
    ends = [outline_at(shown, row) for row in (0, -1)]
    driven = DrivenPaths(controller, [drawn_path(log) for log in logs], ends)
    info = shown.info
    return Sheet(
        f"{info['scenario']['name']}: {controller}, curves of trial {info['trial']} "
        f"({str(shown.outcome).replace('_', ' ')})",
        controller,
        PathsMap(course_of(shown), [driven], *bounds(logs)),
        motion_curves(shown),
    )


def motion_curves(log: TrialLog) -> MotionCurves:
    """Returns the curves of a trial that has samples."""
    v_mps, w_radps = column(log, "v_mps"), column(log, "w_radps")
    try:
        fitted: FittedCurves | str = _fitted_curves(motion(log), _body_or_none(log))
    except Undefined as reason:
        fitted = str(reason)
    return MotionCurves(
        times(log),
        # A recording without commands has NaN here: no curve is drawn.
        log.samples["command_v_mps"].to_numpy(),
        v_mps,
        log.samples["command_w_radps"].to_numpy(),
        w_radps,
        np.abs(v_mps * w_radps),
        fitted,
    )


def _body_or_none(log: TrialLog) -> Body | None:
    """Returns the robot as a body; None where its file gives no mass."""
    try:
        return body_of(log)
    except Undefined:
        return None


def _fitted_curves(signal: Motion, body: Body | None) -> FittedCurves:
    spent_w = np.full(len(signal.v_mps), np.nan)
    if body is not None:
        spent_w = spent_power_w(signal, body)
    return FittedCurves(
        signal.period_s * np.arange(len(signal.v_mps), dtype=np.float64),
        signal.v_mps,
        signal.acceleration_mps2,
        signal.jerk_mps3,
        cumulative_trapezoid(spent_w, dx=signal.period_s, initial=0.0),
    )


class MotionSheet:
    """Path, velocity, yaw rate and energy of one controller after another, on one reused figure.

    Making axes and ticks takes longer than drawing the curves, so they are made once.
    """

    def __init__(self) -> None:
        self._figure, self._panels = new_figure(
            2, 3, axes_size_in=PANEL_SIZE_IN, margins=Margins(top=0.65, right=0.65)
        )
        self._speed = _add_speed_axis(self._panels[-1])
        for axes in self._panels[1:]:
            axes.set_xlabel("time [s]")

    def draw(self, sheet: Sheet, look: Look) -> Figure:
        """Returns the figure; the next call clears it and draws anew."""
        curves = sheet.curves
        line = look.line(sheet.controller) | {"linestyle": "-"}
        path, velocity, derivatives, turning, sideways, energy = self._panels
        for axes in self._figure.axes:
            clear_data(axes)
        _draw_path(path, sheet.map, line)
        _draw_velocity(velocity, curves, line)
        _draw_turning(turning, curves, line)
        _draw_sideways(sideways, curves, line)
        if isinstance(curves.fitted, str):
            for axes in (derivatives, energy):
                axes.text(0.5, 0.5, curves.fitted, ha="center", transform=axes.transAxes)
        else:
            _draw_derivatives(derivatives, curves.fitted, line)
            _draw_energy(energy, self._speed, curves.fitted, line)
        self._figure.suptitle(
            sheet.title,
            x=0.01,
            ha="left",
            fontsize=11,
        )
        return self._figure


def _add_speed_axis(axes: Axes) -> Axes:
    other = axes.twinx()
    other.grid(visible=False)
    other.spines["right"].set_visible(True)
    other.set_ylabel("velocity [m/s]", color=MUTED)
    place_labels(other, is_right=True)
    return other


def _draw_path(axes: Axes, shown: PathsMap, line: Line) -> None:
    (driven,) = shown.driven
    draw_course(axes, shown.course)
    for path in driven.paths:
        axes.plot(*path.T, **line | {"lw": 0.8}, alpha=0.6)
    draw_outlines(axes, driven.outlines, line["color"])
    axes.set_xlim(shown.low[0], shown.high[0])
    axes.set_ylim(shown.low[1], shown.high[1])
    axes.set_title(f"Plan (dashed) and paths of {counted(len(driven.paths), 'trial')}")


def _draw_velocity(axes: Axes, curves: MotionCurves, line: Line) -> None:
    axes.step(curves.time_s, curves.command_v_mps, **SECOND_LINE, where="post", label="command")
    axes.plot(curves.time_s, curves.v_mps, **line, label="true")
    axes.set_ylabel("velocity [m/s]")
    axes.set_title("Velocity")
    legend_above(axes)


def _draw_derivatives(axes: Axes, fitted: FittedCurves, line: Line) -> None:
    axes.plot(fitted.time_s, fitted.jerk_mps3, **SECOND_LINE, label="jerk [m/s³]")
    axes.plot(fitted.time_s, fitted.acceleration_mps2, **line, label="acceleration [m/s²]")
    axes.set_ylabel("m/s², m/s³")
    legend_above(axes)


def _draw_turning(axes: Axes, curves: MotionCurves, line: Line) -> None:
    axes.step(curves.time_s, curves.command_w_radps, **SECOND_LINE, where="post", label="command")
    axes.plot(curves.time_s, curves.w_radps, **line, label="true")
    axes.set_ylabel("yaw rate [rad/s]")
    axes.set_title("Yaw rate")
    legend_above(axes)


def _draw_sideways(axes: Axes, curves: MotionCurves, line: Line) -> None:
    axes.plot(curves.time_s, curves.centripetal_mps2, **line)
    axes.set_ylabel("|v w| [m/s²]")
    axes.set_title("Centripetal acceleration")


def _draw_energy(axes: Axes, speed_axes: Axes, fitted: FittedCurves, line: Line) -> None:
    axes.plot(fitted.time_s, fitted.energy_j, **line, label="energy")
    axes.set_ylabel("mechanical energy [J]")
    speed_axes.plot(fitted.time_s, fitted.v_mps, **SECOND_LINE)
    axes.plot([], [], **SECOND_LINE, label="velocity")
    axes.set_title("Energy")
    legend_above(axes)
