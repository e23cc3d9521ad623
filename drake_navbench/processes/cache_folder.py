"""A folder for compiled kernels and fonts where the usual ones cannot be written.

numba keeps compiled kernels beside the code or in the user's cache, and refuses to start where it
may write into neither; matplotlib complains in every process.
"""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

NUMBA_VARIABLE, MATPLOTLIB_VARIABLE = "NUMBA_CACHE_DIR", "MPLCONFIGDIR"
INSTALLATION = Path(__file__).parents[1]


def provide_cache_folder() -> None:
    """Names a folder of this user's among the temporary ones, unless a usual one will do.

    It is named in the environment, so that every process of a run finds it.
    """
    if _can_be_written(_user_cache()):
        return
    folder = _own_temporary_folder()
    os.environ.setdefault(MATPLOTLIB_VARIABLE, folder)
    if not _can_be_written(INSTALLATION):
        os.environ.setdefault(NUMBA_VARIABLE, folder)


def notice() -> str:
    """Returns the line that tells of it, '' where the usual folders are used."""
    folder = os.environ.get(NUMBA_VARIABLE, "")
    if not folder or folder != _name_of_temporary_folder():
        return ""
    return f"Neither the installation nor the home can be written: kernels are kept in {folder}"


def user_cache_folder() -> Path:
    """Returns where what is expensive to make again is kept for this user."""
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

    What lies there is executed: a folder of that name that is somebody else's is not used.
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
