"""The row of a trial in the tables, made from its log; the columns are defined here alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from drake_navbench.analysis.invariants import Violation, violations_of
from drake_navbench.analysis.metrics.registry import all_metrics, measure_all
from drake_navbench.logs.log import TrialLog

# The columns before the metrics, and the column after them.
IDENTITY = ("suite", "density", "scenario", "controller", "trial", "seed", "outcome", "reason")
VIOLATIONS = "violations"

Row = dict[str, Any]


class MeasuredLog(NamedTuple):
    """A trial's row of the table of trials, with further facts for the report.

    reasons: for each metric without a value, why it has none. violations: the invariants that the
    log breaks.
    """

    row: Row
    reasons: dict[str, str]
    violations: list[Violation]


def row_columns() -> list[str]:
    """Returns the names of a row's columns, in order."""
    return [*IDENTITY, *(entry.name for entry in all_metrics()), VIOLATIONS]


def trial_row(log: TrialLog) -> Row:
    """Returns the row of trials.parquet for a trial: its identity, its outcome, then every metric.

    A metric without a value for this trial is NaN. The last entry is the number of violations of
    `analysis.invariants`, summed over the rows of the log.
    """
    return measured_log(log).row


def measured_log(log: TrialLog, known: Mapping[str, Any] | None = None) -> MeasuredLog:
    """Measures a trial: its row, a reason for each metric without a value, broken invariants.

    Suite and density are '' where the scenario has none.
    known: metrics that were measured before.
    """
    suite = log.info["scenario"].get("suite") or {}
    measured = measure_all(log, known)
    violations = violations_of(log)
    row: Row = {
        "suite": suite.get("name", ""),
        "density": suite.get("density", ""),
        "scenario": log.info["scenario"]["name"],
        "controller": log.info["controller"],
        "trial": log.info["trial"],
        "seed": log.info["seed"],
        "outcome": str(log.outcome),
        "reason": log.info["reason"],
        **{name: measurement.value for name, measurement in measured.items()},
        VIOLATIONS: sum(violation.row_count for violation in violations),
    }
    reasons = {name: found.reason for name, found in measured.items() if found.reason}
    return MeasuredLog(row, reasons, violations)
