"""The header of a log: JSON in the Parquet file's metadata, read without the columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import ConfigDict, Field

from drake_navbench.errors import InputError, as_line
from drake_navbench.logs.outcome import Outcome
from drake_navbench.typed_files.typed_yaml import FrozenModel, validate

SCHEMA_VERSION = 2
METADATA_KEY = b"drake_navbench"


class _HeaderScenario(FrozenModel):
    model_config = ConfigDict(extra="allow")

    name: str
    goal: tuple[float, float, float]


class _Header(FrozenModel):
    """The fields of a log's header that every reader relies on."""

    model_config = ConfigDict(extra="allow")

    scenario: _HeaderScenario
    robot: dict[str, Any]
    controller: str
    trial: int
    seed: int
    outcome: Outcome
    reason: str
    start_time_s: float
    end_time_s: float
    missing: dict[str, str] = Field(default_factory=dict)


def read_info(path: Path) -> dict[str, Any]:
    """Returns a log's header, as `TrialLog.info`; raises InputError where the file has none."""
    return header_of(_footer(path).metadata, path)


def has_samples(path: Path) -> bool:
    """Returns whether a log has at least one sample; reads only the file's header.

    Raises InputError where the file has none.
    """
    footer = _footer(path)
    header_of(footer.metadata, path)
    return bool(footer.num_rows)


def _footer(path: Path) -> pq.FileMetaData:
    """Returns the footer of a Parquet file; raises InputError where it cannot be read."""
    try:
        return pq.read_metadata(path)
    except (OSError, UnicodeDecodeError, pa.ArrowException) as error:
        raise InputError(f"{path}: not a readable trial log: {as_line(str(error))}") from error


def header_of(metadata: Mapping[bytes, bytes] | None, path: Path) -> dict[str, Any]:
    """Returns the header that stands in a file's metadata; raises InputError where it is wrong."""
    content = (metadata or {}).get(METADATA_KEY)
    if content is None:
        raise InputError(f"{path}: a Parquet file, but not a trial log")
    try:
        info = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: a trial log with unreadable metadata: {error}") from error
    if not isinstance(info, dict):
        raise InputError(f"{path}: a trial log with unreadable metadata: expected an object")
    version = info.pop("schema_version", None)
    if version != SCHEMA_VERSION:
        raise InputError(
            f"{path}: schema version {version}, expected {SCHEMA_VERSION}; run the trial again"
        )
    header = {name: info[name] for name in _Header.model_fields if name in info}
    validate(_Header, header, str(path))
    return info
