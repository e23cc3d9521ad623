"""Folders for results that are expensive to make: compiled kernels, fonts, builds of Nav2.

Kernels are kept with the user, never beside the code: an installation that is removed leaves
nothing behind, and one without write access works. All installations share one folder, since each
kernel is known by its content.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

NUMBA_VARIABLE, MATPLOTLIB_VARIABLE = "NUMBA_CACHE_DIR", "MPLCONFIGDIR"
# The variable with the folder for kernels that we chose, not the user; child processes inherit it.
OWN_VARIABLE = "DRAKE_NAVBENCH_KERNELS"
# The variable with a folder that the user chose and that cannot be written: it is only read.
READ_ONLY_VARIABLE = "DRAKE_NAVBENCH_READ_ONLY_KERNELS"
KERNELS = "kernels"
# The folder of kernels in a wheel made for this platform alone.
IN_THE_WHEEL = Path(__file__).parents[1] / "compiled_kernels"
# The file in it that names the compiler of these kernels.
COMPILER_FILE = "compiler.txt"


def provide_cache_folder() -> None:
    """Sets numba's cache folder; also matplotlib's, if the user's cache cannot be written.

    The folder is set in the environment, so that every process of a run finds it. A folder that the
    user has set there stays, unless it cannot be written.
    """
    if not _can_be_written(_user_cache()):
        os.environ.setdefault(MATPLOTLIB_VARIABLE, own_temporary_folder())
    given = os.environ.get(NUMBA_VARIABLE)
    if given and given != os.environ.get(OWN_VARIABLE):
        if _can_be_written(Path(given)):
            return
        os.environ[READ_ONLY_VARIABLE] = given
    folder = str(user_cache_folder() / KERNELS)
    if folder == given:
        return
    os.environ[NUMBA_VARIABLE] = os.environ[OWN_VARIABLE] = folder
    if "numba.core.config" in sys.modules:
        # numba has read the environment already.
        sys.modules["numba.core.config"].reload_config()


def kernel_folder() -> Path:
    """Returns the folder in which compiled kernels are kept."""
    return Path(os.environ[NUMBA_VARIABLE])


def brought_folders() -> list[Path]:
    """Returns the folders from which compiled kernels are copied: the wheel's, and those that
    cannot be written."""
    folders = [IN_THE_WHEEL]
    if named := os.environ.get(READ_ONLY_VARIABLE):
        folders.append(Path(named))
    if not _can_be_written(_user_cache()):
        folders.append(_user_cache() / "drake_navbench" / KERNELS)
    return folders


def notice() -> str:
    """Returns a line on kernels that are not kept where they belong; '' if they are."""
    folder = os.environ.get(NUMBA_VARIABLE, "")
    named = os.environ.get(READ_ONLY_VARIABLE)
    if named:
        return f"{NUMBA_VARIABLE}={named} cannot be written: new kernels are kept in {folder}"
    if not folder.startswith(f"{_name_of_temporary_folder()}{os.sep}"):
        return ""
    return f"The user's cache folder cannot be written: kernels are kept in {folder}"


def user_cache_folder() -> Path:
    """Returns this user's cache folder."""
    user_cache = _user_cache()
    if _can_be_written(user_cache):
        return user_cache / "drake_navbench"
    return Path(own_temporary_folder())


def _user_cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def _can_be_written(folder: Path) -> bool:
    """Returns whether files can be created in a folder, or in the one in which it would be made."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK | os.X_OK)


def _name_of_temporary_folder() -> str:
    return str(Path(tempfile.gettempdir()) / f"drake_navbench-{os.getuid()}")


def own_temporary_folder() -> str:
    """Returns a temporary folder that lasts and to which nobody else can write.

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
