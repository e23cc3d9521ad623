"""Computes everything from the logs of a results folder, scenario by scenario, in parallel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.content_stamps import file_stamps
from drake_navbench.analysis.figures.choice import FIGURES_FOLDER, FigureChoice, FigureEntry
from drake_navbench.analysis.figures.kept_drawing import (
    Drawing,
    drawing_stamp,
    read_drawing,
    write_drawing,
)
from drake_navbench.analysis.many_trials import (
    has_many,
    logs_drawn,
    read_some_trials,
    rows_by_path,
)
from drake_navbench.analysis.measured_trials import MeasuredTrials, read_measured, write_measured
from drake_navbench.analysis.scenario_analysis import (
    KnownValues,
    LeftOut,
    ScenarioAnalysis,
    TrialEntry,
    analyse,
    headline_metrics,
    read_trials,
)
from drake_navbench.analysis.totals import scenarios_in_totals
from drake_navbench.errors import InputError
from drake_navbench.logs.header import read_info
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks, start_server

DEFAULT_JOBS = 2


@dataclass(frozen=True)
class FolderAnalysis:
    """The analysis of a results folder.

    scenarios: in the run's order. figures: the figures that were written. charts: the numbers of
    each scenario's interactive charts, see `chart_data`.
    """

    path: Path
    manifest: Mapping[str, Any]
    scenarios: tuple[ScenarioAnalysis, ...]
    figures: tuple[FigureEntry, ...]
    charts: tuple[dict[str, Any], ...] = ()

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row a trial that could be read."""
        return pd.concat([s.table for s in self.scenarios if s.trials], ignore_index=True)

    @property
    def left_out(self) -> list[LeftOut]:
        """The files that could not be read, and the figures that could not be drawn."""
        return [entry for scenario in self.scenarios for entry in scenario.left_out]


class _ScenarioTask(NamedTuple):
    """The arguments of `_analyse_scenario`. stamp: stamp of the scenario's drawing."""

    root: Path
    paths: Sequence[Path]
    controllers: Sequence[str]
    figures: FigureChoice
    known: KnownValues
    told: frozenset[str]
    stamp: str = ""

    @property
    def name(self) -> str:
        """The name of the folder with the scenario's logs."""
        return self.paths[0].parent.parent.name


_ScenarioResult = tuple[ScenarioAnalysis, list[FigureEntry], dict[str, Any] | None]


def analyse_folder(
    path: Path,
    *,
    figures: FigureChoice = FigureChoice.NONE,
    jobs: int = DEFAULT_JOBS,
    measured: pd.DataFrame | None = None,
    keeps: bool = False,
) -> FolderAnalysis:
    """Computes everything from the logs of a results folder.

    What an earlier report kept is not computed again: measurements of logs (`measured_trials`),
    figures and charts (`kept_drawing`). A scenario of very many trials is read from the table of
    trials, see `many_trials`. figures: which of them to draw into the folder. jobs: processes; 1:
    this process alone. measured: rows as from `trial_row` of logs that need no measuring. keeps:
    whether to keep the measurements for the next report. Raises InputError where the folder is no
    results folder or holds no readable log.
    """
    manifest, files = find_logs(path)
    stamps = file_stamps(file for own in files.values() for file in own)
    before = read_measured(path, stamps)
    if measured is not None:
        rows = rows_by_path(ResultsFolder(path), measured)
        before = MeasuredTrials(before.entries, {**before.values, **rows})
    tasks = _tasks(path, manifest, files, figures, before, stamps)
    kept = [_kept_scenario(task, before) for task in tasks]
    results = [result for result in kept if result is not None]
    left = [task for task, result in zip(tasks, kept, strict=True) if result is None]
    if left:
        results += (
            [_analyse_scenario(*t) for t in left] if jobs == 1 else _analyse_apart(left, jobs)
        )
    wanted = list(manifest.get("scenarios", []))
    results.sort(key=lambda result: _place(result[0].scenario, wanted))
    if not any(analysis.trials for analysis, *_ in results):
        raise InputError(f"{path}: none of its {sum(map(len, files.values()))} logs can be read")
    if keeps and left:
        write_measured(path, [e for analysis, *_ in results for e in analysis.trials], stamps)
    return FolderAnalysis(
        path=path,
        manifest=manifest,
        scenarios=tuple(analysis for analysis, *_ in results),
        figures=tuple(entry for _, written, _ in results for entry in written),
        charts=tuple(chart for *_, chart in results if chart is not None),
    )


