"""The analysis of one scenario of a results folder: rows, intervals, sentences, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.invariants import Violation
from drake_navbench.analysis.journey import Action, Leg, actions_of, legs_of
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.pairs import ComparedPair, compare_every_pair, values_by_seed
from drake_navbench.analysis.repeats import repeated_cells, repeated_controllers
from drake_navbench.analysis.statistics import (
    Interval,
    Summary,
    success_interval,
    summarize,
)
from drake_navbench.analysis.trial_rows import measured_log
from drake_navbench.analysis.verdicts import (
    MetricVerdict,
    comparable_trials,
    scenario_verdicts,
    touch_counts,
)
from drake_navbench.errors import InputError
from drake_navbench.logs.log import LIVE_CHANGES, TrialLog
from drake_navbench.logs.outcome import Outcome

# The metrics for a first look; the tables have the others.
HEADLINE_METRICS = (
    "time_to_goal_s",
    "driven_length_m",
    "min_clearance_m",
    "cross_track_error_mean_m",
    "heading_error_mean_deg",
    "jerk_rms_mps3",
    "angular_jerk_rms_radps3",
    "gulati_kuipers_discomfort_s",
    "compute_cpu_time_p95_ms",
)


def headline_metrics() -> list[Metric]:
    """Returns the metrics that box plots and ranks show."""
    by_name = {entry.name: entry for entry in all_metrics()}
    return [by_name[name] for name in HEADLINE_METRICS]


# Values that were measured before: path of a log -> metric -> value.
KnownValues = Mapping[Path, Mapping[str, Any]]


class LeftOut(NamedTuple):
    """A file that was not analysed, and why."""

    path: str
    reason: str


class TrialEntry(NamedTuple):
    """A trial that was read: its row, the reasons of undefined metrics, and its log's path.

    legs, actions: for trials with a navigator. violations: violations of the invariants.
    """

    row: dict[str, Any]
    reasons: dict[str, str]
    path: str
    legs: Sequence[Leg] = ()
    actions: Sequence[Action] = ()
    violations: Sequence[Violation] = ()


class Cell(NamedTuple):
    """A metric of a controller over its trials.

    reason: reason of the first trial without a value.
    """

    controller: str
    metric: str
    summary: Summary
    reason: str


class Success(NamedTuple):
    """The number of a controller's trials that reached the goal; Wilson's interval of the share.

    is_one_trial: whether all its trials are equal, so that the interval means nothing. touched: the
    number of trials that ended at a touch.
    """

    controller: str
    succeeded: int
    trials: int
    interval: Interval
    is_one_trial: bool = False
    touched: int = 0


class Pair(NamedTuple):
    """Two controllers compared in one metric, among all pairs in that metric."""

    metric: str
    compared: ComparedPair


@dataclass
class ScenarioAnalysis:
    """The analysis of a scenario, in plain values.

    description: from the scenario's file. is_impossible: whether giving up is the right outcome of
    the task. clean_scenario: the scenario of which this one is a harsher variant, '' for none.
    is_in_totals: whether its suite has so many worlds that the report shows only their totals.
    drawn: the number of trials whose logs are drawn; the others are in the table alone.
    """

    scenario: str
    trials: list[TrialEntry] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    successes: list[Success] = field(default_factory=list)
    cells: list[Cell] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    verdicts: list[MetricVerdict] = field(default_factory=list)
    description: str = ""
    is_impossible: bool = False
    clean_scenario: str = ""
    is_in_totals: bool = False
    drawn: int = 0

    @cached_property
    def table(self) -> pd.DataFrame:
        """The rows of the trials, as in trials.parquet."""
        return pd.DataFrame([entry.row for entry in self.trials])

    @property
    def anyone_arrived(self) -> bool:
        """Whether any trial reached its goal."""
        return any(success.succeeded for success in self.successes)


def read_trials(
    paths: Sequence[Path], root: Path, known: KnownValues
) -> tuple[list[TrialLog], list[TrialEntry], list[LeftOut]]:
    """Reads and measures logs; leaves out, with the reason, those that cannot be read."""
    logs, entries, left_out = [], [], []
    for path in paths:
        name = path.relative_to(root).as_posix()
        try:
            log = TrialLog.read(path)
            require_a_result(log)
            measured = measured_log(log, known.get(path))
            legs, actions = legs_of(log), actions_of(log)
        except InputError as error:
            left_out.append(LeftOut(name, str(error).removeprefix(f"{path}: ")))
            continue
        except (KeyError, ValueError, TypeError) as error:
            # The file has the right version, but its content is damaged or incomplete.
            left_out.append(LeftOut(name, f"damaged log: {type(error).__name__}: {error}"))
            continue
        logs.append(log)
        row, reasons, violations = measured
        entries.append(TrialEntry(row, reasons, name, legs, actions, violations))
    return logs, entries, left_out


def require_a_result(log: TrialLog) -> None:
    """Raises InputError for a log whose parameters were changed while it drove."""
    if changes := log.info.get(LIVE_CHANGES):
        names = ", ".join(dict.fromkeys(str(change["name"]) for change in changes))
        raise InputError(f"driven with --live, where sliders changed {names}: no result")


def analyse(scenario: str, entries: list[TrialEntry], left_out: list[LeftOut]) -> ScenarioAnalysis:
    """Returns the statistics of a scenario's trials."""
    result = ScenarioAnalysis(scenario, entries, left_out)
    if not entries:
        return result
    table = result.table
    controllers = list(dict.fromkeys(table["controller"]))
    repeated = repeated_controllers(repeated_cells(table), scenario)
    touches = touch_counts(table)
    result.successes = [
        _success(table, name, is_one_trial=name in repeated, touched=touches.get(name, 0))
        for name in controllers
    ]
    result.cells = [
        cell for name in controllers for cell in _cells(entries, name, is_repeated=name in repeated)
    ]
    comparable = comparable_trials(table, HEADLINE_METRICS)
    for entry in all_metrics():
        if entry.name in HEADLINE_METRICS:
            result.pairs += _pairs(comparable, scenario, entry, repeated)
    result.verdicts = scenario_verdicts(table, scenario, HEADLINE_METRICS)
    return result


