"""Which figures there are, and where they are written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.comparison import (
    box_figure,
    clearance_figure,
    compute_figure,
)
from drake_navbench.analysis.figures.maps import paths_figure
from drake_navbench.analysis.figures.motion import MotionSheet
from drake_navbench.analysis.figures.ranking import pareto_figure, rank_figure
from drake_navbench.analysis.figures.style import Look, figure_style, write_figure
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.scenario_analysis import HEADLINE_METRICS
from drake_navbench.analysis.verdicts import comparable_trials, is_failed
from drake_navbench.log import TrialLog
from drake_navbench.results import file_name


class FigureEntry(NamedTuple):
    """A figure that was written.

    controller: '' where it compares all of them. stem: its path in the figures folder, without
    suffix, in POSIX form.
    """

    scenario: str
    controller: str
    kind: str
    title: str
    stem: str


def headline_metrics() -> list[Metric]:
    """Returns the metrics that box plots and ranks show."""
    by_name = {entry.name: entry for entry in all_metrics()}
    return [by_name[name] for name in HEADLINE_METRICS]


def write_scenario_figures(
    folder: Path,
    scenario: str,
    logs: Mapping[str, Sequence[TrialLog]],
    trials: pd.DataFrame,
) -> list[FigureEntry]:
    """Writes all figures of a scenario as SVG and PNG below `folder`; returns what was written.

    logs: the readable trials by controller. trials: rows as from `trial_row`, all scenarios.
    """
    entries = []
    with figure_style():
        for entry, figure in _figures(scenario, logs, trials):
            write_figure(figure, folder / entry.stem)
            entries.append(entry)
    return entries


def _figures(
    scenario: str, logs: Mapping[str, Sequence[TrialLog]], trials: pd.DataFrame
) -> Iterator[tuple[FigureEntry, Figure]]:
    drawable = {
        name: kept
        for name, own in logs.items()
        if (kept := [log for log in own if len(log.samples)])
    }
    if not drawable:
        return
    look = Look(list(dict.fromkeys([*logs, *trials["controller"]])))
    metrics = headline_metrics()
    comparable = comparable_trials(trials, HEADLINE_METRICS)
    # Where nobody arrived there is no best.
    ranked = None if is_failed(trials).all() else rank_figure(comparable, scenario, metrics, look)
    compared = {
        "paths": ("Driven paths", paths_figure(drawable, look)),
        "clearance": ("Clearance along the path", clearance_figure(drawable, look)),
        "metrics": ("Metrics, every trial", box_figure(trials, scenario, metrics, look)),
        "ranks": ("Ranks", ranked),
        "pareto": ("Time, clearance, jerk", pareto_figure(trials, scenario, look)),
        "compute": ("Compute time", compute_figure(drawable, look)),
    }
    for kind, (title, figure) in compared.items():
        if figure is not None:
            stem = f"{file_name(scenario)}/{kind}"
            yield FigureEntry(scenario, "", kind, title, stem), figure
    sheet = MotionSheet()
    for controller, own in drawable.items():
        stem = f"{file_name(scenario)}/motion-{file_name(controller)}"
        entry = FigureEntry(scenario, controller, "motion", controller, stem)
        yield entry, sheet.draw(own, controller, look)
