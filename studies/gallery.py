"""Pictures of scenarios, controllers and robots.

`python studies/gallery.py` writes docs/gallery.md.

Each scenario is driven once by a few controllers, each controller once through the same scenario,
on the wheelchair or, where the controller is for another base, on a robot that has it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.figures.course import WIDTH_IN, draw_course, draw_outlines
from drake_navbench.analysis.figures.maps import (
    bounds,
    course_of,
    outline_at,
    paths_figure,
    paths_map,
)
from drake_navbench.analysis.figures.style import (
    SVG,
    Look,
    figure_style,
    legend_above,
    new_figure,
    write_figure,
)
from drake_navbench.analysis.metrics.signals import positions
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, load_scenario
from drake_navbench.trial.trial import DEFAULT_ROBOT

PAGE = Path(__file__).parents[1] / "docs" / "gallery.md"
IMAGES = PAGE.parent / "images" / "gallery"
SEED = 0
IN_EVERY_SCENARIO = ("rpp", "dwb", "mppi_nav2")
# Those that get through where none of these does.
ALSO_IN = {
    "box_on_path": ("teb", "harmony"),
    "blocking_box": ("teb", "harmony"),
    "pocket": ("teb", "harmony"),
}
COURSE = "static_obstacles"
ROBOT_OF = {
    "dwb_omni": "omni_robot",
    "mppi_nav2_omni": "omni_robot",
    "mppi_nav2_ackermann": "ackermann_robot",
}
BETWEEN_OUTLINES_S = 1.0
CURVES_HEIGHT_IN = 1.3
ROBOTS = "robots"
ROBOTS_A_ROW = 3
ROBOT_SIZE_IN = (1.9, 1.9)
SHOWN_M = 1.4
INK, MUTED, LIDAR_COLOR = "#1f2933", "#6b7480", "#c0392b"

HEADER = f"""\
# Gallery

Each picture shows one trial with seed {SEED}: first of every [scenario](scenarios.md), then of
every [preset](controllers.md#the-built-in-ones). The dashed line is the plan, the star is the goal.
`python studies/gallery.py` makes this page.
"""


def drive(scenario: str, preset: str) -> TrialLog:
    """Returns the log of one trial, on the robot that a preset is for."""
    return run_trial(scenario, preset, seed=SEED, robot=ROBOT_OF.get(preset, DEFAULT_ROBOT))


def scenario_picture(scenario: str) -> Figure:
    """Returns the map of a scenario with the paths of some controllers."""
    presets = (*IN_EVERY_SCENARIO, *ALSO_IN.get(scenario, ()))
    logs = {preset: [drive(scenario, preset)] for preset in presets}
    figure = paths_figure(paths_map(logs), Look(presets))
    figure.axes[0].set_title("Driven paths; outlines where each ended")
    return figure


def controller_picture(log: TrialLog, preset: str) -> Figure:
    """Returns the figure of one drive: path with an outline each second, above its velocities."""
    figure, (above, below) = new_figure(2, 1, axes_size_in=(WIDTH_IN, CURVES_HEIGHT_IN))
    times_s = log.samples["time_s"].to_numpy()
    line = Look([preset]).line(preset)
    draw_course(above, course_of(log))
    above.plot(*positions(log).T, **line)
    shown_s = np.arange(times_s[0], times_s[-1], BETWEEN_OUTLINES_S)
    rows = np.searchsorted(times_s, shown_s)
    draw_outlines(above, [outline_at(log, row) for row in rows], line["color"])
    low, high = bounds([log])
    above.set_xlim(low[0], high[0])
    above.set_ylim(low[1], high[1])
    seconds = f"after {times_s[-1]:.1f} s"
    above.set_title(f"{str(log.outcome).replace('_', ' ')} {seconds}; an outline a second")
    below.plot(times_s, log.samples["v_mps"], **line, label="v [m/s]")
    below.plot(times_s, log.samples["w_radps"], color=MUTED, lw=0.8, label="yaw rate [rad/s]")
    below.set_xlabel("time [s]")
    legend_above(below)
    _give_height(figure, WIDTH_IN * (high[1] - low[1]) / (high[0] - low[0]))
    return figure


def _give_height(figure: Figure, height_in: float) -> None:
    """Makes the upper axes so much taller, the lower ones keep their size."""
    old_in = figure.get_figheight()
    new_in = old_in + height_in - CURVES_HEIGHT_IN
    figure.set_figheight(new_in)
    for axes, axes_height_in in zip(figure.axes, (height_in, CURVES_HEIGHT_IN), strict=True):
        box = axes.get_position(original=True)
        bottom = box.y0 * old_in / new_in
        axes.set_position((box.x0, bottom, box.width, axes_height_in / new_in))


def robots_picture(names: Sequence[str]) -> Figure:
    """Returns the outlines of all robots to scale, heading right, with their lidars as dots."""
    row_count = -(-len(names) // ROBOTS_A_ROW)
    figure, all_axes = new_figure(row_count, ROBOTS_A_ROW, axes_size_in=ROBOT_SIZE_IN)
    for name, axes in zip(names, all_axes, strict=False):
        robot = load_robot(name)
        centre_m = (robot.outline.min(axis=0) + robot.outline.max(axis=0)) / 2.0
        draw_outlines(axes, [robot.outline - centre_m], INK)
        for mounting in (robot.lidar.pose, *robot.lidar.further_poses):
            axes.plot(*(mounting[:2] - centre_m), marker="o", ms=4, color=LIDAR_COLOR)
        axes.set_title(name)
    for axes in all_axes:
        axes.set_xlim(-SHOWN_M / 2.0, SHOWN_M / 2.0)
        axes.set_ylim(-SHOWN_M / 2.0, SHOWN_M / 2.0)
        axes.set_visible(bool(axes.get_title(loc="left")))
    return figure


def captions() -> dict[str, str]:
    """Returns the captions of scenarios, then of presets: none, as these drive one course."""
    others = [name for name in SCENARIO_FILES.names if name not in PUBLISHED_SCENARIOS]
    scenarios = {n: load_scenario(n).description for n in (*PUBLISHED_SCENARIOS, *others)}
    return scenarios | dict.fromkeys(preset_files(), "")


def picture(name: str) -> Figure:
    """Returns the picture of a scenario, of a controller or of all robots."""
    if name == ROBOTS:
        # From above a robot with wheels looks like the one that it is like.
        names = [name for name in ROBOT_FILES.names if not load_robot(name).drive.has_wheels]
        return robots_picture(names)
    if name in SCENARIO_FILES.names:
        return scenario_picture(name)
    return controller_picture(drive(COURSE, name), name)


def page() -> str:
    """Returns the page in Markdown."""
    lines = [HEADER]
    for name, caption in captions().items():
        lines += [f"## {name}", "", *([f"{caption}.", ""] if caption else []), _shown(name), ""]
    lines += ["## Robots", "", "To scale, in m; the dots are the lidars.", "", _shown(ROBOTS), ""]
    return "\n".join(lines)


def _shown(name: str) -> str:
    return f"![{name}](images/gallery/{name}{SVG})"


def main() -> None:
    """Drives the trials, writes the pictures and the page."""
    known = [*captions(), ROBOTS]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="draw only these (all)")
    names = parser.parse_args().names or known
    for name in names:
        if name not in known:
            parser.error(f"{name}: expected one of {', '.join(known)}")
    with figure_style():
        for name in names:
            write_figure(picture(name), IMAGES / name, [SVG])
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
