"""What `run_benchmark` returns: the table of trials, and all that can be made of their logs."""

from __future__ import annotations

from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from drake_navbench.analysis.notebook import ReplayPage, model_of
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder, write_whole


class Results:
    """The trials of a benchmark.

    trials: one row a trial: outcome, reason and the metrics. path: the results folder; a temporary
    one goes with this object.
    """

    def __init__(
        self, trials: pd.DataFrame, path: Path, temporary: TemporaryDirectory[str] | None = None
    ) -> None:
        self.trials = trials
        self.path = path
        self._temporary = temporary

    def __len__(self) -> int:
        return len(self.trials)

    def __repr__(self) -> str:
        told = ", ".join(f"{count} {outcome}" for outcome, count in self._outcomes().items())
        # The name of a temporary folder is another each time, and says nothing.
        place = self.path if self._temporary is None else "in a temporary folder"
        return f"Results({len(self.trials)} trials: {told}; {place})"

    def _repr_html_(self) -> str:
        """Returns how often each controller reached its goal, as a table for notebooks."""
        succeeded = self.trials.assign(succeeded=self.trials["outcome"] == "succeeded")
        shares = succeeded.pivot_table(
            index="scenario", columns="controller", values="succeeded", sort=False
        )
        return f"<p>{escape(repr(self))}</p>{shares.style.format('{:.0%}', na_rep='–').to_html()}"

    def _outcomes(self) -> dict[str, int]:
        return {str(name): int(n) for name, n in self.trials["outcome"].value_counts().items()}

    def log(self, scenario: str, controller: str, trial: int = 0) -> TrialLog:
        """Returns the log of a trial; raises InputError where there is none."""
        for column, name in (("scenario", scenario), ("controller", controller)):
            known = list(dict.fromkeys(self.trials[column]))
            if name not in known:
                raise InputError(f"{column} {name!r} was not run{nearest_name_hint(name, known)}")
        return TrialLog.read(ResultsFolder(self.path).log_path(scenario, controller, trial))

    def report(self, *, jobs: int = 1) -> Path:
        """Makes tables, figures and report.html in the folder; returns the page's path."""
        from drake_navbench.analysis.report import build_report

        return build_report(self.path, jobs=jobs, measured=self.trials).path

    def replay(self, scenario: str, controller: str | None = None, trial: int = 0) -> ReplayPage:
        """Makes the replay of a scenario's race, or of one controller's trial.

        Raises InputError where there is no such trial, or nothing to show of it.
        """
        from drake_navbench.analysis.replay import write_race_replay, write_trial_replay

        columns = list(dict.fromkeys(self.trials["controller"]))
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
            raise InputError(f"{scenario}: no trial came to its first sample; nothing to show")
        page = ResultsFolder(self.path).replay_path(scenario)
        model = model_of(driven[0])
        write_whole(
            page, lambda file: write_race_replay(driven, file, model=model, columns=columns)
        )
        return ReplayPage(page)
