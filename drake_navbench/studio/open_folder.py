"""The folder of a studio: what may be read and written, and the lock against a second studio."""

from __future__ import annotations

import fcntl
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import CannotBeWritten, InputError, printable
from drake_navbench.typed_files.input_file import read_input_text
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES

LOCK_NAME = ".studio.lock"
# The greatest depth that is searched: folders of scenarios and Nav2 files are no deeper, but
# results, environments and builds are.
MAX_DEPTH = 3
MAX_NAMES = 500
NO_FILES_OF_USERS = {"node_modules", "__pycache__", "build", "install", "log"}
# Longer texts cannot be names of files.
MAX_PATH_LENGTH = 4096


class FileText(NamedTuple):
    """A file's text, and its stamp, which shows a later change of the file."""

    text: str
    stamp: str


class ChangedOnDisk(InputError):
    """The file has changed since it was read, so it is not overwritten."""


@dataclass(frozen=True)
class OpenFolder:
    """A folder, with all links resolved; nothing outside is read or written."""

    root: Path

    @classmethod
    def at(cls, path: Path) -> OpenFolder:
        """Returns the folder at a path; raises InputError if it does not exist."""
        try:
            root = path.resolve(strict=True)
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(f"{path}: no such folder") from error
        if not root.is_dir():
            raise InputError(f"{path}: is not a folder")
        return cls(root)

    def inside(self, name: str) -> Path:
        """Returns the file of a name below the folder, with links resolved; raises InputError."""
        try:
            path = (self.root / name).resolve()
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(f"{printable(name)}: is no name of a file") from error
        if not name or not path.is_relative_to(self.root) or path == self.root:
            raise InputError(f"{printable(name)}: lies outside {self.root}")
        return path

    def name_of(self, path: Path) -> str:
        """Returns a file's path relative to the folder."""
        return path.relative_to(self.root).as_posix()

    def names(self, suffixes: tuple[str, ...]) -> list[str]:
        """Returns the names of files with these suffixes, without hidden files and results."""
        found: list[str] = []
        waiting = [(self.root, 0)]
        while waiting and len(found) < MAX_NAMES:
            folder, depth = waiting.pop(0)
            for entry in _entries(folder):
                path = Path(entry.path)
                if entry.is_dir(follow_symlinks=False):
                    is_results = (path / "manifest.json").is_file()
                    if depth < MAX_DEPTH and not is_results and entry.name not in NO_FILES_OF_USERS:
                        waiting.append((path, depth + 1))
                elif path.suffix in suffixes and path.resolve().is_relative_to(self.root):
                    found.append(self.name_of(path))
        return found[:MAX_NAMES]

    def read(self, name: str) -> FileText:
        """Returns a file's text; raises InputError where it is outside or cannot be read."""
        text = read_input_text(self.inside(name), max_bytes=MAX_FILE_BYTES)
        return FileText(text, _digest(text))

    def is_changed(self, name: str, stamp: str) -> bool:
        """Returns whether a file's stamp is no longer `stamp`; '' stands for no file."""
        try:
            return self.read(name).stamp != stamp
        except InputError:
            return bool(stamp)

    def write(self, name: str, text: str, stamp: str) -> str:
        """Writes a file, whole or not at all; returns its new stamp.

        stamp: stamp of the file as it was read, '' for a new file. Raises ChangedOnDisk if the file
        has changed, InputError if the name leads outside, CannotBeWritten.
        """
        path = self.inside(name)
        if self.is_changed(name, stamp) or (not stamp and path.exists()):
            what = "has changed on disk since it was opened" if stamp else "exists already"
            raise ChangedOnDisk(f"{name}: {what}; nothing was overwritten, give another name")
        write_text(path, text)
        return _digest(text)

    def require_inside(self, data: Any, folder: Path) -> None:
        """Raises InputError where a text of a file's content names a file outside.

        folder: the file's, from which relative names start. Files of the package may be named.
        """
        for text in (part for found in _texts(data) for part in (found, found.rpartition(":")[0])):
            if not text or len(text) > MAX_PATH_LENGTH or "\0" in text or "\n" in text:
                continue
            try:
                path = (folder / text).resolve()
                is_file = path.is_file()
            except (OSError, ValueError, RuntimeError):
                continue
            homes = (self.root, *_own_folders())
            if is_file and not any(path.is_relative_to(home) for home in homes):
                raise InputError(
                    f"{printable(text)}: lies outside {self.root}; the studio reads nothing there"
                )

    @contextmanager
    def lock(self, told: str) -> Iterator[None]:
        """Locks the folder against a second studio while the block runs.

        told: the text that a second studio shows about this one. Raises InputError if another
        studio holds the lock.
        """
        path = self.root / LOCK_NAME
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        except OSError as error:
            raise CannotBeWritten(f"{path}: cannot be written: {error.strerror}") from error
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                first = printable(os.read(descriptor, 200).decode(errors="replace").strip())
                raise InputError(
                    f"{self.root}: a studio is open on it ({first}); close that one first"
                ) from error
            except OSError:
                # On a file system without locks the user alone can take care.
                pass
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"{told}\n".encode(), 0)
            yield
            path.unlink(missing_ok=True)
        finally:
            os.close(descriptor)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            shown = [e for e in entries if not e.name.startswith(".") and e.name.isprintable()]
    except OSError:
        return []
    return sorted(shown, key=lambda entry: entry.name)


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict):
        for value in data.values():
            yield from _texts(value)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from _texts(value)


def _own_folders() -> list[Path]:
    """Returns the folders of the package; in a development installation they lie side by side."""
    names = ("drake_navbench", "drake_navbench.scenarios", "drake_navbench.models")
    specs = [find_spec(name) for name in names]
    return [Path(spec.origin).parent.resolve() for spec in specs if spec and spec.origin]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
