"""The pictures of bends and encounters in harmony.md: `python studies/harmony_pictures.py`.

Bends: the first three try-out worlds of S-curves, and in each the bend in which harmony gets
farthest from the plan. Encounters: somebody walks straight on to where the robot will be. Prints
the robot's speed at each touch, for both walking speeds.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from harmony_comparison import RIVALS
from harmony_encounters import LAYERS, WALKING_MPS, encounter, told
from harmony_worlds import write_world
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.figures import style
from drake_navbench.analysis.figures.course import draw_course
from drake_navbench.analysis.figures.maps import bounds, course_of, outline_at
from drake_navbench.analysis.metrics.efficiency import duration_s
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.metrics.signals import positions
from drake_navbench.analysis.metrics.tracking import cross_track_error_mean_m, projection_on_plans
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import Outcome

IMAGES = Path(__file__).parents[1] / "docs" / "images"
OURS, TRACKING = "harmony", "harmony:track_moving=true"
WORLDS, SEED = (8000, 8001, 8002), 1000
COLUMNS = {OURS: OURS, "rpp": RIVALS["rpp"], "teb": RIVALS["teb"]}
# The sides that somebody comes from, off the robot's heading.
BEARINGS_RAD = {"ahead": 0.0, "the left": 0.5 * math.pi, "behind": math.pi}
BEFORE_S = (2, 1, 0)
LOOK = style.Look(list(COLUMNS))
BEND_M, ENCOUNTER_M = np.array([2.4, 1.9]), np.array([5.0, 4.0])
PANEL_IN = 2.1
MARGINS = style.Margins(left=0.75, bottom=1.1, between_columns=0.5, between_rows=0.65)


def drive_bends(number: int) -> dict[str, TrialLog]:
    """Returns the log of each controller in an S-curve."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(write_world(Path(folder), "s_curve", number))
        return {name: run_trial(path, column, seed=SEED) for name, column in COLUMNS.items()}


def drive_encounter(bearing_rad: float, walking_mps: float) -> TrialLog:
    """Returns the log of harmony that follows what moves, on a costmap that beams clear."""
    return run_trial(encounter(bearing_rad, walking_mps, LAYERS["inf_is_valid"]), TRACKING, seed=0)


def draw_bends(whole: Axes, bend: Axes, logs: Mapping[str, TrialLog]) -> None:
    """Draws plan, boxes and driven paths: all of them, and where ours is farthest from the plan."""
    lines = []
    for axes in (whole, bend):
        draw_course(axes, course_of(logs[OURS]))
        lines = [axes.plot(*positions(log).T, **LOOK.line(name))[0] for name, log in logs.items()]
    low, high = bounds(list(logs.values()))
    _show(whole, 0.5 * (low + high), BEND_M * np.max((high - low) / BEND_M))
    worst = positions(logs[OURS])[np.nanargmax(projection_on_plans(logs[OURS]).distance_m)]
    _show(bend, worst, BEND_M)
    whole.add_patch(Rectangle(worst - 0.5 * BEND_M, *BEND_M, fill=False, edgecolor=style.MUTED))
    words = [
        f"{name}: {duration_s(log):.1f} s, error {cross_track_error_mean_m(log):.3f} m"
        for name, log in logs.items()
    ]
    bend.legend(lines, words, loc="upper center", bbox_to_anchor=(0.45, -0.25), handlelength=2.6)


def draw_encounter(axes: Axes, log: TrialLog) -> None:
    """Draws robot and person at the same times up to the end, the later the darker."""
    times_s, movers = log.samples["time_s"].to_numpy(), movers_of(log)
    drawn: list[Array] = []
    for before_s in BEFORE_S:
        row = int(np.searchsorted(times_s, times_s[-1] - before_s))
        shade = 1.0 - 0.3 * before_s
        robot = outline_at(log, row)
        pose = movers.poses_at(times_s[[row]])[0, 0]
        person = place_outline(movers.outlines[0], pose)
        color = LOOK.line(OURS)["color"]
        axes.fill(*robot.T, fill=False, edgecolor=color, lw=1.6, alpha=shade)
        axes.fill(
            *person.T,
            facecolor=style.MOVING_FACE,
            edgecolor=style.MOVING_COLOR,
            lw=1.4,
            alpha=shade,
        )
        axes.text(*pose[:2], str(before_s), ha="center", va="center", fontsize=8)
        x, y = robot.min(axis=0)
        axes.text(x + 0.08, y - 0.06, str(before_s), ha="center", va="top", fontsize=8, color=color)
        drawn += [robot, person]
    corners = np.vstack(drawn)
    axes.plot(*log.course[:, :2].T, color=style.PLAN_COLOR, lw=0.8, ls=(0, (4, 3)), zorder=0.5)
    _show(axes, 0.5 * (corners.min(axis=0) + corners.max(axis=0)), ENCOUNTER_M)


def _show(axes: Axes, middle: Array, size_m: Array) -> None:
    """Shows so much of the world, (2,) m; leaves the label of y to the first column."""
    low, high = middle - 0.5 * size_m, middle + 0.5 * size_m
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]" if axes.get_subplotspec().is_first_col() else "")


def picture_bends() -> None:
    """Drives the bends and writes their picture."""
    figure, panels = _panels(2, BEND_M, MARGINS)
    for place, number in enumerate(WORLDS):
        draw_bends(panels[place], panels[place + 3], drive_bends(number))
        panels[place].set_title(f"s_curve {number}")
    style.write_figure(figure, IMAGES / "harmony_bends", [style.SVG])


def picture_encounters() -> None:
    """Drives the encounters, prints how each ends and writes the picture of the slower ones."""
    figure, panels = _panels(1, ENCOUNTER_M, MARGINS._replace(bottom=0.5))
    for axes, (side, bearing_rad) in zip(panels, BEARINGS_RAD.items(), strict=True):
        logs = [drive_encounter(bearing_rad, walking_mps) for walking_mps in WALKING_MPS]
        ends = [
            f"{told(log)} m/s" if log.outcome is Outcome.COLLIDED else told(log) for log in logs
        ]
        print(f"from {side}, walking {WALKING_MPS} m/s: {', '.join(ends)}")
        draw_encounter(axes, logs[0])
        axes.set_title(f"from {side}: {ends[0]}")
    style.write_figure(figure, IMAGES / "harmony_encounters", [style.SVG])


def _panels(rows: int, shown_m: Array, margins: style.Margins) -> tuple[Figure, list[Axes]]:
    size_in = (PANEL_IN, PANEL_IN * shown_m[1] / shown_m[0])
    return style.new_figure(rows, 3, axes_size_in=size_in, margins=margins)


if __name__ == "__main__":
    with style.figure_style():
        picture_bends()
        picture_encounters()
