"""What is in a checkout of Nav2: its packages, its release, and the controllers in them."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.errors import InputError
from drake_navbench.typed_files.input_file import read_input

# Of nav2_core: https://docs.nav2.org/ names the releases, their branches number them so.
RELEASES: Mapping[tuple[int, int], str] = {
    (1, 1): "humble",
    (1, 2): "iron",
    (1, 3): "jazzy",
    (1, 4): "kilted",
    (1, 5): "lyrical",
}
CORE = "nav2_core"
PACKAGE_FILE = "package.xml"
CONTROLLER_BASE = f"{CORE}::Controller"
PLANNER_BASE = f"{CORE}::GlobalPlanner"
# What is compiled of packages that hold much besides; of all others it is the whole `src`.
PARTS: Mapping[str, tuple[str, ...]] = {
    "nav2_costmap_2d": (
        "src/array_parser.cpp",
        "src/costmap_2d.cpp",
        "src/costmap_layer.cpp",
        "src/costmap_math.cpp",
        "src/footprint.cpp",
        "src/footprint_collision_checker.cpp",
        "src/layer.cpp",
        "src/layered_costmap.cpp",
        "plugins/inflation_layer.cpp",
    ),
    "nav2_util": (
        "src/array_parser.cpp",
        "src/controller_utils.cpp",
        "src/costmap.cpp",
        "src/path_utils.cpp",
        "src/robot_utils.cpp",
        "src/string_utils.cpp",
    ),
    "nav2_controller": (
        "plugins/position_goal_checker.cpp",
        "plugins/simple_goal_checker.cpp",
        "plugins/stopped_goal_checker.cpp",
    ),
    # The 2D planner, with what it is linked to: up to Kilted each search is one of all nodes.
    "nav2_smac_planner": (
        "src/a_star.cpp",
        "src/analytic_expansion.cpp",
        "src/collision_checker.cpp",
        "src/costmap_downsampler.cpp",
        "src/distance_heuristic.cpp",
        "src/node_2d.cpp",
        "src/node_basic.cpp",
        "src/node_hybrid.cpp",
        "src/node_lattice.cpp",
        "src/obstacle_heuristic.cpp",
        "src/smac_planner_2d.cpp",
        "src/smoother.cpp",
    ),
    # Its interface alone; its plugins need OpenCV.
    "costmap_converter": (),
    "nav2_behavior_tree": (),
    "nav2_ros_common": (),
    "nav2_voxel_grid": (),
}
NOT_OF_A_PACKAGE = {"test", "tests", "benchmark", "build", "install", "log"}
DEPENDENCY_TAGS = ("depend", "build_depend", "build_export_depend", "exec_depend")
MAX_SOURCE_BYTES = 2**24
GIT_PATIENCE_S = 10.0

_EXPORT = re.compile(r"^\s*PLUGINLIB_EXPORT_CLASS\(\s*([\w:]+)\s*,\s*([\w:]+)\s*\)", re.MULTILINE)
_INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
_MAIN = re.compile(r"^\s*int\s+main\s*\(", re.MULTILINE)


@dataclass(frozen=True)
class Package:
    """One package: its name, folder, version, and what it depends on, tests left out."""

    name: str
    folder: Path
    version: str
    dependencies: frozenset[str]

    @property
    def include_folder(self) -> Path:
        """Where its public headers are."""
        return self.folder / "include"

    @cached_property
    def sources(self) -> tuple[Path, ...]:
        """What is compiled of it: no programs of their own."""
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
        """Its headers, public and private."""
        folders = (self.include_folder, self.folder / "src")
        return tuple(
            path
            for folder in folders
            for path in sorted(folder.rglob("*"))
            if path.suffix in {".hpp", ".h", ".hh"}
        )

    @property
    def messages(self) -> tuple[Path, ...]:
        """Its definitions of messages."""
        return tuple(sorted((self.folder / "msg").glob("*.msg")))

    @cached_property
    def plugins(self) -> Mapping[str, str]:
        """The classes that it exports, each with its base class."""
        return {
            name: base for path in self.sources for name, base in _EXPORT.findall(text_of(path))
        }

    @cached_property
    def plugin_names(self) -> Mapping[str, str]:
        """The names that its plugin descriptions give to classes, where these have others."""
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
        """The controllers that it exports."""
        return tuple(name for name, base in self.plugins.items() if base == CONTROLLER_BASE)

    @property
    def planners(self) -> tuple[str, ...]:
        """The global planners that it exports."""
        return tuple(name for name, base in self.plugins.items() if base == PLANNER_BASE)


@dataclass(frozen=True)
class Checkout:
    """A folder with packages of Nav2.

    release: by the version of its nav2_core. commit: of git, '' where it is not known, with a plus
    where files differ from it.
    """

    root: Path
    packages: Mapping[str, Package]
    release: str
    version: str
    commit: str

    @property
    def controller_packages(self) -> dict[str, Package]:
        """The packages with controllers, by name."""
        return {name: package for name, package in self.packages.items() if package.controllers}

    @property
    def planner_packages(self) -> dict[str, Package]:
        """The packages with global planners, by name."""
        return {name: package for name, package in self.packages.items() if package.planners}

    def seen_from(self, names: Iterable[str]) -> dict[str, Package]:
        """Returns packages with all that their package.xml name, and so on: whose headers count."""
        return self._closure(names, lambda package: package.dependencies)

    def compiled_for(self, names: Iterable[str]) -> dict[str, Package]:
        """Returns what is linked for some packages: they, what they need, and its plugins.

        Of what packages that only serve by parts of them need nothing is linked.
        """
        return self._closure(names, self._linked_with)

    def _linked_with(self, package: Package) -> Iterable[str]:
        if package.name in PARTS and not package.planners:
            return ()
        if not package.controllers:
            return package.dependencies
        return package.dependencies | {
            other.name
            for other in self.packages.values()
            if package.name in other.dependencies
            and other.plugins
            and not other.controllers
            and other.name not in PARTS
        }

    def _closure(
        self, names: Iterable[str], leads_to: Callable[[Package], Iterable[str]]
    ) -> dict[str, Package]:
        found: dict[str, Package] = {}
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name not in found and name in self.packages:
                found[name] = self.packages[name]
                waiting += leads_to(found[name])
        return dict(sorted(found.items()))


def read_checkout(root: Path) -> Checkout:
    """Returns what a folder holds; raises InputError where it is no checkout of Nav2."""
    root = root.absolute()
    if not root.is_dir():
        raise InputError(f"{root}: no such folder, expected a checkout of navigation2")
    packages = {package.name: package for package in map(_package, _package_files(root))}
    if CORE not in packages:
        raise InputError(
            f"{root}: no checkout of navigation2: no package {CORE} in it or its folders"
        )
    version = packages[CORE].version
    numbers = tuple(int(part) for part in version.split(".")[:2] if part.isdecimal())
    release = RELEASES.get(numbers) if len(numbers) == 2 else None
    if release is None:
        known = ", ".join(f"{name} ({a}.{b})" for (a, b), name in RELEASES.items())
        raise InputError(
            f"{packages[CORE].folder / PACKAGE_FILE}: version: got {version!r}, "
            f"expected a release that is known: {known}"
        )
    checkout = Checkout(root, packages, release, version, _commit(root))
    if not checkout.controller_packages:
        raise InputError(f"{root}: no package in it exports a {CONTROLLER_BASE}")
    return checkout


def text_of(path: Path) -> str:
    """Returns the text of a source, whatever its encoding; raises InputError."""
    return read_input(path, max_bytes=MAX_SOURCE_BYTES).decode(errors="replace")


def includes_of(path: Path) -> list[str]:
    """Returns what a source or header includes, as it is written."""
    return _INCLUDE.findall(text_of(path))


def _package_files(root: Path) -> list[Path]:
    # As deep as packages are in a workspace with several repositories.
    return [
        path
        for depth in range(5)
        for path in sorted(root.glob("*/" * depth + PACKAGE_FILE))
        if not any(
            part.startswith(".") or part in NOT_OF_A_PACKAGE
            for part in path.relative_to(root).parts[:-1]
        )
    ]


def _package(path: Path) -> Package:
    tree = _xml(path)
    name = (tree.findtext("name") or "").strip()
    if not name:
        raise InputError(f"{path}: name: missing, expected the package's")
    found = {(element.text or "").strip() for tag in DEPENDENCY_TAGS for element in tree.iter(tag)}
    version = (tree.findtext("version") or "").strip()
    return Package(name, path.parent, version, frozenset(found - {""}))


def _xml(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(read_input(path, max_bytes=MAX_SOURCE_BYTES))
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: no XML: {error}") from error


def _commit(root: Path) -> str:
    """Returns the commit of a checkout, '' where there is none to be known."""
    if not (root / ".git").exists():
        return ""
    words = ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+"]
    words += ["--exclude=*"]
    try:
        found = subprocess.run(
            words, capture_output=True, text=True, timeout=GIT_PATIENCE_S, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
