"""Reads one ROS package: the files in its folder, and its package.xml."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.errors import InputError
from drake_navbench.typed_files.input_file import read_input
from drake_navbench.typed_files.name_lists import name_lists

CORE = "nav2_core"
PACKAGE_FILE = "package.xml"
CONTROLLER_BASE = f"{CORE}::Controller"
PLANNER_BASE = f"{CORE}::GlobalPlanner"
# Only these files of these packages are compiled; of all other packages the whole `src`.
PARTS = name_lists(__package__, "parts.yaml")
NOT_OF_A_PACKAGE = {"test", "tests", "benchmark", "build", "install", "log"}
# The tags of dependencies needed for compiling. Those of exec_depend are no part of the program;
# launch files, for instance, name all of Nav2.
DEPENDENCY_TAGS = ("depend", "build_depend", "build_export_depend")
MAX_SOURCE_BYTES = 2**24

_EXPORT = re.compile(r"^\s*PLUGINLIB_EXPORT_CLASS\(\s*([\w:]+)\s*,\s*([\w:]+)\s*\)", re.MULTILINE)
_LOADER = re.compile(r"\bClassLoader<\s*([\w:]+)\s*>")
_INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
_MAIN = re.compile(r"^\s*int\s+main\s*\(", re.MULTILINE)
# https://ros.org/reps/rep-0144.html; upper case is not forbidden everywhere.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@dataclass(frozen=True)
class Package:
    """One package: its name, folder, version and dependencies, those for tests left out."""

    name: str
    folder: Path
    version: str
    dependencies: frozenset[str]

    @property
    def include_folder(self) -> Path:
        """The folder of the package's public headers."""
        return self.folder / "include"

    @cached_property
    def sources(self) -> tuple[Path, ...]:
        """The package's sources that are compiled; programs are left out."""
        if self.name in PARTS:
            parts = (self.folder / part for part in PARTS[self.name])
            return tuple(path for path in parts if path.is_file())
        found = (path for path in sorted((self.folder / "src").rglob("*.cpp")))
        return tuple(
            path
            for path in found
            if not NOT_OF_A_PACKAGE & set(path.relative_to(self.folder).parts)
            and not _MAIN.search(text_of(path))
        )

    @cached_property
    def headers(self) -> tuple[Path, ...]:
        """The package's headers, public and private."""
        folders = (self.include_folder, self.folder / "src")
        return tuple(
            path
            for folder in folders
            for path in sorted(folder.rglob("*"))
            if path.suffix in {".hpp", ".h", ".hh"}
        )

    @property
    def messages(self) -> tuple[Path, ...]:
        """The package's message definitions."""
        return tuple(sorted((self.folder / "msg").glob("*.msg")))

    @cached_property
    def plugins(self) -> Mapping[str, str]:
        """The classes that the package exports -> base class."""
        return {
            name: base for path in self.sources for name, base in _EXPORT.findall(text_of(path))
        }

    @cached_property
    def loaded(self) -> frozenset[str]:
        """The base classes of the plugins that the package loads, without their namespaces."""
        texts = map(text_of, (*self.sources, *self.headers))
        return frozenset(last_name(base) for text in texts for base in _LOADER.findall(text))

    @cached_property
    def plugin_names(self) -> Mapping[str, str]:
        """Classes by the name in the package's plugin descriptions, where name and class differ."""
        names = {}
        for path in sorted(self.folder.glob("*.xml")):
            if path.name != PACKAGE_FILE:
                for element in _xml(path).iter("class"):
                    name, kind = element.get("name"), element.get("type")
                    if name and kind and name != kind:
                        names[name] = kind
        return names

    @property
    def controllers(self) -> tuple[str, ...]:
        """The controllers that the package exports."""
        return tuple(name for name, base in self.plugins.items() if base == CONTROLLER_BASE)

    @property
    def planners(self) -> tuple[str, ...]:
        """The global planners that the package exports."""
        return tuple(name for name, base in self.plugins.items() if base == PLANNER_BASE)


def text_of(path: Path) -> str:
    """Returns the text of a source, whatever its encoding; raises InputError."""
    return read_input(path, max_bytes=MAX_SOURCE_BYTES).decode(errors="replace")


def includes_of(path: Path) -> list[str]:
    """Returns the names that a source or header includes, as written."""
    return _INCLUDE.findall(text_of(path))


def last_name(name: str) -> str:
    """Returns the name of a class without its namespaces."""
    return name.rpartition(":")[2]


def read_package(path: Path) -> Package:
    """Returns the package of a package.xml; raises InputError."""
    tree = _xml(path)
    name = (tree.findtext("name") or "").strip()
    if not name:
        raise InputError(f"{path}: name: missing, expected the package's")
    # The name becomes part of the paths of generated headers.
    if _NAME.fullmatch(name) is None:
        raise InputError(
            f"{path}: name: got {name[:80]!r}, expected letters, digits, dashes and underscores"
        )
    found = {(element.text or "").strip() for tag in DEPENDENCY_TAGS for element in tree.iter(tag)}
    version = (tree.findtext("version") or "").strip()
    return Package(name, path.parent, version, frozenset(found - {""}))


def _xml(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(read_input(path, max_bytes=MAX_SOURCE_BYTES))
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: not XML: {error}") from error
