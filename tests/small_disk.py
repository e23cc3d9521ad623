"""Work on a disk that fills up: in a fork of the tests' process, which mounts it for itself."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

# Namespaces of its own for users and mounts: in them any user may mount a disk.
CLONE_NEWUSER, CLONE_NEWNS = 0x10000000, 0x00020000
NO_MOUNT = 77


class SmallDisk:
    """A folder on a disk in memory."""

    def __init__(self, path: Path, size: str) -> None:
        self.path = path
        _mount("-t", "tmpfs", "-o", f"size={size}", "none", str(path))

    def grow(self, size: str) -> None:
        """Makes room: `size` in all, such as '50m'."""
        _mount("-o", f"remount,size={size}", str(self.path))


class Printed(NamedTuple):
    """The lines that the work has written to its standard output and error."""

    out: list[str]
    error: list[str]


def on_small_disk(folder: Path, size: str, work: Callable[[SmallDisk], None]) -> Printed:
    """Returns what `work` prints in a forked process that has mounted a disk in `folder`.

    Skips the test where nothing may be mounted. What the work changes in the process ends with it.
    """
    path, out, error = folder / "disk", folder / "out.txt", folder / "error.txt"
    path.mkdir()
    with warnings.catch_warnings():
        # Newer Pythons warn of the threads of libraries, which the child does not use.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        status = 1
        try:
            with out.open("w") as sys.stdout, error.open("w") as sys.stderr:
                status = _work(path, size, work)
        finally:
            os._exit(status)
    _, state = os.waitpid(child, 0)
    status = os.waitstatus_to_exitcode(state)
    if status == NO_MOUNT:
        pytest.skip("no mounts allowed: a full disk is faked in test_driving.py alone")
    assert status == 0, error.read_text()
    return Printed(out.read_text().splitlines(), error.read_text().splitlines())


def _work(path: Path, size: str, work: Callable[[SmallDisk], None]) -> int:
    try:
        _enter_namespaces()
        disk = SmallDisk(path, size)
    except (OSError, subprocess.CalledProcessError):
        return NO_MOUNT
    try:
        work(disk)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def _enter_namespaces() -> None:
    """Leaves the namespaces of users and mounts; the user is root in the new ones."""
    user, group = os.getuid(), os.getgid()
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    Path("/proc/self/setgroups").write_text("deny")
    Path("/proc/self/uid_map").write_text(f"0 {user} 1")
    Path("/proc/self/gid_map").write_text(f"0 {group} 1")


def _mount(*arguments: str) -> None:
    subprocess.run(["mount", *arguments], check=True, capture_output=True)
