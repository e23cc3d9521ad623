"""Reads a scenario of very many trials from their rows, and opens few of its logs.

The rows come from the run that drove the trials, or from an earlier report. Logs are opened only
for data that the rows lack: the paths and curves of each controller's first trials, the reason why
a metric has no value, and violations of invariants.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.scenario_analysis import (
    KnownValues,
    LeftOut,
    TrialEntry,
    read_trials,
)
from drake_navbench.analysis.trial_rows import VIOLATIONS, row_columns
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

# The largest number of trials of a scenario for which all logs are opened.
MOST_LOGS_OPENED = 400
# The most logs of a scenario that are drawn: more could not be told apart in a figure.
LOGS_DRAWN = 60
# The most logs that are opened because of broken invariants; one fault may be in every trial.
LOGS_WITH_VIOLATIONS_OPENED = 50


def has_many(paths: Sequence[Path]) -> bool:
    """Returns whether a scenario has so many logs that it is read from the table of trials."""
    return len(paths) > MOST_LOGS_OPENED


def rows_by_path(folder: ResultsFolder, table: pd.DataFrame) -> KnownValues:
    """Returns the rows of a table of trials by the paths of their logs."""
    kept = table[[name for name in row_columns() if name in table]]
    rows = kept.to_dict("records")
    return {folder.log_path(row["scenario"], row["controller"], row["trial"]): row for row in rows}


def logs_drawn(paths: Sequence[Path]) -> list[Path]:
    """Returns the logs of a scenario that are drawn: all, or, of very many, each column's first."""
    if not has_many(paths):
        return list(paths)
    by_controller = _by_controller(paths)
    count = max(1, LOGS_DRAWN // len(by_controller))
    return [path for own in by_controller.values() for path in own[:count]]


def _by_controller(paths: Sequence[Path]) -> dict[Path, list[Path]]:
    by_controller: dict[Path, list[Path]] = {}
    for path in paths:
        by_controller.setdefault(path.parent, []).append(path)
    return by_controller


def read_some_trials(
    paths: Sequence[Path], root: Path, rows: KnownValues
) -> tuple[list[TrialLog], list[TrialEntry], list[LeftOut]]:
    """Returns the same as `read_trials`, except that it returns only the logs that are drawn.

    rows: rows of the logs that are measured already. A log without a row, or one that lacks a
    metric, is opened and measured. Of the logs that are not drawn, only one at a time is in memory.
    """
    names = set(row_columns())
    rows = {path: row for path, row in rows.items() if names <= row.keys()}
    drawn = set(logs_drawn(paths))
    opened = drawn | _unexplained(_by_controller(paths), rows) | _violating(paths, rows)
    logs, entries, left_out = [], [], []
    for path in paths:
        if path in rows and path not in opened:
            entries.append(TrialEntry(dict(rows[path]), {}, path.relative_to(root).as_posix()))
            continue
        one_log, one_entry, refused = read_trials([path], root, rows)
        entries += one_entry
        left_out += refused
        if path in drawn:
            logs += one_log
    return logs, entries, left_out


def _unexplained(by_controller: Mapping[Path, Sequence[Path]], rows: KnownValues) -> set[Path]:
    """Returns, for each controller and metric, the first trial in which the metric has no value."""
    names = [entry.name for entry in all_metrics()]
    found = set()
    for own in by_controller.values():
        sought = set(names)
        for path in own:
            row = rows.get(path, {})
            missing = {name for name in sought if math.isnan(row.get(name, 0.0))}
            if missing:
                found.add(path)
                sought -= missing
    return found


def _violating(paths: Sequence[Path], rows: KnownValues) -> set[Path]:
    violating = [path for path in paths if rows.get(path, {}).get(VIOLATIONS)]
    return set(violating[:LOGS_WITH_VIOLATIONS_OPENED])
