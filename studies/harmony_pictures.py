"""The pictures of bends and of encounters in harmony.md.

`python studies/harmony_pictures.py` drives twelve trials and writes docs/images/harmony_bends.svg
and harmony_encounters.svg. The bends are those of the first three try-out worlds of S-curves in
which harmony gets farthest from the plan. The encounters are of docs/harmony_encounters.csv, at
1.0 m/s: by seed and number the first from ahead in which the robot drives at more than 0.1 m/s when
it is touched, and the first from the left and from behind in which it drove 1.5 s before and is at
rest.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import shapely
import shapely.ops
from harmony_comparison import RIVALS
from harmony_encounters import REST_MPS, REST_RADPS, encounter
from harmony_families import write_world
from harmony_living import CLEARED, OPTION
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.figures import style
from drake_navbench.analysis.figures.course import draw_course, draw_outlines
from drake_navbench.analysis.figures.maps import bounds, course_of, outline_at
from drake_navbench.analysis.metrics.efficiency import duration_s
from drake_navbench.analysis.metrics.signals import column, positions, times
from drake_navbench.analysis.metrics.tracking import cross_track_error_mean_m, projection_on_plans
from drake_navbench.kernels.arrays import Array

IMAGES = Path(__file__).parents[1] / "docs" / "images"
OURS = "harmony"
WORLDS, SEED = (8000, 8001, 8002), 1000
COLUMNS = {OURS: OURS, "rpp": RIVALS["rpp"], "teb": RIVALS["teb"]}
LOOK = style.Look(list(COLUMNS))
BEND_M = np.array([2.4, 1.9])
PANEL_IN = 2.1
# The encounters: seed, encounters of this seed, walking speed m/s, and their numbers by side.
ENCOUNTER_SEED, ENCOUNTER_COUNT, WALKING_MPS = 3601, 250, 1.0
ENCOUNTERS = {"from ahead": 104, "from the left": 156, "from behind": 0}
# A person's body, m. They are shown so long before the touch, s, in these shades.
BODY_M, SHOWN_S, SHADES = 0.3, (1.5, 1.0, 0.5, 0.0), ("0.75", "0.55", "0.25", "tab:red")
MEETING_M = 1.6 * BEND_M
MARGINS = style.Margins(left=0.75, bottom=1.1, between_columns=0.5, between_rows=0.65)


def drive_bends(number: int) -> dict[str, TrialLog]:
    """Returns the log of each controller in an S-curve."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(write_world(Path(folder), "s_curve", number))
        return {name: run_trial(path, column, seed=SEED) for name, column in COLUMNS.items()}


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


def _show(axes: Axes, middle: Array, size_m: Array) -> None:
    """Shows so much of the world, (2,) m; leaves the label of y to the first column."""
    low, high = middle - 0.5 * size_m, middle + 0.5 * size_m
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]" if axes.get_subplotspec().is_first_col() else "")


def drive_encounter(number: int) -> TrialLog:
    """Returns the log of an encounter."""
    _, scenario = encounter(ENCOUNTER_SEED, number, ENCOUNTER_COUNT, WALKING_MPS)
    scenario = scenario.model_copy(update={"robot_overrides": CLEARED})
    return run_trial(scenario, f"{OURS}:{OPTION}=true", number, keeps_costmaps=False)


def draw_encounter(above: Axes, below: Axes, log: TrialLog) -> None:
    """Draws robot and person at SHOWN_S before the touch, and the robot's speed until then."""
    assert log.people is not None
    time_s = times(log) - times(log)[-1]
    speed_mps, turn_radps = column(log, "v_mps"), column(log, "w_radps")
    for shade, before_s in zip(SHADES, SHOWN_S, strict=True):
        row = int(np.argmin(np.abs(time_s + before_s)))
        shown = int(np.argmin(np.abs(log.people.time_s - times(log)[-1] + before_s)))
        where = log.people.poses[shown, 0, :2]
        draw_outlines(above, [outline_at(log, row)], shade)
        above.add_patch(Circle(where, BODY_M, facecolor=shade, edgecolor=shade, alpha=0.4))
        below.plot(time_s[row], speed_mps[row], "o", color=shade)
    moves = np.flatnonzero((np.abs(speed_mps) > REST_MPS) | (np.abs(turn_radps) > REST_RADPS))
    below.plot(time_s, speed_mps, color=style.INK, lw=1.2, zorder=0)
    if moves[-1] + 1 < len(time_s):
        stop_s = time_s[moves[-1] + 1]
        below.axvline(stop_s, color=style.MUTED, ls=":")
        words = f"at rest {-stop_s:.2f} s before the touch"
    else:
        words = f"touched at {speed_mps[-1]:.2f} m/s"
    below.set_title(words, fontsize=8, weight="normal")
    robot = shapely.Polygon(outline_at(log, -1))
    touch = shapely.ops.nearest_points(robot, shapely.Point(log.people.poses[-1, 0, :2]))[0]
    above.plot(touch.x, touch.y, "x", color=style.INK)
    first = np.searchsorted(log.people.time_s, times(log)[-1] - SHOWN_S[0])
    middle = np.array([robot.centroid.x, robot.centroid.y]) + log.people.poses[first, 0, :2]
    _show(above, 0.5 * middle, MEETING_M)
    below.set_xlim(-SHOWN_S[0] - 0.2, 0.1)
    below.set_ylim(-0.05, 0.6)
    below.set_xlabel("time before the touch [s]")
    below.set_ylabel("speed [m/s]" if below.get_subplotspec().is_first_col() else "")


def main() -> None:
    """Drives bends and encounters and writes their pictures."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    size_in = (PANEL_IN, PANEL_IN * BEND_M[1] / BEND_M[0])
    figure, panels = style.new_figure(2, 3, axes_size_in=size_in, margins=MARGINS)
    for place, number in enumerate(WORLDS):
        draw_bends(panels[place], panels[place + 3], drive_bends(number))
        panels[place].set_title(f"s_curve {number}")
    style.write_figure(figure, IMAGES / "harmony_bends", [style.SVG])
    figure, panels = style.new_figure(2, 3, axes_size_in=size_in, margins=style.Margins())
    for place, (side, number) in enumerate(ENCOUNTERS.items()):
        draw_encounter(panels[place], panels[place + 3], drive_encounter(number))
        panels[place].set_title(side)
    keys = [
        Line2D([], [], ls="none", marker="o", color=shade, label=f"{before_s:g} s before")
        for shade, before_s in zip(SHADES, SHOWN_S, strict=True)
    ]
    keys[-1].set_label("touch")
    keys.append(Line2D([], [], ls="none", marker="x", color=style.INK, label="place of the touch"))
    keys.append(Line2D([], [], ls=":", color=style.MUTED, label="at rest"))
    style.legend_below(figure, keys)
    style.write_figure(figure, IMAGES / "harmony_encounters", [style.SVG])


if __name__ == "__main__":
    with style.figure_style():
        main()
