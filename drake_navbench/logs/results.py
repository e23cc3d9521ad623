"""A results folder: the request of the run, one log a trial, the table of trials.

manifest.json, inputs/, trials/<scenario>/<controller>/trial_000.parquet, trials.parquet, tables/,
replays/, kept/. Every file appears whole or not at all.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict, Field

from drake_navbench.errors import CannotBeWritten, InputError
from drake_navbench.typed_files.input_file import read_input
from drake_navbench.typed_files.output_file import UNFINISHED, write_text, write_whole
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES, FrozenModel, validate

if TYPE_CHECKING:
    import pandas as pd

    from drake_navbench.logs.log import TrialLog

MANIFEST_VERSION = 1
# The longest name: a file system takes 255 bytes, and a replay's name has two such names and a
# suffix.
MAX_NAME_LENGTH = 100


def file_name(name: str) -> str:
    """Returns a column's name as a file name: anything unusual becomes '_', a long one is cut.

    No dot or dash stays in front, so that the file is never hidden, an option or a way out of its
    folder. Names that would collide get a piece of their hash.
    """
    plain = re.sub(r"[^A-Za-z0-9._-]|^[.-]", "_", name)[:MAX_NAME_LENGTH]
    if plain == name and plain:
        return plain
    return f"{plain or '_'}-{hashlib.sha256(name.encode()).hexdigest()[:6]}"


class _RequestFacts(FrozenModel):
    """The parts of a request that the report and the reproduction show."""

    model_config = ConfigDict(extra="allow")

    scenarios: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()
    parameter_files: tuple[str, ...] = ()
    trials: int | None = None
    seed: int | None = None
    robot: str | None = None


class _Origin(FrozenModel):
    """The origin of a scenario or column of a sweep, and its values by field."""

    of: str
    values: dict[str, Any]


class _Manifest(FrozenModel):
    """The fields of a manifest that every reader may rely on."""

    model_config = ConfigDict(extra="allow")

    request: _RequestFacts = _RequestFacts()
    scenarios: tuple[str, ...] = ()
    suites: dict[str, str] = Field(default_factory=dict)
    controllers: tuple[str, ...] = ()
    inputs: dict[str, str] = Field(default_factory=dict)
    stand_ins: tuple[str, ...] = ()
    stand_ins_of_columns: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    nav2_columns: dict[str, dict[str, str]] = Field(default_factory=dict)
    sweep: dict[str, dict[str, _Origin]] = Field(default_factory=dict)
    packages: dict[str, str] = Field(default_factory=dict)
    plugins: dict[str, str] = Field(default_factory=dict)
    killed_once: tuple[str, ...] = ()
    wall_clock_s: float = Field(0.0, ge=0.0)
    identity: str = ""
    drake_navbench: str = ""
    python: str = ""
    platform: str = ""
    created: str = ""


@dataclass(frozen=True)
class ResultsFolder:
    """The paths in a results folder."""

    path: Path

    @property
    def manifest_path(self) -> Path:
        """The file with the request, versions, seeds and hashes of the inputs."""
        return self.path / "manifest.json"

    @property
    def trials_path(self) -> Path:
        """The table with one row a trial."""
        return self.path / "trials.parquet"

    @property
    def kept_path(self) -> Path:
        """The folder of data that reports keep for the next one; it may be deleted any time."""
        return self.path / "kept"

    def log_path(self, scenario: str, controller: str, trial: int) -> Path:
        """Returns the path of a trial's log, which need not exist yet."""
        folder = self.path / "trials" / file_name(scenario) / file_name(controller)
        return folder / f"trial_{trial:03d}.parquet"

    def path_of(self, log: TrialLog) -> Path:
        """Returns the path of a log."""
        return self.log_path(
            log.info["scenario"]["name"], log.info["controller"], log.info["trial"]
        )

    def table_path(self, scenario: str, suffix: str) -> Path:
        """Returns the path of a scenario's table; suffix '.csv' or '.md'."""
        return self.path / "tables" / f"{file_name(scenario)}{suffix}"

    @property
    def replays_path(self) -> Path:
        """The folder of the replays."""
        return self.path / "replays"

    def replay_path(self, scenario: str, controller: str = "") -> Path:
        """Returns the path of a scenario's replay, or of the replay of one controller in it."""
        stem = file_name(scenario) + (f"--{file_name(controller)}" if controller else "")
        return self.replays_path / f"{stem}.html"

    def write_log(self, log: TrialLog, campaign_identity: str | None = None) -> None:
        """Writes a trial's log.

        campaign_identity: identity of the log's campaign. Raises InputError where the folder now
        belongs to another campaign, as when a worker outlives its run.
        """

        def write(unfinished: Path) -> None:
            log.write(unfinished)
            if campaign_identity is not None:
                self._require_campaign(campaign_identity)

        write_whole(self.path_of(log), write)

    def _require_campaign(self, identity: str) -> None:
        if self.read_manifest().get("identity") != identity:
            raise InputError(f"{self.path}: is no longer the folder of this run")

    def write_manifest(self, manifest: Mapping[str, Any]) -> None:
        """Writes the manifest."""
        content = {"manifest_version": MANIFEST_VERSION} | dict(manifest)
        write_text(self.manifest_path, json.dumps(content, indent=2, sort_keys=True) + "\n")

    def read_manifest(self) -> dict[str, Any]:
        """Returns the manifest; raises InputError where the folder is no results folder."""
        try:
            content = read_input(self.manifest_path, max_bytes=MAX_FILE_BYTES)
        except InputError as error:
            raise InputError(f"{self.path}: not a results folder: {error}") from error
        try:
            manifest = json.loads(content)
        except (ValueError, RecursionError) as error:
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
        validate(_Manifest, manifest, str(self.manifest_path))
        return manifest

    def write_trials(self, trials: pd.DataFrame) -> None:
        """Writes the table of trials."""
        write_whole(self.trials_path, lambda path: trials.to_parquet(path, index=False))


