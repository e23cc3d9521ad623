"""A results folder: what was asked, one log a trial, the table of trials.

manifest.json, inputs/, trials/<scenario>/<controller>/trial_000.parquet, trials.parquet, tables/,
replays/. Every file appears whole or not at all.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from drake_navbench.errors import InputError
from drake_navbench.log import TrialLog

MANIFEST_VERSION = 1
# Of 255 bytes that a file system takes: a replay has two names in one, and a suffix.
MAX_NAME_LENGTH = 100


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Makes a file appear whole or not at all: written under another name, synced, renamed.

    Raises InputError where it cannot be written, as on a full disk.
    """
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(unfinished)
            with unfinished.open("rb") as file:
                os.fsync(file.fileno())
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error}") from error


def write_text(path: Path, text: str) -> None:
    """Writes a text file, whole or not at all."""
    write_whole(path, lambda unfinished: unfinished.write_text(text, encoding="utf-8"))


def file_name(name: str) -> str:
    """Returns a column's name as a file name: anything unusual becomes '_', a long one is cut.

    Names that would collide after that are told apart by a piece of their hash.
    """
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)[:MAX_NAME_LENGTH]
    if plain == name:
        return plain
    return f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:6]}"


@dataclass(frozen=True)
class ResultsFolder:
    """The paths in a results folder."""

    path: Path

    @property
    def manifest_path(self) -> Path:
        """What was asked, with versions, seeds and hashes of the inputs."""
        return self.path / "manifest.json"

    @property
    def trials_path(self) -> Path:
        """The table with one row a trial."""
        return self.path / "trials.parquet"

    def log_path(self, scenario: str, controller: str, trial: int) -> Path:
        """Where the log of a trial is, or will be."""
        folder = self.path / "trials" / file_name(scenario) / file_name(controller)
        return folder / f"trial_{trial:03d}.parquet"

    def table_path(self, scenario: str, suffix: str) -> Path:
        """Where a scenario's table is; suffix '.csv' or '.md'."""
        return self.path / "tables" / f"{file_name(scenario)}{suffix}"

    def replay_path(self, scenario: str, controller: str = "") -> Path:
        """Where the replay of a scenario is, or of one controller in it."""
        stem = file_name(scenario) + (f"--{file_name(controller)}" if controller else "")
        return self.path / "replays" / f"{stem}.html"

    def write_log(self, log: TrialLog) -> None:
        """Writes a trial's log."""
        info = log.info
        path = self.log_path(info["scenario"]["name"], info["controller"], info["trial"])
        write_whole(path, log.write)

    def write_manifest(self, manifest: Mapping[str, Any]) -> None:
        """Writes the manifest."""
        content = {"manifest_version": MANIFEST_VERSION} | dict(manifest)
        write_text(self.manifest_path, json.dumps(content, indent=2, sort_keys=True) + "\n")

    def read_manifest(self) -> dict[str, Any]:
        """Returns the manifest; raises InputError where the folder is no results folder."""
        try:
            manifest = json.loads(self.manifest_path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(
                f"{self.path}: not a results folder: no readable {self.manifest_path.name}"
            ) from error
        except ValueError as error:
            raise InputError(f"{self.manifest_path}: not valid JSON: {error}") from error
        if not isinstance(manifest, dict):
            raise InputError(
                f"{self.manifest_path}: expected a JSON object, got {type(manifest).__name__}"
            )
        version = manifest.pop("manifest_version", None)
        if version != MANIFEST_VERSION:
            raise InputError(
                f"{self.manifest_path}: manifest version {version}, expected {MANIFEST_VERSION}"
            )
        return manifest

    def write_trials(self, trials: pd.DataFrame) -> None:
        """Writes the table of trials."""
        write_whole(self.trials_path, lambda path: trials.to_parquet(path, index=False))


def require_writable(path: Path) -> None:
    """Raises InputError unless a folder can be made, or written to, at `path`."""
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"--out {path}: exists and is not a folder")
        if path.is_dir() and any(path.iterdir()):
            raise InputError(
                f"--out {path}: is not empty; name a new folder, or continue with --resume"
            )
        existing = path
        while not existing.exists():
            existing = existing.parent
        if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
            raise InputError(f"--out {path}: {existing} is not a folder that can be written to")
    except OSError as error:
        raise InputError(f"--out {path}: cannot be used: {error.strerror}") from error
