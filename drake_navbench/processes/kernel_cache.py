"""The folder of compiled kernels, in which each is kept by the content that it was compiled from.

numba alone would go by a kernel's own file: it would miss that a kernel in another file, which this
one calls, has changed, and compile the same anew in every checkout. `KernelPlace` gives it a folder
for each module instead, named by the digest of its sources, so that nothing in it is ever stale. A
wheel may bring such folders.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from types import FunctionType
from typing import Any

from drake_navbench.processes import cache_folder
from drake_navbench.processes.cache_folder import (
    COMPILER_FILE,
    brought_folders,
    kernel_folder,
    provide_cache_folder,
)
from drake_navbench.processes.compiler_shortcuts import take_shortcuts
from drake_navbench.processes.kernel_sources import compiler, digest_of_module

DAY_S = 24 * 3600.0
# Kernels of older sources are removed when nobody has used them for this long, s.
KEPT_S = 30 * DAY_S


def prepare_kernels() -> None:
    """Makes numba keep our kernels, and kernels that call them, by their content, and compile them
    sooner."""
    provide_cache_folder()
    take_shortcuts()
    from numba.core import caching

    # numba asks these in order for the place of each kernel.
    locators: list[Any] = caching.CacheImpl._locator_classes
    if KernelPlace not in locators:
        locators.insert(0, KernelPlace)


def notice_of_wheel() -> str:
    """Returns a line where the kernels in the wheel cannot be used here; '' otherwise."""
    try:
        told = (cache_folder.IN_THE_WHEEL / COMPILER_FILE).read_text(encoding="utf-8").strip()
    except OSError:
        return ""
    if told == compiler():
        return ""
    return f"The wheel's kernels are of {told}; here is {compiler()}: they are compiled anew"


class KernelPlace:
    """The place of one compiled kernel; numba calls this a cache locator."""

    def __init__(self, function: FunctionType, file: str, digest: str) -> None:
        self._py_file = file
        self._line = function.__code__.co_firstlineno
        self._digest = digest
        self._folder = kernel_folder() / f"{function.__module__}-{digest}"

    @classmethod
    def from_function(cls, function: FunctionType, file: str) -> KernelPlace | None:
        """Returns the place of a kernel of ours, or in a module that imports ours; else None.

        Kernels that a wheel brings are copied there when they are first asked for.
        """
        if not os.path.exists(file):
            return None
        digest = digest_of_module(function.__module__, Path(file))
        if digest is None:
            return None
        place = cls(function, file, digest)
        _fetch(place._folder)
        return place

    def get_cache_path(self) -> str:
        """Returns the folder of the kernel."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Returns the digest of the sources."""
        return self._digest

    def get_disambiguator(self) -> str:
        """Returns the line of the kernel, since a name may be given twice."""
        return str(self._line)

    def ensure_cache_path(self) -> None:
        """Makes the folder; numba calls this before it writes into it."""
        if not self._folder.exists():
            self._folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(self._folder)


def _fetch(folder: Path) -> None:
    """Notes the use of a module's kernels; copies them from a wheel where they are missing."""
    try:
        if time.time() - folder.stat().st_mtime > DAY_S:
            os.utime(folder)
        return
    except OSError:
        pass
    for brought in brought_folders():
        if (brought / folder.name).is_dir():
            with suppress(OSError):
                _copy_whole(brought / folder.name, folder)
            return


def _copy_whole(source: Path, target: Path) -> None:
    """Copies a folder so that other processes see all or nothing; of two copies one stays."""
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=target.parent))
    try:
        shutil.copytree(source, unfinished, dirs_exist_ok=True, copy_function=shutil.copyfile)
        unfinished.rename(target)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _remove_unused(folder: Path) -> None:
    """Removes the kernels of a module's older sources that nobody has used for long."""
    module = folder.name.rpartition("-")[0]
    for older in folder.parent.glob(f"{module}-*"):
        with suppress(OSError):
            if time.time() - older.stat().st_mtime > KEPT_S:
                shutil.rmtree(older, ignore_errors=True)
