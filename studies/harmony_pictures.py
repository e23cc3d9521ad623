"""The picture of bends in harmony.md.

`python studies/harmony_pictures.py` drives nine trials and writes docs/images/harmony_bends.svg.
The first three try-out worlds of S-curves, and in each the bend in which harmony gets farthest from
the plan.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from harmony_comparison import RIVALS
from harmony_families import write_world
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.figures import style
from drake_navbench.analysis.figures.course import draw_course
from drake_navbench.analysis.figures.maps import bounds, course_of
from drake_navbench.analysis.metrics.efficiency import duration_s
from drake_navbench.analysis.metrics.signals import positions
from drake_navbench.analysis.metrics.tracking import cross_track_error_mean_m, projection_on_plans
from drake_navbench.kernels.arrays import Array

IMAGES = Path(__file__).parents[1] / "docs" / "images"
OURS = "harmony"
WORLDS, SEED = (8000, 8001, 8002), 1000
COLUMNS = {OURS: OURS, "rpp": RIVALS["rpp"], "teb": RIVALS["teb"]}
LOOK = style.Look(list(COLUMNS))
BEND_M = np.array([2.4, 1.9])
PANEL_IN = 2.1
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


def main() -> None:
    """Drives the bends and writes their picture."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    size_in = (PANEL_IN, PANEL_IN * BEND_M[1] / BEND_M[0])
    figure, panels = style.new_figure(2, 3, axes_size_in=size_in, margins=MARGINS)
    for place, number in enumerate(WORLDS):
        draw_bends(panels[place], panels[place + 3], drive_bends(number))
        panels[place].set_title(f"s_curve {number}")
    style.write_figure(figure, IMAGES / "harmony_bends", [style.SVG])


if __name__ == "__main__":
    with style.figure_style():
        main()
