"""Compiled kernels are kept with the user, never beside the code."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from drake_navbench.processes import cache_folder, instruction_set
from drake_navbench.processes.cache_folder import (
    OWN_VARIABLE,
    READ_ONLY_VARIABLE,
    brought_folders,
    notice,
    provide_cache_folder,
)

VARIABLES = (
    "NUMBA_CACHE_DIR",
    OWN_VARIABLE,
    READ_ONLY_VARIABLE,
    "MPLCONFIGDIR",
    "XDG_CACHE_HOME",
)


@pytest.fixture
def provided(monkeypatch, tmp_path):
    """A function that provides the folders where the user's cache can be written, or cannot."""
    monkeypatch.setattr(cache_folder.tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    for variable in VARIABLES:
        monkeypatch.setenv(variable, "")
        monkeypatch.delenv(variable)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))

    def provide(*, home: bool = True) -> tuple[str | None, str | None]:
        monkeypatch.setattr(cache_folder, "_can_be_written", lambda path: home)
        provide_cache_folder()
        return os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("MPLCONFIGDIR")

    return provide


def test_kernels_are_kept_in_the_users_cache(provided, tmp_path):
    kernels = tmp_path / "home" / ".cache" / "drake_navbench" / "kernels"
    assert provided() == (str(kernels), None)
    assert notice() == ""


def test_without_a_home_all_is_kept_among_temporary_files(provided, tmp_path):
    temporary = tmp_path / "temporary" / f"drake_navbench-{os.getuid()}"
    kernels, fonts = provided(home=False)
    assert kernels == str(temporary / "kernels")
    assert fonts == str(temporary)
    assert stat.S_IMODE(temporary.stat().st_mode) == 0o700
    assert notice().endswith(f"kernels are kept in {kernels}")
    assert len(notice().splitlines()) == 1
    # The next process finds it again.
    assert provided(home=False) == (kernels, fonts)


def test_a_folder_that_others_can_write_into_is_not_trusted(provided, tmp_path):
    foreign = tmp_path / "temporary" / f"drake_navbench-{os.getuid()}"
    foreign.mkdir()
    foreign.chmod(0o777)
    kernels, _ = provided(home=False)
    assert foreign not in Path(kernels).parents


def test_what_the_user_has_named_stays(provided, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/elsewhere")
    assert provided()[0] == "/elsewhere"


def test_a_named_folder_that_cannot_be_written_is_read_and_told(provided, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/image/kernels")
    monkeypatch.setattr(
        cache_folder, "_can_be_written", lambda path: path != Path("/image/kernels")
    )
    kernels = tmp_path / "home" / ".cache" / "drake_navbench" / "kernels"
    provide_cache_folder()
    assert os.environ["NUMBA_CACHE_DIR"] == str(kernels)
    assert Path("/image/kernels") in brought_folders()
    assert notice() == (
        f"NUMBA_CACHE_DIR=/image/kernels cannot be written: new kernels are kept in {kernels}"
    )
    # Processes of this one find the same.
    provide_cache_folder()
    assert os.environ["NUMBA_CACHE_DIR"] == str(kernels)


def test_no_kernel_is_kept_beside_the_code(tmp_path):
    """What pip does not know of it would leave behind: once 328 files."""
    script = (
        "import numpy\n"
        "from drake_navbench.kernels import angles\n"
        "kernel = next(v for v in vars(angles).values() if hasattr(v, 'py_func'))\n"
        "kernel(1.0)\n"
        "print(kernel._cache._cache_path)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k not in VARIABLES}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment | {"XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    folder = Path(done.stdout.strip())
    assert folder.parent == tmp_path / "drake_navbench" / "kernels"
    assert [path.suffix for path in folder.iterdir()].count(".nbc") == 1


def test_to_import_the_package_sets_the_instruction_set_alone_and_makes_no_folder(tmp_path):
    script = (
        "import os\n"
        "before = dict(os.environ)\n"
        "import drake_navbench, drake_navbench.__main__\n"
        "print(*(name for name in os.environ if os.environ[name] != before.get(name)))\n"
    )
    set_before = {*VARIABLES, *instruction_set.VARIABLES}
    environment = {k: v for k, v in os.environ.items() if k not in set_before}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment | {"XDG_CACHE_HOME": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    expected = instruction_set.VARIABLES if instruction_set.has_baseline() else {}
    assert set(done.stdout.split()) == set(expected)
    assert not (tmp_path / "cache").exists()
