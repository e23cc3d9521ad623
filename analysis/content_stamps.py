"""Stamps of contents, which tell whether a value that was computed earlier still holds.

A stamp is the SHA-256 digest of everything that a value depends on: the bytes of the logs, the code
that measures and draws, and the releases of the packages that it uses. Times of files say nothing.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from drake_navbench import analysis
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.processes.fingerprint import PACKAGE

OWN_PACKAGE = "drake_navbench"
# Another release of these packages may round, or draw, differently.
PACKAGES = ("matplotlib", "numba", "numpy", "pandas", "scipy")
THREADS = 4


def stamp_of(*parts: Any) -> str:
    """Returns the stamp of values that JSON can hold."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def file_stamp(path: Path) -> str:
    """Returns the stamp of a file's content, '' where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def file_stamps(paths: Iterable[Path]) -> dict[Path, str]:
    """Returns the stamps of files by path."""
    listed = list(paths)
    with ThreadPoolExecutor(THREADS) as pool:
        return dict(zip(listed, pool.map(file_stamp, listed), strict=True))


@cache
def code_stamp() -> str:
    """Returns the stamp of this package's code and of the releases of the packages it uses."""
    folders = [PACKAGE, Path(str(analysis.__file__)).parent]
    return stamp_of([_source_stamp(folder) for folder in folders], _releases())


def metric_stamps(metrics: Iterable[Metric]) -> dict[str, str]:
    """Returns the stamp of each metric's definition by name.

    A metric of another package is defined by all code of that package; a metric of `--metric
    FILE.py:NAME` by the file.
    """
    return {entry.name: _definition_stamp(str(entry.function.__module__)) for entry in metrics}


@cache
def _definition_stamp(module_name: str) -> str:
    package = module_name.partition(".")[0]
    if package == OWN_PACKAGE:
        return code_stamp()
    source = getattr(sys.modules.get(package), "__file__", None)
    if source is None:
        # The name of the module of a metric's file contains the digest of the file's content.
        return stamp_of(code_stamp(), module_name)
    path = Path(source)
    own = _source_stamp(path.parent) if path.name == "__init__.py" else file_stamp(path)
    return stamp_of(code_stamp(), own)


def _source_stamp(folder: Path) -> str:
    files = sorted(folder.rglob("*.py"))
    return stamp_of([(file.relative_to(folder).as_posix(), file_stamp(file)) for file in files])


def _releases() -> list[str]:
    return [f"{name} {metadata.version(name)}" for name in PACKAGES]
