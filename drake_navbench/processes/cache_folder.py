"""Folders for what is expensive to make again: compiled kernels, fonts, builds of Nav2.

Kernels are kept with the user, never beside the code: an installation that is removed leaves
nothing behind, and one that cannot be written works. Each installation has its own folder, known by
its path, so that two trees never compile each other's kernels anew.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from pathlib import Path

NUMBA_VARIABLE, MATPLOTLIB_VARIABLE = "NUMBA_CACHE_DIR", "MPLCONFIGDIR"
# Which folder for kernels is ours and not the user's choice; processes of this one inherit it, and
# so does a process of another installation that one of them starts.
OWN_VARIABLE = "DRAKE_NAVBENCH_KERNELS"
INSTALLATION = Path(__file__).parents[1]
KERNELS = "kernels"
DIGEST_LENGTH = 12


def provide_cache_folder() -> None:
    """Sets numba's cache folder; also matplotlib's, if the user's cache cannot be written.

    The folder is set in the environment, so that every process of a run finds it. A folder that the
    user has set there stays.
    """
    if not _can_be_written(_user_cache()):
        os.environ.setdefault(MATPLOTLIB_VARIABLE, _own_temporary_folder())
    given = os.environ.get(NUMBA_VARIABLE)
    is_ours = not given or given == os.environ.get(OWN_VARIABLE)
    if not is_ours or (given and Path(given).name == installation_digest()):
        return
    folder = str(user_cache_folder() / KERNELS / installation_digest())
    os.environ[NUMBA_VARIABLE] = os.environ[OWN_VARIABLE] = folder
    if "numba.core.config" in sys.modules:
        # It has read the environment already.
        sys.modules["numba.core.config"].reload_config()


def kernel_folder() -> Path:
    """Returns the folder of this installation's compiled kernels."""
    return Path(os.environ[NUMBA_VARIABLE])


def installation_digest() -> str:
    """Returns a digest of the installation's path, which names its folder."""
    return hashlib.sha256(str(INSTALLATION).encode()).hexdigest()[:DIGEST_LENGTH]


def notice() -> str:
    """Returns a line on kernels in a temporary folder, '' where they are in the user's cache."""
    folder = os.environ.get(NUMBA_VARIABLE, "")
    if not folder.startswith(f"{_name_of_temporary_folder()}{os.sep}"):
        return ""
    return f"The user's cache folder cannot be written: kernels are kept in {folder}"


def user_cache_folder() -> Path:
    """Returns this user's cache folder."""
    user_cache = _user_cache()
    if _can_be_written(user_cache):
        return user_cache / "drake_navbench"
    return Path(_own_temporary_folder())


def _user_cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def _can_be_written(folder: Path) -> bool:
    """Returns whether files can be made in a folder, or in the one where it would be made."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK | os.X_OK)


def _name_of_temporary_folder() -> str:
    return str(Path(tempfile.gettempdir()) / f"drake_navbench-{os.getuid()}")


def _own_temporary_folder() -> str:
    """Returns a temporary folder that lasts and that nobody else can write into.

    Files in it are executed, so a folder of that name that belongs to another user is not used.
    """
    folder = _name_of_temporary_folder()
    try:
        os.mkdir(folder, mode=0o700)
    except FileExistsError:
        found = os.lstat(folder)
        is_own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
        if not is_own or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return tempfile.mkdtemp(prefix="drake_navbench-")
    return folder
