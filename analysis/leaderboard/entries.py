"""Entries of a leaderboard: results folders, checked against the suite.

The file `leaderboard.json` in a folder names the suite, and its version, for which the folder was
entered.
"""

from __future__ import annotations

import hashlib
import json
import re
import stat
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from pydantic import ConfigDict, Field

from drake_navbench.analysis.leaderboard.ranking import RUN_SEED
from drake_navbench.analysis.leaderboard.suite import Suite
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.errors import InputError, one_line
from drake_navbench.logs.header import has_samples
from drake_navbench.logs.results import ResultsFolder, file_name
from drake_navbench.typed_files.input_file import file_digest
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import (
    MAX_FILE_BYTES,
    FrozenModel,
    parse_yaml,
    read_text,
    read_yaml,
    validate,
)

STAMP_NAME = "leaderboard.json"
# From the run's seed, the scenario and the trial's number to the trial's seed.
SeedOf = Callable[[int, str, int], int]
SHOWN_DIGEST = 12
# A file's name, or folder/file, in which the folder's and file's names are from `file_name`; as in
# `campaign.manifest`.
INPUT_NAME = re.compile(r"([A-Za-z0-9_][A-Za-z0-9._-]*/)?[A-Za-z0-9_][A-Za-z0-9._-]*")


class _Stamp(FrozenModel):
    suite: str
    version: int = Field(ge=1)
    digest: str


class CardPreset(FrozenModel):
    """The resolved preset, as far as a controller's card shows it."""

    model_config = ConfigDict(extra="ignore")

    controller: str
    description: str
    parameters: dict[str, Any]


class TrialName(NamedTuple):
    """A trial of a results folder."""

    scenario: str
    controller: str
    trial: int


@dataclass(frozen=True)
class Entry:
    """A complete results folder for one of the suite's seeds.

    trials: its table, with a column for the run's seed. failed: the trials that did not reach their
    goal.
    """

    folder: ResultsFolder
    manifest: Mapping[str, Any]
    seed: int
    trials: pd.DataFrame
    failed: tuple[TrialName, ...] = field(default=())

    @property
    def controllers(self) -> list[str]:
        """The columns of the folder."""
        return list(self.manifest["controllers"])

    @property
    def software(self) -> str:
        """The software that drove the entry, in words."""
        packages = self.manifest.get("packages", {}) | self.manifest.get("plugins", {})
        told = [
            f"drake_navbench {self.manifest.get('drake_navbench', 'unknown')}",
            f"Python {self.manifest.get('python', 'unknown')}",
            *(f"{name} {version}" for name, version in packages.items()),
            self.manifest.get("platform", "unknown platform"),
        ]
        # The workers of a cluster also report a digest of their code.
        software = [machine.get("software", {}) for machine in self.machines("cluster")]
        told += dict.fromkeys(f"code {found['code']}" for found in software if "code" in found)
        return ", ".join(told)

    def machines(self, key: str) -> list[Mapping[str, Any]]:
        """Returns the machines that the manifest names under 'machines' or 'cluster'."""
        return [entry for entry in self.manifest.get(key, ()) if isinstance(entry, Mapping)]

    @property
    def fingerprint(self) -> str:
        """A short digest of `software`: entries of the same software have the same fingerprint."""
        return hashlib.sha256(self.software.encode()).hexdigest()[:SHOWN_DIGEST]

    def digest(self, controller: str) -> str:
        """Returns the SHA-256 of a controller's resolved parameters and of the files it reads."""
        stem = f"controllers/{file_name(controller)}"
        hashes = self.manifest["inputs"]
        parts = [hashes[f"{stem}.yaml"], hashes.get(f"{stem}.files.yaml", "")]
        return hashlib.sha256("".join(parts).encode()).hexdigest() if parts[1] else str(parts[0])

    def preset(self, controller: str) -> CardPreset:
        """Returns the resolved preset; raises InputError where its file is not a valid preset."""
        path = self.folder.path / "inputs/controllers" / f"{file_name(controller)}.yaml"
        return validate(CardPreset, read_yaml(path), str(path))

    def shown(self, scenario: str, controller: str) -> TrialName | None:
        """Returns the first trial of a controller in a scenario that a replay can show."""
        count = int(self.trials["trial"].max()) + 1
        trials = (TrialName(scenario, controller, trial) for trial in range(count))
        return next(filter(self.can_be_shown, trials), None)

    def can_be_shown(self, trial: TrialName) -> bool:
        """Whether the log of a trial has at least one sample."""
        return has_samples(self.folder.log_path(*trial))


