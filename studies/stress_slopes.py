"""Slopes of the metrics over each stress: `python studies/stress_slopes.py FOLDER`.

Drives the default controllers through one scenario, clean and with one field of the robot changed
at a time, 32 seeds each, and compares pair by pair: seed 7 of a controller with the field against
seed 7 of it without. FOLDER keeps the trials, so that the command goes on where it stopped, and a
page is made anew from trials that were driven. Writes docs/stress_slopes.md and its picture. It
takes half an hour on two cores.
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
from drake_navbench.analysis.paired_comparison import PairedComparison, paired_comparison
from drake_navbench.analysis.paired_tests import ALARM_RATES, SUCCESS, Family, Finding, judge_pairs
from drake_navbench.analysis.paired_trials import IDENTITY, Contest
from drake_navbench.analysis.pairs import holm, smallest_p_value
from drake_navbench.analysis.statistics import Interval
from drake_navbench.kernels.percent import PERCENT
from drake_navbench.typed_files.output_file import write_text, write_whole

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
    """A metric of the picture: its name and its heading."""

    name: str
    heading: str


METRICS = (
    Metric("time_to_goal_s", "time to the goal [s]"),
    Metric("min_clearance_m", "least clearance [m]"),
    Metric("cross_track_error_rms_m", "path error, rms [m]"),
    Metric("angular_jerk_rms_radps3", "angular jerk, rms [rad/s³]"),
)
COLUMNS = [*IDENTITY, "outcome", "reason", *(metric.name for metric in METRICS)]
CELLS = 6 * len(AXES)
INTRODUCTION = f"""\
# What each stress does

Made by `python studies/stress_slopes.py FOLDER`: `{SCENARIO}`, {SEEDS} seeds, one field of the
robot at a time. A number in the table is the share of arrivals with the field minus the share
without it, over the same seeds, with the exact 95% interval of paired shares. Bold: the change is
decided, by the exact sign test, corrected over the {CELLS} cells
({ALARM_RATES[Family.OUTCOMES]:.0%} for all of them). Divided by the field's value it is the slope.
A controller that does not arrive in the clean world cannot get worse there.

The picture also has the mean differences of four metrics, with Student's 95% interval over all
pairs in which both trials have a value. No test corrects these intervals: if no field had any
effect, about {0.05 * len(METRICS) * CELLS:.0f} of the {len(METRICS) * CELLS} would leave zero out.

![differences](images/stress_slopes.svg)

## Arrivals
"""

# By field and controller.
Findings = Mapping[tuple[str, str], Finding]


def trials_of(folder: Path, name: str, sweeps: list[str]) -> pd.DataFrame:
    """Returns the trials of one world, which are driven unless the folder has them."""
    table = folder / f"{name}.parquet"
    if not table.exists():
        trials = run_benchmark([SCENARIO], trials=SEEDS, sweeps=sweeps).trials
        # A sweep names its scenario by the field; here it is the same one.
        kept = trials.assign(scenario=SCENARIO)[COLUMNS]
        write_whole(table, lambda path: kept.to_parquet(path, index=False))
    return pd.read_parquet(table)


def judge(clean: pd.DataFrame, stressed: Mapping[str, pd.DataFrame]) -> Findings:
    """Returns the effect of each field on the arrivals of each controller."""
    contests = [Contest(clean, trials, field) for field, trials in stressed.items()]
    findings = judge_pairs(contests, metrics=()).findings
    return {(f.label, f.controller): f for f in findings if f.quantity.name == SUCCESS}


def decided(found: Findings) -> set[tuple[str, str]]:
    """Returns the fields and controllers whose change is decided, corrected over all of them."""
    adjusted = holm(
        [finding.comparison.p_value for finding in found.values()],
        [smallest_p_value(finding.differing, 1) for finding in found.values()],
    )
    rate = ALARM_RATES[Family.OUTCOMES]
    return {key for key, p_value in zip(found, adjusted, strict=True) if p_value <= rate}


def cell(found: Finding, *, is_bold: bool) -> str:
    """Returns a cell of the table."""
    ends = (found.comparison.difference, *found.comparison.interval)
    # Adding 0 turns -0 into 0.
    mean, low, high = (round(end / PERCENT, 2) + 0.0 for end in ends)
    text = f"{mean:+.2f} [{low:.2f}, {high:.2f}]"
    return f"**{text}**" if is_bold else text


# The differences of a metric, by field and controller.
Differences = Mapping[tuple[str, str], PairedComparison]


def differences_of(
    metric: str, clean: pd.DataFrame, stressed: Mapping[str, pd.DataFrame]
) -> Differences:
    """Returns the effect of each field on a metric of each controller."""
    before, *others = (
        table.set_index(["controller", "seed"])[metric] for table in (clean, *stressed.values())
    )
    return {
        (field, name): paired_comparison(before[name], after[name])
        for field, after in zip(stressed, others, strict=True)
        for name in dict.fromkeys(clean["controller"])
    }


def picture(panels: Mapping[str, Differences], controllers: list[str]) -> Figure:
    """Returns a panel a heading: differences with intervals, a row a field."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    drawn = figure.subplots(1, len(panels), sharey=True)
    for panel, (heading, differences) in zip(drawn, panels.items(), strict=True):
        for row, field in enumerate(AXES):
            for place, controller in enumerate(controllers):
                own = differences[field, controller]
                if own.pairs < FEWEST_PAIRS:
                    continue
                y = row + 0.12 * (place - (len(controllers) - 1) / 2)
                color = controller_color(controller)
                panel.plot(own.interval, [y, y], color=color, linewidth=1.2)
                label = controller if row == 0 and panel is drawn[0] else None
                panel.plot(own.difference, y, "o", color=color, markersize=3, label=label)
        panel.axvline(0.0, color="black", linewidth=0.6)
        panel.set_title(heading, fontsize=8)
    drawn[0].set_yticks(range(len(AXES)), [f"{field} = {value:g}" for field, value in AXES.items()])
    drawn[0].invert_yaxis()
    figure.legend(loc="outside lower center", ncols=len(controllers))
    return figure


def page(found: Findings, controllers: list[str]) -> str:
    """Returns the page: a table of the fields that change a controller's arrivals; the others."""
    told = decided(found)
    lines = [INTRODUCTION, f"| field | {' | '.join(f'`{name}`' for name in controllers)} |"]
    lines += [f"|{'---|' * (len(controllers) + 1)}"]
    silent = [field for field in AXES if not any((field, name) in told for name in controllers)]
    for field, value in AXES.items():
        keys = [(field, name) for name in controllers]
        cells = [cell(found[key], is_bold=key in told) for key in keys]
        if field not in silent:
            lines.append(f"| `{field}` {value:g} | {' | '.join(cells)} |")
    if silent:
        names = ", ".join(f"`{field}`" for field in silent)
        lines += ["", f"No controller is shown to answer to: {names}."]
    return "\n".join([*lines, ""])


def in_shares(found: PairedComparison) -> PairedComparison:
    """Returns a comparison in per cent as one in shares."""
    low, high = found.interval
    interval = Interval(low / PERCENT, high / PERCENT)
    return found._replace(difference=found.difference / PERCENT, interval=interval)


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
    panels = {"arrivals": {key: in_shares(f.comparison) for key, f in found.items()}}
    panels |= {metric.heading: differences_of(metric.name, clean, stressed) for metric in METRICS}
    with figure_style():
        write_figure(picture(panels, controllers), PICTURE, [SVG])
    write_text(PAGE, page(found, controllers))


if __name__ == "__main__":
    main()