def _tasks(
    path: Path,
    manifest: Mapping[str, Any],
    files: Mapping[Path, Sequence[Path]],
    figures: FigureChoice,
    before: MeasuredTrials,
    stamps: Mapping[Path, str],
) -> list[_ScenarioTask]:
    """Returns one task for each scenario. files: logs by the folder of their scenario."""
    controllers = list(manifest.get("controllers", []))
    told = scenarios_in_totals(manifest.get("suites", {}))
    # The longest scenarios first, so that the last worker does not start with the most work.
    order = sorted(files, key=lambda key: -sum(file.stat().st_size for file in files[key]))
    tasks = []
    for key in order:
        own = files[key]
        known = {p: before.values[p] for p in own if p in before.values}
        logs = {p.relative_to(path).as_posix(): stamps[p] for p in own}
        stamp = drawing_stamp(logs, figures, controllers)
        tasks.append(_ScenarioTask(path, own, controllers, figures, known, told, stamp))
    return tasks


def _kept_scenario(task: _ScenarioTask, before: MeasuredTrials) -> _ScenarioResult | None:
    """Returns a scenario's result from kept files alone; None where a log must be read."""
    entries = [before.entries[path] for path in task.paths if path in before.entries]
    if len(entries) < len(task.paths):
        return None
    entries = _in_order(entries, task.controllers)
    scenario = str(entries[0].row["scenario"])
    drawing: Drawing | None = Drawing([], None, len(logs_drawn(task.paths)))
    if _is_drawn(task.figures, scenario in task.told):
        drawing = read_drawing(task.root, scenario, task.stamp)
    if drawing is None:
        return None
    analysis = analyse(scenario, entries, [])
    _describe(analysis, read_info(task.root / entries[0].path), task.told)
    analysis.drawn = drawing.log_count
    return analysis, drawing.figures, drawing.chart


def find_logs(path: Path) -> tuple[Mapping[str, Any], dict[Path, list[Path]]]:
    """Returns the manifest of a results folder, and its logs by the folder of their scenario.

    Raises InputError where the folder is no results folder or holds no log.
    """
    manifest = ResultsFolder(path).read_manifest()
    files: dict[Path, list[Path]] = {}
    for file in sorted((path / "trials").glob("*/*/trial_*.parquet")):
        files.setdefault(file.parent.parent, []).append(file)
    if not files:
        raise InputError(
            f"{path}: none of its trials has ended; if the run was stopped, "
            f"`drake-navbench run --resume {quote(str(path))}` continues it"
        )
    return manifest, files


def _analyse_apart(tasks: Sequence[_ScenarioTask], jobs: int) -> list[_ScenarioResult]:
    """Runs `_analyse_scenario` for each task in workers; returns the results.

    Raises the error that a worker raised. A scenario whose worker was killed is analysed once more;
    if that fails, without figures; else it is left out. The results list the parts that were left
    out.
    """
    start_server([__name__])
    first, ended = _analyse_once(tasks, jobs)
    again, ended = _analyse_once([task for task, _ in ended], jobs)
    plain = [task._replace(figures=FigureChoice.NONE) for task, _ in ended]
    without, lost = _analyse_once(plain, jobs)
    reasons = {task.name: reason for task, reason in ended}
    for task, (analysis, _, _) in without:
        reason = f"not drawn: {reasons[task.name]}"
        analysis.left_out.append(LeftOut(f"{FIGURES_FOLDER}/{task.name}", reason))
    found = [result for _, result in (*first, *again, *without)]
    return [*found, *(_lost(task, reason) for task, reason in lost)]