def _success(table: pd.DataFrame, controller: str, *, is_one_trial: bool, touched: int) -> Success:
    outcomes = table.loc[table["controller"] == controller, "outcome"]
    succeeded = int((outcomes == Outcome.SUCCEEDED).sum())
    count = 1 if is_one_trial else len(outcomes)
    interval = success_interval(min(succeeded, count), count)
    return Success(controller, succeeded, len(outcomes), interval, is_one_trial, touched)


def _cells(
    entries: Sequence[TrialEntry], controller: str, *, is_repeated: bool = False
) -> list[Cell]:
    """Returns the summary of every metric of a controller; equal trials count once.

    Compute times count from each trial: they are measured anew and differ.
    """
    own = [entry for entry in entries if entry.row["controller"] == controller]
    cells = []
    for entry in all_metrics():
        counted = own[:1] if is_repeated and entry.is_repeatable else own
        summary = summarize([trial.row[entry.name] for trial in counted])
        reason = next(
            (trial.reasons[entry.name] for trial in own if entry.name in trial.reasons), ""
        )
        cells.append(Cell(controller, entry.name, summary, reason))
    return cells


def _pairs(
    table: pd.DataFrame, scenario: str, entry: Metric, repeated: frozenset[str]
) -> list[Pair]:
    once = repeated if entry.is_repeatable else frozenset()
    values = values_by_seed(table, scenario, entry.name)
    columns = {str(name): values[name] for name in values}
    return [Pair(entry.name, pair) for pair in compare_every_pair(columns, repeated=once)]
