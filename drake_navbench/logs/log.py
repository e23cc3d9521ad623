"""TrialLog: all that is kept of a trial, and the schema that analysis reads.

One Parquet file a trial. The rows are samples on the recorder's clock; what changes more slowly
(scans, plans, the controller's diagnostics) stands in the row of the first sample that saw it and
is null elsewhere. What does not change (scenario, robot, parameters, outcome) is JSON in the file's
metadata. docs/log_format.md is generated from `COLUMNS`, `PLAN_COLUMNS` and `COSTMAP_COLUMNS`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from drake_navbench.errors import InputError, as_line, one_line, printable
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.costmaps import costmap_columns, read_costmaps
from drake_navbench.logs.header import METADATA_KEY, SCHEMA_VERSION, header_of
from drake_navbench.logs.log_columns import COLUMNS, LATER_COLUMNS, OWN_COLUMNS, own_columns
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.people import LoggedPeople, people_columns, read_people
from drake_navbench.logs.plans import (
    PLAN_COLUMNS,
    PLAN_ENCODINGS,
    Plan,
    first_of_each_leg,
    plan_columns,
    read_plans,
)
from drake_navbench.logs.scans import SCAN_LEAVES, read_scans, scan_columns

# The header's entry with the sliders moved during the trial, each with time, name and value.
LIVE_CHANGES = "live_changes"
# The most characters of a name or reason in the short form of a log.
MAX_SHOWN = 80
# The most bytes of a log, uncompressed; a trial of an hour takes a tenth of it.
MAX_LOG_BYTES = 1_000_000_000


@dataclass(frozen=True, eq=False, repr=False)
class TrialLog:
    """The log of one trial after it ended.

    samples: one row a sample, columns as in `COLUMNS` and, for robots that move sideways,
        `LATERAL_COLUMNS`, for those whose odometry drifts `ODOMETRY_COLUMNS`.
    plans: the global plans in order of time, as `logs.plans.as_logged` keeps them; one
        in the mode follow_path.
    scans: the lidar scans in order. costmaps: the local costmaps in order, where they were kept.
    diagnostics: (time_s, mapping) of every control cycle that left any.
    events: (time_s, mapping) of what the navigator did: `node` and `status` where a node of its
        behaviour tree changed, `plan_id` and `poses` where there was a new plan.
    people: where the people were, None in worlds without any.
    info: scenario, robot, controller, parameters, seed, outcome, reason ... as plain JSON values.
    """

    samples: pd.DataFrame
    plans: tuple[Plan, ...]
    info: Mapping[str, Any]
    scans: tuple[Scan, ...] = ()
    diagnostics: tuple[tuple[float, Mapping[str, Any]], ...] = field(default=())
    events: tuple[tuple[float, Mapping[str, Any]], ...] = field(default=())
    costmaps: tuple[Costmap, ...] = ()
    people: LoggedPeople | None = None

    def __repr__(self) -> str:
        """Returns one line: controller, scenario and seed, the outcome, and the size of the log."""
        told = ", ".join(f"{name}={value}" for name, value in self._in_short().items())
        return f"TrialLog({told})"

    def _repr_html_(self) -> str:
        """Returns the same facts as a small table, for notebooks."""
        rows = "".join(
            f"<tr><th>{name}</th><td>{escape(str(value))}</td></tr>"
            for name, value in self._in_short().items()
        )
        return f"<table>{rows}</table>"

    def _in_short(self) -> dict[str, Any]:
        told = {
            "scenario": self.info["scenario"]["name"],
            "controller": self.info["controller"],
            "trial": self.info["trial"],
            "seed": self.info["seed"],
            "outcome": self.info["outcome"],
            "reason": self.info["reason"],
        }
        return {name: printable(str(value))[:MAX_SHOWN] for name, value in told.items()} | {
            "end_time_s": f"{self.end_time_s:.4g}",
            "samples": len(self.samples),
            "scans": len(self.scans),
            "plans": len(self.plans),
        }

    def metrics(self) -> pd.DataFrame:
        """Returns every installed metric of the trial, with the reason where it has no value."""
        return _analysis().metrics_of(self)

    def plot(self) -> Any:
        """Returns path, velocities, accelerations and energy as a picture for notebooks."""
        return _analysis().plot(self)

    def replay(self, path: Path | str) -> Any:
        """Writes the trial's replay, a page that plays offline; notebooks show it in a frame."""
        return _analysis().replay(self, path)

    @property
    def outcome(self) -> Outcome:
        """The outcome of the trial."""
        return Outcome(self.info["outcome"])

    @property
    def end_time_s(self) -> float:
        """When the trial ended, s."""
        return float(self.info["end_time_s"])

    @property
    def missing(self) -> Mapping[str, str]:
        """The parts of the log that a recording does not have, each with the reason."""
        return self.info.get("missing", {})

    @property
    def is_recording(self) -> bool:
        """Whether the log was made from a recording, not simulated."""
        return "recording" in self.info

    @property
    def first_plans(self) -> tuple[Plan, ...]:
        """The first plan of every leg that has any."""
        return first_of_each_leg(self.plans)

    @property
    def course(self) -> NDArray[np.float64]:
        """(N, 3) the first plans of all legs, joined in order: x m, y m, yaw rad."""
        return np.concatenate([np.empty((0, 3)), *(plan.poses for plan in self.first_plans)])

    @property
    def obstacles(self) -> list[Mapping[str, Any]]:
        """The world's obstacles as shapes of a scenario file; a map's walls are boxes."""
        return self.info.get("obstacles", self.info["scenario"]["world"]["obstacles"])

    def write(self, path: Path) -> None:
        """Writes the Parquet file; equal logs give equal bytes."""
        pq.write_table(
            self._table(),
            path,
            compression="zstd",
            use_dictionary=[*_WITH_DICTIONARY, *self._own_columns],
            column_encoding=dict(PLAN_ENCODINGS),
        )

    @property
    def _own_columns(self) -> list[str]:
        return own_columns(self.samples.columns)

    def _table(self) -> pa.Table:
        times = self.samples["time_s"].to_numpy()
        names = [*COLUMNS, *self._own_columns]
        columns = {name: pa.array(self.samples[name].to_numpy()) for name in names}
        rows = [_first_row_at(times, scan.time_s) for scan in self.scans]
        columns |= scan_columns(self.scans, rows, len(times))
        notes: list[str | None] = [None] * len(times)
        for time_s, diagnostics in self.diagnostics:
            row = _first_row_at(times, time_s)
            notes[row] = as_json({"time_s": time_s} | dict(diagnostics))
        columns["diagnostics"] = pa.array(notes, type=pa.string())
        rows = [_first_row_at(times, plan.time_s) for plan in self.plans]
        columns |= plan_columns(self.plans, rows, len(times))
        rows = [_first_row_at(times, costmap.stamp_s) for costmap in self.costmaps]
        columns |= costmap_columns(self.costmaps, rows, len(times))
        columns |= people_columns(self.people, times)
        header = dict(self.info) | {
            "schema_version": SCHEMA_VERSION,
            "events": [{"time_s": time_s} | dict(event) for time_s, event in self.events],
            "scan_angles_rad": self.scans[0].angles_rad.tolist() if self.scans else [],
        }
        metadata = {METADATA_KEY: json.dumps(header, sort_keys=True).encode()}
        return pa.table(columns).replace_schema_metadata(metadata)

    @classmethod
    def read(cls, path: str | Path) -> TrialLog:
        """Reads a log; raises InputError where the file is no whole log of this schema version."""
        path = Path(path)
        try:
            if not path.is_file():
                reason = (
                    "a folder; expected trials/*/*/trial_*.parquet in it"
                    if path.is_dir()
                    else "no such file"
                )
                raise InputError(f"{path}: not a readable trial log: {reason}")
            size = pq.read_metadata(path)
            uncompressed = sum(
                size.row_group(group).total_byte_size for group in range(size.num_row_groups)
            )
            if uncompressed > MAX_LOG_BYTES:
                raise InputError(f"{path}: not a trial log: {uncompressed / 1e9:.3g} GB of columns")
            table = pq.read_table(path)
        # A column's name in the file may be no text.
        except (OSError, UnicodeDecodeError, pa.ArrowException) as error:
            raise InputError(f"{path}: not a readable trial log: {as_line(str(error))}") from error
        info = header_of(table.schema.metadata, path)
        found = set(table.column_names)
        missing = {*COLUMNS, *PLAN_COLUMNS, "scan", "diagnostics"} - LATER_COLUMNS - found
        for columns in OWN_COLUMNS:
            if found & set(columns):
                missing |= set(columns) - found
        if missing:
            raise InputError(
                f"{path}: a trial log without the columns {', '.join(sorted(missing))}"
            )
        try:
            return cls._of(table, info)
        except (
            pa.ArrowException,
            AttributeError,
            KeyError,
            OverflowError,
            RecursionError,
            TypeError,
            ValueError,
        ) as error:
            raise InputError(f"{path}: a damaged trial log: {one_line(error)}") from error

    @classmethod
    def _of(cls, table: pa.Table, info: dict[str, Any]) -> TrialLog:
        """Returns the log from its table and header; raises any exception if they are invalid."""
        angles = np.array(info.pop("scan_angles_rad"), dtype=float)
        events = info.pop("events", [])
        notes = _read_notes(table["diagnostics"].drop_null().to_pylist())
        own = own_columns(table.column_names)
        present = [name for name in COLUMNS if name in table.column_names]
        samples = table.select([*present, *own]).to_pandas()
        samples = samples.reindex(columns=[*COLUMNS, *own])
        if not all(kind.kind in "if" for kind in samples.dtypes):
            raise TypeError("a column does not hold numbers")
        return cls(
            samples=samples,
            plans=read_plans(table),
            info=info,
            scans=tuple(read_scans(table["scan"].drop_null(), angles)),
            diagnostics=tuple((float(n.pop("time_s")), n) for n in notes),
            events=tuple((float(event.pop("time_s")), event) for event in events),
            costmaps=read_costmaps(table),
            people=read_people(table),
        )


