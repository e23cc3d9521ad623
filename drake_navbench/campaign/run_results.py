"""The result of `run_benchmark`: the table of trials, their logs, and the pages made from them."""

from __future__ import annotations

from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import pandas as pd

from drake_navbench.analysis.compare import FolderComparison, compare_folders
from drake_navbench.analysis.contests import by_task
from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import counted
from drake_navbench.analysis.repeats import repeated_cells, repeated_controllers
from drake_navbench.analysis.totals import suites_of
from drake_navbench.analysis.verdicts import comparable_trials, faults_of, verdict
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.typed_files.output_file import write_whole

if TYPE_CHECKING:
    from drake_navbench.analysis.notebook import Picture, ReplayPage


class Results:
    """The trials of a benchmark.

    trials: one row a trial: outcome, reason and the metrics. path: the results folder; a temporary
    one is deleted with this object.
    """

    def __init__(
        self, trials: pd.DataFrame, path: Path, temporary: TemporaryDirectory[str] | None = None
    ) -> None:
        self.trials = trials
        self.path = path
        self._temporary = temporary

    @classmethod
    def open(cls, path: str | Path, *, jobs: int = 1) -> Results:
        """Returns the results of a folder, measured anew only where it has no table of trials.

        jobs: processes that measure. Raises InputError where `path` is no results folder.
        """
        folder = ResultsFolder(Path(path))
        folder.read_manifest()
        if folder.trials_path.is_file():
            return cls(pd.read_parquet(folder.trials_path), folder.path)
        return cls(analyse_folder(folder.path, jobs=jobs).trials, folder.path)

    def __len__(self) -> int:
        return len(self.trials)

    def __repr__(self) -> str:
        told = ", ".join(f"{count} {outcome}" for outcome, count in self._outcomes().items())
        # The name of a temporary folder differs each time, and says nothing.
        place = self.path if self._temporary is None else "in a temporary folder"
        return f"Results({counted(len(self.trials), 'trial')}: {told}; {place})"

    def _repr_html_(self) -> str:
        """Returns the success rates by scenario and controller as an HTML table, for notebooks."""
        succeeded = self.trials.assign(succeeded=self.trials["outcome"] == "succeeded")
        shares = succeeded.pivot_table(
            index="scenario", columns="controller", values="succeeded", sort=False
        )
        return f"<p>{escape(repr(self))}</p>{shares.style.format('{:.0%}', na_rep='–').to_html()}"

    def _outcomes(self) -> dict[str, int]:
        return {str(name): int(n) for name, n in self.trials["outcome"].value_counts().items()}

    def log(self, scenario: str, controller: str, trial: int = 0) -> TrialLog:
        """Returns the log of a trial; raises InputError where there is none."""
        self._require_run("scenario", scenario)
        self._require_run("controller", controller)
        return TrialLog.read(ResultsFolder(self.path).log_path(scenario, controller, trial))

    def _require_run(self, column: str, name: str) -> None:
        known = self._names(column)
        if name not in known:
            raise InputError(f"{column} {name!r} was not run{nearest_name_hint(name, known)}")

    def _names(self, column: str) -> list[str]:
        return list(dict.fromkeys(self.trials[column]))

    def best(self, metric: str = "time_to_goal_s", scenario: str | None = None) -> str | None:
        """Returns the controller that is shown to be best, None where the trials do not show one.

        By the rules of the report's verdicts, over all scenarios unless one is named. Each task of
        a suite, such as a goal on a map, is one pair, however many trials it has; equal trials of a
        controller in a scenario count once. Raises InputError where the metric or the scenario is
        not known.
        """
        metrics = {entry.name: entry for entry in all_metrics()}
        if metric not in metrics:
            raise _unknown_metric(metric)
        trials, entry = self.trials, metrics[metric]
        if scenario is not None:
            self._require_run("scenario", scenario)
            trials = trials[trials["scenario"] == scenario]
        trials = by_task(
            trials, {name: suite for name, suite in suites_of(trials).items() if suite}
        )
        repeated = repeated_cells(trials) if entry.is_repeatable else frozenset()
        cells = pd.MultiIndex.from_frame(trials[["scenario", "controller"]])
        faults = faults_of(trials)
        trials = trials[~(cells.isin(list(repeated)) & cells.duplicated())]
        driven = list(dict.fromkeys(trials["scenario"]))
        groups = trials.groupby("scenario", sort=False)
        pooled = pd.concat([comparable_trials(own, metrics) for _, own in groups])
        seeds = pooled["scenario"].astype(str) + "/" + pooled["seed"].astype(str)
        judged = verdict(
            pooled.assign(seed=seeds, scenario=""),
            "",
            entry,
            repeated=repeated_controllers(repeated, driven[0]) if len(driven) == 1 else frozenset(),
            anyone_arrived=bool((trials["outcome"] == "succeeded").any()),
            faults=faults,
        )
        return None if judged is None else judged.best

    def compare(
        self, other: Results | str | Path | None = None, *, jobs: int = 1
    ) -> FolderComparison:
        """Returns the comparison of another results folder with this one; `print` shows it.

        other: None compares the columns of this folder with its first one. Columns are paired as
        by `drake-navbench compare`. Raises InputError where nothing can be compared.
        """
        path = other.path if isinstance(other, Results) else other
        folders = [self.path] if path is None else [self.path, Path(path)]
        return compare_folders(folders, jobs=jobs)

    def plot(self, metric: str) -> Picture:
        """Returns a picture of a metric: a dot a trial, a row a controller, a panel a scenario.

        Raises InputError where the table has no such metric.
        """
        if metric not in self.trials or self.trials[metric].map(type).eq(str).any():
            raise _unknown_metric(metric)
        # matplotlib takes half a second to import, which runs that draw nothing save.
        from drake_navbench.analysis.notebook import dots

        return dots(self.trials, metric)

    def report(self, *, jobs: int = 1) -> Path:
        """Makes tables, figures and report.html in the folder; returns the page's path."""
        from drake_navbench.analysis.report import build_report

        return build_report(self.path, jobs=jobs, measured=self.trials).path

    def replay(self, scenario: str, controller: str | None = None, trial: int = 0) -> ReplayPage:
        """Makes the replay of a scenario's race, or of one controller's trial.

        Raises InputError where there is no such trial, or nothing to show of it.
        """
        from drake_navbench.analysis.notebook import ReplayPage, model_of
        from drake_navbench.analysis.replay import write_race_replay, write_trial_replay

        columns = self._names("controller")
        if controller is not None:
            path = ResultsFolder(self.path).log_path(scenario, controller, trial)
            log, page = self.log(scenario, controller, trial), path.with_suffix(".html")
            write_whole(
                page,
                lambda file: write_trial_replay(log, file, model=model_of(log), columns=columns),
            )
            return ReplayPage(page)
        logs = [self.log(scenario, name, trial) for name in columns]
        driven = [log for log in logs if len(log.samples)]
        if not driven:
            raise InputError(
                f"{scenario}: every trial ended before its first sample; there is nothing to show"
            )
        page = ResultsFolder(self.path).replay_path(scenario)
        model = model_of(driven[0])
        write_whole(
            page, lambda file: write_race_replay(driven, file, model=model, columns=columns)
        )
        return ReplayPage(page)


def _unknown_metric(name: str) -> InputError:
    known = [entry.name for entry in all_metrics()]
    return InputError(f"metric {name!r} is unknown{nearest_name_hint(name, known)}")
