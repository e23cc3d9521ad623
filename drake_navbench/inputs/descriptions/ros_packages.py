"""Finds the folders of the ROS packages that a file names, and the files behind package URIs.

A package is a folder whose package.xml has its name, a folder of its name with a model.config, or
any folder of its name. The search covers the folders that the user named, the repository around the
file, the folders beside and above the file, AMENT_PREFIX_PATH (share/name) and ROS_PACKAGE_PATH.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

from drake_navbench.errors import InputError

PACKAGE_URI = re.compile(r"(?:package|model)://([^/]+)/?(.*)")
PACKAGE_FILE = "package.xml"
CHECKOUT = ".git"
MODEL_FILE = "model.config"
# A downloaded model lies in a folder named by its version.
VERSION = re.compile(r"\d+")
PACKAGE_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
# The most folders above the file that are searched: more than any workspace has.
MAX_DEPTH = 8
# The most folders of a repository that are searched: a hundred times those of a large one.
MAX_FOLDERS = 50_000
# Folders of generated files, which may contain a second copy of the packages.
NO_SOURCES = frozenset({"build", "install", "log", "node_modules", "__pycache__"})


class Packages:
    """The packages around a file, with those below the folders that the user named.

    is_told_folders: whether the user named any. is_own: whether this program wrote the file, which
    then may name files anywhere.
    """

    def __init__(self, file: Path, folders: Sequence[Path] = (), *, is_own: bool = False) -> None:
        self._folder = file.parent.absolute()
        for folder in folders:
            if not folder.is_dir():
                raise InputError(f"--packages {folder}: expected a folder")
        self.root = repository_of(file)
        self.is_told_folders = bool(folders)
        self._is_own = is_own
        self._roots = (*(folder.absolute() for folder in folders), self.root)
        # A repository that was downloaded as an archive has no `.git`.
        around = [root for root in self._roots if self._folder.is_relative_to(root)]
        self._end = min(around, key=lambda root: len(root.parts))
        self.found: dict[str, Path] = {}

    def folder(self, name: str) -> Path | None:
        """Returns the folder of a package; None where there is none."""
        if name in self.found:
            return self.found[name]
        if name in ("", ".", ".."):
            return None
        place = self._known(name) or _package_nearby(name, self._folder)
        if place is not None:
            self.found[name] = place
        return place

    def _known(self, name: str) -> Path | None:
        """Returns the folder of a package or model in the repository or the named folders."""
        kinds = (packages_below, models_below)
        places = (below(root).get(name) for below in kinds for root in self._roots)
        return next((place for place in places if place is not None), None)

    def all(self) -> dict[str, Path]:
        """Returns every package with a package.xml by name, in the repository and named folders."""
        known: dict[str, Path] = {}
        for root in reversed(self._roots):
            known |= packages_below(root)
        return known

    def files(self, is_wanted: Callable[[Path], bool]) -> list[Path]:
        """Returns the wanted files that belong to the file's robot, the nearest first.

        They are in the repository and in the named folders. Without a `.git`, the packages beside
        the file's may be other robots': the named folder around the file counts then.
        """
        *named, root = self._roots
        is_clone = (root / CHECKOUT).exists()
        is_named = any(self._folder.is_relative_to(folder) for folder in named)
        roots = named if is_named and not is_clone else [root, *named]
        found = [f for below in roots for f in files_below(below) if is_wanted(f)]
        here = self._folder.parts

        def shared(file: Path) -> int:
            pairs = zip(here, file.parts, strict=False)
            return next((i for i, (ours, theirs) in enumerate(pairs) if ours != theirs), len(here))

        return sorted(dict.fromkeys(found), key=shared, reverse=True)

    def model(self, name: str) -> Path | None:
        """Returns the folder of a Gazebo model by its name, in upper or lower case."""
        for root in self._roots:
            place = models_below(root).get(name) or models_below(root).get(name.lower())
            if place is not None:
                return place
        return self.folder(name)

    def place(self, uri: str, folder: Path | None = None) -> Path | None:
        """Returns the file or folder of a URI or relative path; None where it is not found.

        folder: the start of relative paths; None: the file's own folder. Files outside of the
        repository, of the named folders and of the packages are never returned.
        """
        named = PACKAGE_URI.fullmatch(uri)
        if named is not None:
            package = self.model(named[1]) if uri[0] == "m" else self.folder(named[1])
            place = None if package is None else self._inside(package / named[2])
            if place is None and package is not None:
                place = self._above(named[2], package)
            is_elsewhere = place is None and uri[0] == "m"
            return self._in_a_folder(named[1], named[2]) if is_elsewhere else place
        # `file:/p` and `file:///p` name the same file (RFC 8089); before the first of them, tools
        # that expand xacro put a folder, as before a relative path.
        path = Path(uri.rpartition("file:")[2].removeprefix("//"))
        start = folder or self._folder
        place = self._inside(start / path)
        if place is None and path.is_absolute() and path.is_relative_to(start):
            # Tools that expand xacro make a relative path absolute.
            return self._above(path.relative_to(start), self._end)
        if place is None and path.is_absolute():
            return self._of_another_computer(path)
        if place is not None:
            return place
        if not uri.startswith("file://"):
            return self._above(path, self._end)
        # Gazebo searches such files below its resource folders, which hold models.
        places = [self._inside(root / path) for root in self._roots]
        if path.parts[:1] == ("models",) and len(path.parts) > 2:
            model = self.model(path.parts[1])
            places.append(None if model is None else self._inside(model.joinpath(*path.parts[2:])))
        return next((found for found in places if found is not None), None)

    def _in_a_folder(self, name: str, path: str) -> Path | None:
        """Returns a file of a folder that is no model, as below GZ_SIM_RESOURCE_PATH."""
        folders = (f for root in self._roots for f in _folders(root) if f.name == name)
        return next((place for f in folders if (place := self._inside(f / path))), None)

    def _of_another_computer(self, path: Path) -> Path | None:
        """Returns the file of this repository that an absolute path names on its author's computer.

        The path leads through a package, as `ws/src/cart/meshes/hull.stl` or, installed,
        `ws/install/cart/share/cart/meshes/hull.stl`; else its last folders are here, too.
        """
        for i, name in enumerate(path.parts[1:-1], 1):
            package = self._known(name)
            place = (
                None if package is None else self._inside(package.joinpath(*path.parts[i + 1 :]))
            )
            place = place or self._above(Path(*path.parts[i:]), self._end)
            if place is not None:
                return place
        return self._inside(self._folder / path.name)

    def _above(self, path: Path | str, end: Path) -> Path | None:
        """Returns a file by its path from the folder, or from a folder above it up to `end`.

        Installed packages lie in other folders than their sources.
        """
        if Path(path).is_absolute() or not self._folder.is_relative_to(end):
            return None
        above = [self._folder, *self._folder.parents][:MAX_DEPTH]
        within = [folder for folder in above if folder.is_relative_to(end)]
        return next((p for folder in within if (p := self._inside(folder / path))), None)

    def _inside(self, path: Path) -> Path | None:
        try:
            if not path.exists():
                return None
            resolved = path.resolve()
        except (OSError, ValueError):
            return None
        if self._is_own:
            return path
        allowed = (*self._roots, self._folder, *self.found.values())
        is_inside = any(resolved.is_relative_to(root.resolve()) for root in allowed)
        return path if is_inside else None


def repository_of(file: Path) -> Path:
    """Returns the folder of the repository around a file.

    The folder is the next one above with `.git`; else the folder of the outermost package around
    the file and of the packages beside it; else the file's own folder.
    """
    above = [*file.absolute().parents][:MAX_DEPTH]
    checkout = next((folder for folder in above if (folder / CHECKOUT).exists()), None)
    if checkout is not None:
        return checkout
    packages = [folder for folder in above if (folder / PACKAGE_FILE).is_file()]
    return packages[-1].parent if packages else above[0]


@lru_cache(maxsize=64)
def packages_below(root: Path) -> dict[str, Path]:
    """Returns the packages below a folder by name; of equal names the one nearer to the root."""
    found: dict[str, Path] = {}
    for folder in _folders(root):
        name = _name_in(folder / PACKAGE_FILE)
        if name is not None:
            found.setdefault(name, folder)
    return found


@lru_cache(maxsize=64)
def models_below(root: Path) -> dict[str, Path]:
    """Returns the folders with a model.config below a folder, by name and by name in lower case."""
    found: dict[str, Path] = {}
    for folder in _folders(root):
        if _is_file(folder / MODEL_FILE):
            name = folder.parent.name if VERSION.fullmatch(folder.name) else folder.name
            found.setdefault(name, folder)
            found.setdefault(name.lower(), folder)
    return found


@lru_cache(maxsize=64)
def _folders(root: Path) -> tuple[Path, ...]:
    """Returns a folder and those below it, level by level, without generated and hidden ones."""
    level, found = [root], list[Path]()
    while level:
        below: list[Path] = []
        for folder in level:
            found.append(folder)
            if len(found) >= MAX_FOLDERS:
                return tuple(found)
            try:
                entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
            except OSError:
                continue
            below += [
                Path(entry.path)
                for entry in entries
                if entry.is_dir(follow_symlinks=False)
                and not entry.name.startswith(".")
                and entry.name not in NO_SOURCES
            ]
        level = below
    return tuple(found)


@lru_cache(maxsize=16)
def files_below(root: Path) -> tuple[Path, ...]:
    """Returns the files in a folder and those below it, level by level."""
    found: list[Path] = []
    for folder in _folders(root):
        try:
            entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
        except OSError:
            continue
        found += [Path(entry.path) for entry in entries if _is_file(entry)]
    return tuple(found)


def forget_folders() -> None:
    """Forgets the packages, models and files that were found, as others may be there by now."""
    for found in (packages_below, models_below, _folders, files_below):
        found.cache_clear()


def broken_links_below(root: Path) -> list[Path]:
    """Returns the broken links in a folder and those below it."""
    found = []
    for folder in _folders(root):
        try:
            found += [path for path in folder.iterdir() if path.is_symlink() and _is_broken(path)]
        except OSError:
            continue
    return sorted(found)


def _is_broken(link: Path) -> bool:
    """Tells whether a link leads to no file, as one in a loop of links."""
    try:
        return not link.exists()
    except OSError:
        return True


def _is_file(entry: os.DirEntry[str] | Path) -> bool:
    """Tells whether an entry is a file; a link in a loop, or one in a closed folder, is none."""
    try:
        return entry.is_file()
    except OSError:
        return False


def _name_in(file: Path) -> str | None:
    """Returns the name in a package.xml; None without such a file."""
    try:
        said = PACKAGE_NAME.search(file.read_text(errors="replace"))
    except OSError:
        return None
    return said[1] if said else None


def _package_nearby(name: str, start: Path) -> Path | None:
    """Returns the folder of a package beside or above `start`, or in ROS's own paths."""
    above = [start, *start.parents][:MAX_DEPTH]
    environment = {
        variable: [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]
        for variable in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH")
    }
    places = [
        *above,
        *(folder / name for folder in above),
        *(prefix / "share" / name for prefix in environment["AMENT_PREFIX_PATH"]),
        *environment["ROS_PACKAGE_PATH"],
        *(entry / name for entry in environment["ROS_PACKAGE_PATH"]),
    ]
    return next((place for place in places if _is_package(place, name)), None)


def _is_package(folder: Path, name: str) -> bool:
    file = folder / PACKAGE_FILE
    if _is_file(file):
        return _name_in(file) == name
    # False, too, for a folder in another user's closed one, where `Path.is_dir` raises an error.
    return folder.name == name and os.path.isdir(folder)
