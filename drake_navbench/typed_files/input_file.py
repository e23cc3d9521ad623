"""Reads a user's file: only a regular file, and only up to a limit of its size."""

from __future__ import annotations

import os
import stat
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from drake_navbench.errors import InputError

MEGABYTE = 2**20
# The first bytes of what stands in a clone for a file that Git LFS keeps elsewhere.
LFS_POINTER = b"version https://git-lfs"
POINTER = "a pointer of Git LFS, not the file; run git lfs pull"
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
# The mark with which editors on Windows begin a text in UTF-8.
UTF_8_MARK = b"\xef\xbb\xbf"
NOT_UTF_8 = "not UTF-8 text, found UTF-16; save it as UTF-8"
# The first bytes of ZIP and gzip.
ARCHIVES = (b"PK\x03\x04", b"\x1f\x8b")


def read_input(path: Path, *, max_bytes: int) -> bytes:
    """Returns the content of a regular file of at most `max_bytes`.

    Raises InputError, one line, where the file is missing, cannot be read, is larger, or is not a
    regular file: a folder, a device or a pipe, from which one could read for ever.
    """
    try:
        with open(path, "rb", opener=_opened_at_once) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"{path}: cannot be read: expected a regular file")
            content = file.read(max_bytes + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: {_reason(path, error)}") from error
    require_fetched(path, content)
    if len(content) > max_bytes:
        raise InputError(f"{path}: expected at most {max_bytes // MEGABYTE} MB")
    return content


def require_fetched(path: Path, content: bytes) -> None:
    """Raises InputError for a pointer to the file, as a clone without Git LFS has it."""
    if content.startswith(LFS_POINTER):
        raise InputError(f"{path}: {POINTER}")


def require_utf_8(path: Path, content: bytes) -> None:
    """Raises InputError for a text in UTF-16, as editors on Windows may save it."""
    if content.startswith(UTF_16):
        raise InputError(f"{path}: {NOT_UTF_8}")


def _reason(path: Path, error: OSError | ValueError) -> str:
    """Returns why a file cannot be opened."""
    if isinstance(error, IsADirectoryError):
        return "is a folder; expected a file"
    if isinstance(error, FileNotFoundError) and path.is_symlink():
        return broken_link(path)
    # A ValueError comes of a name with a NUL character.
    return f"cannot be read: {getattr(error, 'strerror', None) or error}"


def broken_link(path: Path) -> str:
    """Returns a remark on a link to a file that is not there."""
    return f"a link to {os.readlink(path)}, which is not there"


def other_case(path: Path) -> Path | None:
    """Returns the file in the same folder whose name differs in upper and lower case alone."""
    try:
        beside = sorted(path.parent.iterdir())
    except OSError:
        return None
    alike = [file for file in beside if file.name.lower() == path.name.lower() and file.is_file()]
    return next((file for file in alike if file.name != path.name), None)


def read_head(path: Path, count: int) -> bytes:
    """Returns the first bytes of a regular file; b'' for any other, or an unreadable one."""
    try:
        with open(path, "rb", opener=_opened_at_once) as file:
            return file.read(count) if stat.S_ISREG(os.fstat(file.fileno()).st_mode) else b""
    except (OSError, ValueError):
        return b""


def read_head_text(path: Path) -> str:
    """Returns the first megabyte of a regular file as text; '' where `read_head` has none.

    Bytes that are no UTF-8 are replaced, and lines end with a newline alone.
    """
    head = read_head(path, MEGABYTE).removeprefix(UTF_8_MARK)
    return head.decode(errors="replace").replace("\r\n", "\n")


def _opened_at_once(path: str, flags: int) -> int:
    """Returns a descriptor; without O_NONBLOCK, opening a pipe would wait for a writer."""
    return os.open(path, flags | os.O_NONBLOCK)


def read_input_text(path: Path, *, max_bytes: int) -> str:
    """Returns a regular file's text; raises InputError as `read_input`, or if it is not UTF-8."""
    content = read_input(path, max_bytes=max_bytes).removeprefix(UTF_8_MARK)
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        if content.startswith(ARCHIVES):
            raise InputError(f"{path}: is an archive; expected a file in it, unpacked") from error
        line = content.count(b"\n", 0, error.start) + 1
        require_utf_8(path, content)
        raise InputError(
            f"{path}, line {line}: cannot be read: not UTF-8 text, found the byte "
            f"{content[error.start]:#04x}"
        ) from error


def file_digest(path: Path, *, max_bytes: int) -> str:
    """Returns a regular file's SHA-256, read again only if it has changed; raises InputError."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return sha256(read_input(path, max_bytes=max_bytes)).hexdigest()
    return _digest(path, max_bytes, status.st_size, status.st_mtime_ns, status.st_ino)


@lru_cache
def _digest(path: Path, max_bytes: int, *state: int) -> str:
    return sha256(read_input(path, max_bytes=max_bytes)).hexdigest()