def _analyse_once(
    tasks: Sequence[_ScenarioTask], jobs: int
) -> tuple[list[tuple[_ScenarioTask, _ScenarioResult]], list[tuple[_ScenarioTask, str]]]:
    """Returns the tasks with their results, and those whose worker was killed, with the reason."""
    results, ended = [], []
    own = {Task(_analyse_scenario, task): task for task in tasks}
    with closing(run_tasks(list(own), jobs=jobs)) as endings:
        for task, ending in endings:
            if isinstance(ending, Raised):
                raise ending.error
            if isinstance(ending, Returned):
                results.append((own[task], ending.value))
            else:
                ended.append((own[task], ending.sentence))
    return results, ended


def _lost(task: _ScenarioTask, reason: str) -> _ScenarioResult:
    left_out = [LeftOut(path.relative_to(task.root).as_posix(), reason) for path in task.paths]
    return analyse(task.name, [], left_out), [], None


def _analyse_scenario(
    root: Path,
    paths: Sequence[Path],
    controllers: Sequence[str],
    figures: FigureChoice,
    known: KnownValues,
    told: frozenset[str],
    stamp: str,
) -> _ScenarioResult:
    read = read_some_trials if has_many(paths) else read_trials
    logs, entries, left_out = read(paths, root, known)
    logs.sort(key=lambda log: (_place(log.info["controller"], controllers), log.info["trial"]))
    entries = _in_order(entries, controllers)
    scenario = str(entries[0].row["scenario"]) if entries else paths[0].parent.parent.name
    analysis = analyse(scenario, entries, left_out)
    analysis.drawn = len(logs)
    if not logs:
        return analysis, [], None
    _describe(analysis, logs[0].info, told)
    if not _is_drawn(figures, analysis.is_in_totals):
        return analysis, [], None
    drawing = _drawn(root / FIGURES_FOLDER, analysis, logs, figures, controllers)
    if drawing.figures:
        write_drawing(root, scenario, stamp, figures, drawing)
    return analysis, drawing.figures, drawing.chart


def _drawn(
    folder: Path,
    analysis: ScenarioAnalysis,
    logs: Sequence[TrialLog],
    figures: FigureChoice,
    controllers: Sequence[str],
) -> Drawing:
    """Draws the figures of a scenario into a folder; returns them, with its chart."""
    # These modules import matplotlib, which a report without drawings does not need.
    from drake_navbench.analysis.chart_data import chart_data
    from drake_navbench.analysis.figures.album import drawable_logs, write_scenario_figures

    by_controller: dict[str, list[TrialLog]] = {}
    for log in logs:
        by_controller.setdefault(log.info["controller"], []).append(log)
    scenario, table = analysis.scenario, analysis.table
    written = write_scenario_figures(
        folder,
        scenario,
        by_controller,
        table,
        figures,
        verdicts=analysis.verdicts,
        columns=controllers,
    )
    drawable = drawable_logs(by_controller)
    chart = None
    if drawable:
        chart = chart_data(scenario, drawable, table, headline_metrics(), controllers)
    return Drawing(written, chart, len(logs))


def _is_drawn(figures: FigureChoice, is_in_totals: bool) -> bool:
    if is_in_totals:
        return figures is FigureChoice.ALL
    return figures is not FigureChoice.NONE


def _describe(analysis: ScenarioAnalysis, info: Mapping[str, Any], told: frozenset[str]) -> None:
    """Sets a scenario's description, purpose and clean scenario from one log's header.

    told: the scenarios that the report shows by totals alone.
    """
    task = info["scenario"]
    analysis.description = str(task.get("description", ""))
    analysis.is_impossible = task.get("expected_outcome") == Outcome.ABORTED
    analysis.clean_scenario = str(task.get("clean_scenario") or "")
    analysis.is_in_totals = analysis.scenario in told


def _in_order(entries: Sequence[TrialEntry], controllers: Sequence[str]) -> list[TrialEntry]:
    """Returns trials by controller, in the order of the results' columns, then by number."""
    return sorted(entries, key=lambda e: (_place(e.row["controller"], controllers), e.row["trial"]))


def _place(name: str, order: Sequence[str]) -> tuple[int, str]:
    """Returns a sorting key: names in `order` in their order, all others after them by name."""
    return (order.index(name) if name in order else len(order), name)
