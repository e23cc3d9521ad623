"""How metrics answer to each stress: `python docs/stress_slopes.py FOLDER`.

Drives the default controllers through one scenario, clean and with one field of the robot changed
at a time, 32 seeds each, and compares pair by pair: seed 7 of a controller with the field against
seed 7 of it without. FOLDER keeps the trials, so that the command goes on where it stopped. Writes
docs/stress_slopes.md. It takes half an hour on two cores.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from drake_navbench import run_benchmark
from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.style import SVG, figure_style, write_figure
from drake_navbench.analysis.statistics import PairedComparison, paired_comparison
from drake_navbench.analysis.verdicts import is_failed

PAGE = Path(__file__).with_suffix(".md")
PICTURE = Path(__file__).parent / "images" / "stress_slopes"
SCENARIO, SEEDS = "doorway", 32
CLEAN = "clean"
# Fewer pairs tell nothing of an interval.
FEWEST_PAIRS = 5
AXES = {
    "localization.drift": 0.05,
    "localization.yaw_drift": 0.05,
    "localization.jump_m": 0.2,
    "localization.y_bias_m": 0.05,
    "localization.xy_std_m": 0.03,
    "lidar.range_std_m": 0.03,
    "lidar.range_bias_m": 0.05,
    "lidar.dropout_probability": 0.5,
    "lidar.scan_loss_probability": 0.5,
    "lidar.stuck_beam_share": 0.05,
    "actuators.deadband_mps": 0.05,
    "actuators.slip_std": 0.1,
    "actuators.radius_difference": 0.03,
    "actuators.payload_kg": 60.0,
    "actuators.slope_rad": 0.05,
    "timing.scan_latency_s": 0.3,
    "timing.odometry_latency_s": 0.15,
    "timing.command_latency_s": 0.15,
    "timing.command_loss_probability": 0.3,
    "timing.compute_time": 60.0,
}


class Metric(NamedTuple):
    """A metric on the page: its column, heading and digits."""

    column: str
    heading: str
    digits: int


ARRIVED = Metric("arrived", "arrivals", 2)
METRICS = (
    ARRIVED,
    Metric("time_to_goal_s", "time to the goal [s]", 2),
    Metric("min_clearance_m", "least clearance [m]", 3),
    Metric("cross_track_error_rms_m", "path error, rms [m]", 3),
    Metric("angular_jerk_rms_radps3", "angular jerk, rms [rad/s³]", 2),
)
INTRODUCTION = """\
# What each stress does

Made by `python docs/stress_slopes.py FOLDER`: `{scenario}`, {seeds} seeds, one field of the robot
at a time. A number is the mean over the seeds of the metric with the field minus the metric without
it, in the same seed, with Student's 95% interval; bold: the interval leaves zero out. Divided by
the field's value it is the slope. A time counts where both trials arrive. Who does not arrive in
the clean world cannot get worse there. A dash: fewer than {pairs} pairs.

![differences](images/stress_slopes.svg)
"""


def trials_of(folder: Path, name: str, sweeps: list[str]) -> pd.DataFrame:
    """Returns the trials of one world, which are driven unless the folder has them."""
    table = folder / f"{name}.parquet"
    if not table.exists():
        run_benchmark([SCENARIO], trials=SEEDS, sweeps=sweeps).trials.to_parquet(table)
    trials = pd.read_parquet(table)
    trials["arrived"] = (~is_failed(trials)).astype(float)
    trials["time_to_goal_s"] = trials["time_to_goal_s"].where(trials["arrived"] > 0.0)
    return trials


def compare(clean: pd.DataFrame, stressed: pd.DataFrame, metric: str) -> PairedComparison:
    """Compares the trials of one controller, pair by pair."""
    return paired_comparison(clean.set_index("seed")[metric], stressed.set_index("seed")[metric])


def _tells(found: PairedComparison) -> bool:
    return found.pairs >= FEWEST_PAIRS and found.interval.excludes(0.0)


def cell(found: PairedComparison, digits: int) -> str:
    """Returns a cell of a table."""
    if found.pairs < FEWEST_PAIRS:
        return "–"
    low, high = found.interval
    text = f"{found.difference:+.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
    return f"**{text}**" if _tells(found) else text


def picture(found: dict[tuple[str, str, str], PairedComparison], controllers: list[str]) -> Figure:
    """Returns a panel a metric: differences with intervals, a row a field."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    panels = figure.subplots(1, len(METRICS), sharey=True)
    for panel, metric in zip(panels, METRICS, strict=True):
        for row, field in enumerate(AXES):
            for place, controller in enumerate(controllers):
                own = found[metric.column, field, controller]
                if own.pairs < FEWEST_PAIRS:
                    continue
                y = row + 0.12 * (place - (len(controllers) - 1) / 2)
                color = controller_color(controller)
                panel.plot(own.interval, [y, y], color=color, linewidth=1.2)
                label = controller if row == 0 and metric is ARRIVED else None
                panel.plot(own.difference, y, "o", color=color, markersize=3, label=label)
        panel.axvline(0.0, color="black", linewidth=0.6)
        panel.set_title(metric.heading, fontsize=8)
    panels[0].set_yticks(
        range(len(AXES)), [f"{field} = {value:g}" for field, value in AXES.items()]
    )
    panels[0].invert_yaxis()
    figure.legend(loc="outside lower center", ncols=len(controllers))
    return figure


def page(found: dict[tuple[str, str, str], PairedComparison], controllers: list[str]) -> str:
    """Returns the page: a table a metric, and the fields in which no controller answers."""
    lines = [INTRODUCTION.format(scenario=SCENARIO, seeds=SEEDS, pairs=FEWEST_PAIRS)]
    for metric in METRICS:
        lines += [f"## {metric.heading[0].upper()}{metric.heading[1:]}", ""]
        lines += [f"| field | {' | '.join(f'`{name}`' for name in controllers)} |"]
        lines += [f"|{'---|' * (len(controllers) + 1)}"]
        for field, value in AXES.items():
            cells = [cell(found[metric.column, field, name], metric.digits) for name in controllers]
            lines.append(f"| `{field}` {value:g} | {' | '.join(cells)} |")
        silent = [
            f"`{field}`"
            for field in AXES
            if not any(_tells(found[metric.column, field, c]) for c in controllers)
        ]
        if silent:
            lines += ["", f"No controller is shown to answer to: {', '.join(silent)}."]
        lines += [""]
    return "\n".join(lines)


def main() -> None:
    """Drives what is missing and writes page and picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    clean = trials_of(folder, CLEAN, [])
    controllers = list(dict.fromkeys(clean["controller"]))
    found = {}
    for field, value in AXES.items():
        stressed = trials_of(folder, field, [f"{field}={value:g}"])
        for controller in controllers:
            own = [rows[rows["controller"] == controller] for rows in (clean, stressed)]
            for metric in METRICS:
                found[metric.column, field, controller] = compare(*own, metric.column)
    with figure_style():
        write_figure(picture(found, controllers), PICTURE, [SVG])
    PAGE.write_text(page(found, controllers), encoding="utf-8")


if __name__ == "__main__":
    main()
