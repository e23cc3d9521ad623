"""The list of trials' parts whose kernels are compiled, so that no run compiles them again."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from drake_navbench.errors import CannotBeWritten
from drake_navbench.processes.cache_folder import brought_folders, kernel_folder
from drake_navbench.processes.kernel_sources import digest_of_all
from drake_navbench.typed_files.output_file import write_text


def compiled_parts() -> set[str]:
    """Returns the parts whose kernels were compiled from the present sources."""
    name = _name()
    return {
        part for folder in (kernel_folder(), *brought_folders()) for part in _read(folder / name)
    }


def note_compiled(parts: Iterable[str]) -> None:
    """Adds parts to the list of those whose kernels are compiled."""
    file = kernel_folder() / _name()
    known = sorted({*_read(file), *parts})
    # If this file cannot be written, neither can compiled kernels.
    with suppress(CannotBeWritten):
        write_text(file, json.dumps(known))


def _name() -> str:
    """Returns the name of the list, in every folder of kernels."""
    return f"parts-{digest_of_all()}.json"


def _read(file: Path) -> set[str]:
    try:
        return set(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return set()
