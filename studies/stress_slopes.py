"""Slopes of the metrics over each stress: `python studies/stress_slopes.py FOLDER`.

Drives the default controllers through one scenario, clean and with one field of the robot changed
at a time, 32 seeds each, and compares pair by pair: seed 7 of a controller with the field against
seed 7 of it without. FOLDER keeps the trials, so that the command goes on where it stopped, and a
page is made anew from trials that were driven. Writes docs/stress_slopes.md. It takes half an hour
on two cores.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from drake_navbench import run_benchmark
from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.choice import SVG
from drake_navbench.analysis.figures.style import figure_style, write_figure
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_tests import (
    ALARM_RATES,
    SUCCESS,
    TOUCH,
    Family,
    Finding,
    PairedVerdict,
    judge_pairs,
)
from drake_navbench.analysis.paired_trials import IDENTITY, Contest
from drake_navbench.kernels.percent import PERCENT

PAGE = Path(__file__).parents[1] / "docs" / "stress_slopes.md"
PICTURE = PAGE.parent / "images" / "stress_slopes"
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
    """A quantity on the page: its name, heading, digits, and the unit it is told in."""

    name: str
    heading: str
    digits: int
    unit: float = 1.0


ARRIVED = Metric(SUCCESS, "arrivals", 2, PERCENT)
METRICS = (
    ARRIVED,
    Metric(TOUCH, "touches", 2, PERCENT),
    Metric("time_to_goal_s", "time to the goal [s]", 2),
    Metric("min_clearance_m", "least clearance [m]", 3),
    Metric("cross_track_error_rms_m", "path error, rms [m]", 3),
    Metric("angular_jerk_rms_radps3", "angular jerk, rms [rad/s³]", 2),
)
COLUMNS = [*IDENTITY, "outcome", "reason", *(metric.name for metric in METRICS[2:])]
INTRODUCTION = f"""\
# What each stress does

Made by `python studies/stress_slopes.py FOLDER`: `{SCENARIO}`, {SEEDS} seeds, one field of the
robot at a time. A number is the mean over the seeds of the metric with the field minus the metric
without it, in the same seed, with its 95% interval: of arrivals and touches the exact one
of paired shares, of metrics Student's. Bold: the change is decided, by the exact sign test or
Wilcoxon's, corrected over all cells of arrivals and touches
({ALARM_RATES[Family.OUTCOMES]:.0%} for all of them), and over all of metrics
({ALARM_RATES[Family.LISTED]:.0%}). Divided by the field's value it is the slope.
Metrics count where both trials arrive; where none does, with or without the field, how they
failed counts. Who does not arrive in the clean world cannot get worse there. A dash: fewer than
{FEWEST_PAIRS} pairs.

![differences](images/stress_slopes.svg)
"""
DECIDED = (PairedVerdict.WORSE, PairedVerdict.BETTER, PairedVerdict.CHANGED)

# By quantity, field and controller.
Findings = Mapping[tuple[str, str, str], Finding]


def trials_of(folder: Path, name: str, sweeps: list[str]) -> pd.DataFrame:
    """Returns the trials of one world, which are driven unless the folder has them."""
    table = folder / f"{name}.parquet"
    if not table.exists():
        trials = run_benchmark([SCENARIO], trials=SEEDS, sweeps=sweeps).trials
        # A sweep names its scenario by the field; here it is the same one.
        trials.assign(scenario=SCENARIO)[COLUMNS].to_parquet(table, index=False)
    return pd.read_parquet(table)


def judge(clean: pd.DataFrame, stressed: Mapping[str, pd.DataFrame]) -> Findings:
    """Returns the effect of each field on each controller, corrected over all fields."""
    names = [metric.name for metric in METRICS]
    judged = judge_pairs(
        [Contest(clean, trials, field) for field, trials in stressed.items()],
        listed=names,
        metrics=[metric for metric in all_metrics() if metric.name in names],
        tolerance=0.0,
    )
    return {(f.quantity.name, f.label, f.controller): f for f in judged.findings}


def _tells(found: Finding) -> bool:
    return found.comparison.pairs >= FEWEST_PAIRS and found.verdict in DECIDED


def cell(found: Finding, metric: Metric) -> str:
    """Returns a cell of a table."""
    if found.comparison.pairs < FEWEST_PAIRS:
        return "–"
    ends = (found.comparison.difference, *found.comparison.interval)
    # Adding 0 turns -0 into 0.
    mean, low, high = (round(end / metric.unit, metric.digits) + 0.0 for end in ends)
    digits = metric.digits
    text = f"{mean:+.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
    return f"**{text}**" if _tells(found) else text


def picture(found: Findings, controllers: list[str]) -> Figure:
    """Returns a panel a metric: differences with intervals, a row a field."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    panels = figure.subplots(1, len(METRICS), sharey=True)
    for panel, metric in zip(panels, METRICS, strict=True):
        for row, field in enumerate(AXES):
            for place, controller in enumerate(controllers):
                own = found[metric.name, field, controller].comparison
                if own.pairs < FEWEST_PAIRS:
                    continue
                y = row + 0.12 * (place - (len(controllers) - 1) / 2)
                color = controller_color(controller)
                ends = [end / metric.unit for end in own.interval]
                panel.plot(ends, [y, y], color=color, linewidth=1.2)
                label = controller if row == 0 and metric is ARRIVED else None
                mean = own.difference / metric.unit
                panel.plot(mean, y, "o", color=color, markersize=3, label=label)
        panel.axvline(0.0, color="black", linewidth=0.6)
        panel.set_title(metric.heading, fontsize=8)
    panels[0].set_yticks(
        range(len(AXES)), [f"{field} = {value:g}" for field, value in AXES.items()]
    )
    panels[0].invert_yaxis()
    figure.legend(loc="outside lower center", ncols=len(controllers))
    return figure


def section(found: Findings, metric: Metric, controllers: list[str]) -> list[str]:
    """Returns the table of the fields that change this metric of a controller, and the others."""
    lines = [f"## {metric.heading[0].upper()}{metric.heading[1:]}", ""]
    lines += [f"| field | {' | '.join(f'`{name}`' for name in controllers)} |"]
    lines += [f"|{'---|' * (len(controllers) + 1)}"]
    silent = [
        field
        for field in AXES
        if not any(_tells(found[metric.name, field, name]) for name in controllers)
    ]
    for field, value in AXES.items():
        cells = [cell(found[metric.name, field, name], metric) for name in controllers]
        if field not in silent:
            lines.append(f"| `{field}` {value:g} | {' | '.join(cells)} |")
    if silent:
        names = ", ".join(f"`{field}`" for field in silent)
        lines += ["", f"No controller is shown to answer to: {names}."]
    return [*lines, ""]


def page(found: Findings, controllers: list[str]) -> str:
    """Returns the page: a table a metric."""
    sections = (line for metric in METRICS for line in section(found, metric, controllers))
    return "\n".join([INTRODUCTION, *sections])


def main() -> None:
    """Drives what is missing and writes page and picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    clean = trials_of(folder, CLEAN, [])
    controllers = list(dict.fromkeys(clean["controller"]))
    stressed = {
        field: trials_of(folder, field, [f"{field}={value:g}"]) for field, value in AXES.items()
    }
    found = judge(clean, stressed)
    with figure_style():
        write_figure(picture(found, controllers), PICTURE, [SVG])
    PAGE.write_text(page(found, controllers), encoding="utf-8")


if __name__ == "__main__":
    main()