@contextmanager
def only_run_in(path: Path) -> Iterator[None]:
    """Locks a results folder against other runs while the block runs; makes it if it is missing.

    The system holds the lock, on the folder itself, and releases it when this process ends, in
    whatever way. Raises InputError where another run holds the lock or a folder inside is a link,
    CannotBeWritten where the folder cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CannotBeWritten(f"{path}: cannot be used: {reason}") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InputError(f"{path}: another run is writing into it; wait for its end") from error
        except OSError:
            # The file system has no locks: only the user can take care.
            pass
        require_own_folders(path)
        yield
    finally:
        os.close(descriptor)


def require_own_folders(path: Path) -> None:
    """Raises InputError where a folder inside a results folder is a link.

    Writing into such a folder would change files somewhere else. The results folder itself may be
    reached by a link.
    """
    waiting = [path]
    while waiting:
        with os.scandir(waiting.pop()) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    waiting.append(Path(entry.path))
                # A link to a file is replaced when the file is written.
                elif entry.is_symlink() and not entry.is_file():
                    raise InputError(
                        f"{entry.path}: is a link to {os.readlink(entry.path)}; "
                        "expected a folder of its own"
                    )


def remove_unfinished(path: Path) -> None:
    """Removes the unfinished files that killed processes have left in a folder and below it."""
    for file in path.rglob(f".*{UNFINISHED}"):
        with suppress(OSError):
            file.unlink()


def require_writable(path: Path) -> None:
    """Raises InputError unless a folder can be made, or written to, at `path`."""
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"--out {path}: exists and is not a folder")
        if path.is_dir() and any(file.suffix != UNFINISHED for file in path.iterdir()):
            raise InputError(
                f"--out {path}: is not empty; name a new folder, or continue with --resume"
            )
        existing = path
        while not existing.exists():
            existing = existing.parent
        if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
            raise InputError(f"--out {path}: {existing} is not a folder that can be written to")
    except (OSError, ValueError) as error:
        # A ValueError comes of a name with a NUL character.
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"--out {path}: cannot be used: {reason}") from error