def enter(path: Path, suite: Suite, *, seed_of: SeedOf) -> None:
    """Checks a results folder and enters it for the suite.

    Raises InputError, before anything is written, where the folder cannot be entered for the suite.
    """
    _require_regular_files(path)
    _checked(path, suite, seed_of)
    stamp = _Stamp(suite=suite.name, version=suite.version, digest=suite.digest)
    write_text(path / STAMP_NAME, json.dumps(stamp.model_dump(), indent=2) + "\n")


def read_entries(paths: Sequence[Path], suite: Suite, *, seed_of: SeedOf) -> list[Entry]:
    """Returns the entries in results folders, all checked; raises InputError.

    A folder is refused if it was entered for another suite or version, has other seeds, scenarios,
    trials or another robot, is not finished, contains a link, or was driven with other inputs than
    the rest.
    """
    entries = []
    for path in paths:
        _require_regular_files(path)
        _require_stamp(path, suite)
        entries.append(_checked(path, suite, seed_of))
    _require_equal_inputs(entries)
    _require_every_seed(entries, suite)
    return entries


def _require_regular_files(path: Path) -> None:
    """Raises InputError where a folder holds anything but folders and regular files.

    An entry comes from somebody else: a link in it could name any file on the reader's machine.
    """
    for place in path.rglob("*"):
        mode = place.lstat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            kind = "a link" if stat.S_ISLNK(mode) else "no regular file"
            raise InputError(f"{place}: is {kind}; an entry has regular files only")


def _require_stamp(path: Path, suite: Suite) -> None:
    place = path / STAMP_NAME
    if not place.is_file():
        raise InputError(f"{path}: not entered; expected `leaderboard enter {path}` first")
    try:
        stamp = validate(_Stamp, parse_yaml(read_text(place), str(place)), str(place))
    except InputError as error:
        raise InputError(f"{place}: not what `leaderboard enter` writes; enter it again") from error
    if (stamp.suite, stamp.version) != (suite.name, suite.version):
        raise InputError(
            f"{path}: entered for {stamp.suite} version {stamp.version}, "
            f"expected {suite.name} version {suite.version}"
        )
    if stamp.digest != suite.digest:
        raise InputError(
            f"{path}: entered for another text of {suite.name} version {suite.version}; a suite "
            "that changes needs a new version"
        )


def _checked(path: Path, suite: Suite, seed_of: SeedOf) -> Entry:
    folder = ResultsFolder(path)
    manifest = folder.read_manifest()
    request = manifest.get("request")
    if not request:
        raise InputError(f"{folder.manifest_path}: request: missing; expected a run of a shell")
    _require(path, "seed", request.get("seed"), suite.known_seeds)
    _require(path, "trials", request.get("trials"), (suite.trials,))
    # The robot's file may lie anywhere; its hash shows that all entries have the same file.
    _require(path, "robot", Path(str(request.get("robot"))).name, (Path(suite.robot).name,))
    if request.get("nav2_files"):
        raise InputError(
            f"{path}: nav2_files: driven with --nav2, which changes the robot; expected --params"
        )
    driven = manifest.get("scenarios", [])
    if not manifest.get("controllers"):
        raise InputError(f"{folder.manifest_path}: controllers: missing, but required")
    if set(driven) != set(suite.scenarios):
        raise InputError(
            f"{path}: scenarios: expected {', '.join(suite.scenarios)}; got {', '.join(driven)}"
        )
    _require_own_inputs(path, manifest)
    trials = _finished_trials(folder, manifest, suite)
    seed = int(request["seed"])
    paired_with = {name: _paired_with(path, name) for name in suite.scenarios}
    for row in trials.itertuples():
        expected = seed_of(seed, paired_with[str(row.scenario)], int(row.trial))
        if int(row.seed) != expected:
            name = TrialName(str(row.scenario), str(row.controller), int(row.trial))
            raise InputError(
                f"{path}: seed of {_trial_text(name)}: got {row.seed}, expected {expected}, which "
                f"follows from the suite's seed {seed}"
            )
    rows = trials[is_failed(trials)].itertuples()
    failed = [TrialName(str(r.scenario), str(r.controller), int(r.trial)) for r in rows]
    return Entry(folder, manifest, seed, trials.assign(**{RUN_SEED: str(seed)}), tuple(failed))


