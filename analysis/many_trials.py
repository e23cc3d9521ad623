"""Reads a scenario of very many trials from the table of trials, and opens few of its logs.

The rows come from trials.parquet. Logs are opened only for data that the table lacks: the paths and
curves of each controller's first trials, the reason why a metric has no value, and violations of
invariants.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.scenario_analysis import (
    KnownValues,
    LeftOut,
    TrialEntry,
    read_trials,
)
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

# Of one scenario. All logs of fewer are opened, which is quick and tells the most.
MOST_LOGS_OPENED = 400
# Of all controllers of a scenario together: more could not be told apart in a figure.
LOGS_DRAWN = 60
# Of trials that break an invariant; a fault of the robot's model may be in every trial.
LOGS_WITH_VIOLATIONS_OPENED = 50

IDENTITY = ("suite", "density", "scenario", "controller", "trial", "seed", "outcome", "reason")


def has_many(paths: Sequence[Path]) -> bool:
    """Returns whether a scenario has so many logs that it is read from the table of trials."""
    return len(paths) > MOST_LOGS_OPENED


def rows_of_table(folder: ResultsFolder, measured: pd.DataFrame | None) -> KnownValues:
    """Returns the rows of the table of trials by the paths of their logs.

    measured: the table, where it is at hand. Otherwise it is read, and rows of logs that are newer
    than it are left out, as after a run that was interrupted when it had been resumed. Empty where
    there is no table, or it lacks a metric that is installed now.
    """
    if measured is not None:
        return _by_path(folder, measured)
    try:
        table = pd.read_parquet(folder.trials_path)
        written_s = folder.trials_path.stat().st_mtime
    except (OSError, ValueError):
        return {}
    wanted = [*IDENTITY, *(entry.name for entry in all_metrics()), "violations"]
    if not set(wanted) <= set(table.columns):
        return {}
    return {
        path: row
        for path, row in _by_path(folder, table).items()
        if path.is_file() and path.stat().st_mtime <= written_s
    }


def _by_path(folder: ResultsFolder, table: pd.DataFrame) -> dict[Path, Mapping[str, Any]]:
    names = [*IDENTITY, *(entry.name for entry in all_metrics()), "violations"]
    kept = table[[name for name in names if name in table]]
    rows = kept.to_dict("records")
    return {folder.log_path(row["scenario"], row["controller"], row["trial"]): row for row in rows}


def read_some_trials(
    paths: Sequence[Path], root: Path, rows: KnownValues
) -> tuple[list[TrialLog], list[TrialEntry], list[LeftOut]]:
    """Returns the same as `read_trials`, except that it returns only the logs that are drawn.

    rows: as from `rows_of_table`. A log without a row is opened and measured. Of the logs that are
    not drawn, only one at a time is in memory.
    """
    by_controller: dict[Path, list[Path]] = {}
    for path in paths:
        by_controller.setdefault(path.parent, []).append(path)
    count = max(1, LOGS_DRAWN // len(by_controller))
    drawn = {path for own in by_controller.values() for path in own[:count]}
    opened = drawn | _unexplained(by_controller, rows) | _violating(paths, rows)
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
    """Returns, of each controller and metric, the first trial in which it has no value."""
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
    violating = [path for path in paths if rows.get(path, {}).get("violations")]
    return set(violating[:LOGS_WITH_VIOLATIONS_OPENED])
