"""The sources of a kernel: its module and every module that this one imports, by content.

A digest of them names the folder in which the kernel is kept once it is compiled. So a kernel is
compiled anew if anything has changed that it may call, and is found in every checkout or wheel
without a change: neither paths nor times matter. A kernel of a controller may take tuples of any
module of this controller, imported or not: all of these with kernels or tuples are its sources.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from drake_navbench.processes.instruction_set import instruction_set

PACKAGE = "drake_navbench"
CONTROLLERS = f"{PACKAGE}.controllers"
# Packages that lie beside the package in a development installation, else within it.
APART = (CONTROLLERS, "drake_navbench.analysis")
DIGEST_LENGTH = 16
IMPORT_WORDS = r"(?:from|import)[ \t]+([\w.]+)(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?"
# For a module without kernels only its top-level imports count: no kernel reaches those in
# functions.
IMPORT_AT_MARGIN = re.compile(rf"^{IMPORT_WORDS}", re.MULTILINE)
# For a module with kernels all its imports count: one for types may define an argument's fields.
ANY_IMPORT = re.compile(rf"^[ \t]*{IMPORT_WORDS}", re.MULTILINE)
NAME = re.compile(r"\w+")
# The decorators of kernels: those that Python calls, and those that only kernels call.
KERNEL_MARKS = (b"njit(", b"register_jitable")
TUPLE_MARK = b"(NamedTuple)"

# The folders of packages, by the packages' names.
Folders = Mapping[str, Path]


@cache
def packages_with_kernels() -> Folders:
    """Returns the folders of our packages that hold kernels, by their names."""
    folders = {PACKAGE: Path(__file__).parents[1]}
    for name in APART:
        found = find_spec(name)
        if found is not None and found.origin is not None:
            folders[name] = Path(found.origin).parent
    return folders


@cache
def digest_of_module(module: str, file: Path) -> str | None:
    """Returns the digest of a module, of all that it imports from us or its own package, and of
    the compiler. None where none of these files is ours.
    """
    folders = {**_own_package(module, file), **packages_with_kernels()}
    sources = _closure(module, file, folders) | _beside(module)
    if not any(name.partition(".")[0] == PACKAGE for name in sources):
        return None
    digest = hashlib.sha256(compiler().encode())
    for name in sorted(sources):
        digest.update(f"\n{name}\n".encode() + _read(sources[name]))
    return digest.hexdigest()[:DIGEST_LENGTH]


def digest_of_all() -> str:
    """Returns a digest of all our modules with kernels, and of the compiler."""
    digest = hashlib.sha256(compiler().encode())
    for name, file in modules_with_kernels():
        digest.update(f"{name} {digest_of_module(name, file)}\n".encode())
    return digest.hexdigest()[:DIGEST_LENGTH]


def modules_with_kernels() -> list[tuple[str, Path]]:
    """Returns our modules in which kernels are defined: names and files, sorted."""
    modules = {name: file for name, file in _modules(packages_with_kernels())}
    return sorted((name, file) for name, file in modules.items() if _has_kernels(_read(file)))


def compiler() -> str:
    """Returns the versions of the compiler, and the instruction set, in a line."""
    import llvmlite
    import numba

    python = ".".join(map(str, sys.version_info[:2]))
    return (
        f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, Python {python}, "
        f"{instruction_set()}"
    )


def _beside(module: str) -> dict[str, Path]:
    """Returns the files of a kernel's controller that have kernels or tuples, by their modules."""
    name, _, rest = module.removeprefix(f"{CONTROLLERS}.").partition(".")
    return _with_tuples(name) if rest and module.startswith(CONTROLLERS) else {}


@cache
def _with_tuples(controller: str) -> dict[str, Path]:
    folder = packages_with_kernels()[CONTROLLERS] / controller
    return {
        name: file
        for name, file in _modules({f"{CONTROLLERS}.{controller}": folder})
        if _has_kernels(_read(file)) or TUPLE_MARK in _read(file)
    }


def _own_package(module: str, file: Path) -> dict[str, Path]:
    """Returns the folder of a module's top package; nothing for a module without one."""
    depth = module.count(".") + (file.name == "__init__.py")
    return {module.partition(".")[0]: file.parents[depth - 1]} if depth else {}


def _modules(folders: Folders) -> Iterator[tuple[str, Path]]:
    for package, folder in folders.items():
        for file in folder.rglob("*.py"):
            parts = file.relative_to(folder).with_suffix("").parts
            yield ".".join((package, *(part for part in parts if part != "__init__"))), file


def _closure(module: str, file: Path, folders: Folders) -> dict[str, Path]:
    """Returns a module and all modules that it imports, directly or not: files by names."""
    found = {module: file}
    waiting = list(_imports(file))
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        imported = _file_of(name, folders)
        if imported is not None:
            found[name] = imported
            waiting += _imports(imported)
    return found


def _file_of(module: str, folders: Folders) -> Path | None:
    """Returns the file of a module, None where it is in none of the packages."""
    package = module
    while package and package not in folders:
        package = package.rpartition(".")[0]
    return _file_in(folders[package], module.removeprefix(package)) if package else None


@cache
def _file_in(folder: Path, inside: str) -> Path | None:
    path = folder.joinpath(*inside.split(".")[1:])
    files = (path / "__init__.py", *([path.with_suffix(".py")] if inside else ()))
    return next((file for file in files if file.is_file()), None)


def _has_kernels(text: bytes) -> bool:
    return any(mark in text for mark in KERNEL_MARKS)


@cache
def _read(file: Path) -> bytes:
    return file.read_bytes()


@cache
def _imports(file: Path) -> tuple[str, ...]:
    """Returns the dotted names that a module imports: modules, and names that may be modules."""
    text = _read(file)
    pattern = ANY_IMPORT if _has_kernels(text) else IMPORT_AT_MARGIN
    names = []
    for module, members in pattern.findall(text.decode("utf-8", errors="replace")):
        names.append(module)
        names += [f"{module}.{member}" for member in NAME.findall(members)]
    return tuple(names)
