"""Writes files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

from drake_navbench.errors import InputError, writing

UNFINISHED = ".unfinished"
# How pages and JUnit files of every command begin.
HTML, JUNIT = "<!DOCTYPE html", "<?xml"


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Makes a file appear whole or not at all: written under another name, synced, renamed.

    A killed process leaves a file with the suffix `UNFINISHED`. Raises CannotBeWritten, as on a
    full disk.
    """
    with writing(path):
        if path.is_dir():
            # Such as '.', beside which no other name stands.
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        unfinished = path.with_name(f".{path.name}.{os.getpid()}{UNFINISHED}")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(unfinished)
            with unfinished.open("rb") as file:
                os.fsync(file.fileno())
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a text file, whole or not at all."""
    write_whole(path, lambda unfinished: unfinished.write_text(text, encoding="utf-8"))


def require_replaceable(option: str, path: Path | None, start: str) -> None:
    """Raises InputError where an option names a file that does not begin as its own outputs do.

    A new or an empty file may be written, and a device, such as /dev/stdout.
    """
    if path is None or not path.is_file():
        return
    with writing(path), path.open("rb") as file:
        head = file.read(len(start.encode()))
    if head and head.lower() != start.encode().lower():
        raise InputError(
            f"{option} {path}: is another file, which does not begin with {start!r}; expected a "
            "new file, or one to replace that this option wrote"
        )
