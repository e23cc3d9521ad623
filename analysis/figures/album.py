"""The figures of a scenario: their kinds, and the files that are written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.choice import FigureChoice, FigureEntry
from drake_navbench.analysis.figures.comparison import (
    box_figure,
    box_panels,
    clearance_curves,
    clearance_figure,
    compute_figure,
    compute_times,
)
from drake_navbench.analysis.figures.maps import paths_figure, paths_map
from drake_navbench.analysis.figures.motion import MotionSheet, sheet_of
from drake_navbench.analysis.figures.ranking import (
    pareto_figure,
    pareto_points,
    rank_figure,
    rank_rows,
)
from drake_navbench.analysis.figures.style import (
    Look,
    figure_style,
    size_of,
    write_figure,
)
from drake_navbench.analysis.scenario_analysis import headline_metrics
from drake_navbench.analysis.verdicts import MetricVerdict, is_failed
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import file_name


def drawable_logs(logs: Mapping[str, Sequence[TrialLog]]) -> dict[str, list[TrialLog]]:
    """Returns the logs that have samples, by controller; leaves out controllers without."""
    return {
        name: kept
        for name, own in logs.items()
        if (kept := [log for log in own if len(log.samples)])
    }


def write_scenario_figures(
    folder: Path,
    scenario: str,
    logs: Mapping[str, Sequence[TrialLog]],
    trials: pd.DataFrame,
    choice: FigureChoice = FigureChoice.ALL,
    *,
    verdicts: Sequence[MetricVerdict] = (),
    columns: Sequence[str] = (),
) -> list[FigureEntry]:
    """Writes the chosen figures of a scenario below `folder`; returns what was written.

    logs: the readable trials by controller. trials: rows of all scenarios, as from `trial_row`.
    verdicts: the scenario's, for the diagram of places. columns: all columns of the results, so
    that each keeps its colour everywhere.
    """
    drawable = drawable_logs(logs)
    if not drawable or choice is FigureChoice.NONE:
        return []
    look = Look(list(dict.fromkeys([*logs, *trials["controller"]])), columns)
    name = file_name(scenario)
    entries = []
    with figure_style():
        for kind, title, figure in _comparisons(scenario, drawable, trials, verdicts, look):
            stem = f"{name}/{kind}"
            write_figure(figure, folder / stem, choice.suffixes)
            entries.append(FigureEntry(scenario, "", kind, title, stem, size_of(figure)))
        sheets = _motion_sheets(drawable, look) if choice is FigureChoice.ALL else ()
        for controller, figure in sheets:
            stem = f"{name}/motion-{file_name(controller)}"
            write_figure(figure, folder / stem, choice.suffixes)
            size = size_of(figure)
            entries.append(FigureEntry(scenario, controller, "motion", controller, stem, size))
    return entries


def _comparisons(
    scenario: str,
    logs: Mapping[str, Sequence[TrialLog]],
    trials: pd.DataFrame,
    verdicts: Sequence[MetricVerdict],
    look: Look,
) -> Iterator[tuple[str, str, Figure]]:
    """Yields kind, title and figure of each figure that compares controllers, one at a time."""
    metrics = headline_metrics()
    yield "paths", "Driven paths", paths_figure(paths_map(logs), look)
    if figure := clearance_figure(clearance_curves(logs), look):
        yield "clearance", "Clearance along the path", figure
    if figure := box_figure(box_panels(trials, scenario, metrics), look):
        yield "metrics", "Metrics, every trial", figure
    # If no trial arrived, no controller is best.
    if not is_failed(trials).all() and (figure := rank_figure(rank_rows(verdicts, metrics), look)):
        yield "ranks", "Places", figure
    if figure := pareto_figure(pareto_points(trials, scenario), look):
        yield "pareto", "Time, clearance, jerk", figure
    if figure := compute_figure(compute_times(logs), look):
        yield "compute", "Compute time", figure


def _motion_sheets(
    logs: Mapping[str, Sequence[TrialLog]], look: Look
) -> Iterator[tuple[str, Figure]]:
    """Yields each controller with its sheet; write the sheet before asking for the next one."""
    sheet = MotionSheet()
    for controller, own in logs.items():
        yield controller, sheet.draw(sheet_of(own, controller), look)
