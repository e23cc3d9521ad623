"""The suite of a leaderboard: the trials that every entry drives, with seeds that can be sealed.

The organizer publishes a salted hash of the seeds before the first controller is entered, and salt
and seeds after the last one. So nobody can tune a controller to the seeds, and the organizer cannot
choose the seeds afterwards.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, model_validator

from drake_navbench.errors import CannotBeWritten, InputError
from drake_navbench.typed_files.output_file import write_text, write_whole
from drake_navbench.typed_files.typed_yaml import (
    FrozenModel,
    parse_yaml,
    read_text,
    read_yaml,
    validate,
)
from drake_navbench.typed_files.yaml_loader import dump_yaml

# The largest seed of a run, as `--seed` takes it.
MAX_SEED = 2**64 - 1
MAX_SEEDS = 1000
SALT_BYTES = 32
HEXADECIMAL = r"^[0-9a-f]{64}$"
# Only the organiser may read the file of the secret.
SECRET_MODE = 0o600


class Sealed(FrozenModel):
    """A published commitment to seeds that are still secret: their salted hash and their number."""

    sha256: str = Field(pattern=HEXADECIMAL)
    count: int = Field(ge=1, le=MAX_SEEDS)


class Secret(FrozenModel):
    """The seeds with the salt, without which one could find them by trying."""

    salt: str = Field(pattern=HEXADECIMAL)
    seeds: tuple[int, ...] = Field(min_length=1, max_length=MAX_SEEDS)


class Suite(FrozenModel):
    """The trials that every entry drives: each scenario `trials` times with each seed.

    seeds: as for `run --seed`. While the seeds are secret, `sealed` stands in their place; once
    they are published, `revealed` holds them.
    """

    name: str = Field(min_length=1)
    version: int = Field(ge=1)
    scenarios: tuple[str, ...] = Field(min_length=1)
    trials: int = Field(ge=1)
    robot: str = Field(min_length=1)
    seeds: tuple[int, ...] = Field((), max_length=MAX_SEEDS)
    sealed: Sealed | None = None
    revealed: Secret | None = None

    @model_validator(mode="after")
    def _check(self) -> Suite:
        if self.seeds and self.sealed is not None:
            raise ValueError("seeds: expected none beside sealed ones")
        if self.revealed is not None and self.sealed is None:
            raise ValueError("revealed: nothing was sealed")
        known = self.known_seeds
        if len(set(known)) < len(known):
            raise ValueError("seeds: one is given twice; expected each once")
        if any(not 0 <= seed <= MAX_SEED for seed in known):
            raise ValueError(f"seeds: expected whole numbers from 0 to {MAX_SEED}")
        if len(set(self.scenarios)) < len(self.scenarios):
            raise ValueError("scenarios: one is given twice; expected each once")
        return self

    @property
    def known_seeds(self) -> tuple[int, ...]:
        """The seeds, none as long as they are sealed."""
        return self.seeds if self.revealed is None else self.revealed.seeds

    @property
    def digest(self) -> str:
        """A SHA-256 of everything that an entry depends on, the same before and after `reveal`."""
        content = self.model_dump(mode="json", exclude={"revealed"})
        return _digest(content)

    def hash_of(self, secret: Secret) -> str:
        """Returns the hash that seals salt and seeds for this suite and its version."""
        return _digest({"suite": self.name, "version": self.version, **secret.model_dump()})


def read_suite(path: Path) -> Suite:
    """Returns the suite in a file; raises InputError, also if the seeds are not the sealed ones."""
    suite = validate(Suite, read_yaml(path), str(path))
    if suite.revealed is not None:
        _require_sealed(suite, suite.revealed, str(path))
    return suite


def read_open_suite(path: Path) -> Suite:
    """Returns a suite whose seeds are known; raises InputError."""
    suite = read_suite(path)
    if not suite.known_seeds:
        todo = "reveal them first" if suite.sealed else "expected some, or sealed ones"
        raise InputError(f"{path}: seeds: not known; {todo}")
    return suite


def seal(path: Path, secret_path: Path, *, count: int) -> Sealed:
    """Draws a salt and `count` seeds, keeps them in a new file, and their hash in the suite's file.

    Raises InputError where the suite has seeds already, the file of the secret exists already or
    would lie in the repository of the suite.
    """
    suite = read_suite(path)
    if suite.seeds or suite.sealed is not None:
        raise InputError(f"{path}: seeds: given or sealed already; expected none")
    if secret_path.exists():
        raise InputError(f"--secret {secret_path}: exists already; expected a new file")
    repository = _repository_of(path)
    if repository is not None and secret_path.resolve().is_relative_to(repository):
        raise InputError(
            f"--secret {secret_path}: lies in the repository of the suite, {repository}; "
            "expected a place outside"
        )
    drawn: dict[int, None] = {}
    while len(drawn) < count:
        drawn[secrets.randbelow(MAX_SEED + 1)] = None
    secret = Secret(salt=secrets.token_hex(SALT_BYTES), seeds=tuple(drawn))
    sealed = Sealed(sha256=suite.hash_of(secret), count=count)
    text = _with_section(path, "sealed", sealed.model_dump())

    def write(unfinished: Path) -> None:
        unfinished.touch(mode=SECRET_MODE)
        unfinished.write_text(dump_yaml(secret.model_dump(mode="json")), encoding="utf-8")

    write_whole(secret_path, write)
    try:
        write_text(path, text)
    except CannotBeWritten:
        secret_path.unlink()
        raise
    return sealed


def reveal(path: Path, secret_path: Path | None) -> Suite:
    """Checks salt and seeds against the hash, and writes them into the suite's file.

    secret_path: None: checks the seeds that are revealed already. Raises InputError where the
    hashes differ.
    """
    suite = read_suite(path)
    if suite.sealed is None:
        raise InputError(f"{path}: sealed: missing; nothing to reveal")
    if secret_path is None:
        if suite.revealed is None:
            raise InputError(f"{path}: not revealed yet; expected --secret FILE")
        return suite
    secret = validate(Secret, read_yaml(secret_path), str(secret_path))
    _require_sealed(suite, secret, str(secret_path))
    if suite.revealed is None:
        write_text(path, _with_section(path, "revealed", secret.model_dump(mode="json")))
    return read_suite(path)


def _require_sealed(suite: Suite, secret: Secret, source: str) -> None:
    if suite.sealed is None or suite.hash_of(secret) != suite.sealed.sha256:
        raise InputError(
            f"{source}: salt and seeds are not those that were sealed for {suite.name} "
            f"version {suite.version}: another SHA-256"
        )
    if len(secret.seeds) != suite.sealed.count:
        raise InputError(f"{source}: expected {suite.sealed.count} seeds, got {len(secret.seeds)}")


def _with_section(path: Path, name: str, values: Mapping[str, Any]) -> str:
    """Returns the text of a suite's file with one more section; the rest stays unchanged."""
    section = dump_yaml({name: values}, sort_keys=False)
    text = f"{read_text(path).rstrip()}\n{section}"
    try:
        validate(Suite, parse_yaml(text, str(path)), str(path))
    except InputError as error:
        raise InputError(
            f"{path}: no field can be added; expected each field on its own line, 'name: value'"
        ) from error
    return text


def _repository_of(path: Path) -> Path | None:
    folders = path.resolve().parents
    return next((folder for folder in folders if (folder / ".git").exists()), None)


def _digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
