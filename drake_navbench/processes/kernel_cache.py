"""Compiled kernels that no longer belong to the code are forgotten.

numba compiles a kernel anew where its own file has changed, but not where a kernel that it calls
has, in another file: after an update it would go on with the old one without a word. And where a
type that a kernel takes has moved to another module, what numba kept cannot be read any more.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from drake_navbench.processes.cache_folder import (
    installation_digest,
    kernel_folder,
    provide_cache_folder,
)

# Set for the processes that this one starts: they need not look again.
CHECKED_VARIABLE = "DRAKE_NAVBENCH_KERNELS_CHECKED"
TABLE_NAME = "kernel_sources.json"
NOTE_NAME = "installation.txt"
# The file with the parts whose kernels are compiled, see compiled_parts.py.
PARTS_NAME = "compiled_parts.json"
IMPORT = re.compile(
    r"^\s*(?:from|import)\s+([\w.]+)(?:\s+import\s+(\([^)]*\)|[^\n]*))?", re.MULTILINE
)
NAME = re.compile(r"\w+")

# The time of a file's last change, ns, and its size, bytes.
Stamp = list[int]


def prepare_kernels() -> None:
    """Makes the folder of our compiled kernels ready: it is known, and nothing in it is stale."""
    provide_cache_folder()
    forget_stale_kernels(packages_with_kernels())


def packages_with_kernels() -> dict[str, Path]:
    """Returns the folders of our packages that hold kernels."""
    folders = {"drake_navbench": Path(__file__).parents[1]}
    # Installed for development it lies beside the package, else within it.
    controllers = find_spec("drake_navbench.controllers")
    if controllers is not None and controllers.origin is not None:
        folders["drake_navbench.controllers"] = Path(controllers.origin).parent
    return folders


def forget_stale_kernels(packages: Mapping[str, Path]) -> list[str]:
    """Removes compiled kernels of modules that have changed, or that import one that has.

    packages: folders by the names of the packages in them. Returns the names of these modules.
    Where the folder of the kernels cannot be written, nothing is kept there, and nothing is done.
    """
    installation = str(next(iter(packages.values())))
    # A process of another installation that this one starts has to look for itself.
    if os.environ.get(CHECKED_VARIABLE) == installation:
        return []
    os.environ[CHECKED_VARIABLE] = installation
    cache = kernel_folder()
    table = cache / f"{installation_digest()}.{TABLE_NAME}"
    modules = dict(_modules(packages))
    now = {name: _stamp(path) for name, path in modules.items()}
    before = _read(table)
    if now == before:
        return []
    if before is None:
        stale = set(modules)
    else:
        changed = {name for name in now.keys() | before.keys() if now.get(name) != before.get(name)}
        stale = _with_importers(changed, modules)
    try:
        cache.mkdir(parents=True, exist_ok=True)
        if _forget([modules[name] for name in stale & modules.keys()], cache):
            (cache / f"{installation_digest()}.{PARTS_NAME}").unlink(missing_ok=True)
        if before is None:
            _begin_folder(cache, installation)
        _write(table, now)
    except OSError:
        return []
    return sorted(stale)


def _modules(packages: Mapping[str, Path]) -> Iterator[tuple[str, Path]]:
    for package, folder in packages.items():
        for root, folders, files in os.walk(folder):
            folders[:] = [name for name in folders if not name.startswith((".", "__"))]
            inside = [package, *Path(root).relative_to(folder).parts]
            for file in files:
                if file.endswith(".py"):
                    stem = file.removesuffix(".py")
                    parts = inside if stem == "__init__" else [*inside, stem]
                    yield ".".join(parts), Path(root, file)


def _stamp(path: Path) -> Stamp:
    found = path.stat()
    return [found.st_mtime_ns, found.st_size]


def _with_importers(changed: Iterable[str], modules: Mapping[str, Path]) -> set[str]:
    """Returns the changed modules and all modules that import one of them, directly or not."""
    importers: dict[str, set[str]] = {}
    for name, path in modules.items():
        for imported in _imports(path):
            importers.setdefault(imported, set()).add(name)
    found: set[str] = set()
    waiting = list(changed)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += importers.get(name, ())
    return found


def _imports(path: Path) -> Iterator[str]:
    """Yields the dotted names that a module imports: modules, and names that may be modules."""
    for module, names in IMPORT.findall(path.read_text(encoding="utf-8", errors="replace")):
        yield module
        for name in NAME.findall(names):
            yield f"{module}.{name}"


def _forget(sources: Iterable[Path], cache: Path) -> int:
    """Removes the compiled kernels of modules; returns how many files there were.

    numba keeps the kernels of FOLDER/module.py in FOLDER_<digest of the path>/module.<kernel>.nbi.
    Kernels of another program's module with the same name and folder are removed, too, and will be
    compiled again.
    """
    names = {(source.parent.name, source.stem) for source in sources}
    found = [
        path
        for path in cache.glob("*/*.nb[ic]")
        if (path.parent.name.rpartition("_")[0], path.name.partition(".")[0]) in names
    ]
    for path in found:
        # Another process may do the same.
        with suppress(FileNotFoundError):
            path.unlink()
    return len(found)


def _begin_folder(cache: Path, installation: str) -> None:
    """Notes whose kernels a new folder holds; removes the folders of installations that are gone.

    A folder that the user has named is left alone.
    """
    if cache.name != installation_digest():
        return
    for note in cache.parent.glob(f"*/{NOTE_NAME}"):
        with suppress(OSError, ValueError):
            if not Path(note.read_text(encoding="utf-8")).exists():
                shutil.rmtree(note.parent, ignore_errors=True)
    (cache / NOTE_NAME).write_text(installation, encoding="utf-8")


def _read(table: Path) -> dict[str, Stamp] | None:
    try:
        found = json.loads(table.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def _write(table: Path, stamps: Mapping[str, Stamp]) -> None:
    unfinished = table.with_suffix(f".{os.getpid()}")
    unfinished.write_text(json.dumps(stamps), encoding="utf-8")
    unfinished.replace(table)
