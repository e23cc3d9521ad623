"""Drives the configurations of a front on seeds and in scenarios that the search has not seen."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.statistics import CONFIDENCE, Interval, mean_interval
from drake_navbench.campaign.benchmark import run_benchmark
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.studies.tuning.guards import touches_of
from drake_navbench.studies.tuning.objectives import (
    Objective,
    excess_failures,
    pair_difference,
    scales_of,
)

Array = NDArray[np.float64]


class Judged(NamedTuple):
    """A column against the baseline, on trials that the search has not seen.

    means, intervals: of the relative differences by objective, lower is better; the intervals hold
    together for all columns and objectives that were judged. succeeded, touched: of the column and
    of the baseline, of so many trials. by_scenario: means by objective. touches: trials of the
    column in which it touched something, by scenario.
    """

    column: str
    means: tuple[float, ...]
    intervals: tuple[Interval, ...]
    succeeded: tuple[int, int]
    touched: tuple[int, int]
    trials: int
    excess: float
    by_scenario: dict[str, tuple[float, ...]]
    touches: dict[str, int]

    @property
    def beats_baseline(self) -> bool:
        """Whether it is shown to be better in an objective, worse in none, and never touches."""
        is_better = any(interval.high < 0.0 for interval in self.intervals)
        is_worse = any(interval.low > 0.0 for interval in self.intervals)
        return is_better and not is_worse and self.excess <= 0.0 and not self.touches

    def as_data(self) -> dict[str, Any]:
        """Returns it as JSON can hold it."""
        return {
            "column": self.column,
            "means": list(self.means),
            "intervals": [list(interval) for interval in self.intervals],
            "succeeded": list(self.succeeded),
            "touched": list(self.touched),
            "touches": self.touches,
            "trials": self.trials,
            "beats_baseline": self.beats_baseline,
            "by_scenario": {name: list(means) for name, means in self.by_scenario.items()},
        }


def driven_in(
    folder: Path,
    scenarios: Sequence[str | Scenario],
    columns: Sequence[Preset],
    *,
    trials: int,
    seed: int,
    robot: str,
    jobs: int,
) -> pd.DataFrame:
    """Returns the trials of a results folder, and drives them first where they are missing.

    The folder of an interrupted run, or of other trials, is made anew: if the front has changed,
    a column of the same name has other parameters.
    """
    campaign = plan_campaign(scenarios, columns, trials=trials, seed=seed, robot=robot)
    results_folder = ResultsFolder(folder)
    if results_folder.trials_path.is_file():
        found = pd.read_parquet(results_folder.trials_path)
        identity = results_folder.read_manifest().get("identity")
        if identity == campaign.identity and len(found) == len(campaign.specs):
            return found
    shutil.rmtree(folder, ignore_errors=True)
    results = run_benchmark(
        scenarios, columns, trials=trials, seed=seed, robot=robot, jobs=jobs, out=folder
    )
    return results.trials


def judge(
    trials: pd.DataFrame, baseline: str, columns: Sequence[str], objectives: Sequence[Objective]
) -> list[Judged]:
    """Compares columns with the baseline, paired by scenario and seed."""
    rows = {
        (str(row["controller"]), str(row["scenario"]), int(row["trial"])): row
        for row in trials.to_dict("records")
    }
    places = [(scenario, trial) for name, scenario, trial in rows if name == baseline]
    base = [rows[baseline, scenario, trial] for scenario, trial in places]
    scales = scales_of(base, objectives)
    confidence = 1.0 - (1.0 - CONFIDENCE) / (len(columns) * len(objectives))
    judged = []
    for name in columns:
        own = [rows[name, scenario, trial] for scenario, trial in places]
        differences = np.array(
            [
                pair_difference(first, second, objectives, scales[str(second["scenario"])])
                for first, second in zip(own, base, strict=True)
            ]
        )
        where = np.array([scenario for scenario, _ in places])
        judged.append(
            Judged(
                name,
                tuple(map(float, differences.mean(axis=0))),
                tuple(mean_interval(column, confidence=confidence) for column in differences.T),
                (_succeeded(own), _succeeded(base)),
                (touches_of(own).total(), touches_of(base).total()),
                len(own),
                excess_failures(own, base),
                {
                    scenario: tuple(map(float, differences[where == scenario].mean(axis=0)))
                    for scenario in dict.fromkeys(where.tolist())
                },
                dict(touches_of(own)),
            )
        )
    return judged


def winner_of(judged: Sequence[Judged]) -> Judged | None:
    """Returns the column that beats the baseline by most on the whole; None where none does."""
    beating = [entry for entry in judged if entry.beats_baseline]
    return min(beating, key=lambda entry: sum(entry.means), default=None)


def _succeeded(rows: Sequence[dict[str, Any]]) -> int:
    return sum(row["outcome"] == "succeeded" for row in rows)
