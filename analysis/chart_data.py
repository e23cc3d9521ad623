"""The numbers behind the charts of a page, thinned and rounded so that the page stays small.

The static figures are drawn from the full logs. The numbers here are rounded to a millimetre or to
a thousandth of the shown range, both less than a pixel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.choice import AXES
from drake_navbench.analysis.figures.comparison import (
    MOST_DOTS,
    clearance_curves,
    compute_times,
    evenly_chosen,
)
from drake_navbench.analysis.figures.maps import bounds
from drake_navbench.analysis.figures.ranking import pareto_points
from drake_navbench.analysis.metrics.definition import Metric, Undefined
from drake_navbench.analysis.metrics.mission import goals
from drake_navbench.analysis.metrics.safety import DANGER_DISTANCE_M, obstacle_outlines
from drake_navbench.analysis.metrics.signals import positions, times
from drake_navbench.analysis.metrics.tracking import projection_on_plans
from drake_navbench.analysis.numbers import typeset
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

# The most points of all trials of a scenario together; the fewest and the most of one trial.
MAX_POINTS, MIN_POINTS_A_TRIAL, MAX_POINTS_A_TRIAL = 4000, 20, 150
MAX_WALL_COUNT = 1500
DECIMALS_M = 3
DIGITS = 4
COMPUTE_EVERY = 3

Chart = dict[str, Any]


def chart_data(
    scenario: str,
    logs: Mapping[str, Sequence[TrialLog]],
    trials: pd.DataFrame,
    metrics: Sequence[Metric],
    columns: Sequence[str] = (),
) -> Chart:
    """Returns the numbers of a scenario's charts, as JSON can hold them.

    logs: by controller, each with samples. trials: their rows as from `trial_row`. metrics: the
    metrics in the chart of metrics. columns: all columns of the results, so that each keeps its
    colour on every page.
    """
    names = list(logs)
    every = [log for own in logs.values() for log in own]
    points = int(np.clip(MAX_POINTS // len(every), MIN_POINTS_A_TRIAL, MAX_POINTS_A_TRIAL))
    longest = max(every, key=lambda log: len(log.first_plans))
    low, high = bounds(every)
    return {
        "scenario": scenario,
        "controllers": names,
        "colors": [controller_color(name, (*names, *columns)) for name in names],
        "bounds": _rounded([low[0], high[0], low[1], high[1]]),
        "walls": _walls(longest),
        "plans": [_xy(plan.poses[:, :2], MAX_POINTS_A_TRIAL) for plan in longest.first_plans],
        "goals": [_rounded(goal[:2]) for goal in goals(longest)],
        "axes": AXES,
        "danger": DANGER_DISTANCE_M,
        "trials": _trials(logs, points),
        "metrics": [_metric(entry, trials, names) for entry in metrics],
        "compute": _compute(logs, names),
        "pareto": _pareto(trials, scenario, names),
    }


def _walls(log: TrialLog) -> list[list[list[float]]]:
    """Returns outlines of obstacles, at most MAX_WALL_COUNT; of a map's many cells only some."""
    outlines = obstacle_outlines(log)
    every = max(1, -(-len(outlines) // MAX_WALL_COUNT))
    return [_xy(np.asarray(outline), len(outline)) for outline in outlines[::every]]


def _trials(logs: Mapping[str, Sequence[TrialLog]], points: int) -> list[Chart]:
    curves = iter(clearance_curves(logs))
    drawn = []
    for index, own in enumerate(logs.values()):
        for log in own:
            chosen = evenly_chosen(len(log.samples), points)
            path = positions(log)[chosen]
            if "floor" in log.samples:
                # No line is drawn to the place where a lift left the robot.
                path[np.flatnonzero(np.diff(log.samples["floor"].to_numpy()[chosen]))] = np.nan
            curve = next(curves, None)
            drawn.append(
                {
                    "controller": index,
                    "trial": log.info["trial"],
                    "outcome": str(log.outcome).replace("_", " "),
                    "arrived": log.outcome is Outcome.SUCCEEDED,
                    "time": _rounded(times(log)[chosen], 2),
                    "x": _rounded(path[:, 0]),
                    "y": _rounded(path[:, 1]),
                    "error": _rounded(_distances_from_plan(log)[chosen]),
                    "driven": _rounded(curve.driven_m[chosen]) if curve else None,
                    "clearance": _rounded(curve.clearance_m[chosen]) if curve else None,
                }
            )
    return drawn


def _distances_from_plan(log: TrialLog) -> Array:
    """Returns the distance of each sample from the plan, (N,) m; NaN where there is no plan."""
    try:
        return projection_on_plans(log).distance_m
    except Undefined:
        return np.full(len(log.samples), math.nan)


def _metric(entry: Metric, trials: pd.DataFrame, names: Sequence[str]) -> Chart:
    defined = trials[np.isfinite(trials[entry.name])]
    shown = [
        own.iloc[evenly_chosen(len(own), MOST_DOTS)]
        for _, own in defined.groupby("controller", sort=False)
    ]
    columns = ["controller", "trial", "outcome", entry.name]
    rows = (row for own in shown for row in own[columns].itertuples(index=False))
    return {
        "name": entry.name,
        "title": entry.title,
        "unit": typeset(entry.unit),
        "better": str(entry.better),
        "values": [
            [names.index(controller), int(trial), _short(value), outcome == Outcome.SUCCEEDED]
            for controller, trial, outcome, value in rows
            if controller in names
        ],
    }


def _compute(logs: Mapping[str, Sequence[TrialLog]], names: Sequence[str]) -> Chart | None:
    found = compute_times(logs)
    if found is None:
        return None
    return {
        "period": found.period_ms,
        "curves": [
            [
                names.index(name),
                [_short(value) for value in times_ms[::COMPUTE_EVERY]],
                [_short(value) for value in share[::COMPUTE_EVERY]],
            ]
            for name, (times_ms, share) in found.curves.items()
        ],
    }


def _pareto(trials: pd.DataFrame, scenario: str, names: Sequence[str]) -> list[list[Any]]:
    points = pareto_points(trials, scenario)
    return [
        [names.index(name), *map(_short, values), bool(is_best)]
        for name, values, is_best in zip(*points, strict=True)
        if name in names and not np.isnan(values[1])
    ]


def _xy(points: Array, most: int) -> list[list[float]]:
    kept = points[evenly_chosen(len(points), most)]
    return [_rounded(kept[:, 0]), _rounded(kept[:, 1])]


def _rounded(values: Any, decimals: int = DECIMALS_M) -> list[Any]:
    """Returns plain numbers, with None for NaN and infinity, which JSON does not have."""
    return [
        value if math.isfinite(value) else None
        for value in np.round(np.asarray(values, dtype=float), decimals).tolist()
    ]


def _short(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
