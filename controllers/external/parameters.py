"""Parameters of the host of an external controller."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from pydantic import Field, JsonValue, field_validator

from drake_navbench.controller import ControllerParameters
from drake_navbench.typed_files.quantities import Duration


class ExternalParameters(ControllerParameters):
    """The client's command, its deadlines and the parameters that it is sent."""

    command: str | tuple[str, ...] = Field(
        description="Program of the client with its arguments: a list, or one text as in a shell."
    )
    deadline_s: Duration = Field(
        5.0,
        gt=0.0,
        description="Wall-clock time that the client has for an answer before it is killed [s].",
    )
    start_deadline_s: Duration = Field(
        30.0,
        gt=0.0,
        description="Wall-clock time from the client's start to its answer to `configure` [s].",
    )
    shows_output: bool = Field(
        False,
        description="Show the client's output in the terminal. Otherwise the last lines go "
        "into the log of a trial in which the client fails.",
    )
    client: dict[str, JsonValue] = Field(
        default_factory=dict,
        description="Parameters that the client is given unchanged in `configure`.",
    )

    @field_validator("command", mode="before")
    @classmethod
    def _check_kind(cls, command: object) -> object:
        if isinstance(command, str):
            return command
        if isinstance(command, list | tuple) and all(isinstance(word, str) for word in command):
            return tuple(command)
        raise ValueError(
            "expected a program with its arguments, a text or a list of texts (of a program named "
            "false: command=\"'false'\")"
        )

    @field_validator("command")
    @classmethod
    def _check_command(cls, command: str | tuple[str, ...]) -> str | tuple[str, ...]:
        if not _words(command):
            raise ValueError("expected a program")
        return command

    @property
    def words(self) -> tuple[str, ...]:
        """The program and its arguments."""
        return _words(self.command)

    def files_read(self) -> Mapping[str, Path]:
        """Returns the words of the command that are files, such as the program."""
        found: dict[str, Path] = {}
        for path in map(Path, self.words):
            if _is_file(path):
                # Two of one name are told apart by where they are.
                name = str(path) if path.name in found else path.name
                found[name] = path.absolute()
        return found


def _words(command: str | tuple[str, ...]) -> tuple[str, ...]:
    # A quote that is not closed is a ValueError, and so an error of the field.
    return tuple(shlex.split(command)) if isinstance(command, str) else command


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