def _require(path: Path, name: str, value: object, expected: Sequence[object]) -> None:
    if value not in expected:
        shown = " or ".join(map(str, expected))
        raise InputError(f"{path}: {name}: expected the suite's {shown}, got {value}")


def _require_own_inputs(path: Path, manifest: Mapping[str, Any]) -> None:
    """Raises InputError where an input differs from its hash in the manifest, or is missing."""
    hashes = manifest.get("inputs", {})
    needed = [f"controllers/{file_name(name)}.yaml" for name in manifest.get("controllers", [])]
    for part in ("scenarios", "robots"):
        needed += [f"{part}/{file_name(name)}.yaml" for name in manifest["scenarios"]]
    for name in dict.fromkeys([*needed, *hashes]):
        if not INPUT_NAME.fullmatch(name):
            raise InputError(
                f"{path}: manifest.json: inputs: {name!r}: expected the name of a file in inputs/"
            )
        place = path / "inputs" / name
        if file_digest(place, max_bytes=MAX_FILE_BYTES) != hashes.get(name):
            raise InputError(f"{place}: is not what was driven; manifest.json has another SHA-256")


def _finished_trials(
    folder: ResultsFolder, manifest: Mapping[str, Any], suite: Suite
) -> pd.DataFrame:
    """Returns the rows of all trials of a folder; raises InputError where one is missing."""
    wanted = [
        TrialName(scenario, controller, trial)
        for scenario in suite.scenarios
        for controller in manifest.get("controllers", [])
        for trial in range(suite.trials)
    ]
    unfinished = "not finished; expected `run --resume` first"
    for name in wanted:
        if not folder.log_path(*name).is_file():
            raise InputError(f"{folder.path}: no log of {_trial_text(name)}: {unfinished}")
    if not folder.trials_path.is_file():
        raise InputError(f"{folder.path}: no trials.parquet: {unfinished}")
    try:
        kinds = {"seed": "int64", "trial": "int64", "time_to_goal_s": "float64"}
        trials = pd.read_parquet(folder.trials_path).astype(kinds)
        rows = trials.set_index(list(TrialName._fields)).sort_index()
        is_whole = rows.index.is_unique and set(rows.index) == set(wanted)
        _ = trials[["outcome", "reason"]]
    except (OSError, TypeError, ValueError, KeyError) as error:
        raise InputError(f"{folder.trials_path}: cannot be read: {one_line(error)}") from error
    if not is_whole:
        raise InputError(f"{folder.trials_path}: does not have every trial once: {unfinished}")
    return trials


def _paired_with(path: Path, scenario: str) -> str:
    """Returns the scenario that gives the seeds: the clean one of a harsher one, else itself."""
    resolved = read_yaml(path / "inputs/scenarios" / f"{file_name(scenario)}.yaml")
    return str(resolved.get("clean_scenario") or scenario)


def _require_equal_inputs(entries: Sequence[Entry]) -> None:
    """Raises InputError where two entries of one name were not driven with the same inputs."""
    known: dict[str, tuple[str, Entry]] = {}
    for entry in entries:
        for name, digest in entry.manifest["inputs"].items():
            other, first = known.setdefault(name, (digest, entry))
            if other != digest:
                raise InputError(
                    f"{entry.folder.path}: inputs/{name}: expected the file that "
                    f"{first.folder.path} has; they differ"
                )


def _require_every_seed(entries: Sequence[Entry], suite: Suite) -> None:
    """Raises InputError where a controller lacks a seed of the suite, or has one twice."""
    driven: dict[str, dict[int, Entry]] = {}
    for entry in entries:
        for controller in entry.controllers:
            by_seed = driven.setdefault(controller, {})
            if entry.seed in by_seed:
                raise InputError(
                    f"{entry.folder.path}: {controller} with seed {entry.seed} is in "
                    f"{by_seed[entry.seed].folder.path} already"
                )
            by_seed[entry.seed] = entry
    for controller, by_seed in driven.items():
        lacking = [str(seed) for seed in suite.known_seeds if seed not in by_seed]
        if lacking:
            path = next(iter(by_seed.values())).folder.path
            raise InputError(
                f"{path}: {controller} lacks the suite's seed {', '.join(lacking)}; expected a "
                "results folder for each"
            )


def _trial_text(trial: TrialName) -> str:
    return f"{trial.scenario}, {trial.controller}, trial {trial.trial}"
