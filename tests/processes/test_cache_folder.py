"""Where neither home nor installation can be written, kernels are kept among temporary files."""

import os
import stat

import pytest

from drake_navbench.processes import cache_folder
from drake_navbench.processes.cache_folder import notice, provide_cache_folder


@pytest.fixture
def provided(monkeypatch, tmp_path):
    """A function that provides the folder where only some others can be written."""
    monkeypatch.setattr(cache_folder.tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    for variable in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "XDG_CACHE_HOME"):
        monkeypatch.setenv(variable, "")
        monkeypatch.delenv(variable)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))

    def provide(*, home: bool, installation: bool) -> list[str]:
        monkeypatch.setattr(
            cache_folder,
            "_can_be_written",
            lambda path: installation if path == cache_folder.INSTALLATION else home,
        )
        provide_cache_folder()
        named = [os.environ.get(variable) for variable in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR")]
        return [name for name in named if name]

    return provide


def test_a_home_that_can_be_written_is_enough(provided):
    assert provided(home=True, installation=False) == []
    assert notice() == ""


def test_with_the_installation_alone_only_fonts_are_kept_elsewhere(provided):
    (folder,) = provided(home=False, installation=True)
    assert os.environ["MPLCONFIGDIR"] == folder
    assert notice() == ""


def test_with_neither_both_are_kept_among_temporary_files(provided, tmp_path):
    numba, matplotlib = provided(home=False, installation=False)
    assert numba == matplotlib == str(tmp_path / "temporary" / f"drake_navbench-{os.getuid()}")
    assert stat.S_IMODE(os.stat(numba).st_mode) == 0o700
    assert notice().endswith(f"kernels are kept in {numba}")
    assert len(notice().splitlines()) == 1
    # The next process finds it again.
    assert provided(home=False, installation=False) == [numba, matplotlib]


def test_a_folder_that_others_can_write_into_is_not_trusted(provided, tmp_path):
    foreign = tmp_path / "temporary" / f"drake_navbench-{os.getuid()}"
    foreign.mkdir()
    foreign.chmod(0o777)
    numba, _ = provided(home=False, installation=False)
    assert numba != str(foreign)
    assert stat.S_IMODE(os.stat(numba).st_mode) == 0o700


def test_what_the_user_has_named_stays(provided, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/elsewhere")
    assert provided(home=False, installation=False)[0] == "/elsewhere"