def _analysis() -> Any:
    """Returns the analysis module that makes tables and pictures of a log.

    It is a layer above this module and takes seconds to import, only where it is used.
    """
    return import_module("drake_navbench.analysis.notebook")


# Parquet takes no encoding for columns that may have a dictionary; these may, by leaf.
_WITH_DICTIONARY = [
    *COLUMNS,
    "diagnostics",
    *SCAN_LEAVES,
]


def _read_notes(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Returns the JSON objects of texts; one call for all texts takes a third of the time."""
    notes: list[dict[str, Any]] = json.loads(f"[{','.join(texts)}]")
    if len(notes) != len(texts):
        raise ValueError("diagnostics: expected a JSON object a row")
    return notes


def as_json(values: Mapping[str, Any]) -> str:
    """Returns a controller's diagnostics as JSON text.

    Raises TypeError or ValueError where values are not numbers, text, flags or arrays of them.
    """
    return json.dumps(dict(values), sort_keys=True, default=_as_plain)


def _as_plain(value: Any) -> Any:
    """Turns numpy values, which json does not know, into plain ones."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"a log may hold numbers, text, flags and arrays, got {type(value).__name__}")


def _first_row_at(times: NDArray[np.float64], time_s: float) -> int:
    return min(int(np.searchsorted(times, time_s)), len(times) - 1)
