"""Drives the configurations of a front on seeds and in scenarios that the search has not seen."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.contests import Match, contest_of
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.pair_verdict import pair_verdicts
from drake_navbench.analysis.paired_tests import (
    ALARM_RATES,
    Family,
    Finding,
    PairedVerdict,
    fewest_differing,
    judge_pairs,
)
from drake_navbench.campaign.benchmark import run_benchmark
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.studies.tuning.guards import touches_of
from drake_navbench.studies.tuning.objectives import (
    Objective,
    excess_failures,
    pair_difference,
    scales_of,
)


class Judged(NamedTuple):
    """A column against the baseline, on trials that the search has not seen.

    means: relative differences by objective, lower is better. findings: tests of its arrivals,
    touches and objectives, by scenario. text, details: the verdict in words, and a sentence for
    each decided finding. succeeded, touched: numbers of trials, (of the column, of the baseline),
    among the `trials` of each. excess: see `excess_failures`. by_scenario: means by objective.
    touches: trials of the column with a touch, by scenario. errors: the number of its trials that
    ended as an error.
    """

    column: str
    means: tuple[float, ...]
    findings: tuple[Finding, ...]
    text: str
    details: tuple[str, ...]
    succeeded: tuple[int, int]
    touched: tuple[int, int]
    trials: int
    excess: float
    by_scenario: dict[str, tuple[float, ...]]
    touches: dict[str, int]
    errors: int

    @property
    def beats_baseline(self) -> bool:
        """Whether the column is shown better in something, worse in nothing, and has no fault.

        A touch and an error are faults.
        """
        verdicts = {finding.verdict for finding in self.findings if not finding.is_one_trial}
        is_better = PairedVerdict.BETTER in verdicts and PairedVerdict.WORSE not in verdicts
        return is_better and self.excess <= 0.0 and not (self.touches or self.errors)

    def as_data(self) -> dict[str, Any]:
        """Returns the judgement as values for JSON."""
        return {
            "column": self.column,
            "means": list(self.means),
            "verdict": self.text,
            "details": list(self.details),
            "succeeded": list(self.succeeded),
            "touched": list(self.touched),
            "touches": self.touches,
            "trials": self.trials,
            "beats_baseline": self.beats_baseline,
            "by_scenario": {name: list(means) for name, means in self.by_scenario.items()},
        }


def least_pairs(columns: int, places: int, objectives: int) -> int:
    """Returns the least number of pairs in each place with which an objective can be decided.

    So few decide only if all of them differ in one direction. places: scenarios, and suites of
    tasks, in each of which every objective of every column is tested.
    """
    return fewest_differing(ALARM_RATES[Family.LISTED] / (columns * places * objectives))


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
    """Returns the trials of a results folder; drives them first where they are missing.

    The folder of an interrupted run, or of other trials, is made anew: if the front has changed, a
    column of the same name has other parameters.
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


def suites_of(scenarios: Sequence[str | Scenario]) -> dict[str, str]:
    """Returns the suite of each scenario that is in one, by the scenario's name."""
    loaded = [load_scenario(entry) if isinstance(entry, str) else entry for entry in scenarios]
    return {entry.name: entry.suite.name for entry in loaded if entry.suite is not None}


def judge(
    trials: pd.DataFrame,
    baseline: str,
    columns: Sequence[str],
    objectives: Sequence[Objective],
    suites: Mapping[str, str],
) -> list[Judged]:
    """Compares columns with the baseline, paired by scenario and seed.

    suites: by scenario; each task of a suite is one pair. The tests of all columns are corrected
    together, see `paired_tests`: of columns that drive as the baseline does, one beats it in at
    most 4% of all judgements.
    """
    matches = [Match(baseline, name) for name in columns]
    listed = [entry.metric for entry in objectives]
    metrics = [metric for metric in all_metrics() if metric.name in listed]
    contest = contest_of(trials, trials, matches, suites)
    found = judge_pairs([contest], listed=listed, metrics=metrics)
    verdicts = {verdict.name: verdict for verdict in pair_verdicts(found)}
    rows = {
        (str(row["controller"]), str(row["scenario"]), int(row["trial"])): row
        for row in trials.to_dict("records")
    }
    places = [(scenario, trial) for name, scenario, trial in rows if name == baseline]
    base = [rows[baseline, scenario, trial] for scenario, trial in places]
    scales = scales_of(base, objectives)
    where = np.array([scenario for scenario, _ in places])
    judged = []
    for match in matches:
        own = [rows[match.new, scenario, trial] for scenario, trial in places]
        differences = np.array(
            [
                pair_difference(first, second, objectives, scales[str(second["scenario"])])
                for first, second in zip(own, base, strict=True)
            ]
        )
        judged.append(
            Judged(
                match.new,
                tuple(map(float, differences.mean(axis=0))),
                tuple(f for f in found.findings if f.controller == match.name),
                verdicts[match.name].text,
                verdicts[match.name].details,
                (_succeeded(own), _succeeded(base)),
                (touches_of(own).total(), touches_of(base).total()),
                len(own),
                excess_failures(own, base),
                {
                    scenario: tuple(map(float, differences[where == scenario].mean(axis=0)))
                    for scenario in dict.fromkeys(where.tolist())
                },
                dict(touches_of(own)),
                sum(row["outcome"] == Outcome.ERROR for row in own),
            )
        )
    return judged


def winner_of(judged: Sequence[Judged]) -> Judged | None:
    """Returns the column that beats the baseline by most on the whole; None where none does."""
    beating = [entry for entry in judged if entry.beats_baseline]
    return min(beating, key=lambda entry: sum(entry.means), default=None)


def _succeeded(rows: Sequence[dict[str, Any]]) -> int:
    return sum(row["outcome"] == "succeeded" for row in rows)
