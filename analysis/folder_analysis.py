"""Computes everything from the logs of a results folder, scenario by scenario, in parallel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.chart_data import Chart, chart_data
from drake_navbench.analysis.figures.album import (
    FigureChoice,
    FigureEntry,
    drawable_logs,
    headline_metrics,
    write_scenario_figures,
)
from drake_navbench.analysis.many_trials import has_many, read_some_trials, rows_of_table
from drake_navbench.analysis.scenario_analysis import (
    KnownValues,
    LeftOut,
    ScenarioAnalysis,
    analyse,
    read_trials,
)
from drake_navbench.analysis.totals import told_by_totals
from drake_navbench.errors import InputError
from drake_navbench.logs.log import Outcome, TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import Task, run_tasks, start_server

FIGURES_FOLDER = "figures"
DEFAULT_JOBS = 2


@dataclass(frozen=True)
class FolderAnalysis:
    """The analysis of a results folder.

    scenarios: in the order in which the run named them. figures: the figures that were written.
    charts: the numbers of each scenario's interactive charts, see `chart_data`.
    """

    path: Path
    manifest: Mapping[str, Any]
    scenarios: tuple[ScenarioAnalysis, ...]
    figures: tuple[FigureEntry, ...]
    charts: tuple[Chart, ...] = ()

    @cached_property
    def trials(self) -> pd.DataFrame:
        """One row a trial that could be read."""
        return pd.concat([s.table for s in self.scenarios if s.trials], ignore_index=True)

    @property
    def left_out(self) -> list[LeftOut]:
        """The files that could not be read, and figures that could not be drawn."""
        return [entry for scenario in self.scenarios for entry in scenario.left_out]


class _ScenarioTask(NamedTuple):
    """The arguments of `_analyse_scenario`."""

    root: Path
    paths: Sequence[Path]
    controllers: Sequence[str]
    figures: FigureChoice
    known: KnownValues
    told: frozenset[str]

    @property
    def name(self) -> str:
        """The name of the folder with the scenario's logs."""
        return self.paths[0].parent.parent.name


_ScenarioResult = tuple[ScenarioAnalysis, list[FigureEntry], Chart | None]


def analyse_folder(
    path: Path,
    *,
    figures: FigureChoice = FigureChoice.NONE,
    jobs: int = DEFAULT_JOBS,
    measured: pd.DataFrame | None = None,
) -> FolderAnalysis:
    """Computes everything from the logs of a results folder.

    A scenario of very many trials is told from the table of trials, see `many_trials`.
    figures: which of them to draw into the folder. jobs: processes; 1 stays in this one.
    measured: rows as from `tables.trial_row` of some of these logs, not to be measured again.
    Raises InputError where the folder is no results folder or holds no readable log.
    """
    manifest, files = find_logs(path)
    controllers = list(manifest.get("controllers", []))
    # The longest scenarios first: the last worker should not start with the most work.
    order = sorted(files, key=lambda key: -sum(file.stat().st_size for file in files[key]))
    known: KnownValues = {}
    if measured is not None or any(map(has_many, files.values())):
        known = rows_of_table(ResultsFolder(path), measured)
    told = told_by_totals(manifest.get("suites", {}))
    tasks = [
        _ScenarioTask(
            path,
            files[key],
            controllers,
            figures,
            {p: known[p] for p in files[key] if p in known},
            told,
        )
        for key in order
    ]
    if jobs == 1:
        results = [_analyse_scenario(*task) for task in tasks]
    else:
        results = _analyse_apart(tasks, jobs)
    wanted = list(manifest.get("scenarios", []))
    results.sort(key=lambda result: _place(result[0].scenario, wanted))
    if not any(analysis.trials for analysis, *_ in results):
        raise InputError(f"{path}: none of its {sum(map(len, files.values()))} logs can be read")
    return FolderAnalysis(
        path=path,
        manifest=manifest,
        scenarios=tuple(analysis for analysis, *_ in results),
        figures=tuple(entry for _, written, _ in results for entry in written),
        charts=tuple(chart for *_, chart in results if chart is not None),
    )


def find_logs(path: Path) -> tuple[Mapping[str, Any], dict[Path, list[Path]]]:
    """Returns the manifest of a results folder, and its logs by the folder of their scenario.

    Raises InputError where the folder is no results folder or holds no log.
    """
    manifest = ResultsFolder(path).read_manifest()
    files: dict[Path, list[Path]] = {}
    for file in sorted((path / "trials").glob("*/*/trial_*.parquet")):
        files.setdefault(file.parent.parent, []).append(file)
    if not files:
        raise InputError(f"{path}: no trial logs below {path / 'trials'}")
    return manifest, files


def _analyse_apart(tasks: Sequence[_ScenarioTask], jobs: int) -> list[_ScenarioResult]:
    """Runs `_analyse_scenario` for each task in workers; returns the results.

    Raises the error that a worker raised. A scenario whose worker was killed is analysed once more,
    then without figures, then left out. The results list the parts that were left out.
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
) -> _ScenarioResult:
    read = read_some_trials if has_many(paths) else read_trials
    logs, entries, left_out = read(paths, root, known)
    logs.sort(key=lambda log: (_place(log.info["controller"], controllers), log.info["trial"]))
    entries.sort(key=lambda e: (_place(e.row["controller"], controllers), e.row["trial"]))
    scenario = str(entries[0].row["scenario"]) if entries else paths[0].parent.parent.name
    analysis = analyse(scenario, entries, left_out)
    analysis.drawn = len(logs)
    if not logs:
        return analysis, [], None
    asked = logs[0].info["scenario"]
    analysis.description = str(asked.get("description", ""))
    analysis.is_impossible = asked.get("expected_outcome") == Outcome.ABORTED
    analysis.clean_scenario = str(asked.get("clean_scenario") or "")
    analysis.is_told_by_totals = scenario in told
    if analysis.is_told_by_totals and figures is not FigureChoice.ALL:
        return analysis, [], None
    by_controller: dict[str, list[TrialLog]] = {}
    for log in logs:
        by_controller.setdefault(log.info["controller"], []).append(log)
    table = analysis.table
    written = write_scenario_figures(
        root / FIGURES_FOLDER,
        scenario,
        by_controller,
        table,
        figures,
        verdicts=analysis.verdicts,
        columns=controllers,
    )
    drawable = drawable_logs(by_controller)
    is_drawn = bool(drawable) and figures is not FigureChoice.NONE
    chart = (
        chart_data(scenario, drawable, table, headline_metrics(), controllers) if is_drawn else None
    )
    return analysis, written, chart


def _place(name: str, order: Sequence[str]) -> tuple[int, str]:
    """Returns a sort key: named ones in their order, others after them by name."""
    return (order.index(name) if name in order else len(order), name)
