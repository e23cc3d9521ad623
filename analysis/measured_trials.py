"""kept/measured.parquet: the measurements of each log, for the next report.

One row for each log: the log's stamp, its row of the table of trials, and as JSON what the table
lacks (reasons, legs, actions, violations). The metrics' stamps are in the file's metadata. A row is
valid for a log of the same stamp, a column for a metric of the same stamp; others are ignored.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from drake_navbench.analysis.content_stamps import code_stamp, metric_stamps
from drake_navbench.analysis.invariants import Violation
from drake_navbench.analysis.journey import Action, Leg
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.scenario_analysis import KnownValues, TrialEntry
from drake_navbench.analysis.trial_rows import IDENTITY, VIOLATIONS
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.typed_files.output_file import write_whole

METADATA_KEY = b"drake_navbench_stamps"
PATH, STAMP, DETAILS = "log", "log_sha256", "told"
NUMBERS = ("trial", "seed", VIOLATIONS)
WORDS = tuple(name for name in IDENTITY if name not in NUMBERS)


class MeasuredTrials(NamedTuple):
    """Measurements of earlier reports that still hold.

    entries: the entries of logs of which everything is known. values: the metrics, still valid, of
    all known logs.
    """

    entries: Mapping[Path, TrialEntry]
    values: KnownValues


NOTHING_MEASURED = MeasuredTrials({}, {})


def read_measured(root: Path, stamps: Mapping[Path, str]) -> MeasuredTrials:
    """Returns the measurements of these logs that were kept in a results folder.

    stamps: stamps of the logs by path. The result is empty if the file is missing or damaged, or if
    the code has changed.
    """
    try:
        return _read(root, stamps)
    except (
        *(OSError, AttributeError, KeyError, TypeError, ValueError, RecursionError),
        pa.ArrowException,
    ):
        return NOTHING_MEASURED


def _read(root: Path, stamps: Mapping[Path, str]) -> MeasuredTrials:
    table = pq.read_table(_path(root))
    written = json.loads((table.schema.metadata or {})[METADATA_KEY])
    if written["code"] != code_stamp():
        return NOTHING_MEASURED
    wanted = metric_stamps(all_metrics())
    held = [name for name, stamp in wanted.items() if written["metrics"].get(name) == stamp]
    for names, is_right in (
        ((*WORDS, PATH, STAMP, DETAILS), pa.types.is_string),
        (NUMBERS, pa.types.is_integer),
        (held, pa.types.is_float64),
    ):
        if not all(is_right(table.schema.field(name).type) for name in names):
            return NOTHING_MEASURED
    names = [*IDENTITY, *held, VIOLATIONS]
    columns = [table[name].to_pylist() for name in (PATH, STAMP, DETAILS, *names)]
    entries, values = {}, {}
    for place, stamp, told, *row in zip(*columns, strict=True):
        path = root / place
        if stamp and stamps.get(path) == stamp:
            values[path] = dict(zip(names, row, strict=True))
            if len(held) == len(wanted):
                entries[path] = _entry(values[path], place, json.loads(told))
    return MeasuredTrials(entries, values)


def _entry(row: dict[str, Any], place: str, told: Mapping[str, Any]) -> TrialEntry:
    return TrialEntry(
        row,
        {str(name): str(reason) for name, reason in told["reasons"].items()},
        place,
        [Leg(tuple(goal), *rest) for goal, *rest in told["legs"]],
        [Action(*action) for action in told["actions"]],
        [Violation(*violation) for violation in told["violations"]],
    )


def write_measured(root: Path, entries: Sequence[TrialEntry], stamps: Mapping[Path, str]) -> None:
    """Keeps the measurements of trials; stamps: of their logs, from before the logs were read."""
    metrics = all_metrics()
    names = [entry.name for entry in metrics]
    columns: dict[str, pa.Array] = {
        PATH: pa.array([entry.path for entry in entries], pa.string()),
        STAMP: pa.array([stamps.get(root / entry.path, "") for entry in entries], pa.string()),
        DETAILS: pa.array(map(_details, entries), pa.string()),
    }
    for kind, chosen in ((pa.string(), WORDS), (pa.int64(), NUMBERS), (pa.float64(), names)):
        for name in chosen:
            columns[name] = pa.array([entry.row[name] for entry in entries], kind)
    header = {"code": code_stamp(), "metrics": metric_stamps(metrics)}
    table = pa.table(columns).replace_schema_metadata({METADATA_KEY: json.dumps(header)})
    write_whole(_path(root), lambda path: pq.write_table(table, path, compression="zstd"))


def _details(entry: TrialEntry) -> str:
    told = {
        "reasons": entry.reasons,
        "legs": entry.legs,
        "actions": entry.actions,
        "violations": entry.violations,
    }
    return json.dumps(told)


def _path(root: Path) -> Path:
    return ResultsFolder(root).kept_path / "measured.parquet"
