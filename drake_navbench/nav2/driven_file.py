"""The choice among a repository's Nav2 files: one whose controllers exist here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.nav2.controllers import (
    SERVER,
    has_controllers,
    server_columns,
    why_without_column,
)
from drake_navbench.nav2.parameters import nodes_called, read_parameter_file
from drake_navbench.nav2.release import release_of

MAX_TRIED = 8


def driven_file(files: Sequence[Path]) -> tuple[Path, list[str]]:
    """Returns the first file with a controller that exists here, and a line on each before it.

    Where none has one, it is the first, without a line: its own error says why.
    """
    left_out: list[str] = []
    for file in files[:MAX_TRIED]:
        fault = _fault(file)
        if not fault:
            return file, left_out
        left_out.append(f"left out, the next Nav2 file is taken: {fault}")
    return files[0], []


def _fault(file: Path) -> str:
    """Returns why a file's controller server has no controller here; '' for any other file."""
    try:
        sections = read_parameter_file(file).sections
        release = release_of(sections, None).release
        for server in nodes_called(SERVER, sections):
            if not has_controllers(server):
                return f"{file}: its controller_server lists no controller"
            why = why_without_column(server_columns(server, release))
            if why:
                return str(why)
    except InputError:
        return ""
    return ""
