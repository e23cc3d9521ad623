"""The list of trials' parts whose kernels are compiled, so that no run compiles them again."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from drake_navbench.processes.cache_folder import installation_digest, kernel_folder
from drake_navbench.processes.kernel_cache import PARTS_NAME


def compiled_parts() -> set[str]:
    """Returns the parts whose kernels were compiled by the numba that is installed."""
    try:
        found = json.loads(_file().read_text(encoding="utf-8"))
        return set(found[version("numba")])
    except (OSError, ValueError, KeyError, TypeError):
        return set()


def note_compiled(parts: Iterable[str]) -> None:
    """Adds parts to the list of those whose kernels are compiled."""
    known = sorted(compiled_parts().union(parts))
    # If this file cannot be written, neither can compiled kernels.
    with suppress(OSError):
        file = _file()
        file.parent.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(f".{os.getpid()}")
        unfinished.write_text(json.dumps({version("numba"): known}), encoding="utf-8")
        unfinished.replace(file)


def _file() -> Path:
    return kernel_folder() / f"{installation_digest()}.{PARTS_NAME}"
