"""Compiled kernels are kept for as long as what they were compiled from is the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drake_navbench.processes.cache_folder import OWN_VARIABLE, installation_digest
from drake_navbench.processes.kernel_cache import CHECKED_VARIABLE, forget_stale_kernels

SOURCES = {
    "__init__.py": "",
    "base.py": "from numba import njit\n\n@njit(cache=True)\ndef one():\n    return 1\n",
    "caller.py": "from numba import njit\nfrom lab.base import one\n\n"
    "@njit(cache=True)\ndef two():\n    return 2 * one()\n",
    "far.py": "import lab.caller\n",
    "other.py": "from lab import far\n",
    "apart.py": "",
}


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """The folder of compiled kernels, as an installation has it among those of others."""
    folder = tmp_path / "kernels" / installation_digest()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setenv(OWN_VARIABLE, str(folder))
    return folder


@pytest.fixture
def lab(tmp_path, cache) -> Path:
    folder = tmp_path / "lab"
    folder.mkdir()
    for name, text in SOURCES.items():
        (folder / name).write_text(text)
    keep_again(cache)
    return folder


@pytest.fixture
def look(lab, cache, monkeypatch):
    """Returns what looks for stale kernels, as a new process does; returns whose are left."""

    def look() -> set[str]:
        monkeypatch.delenv(CHECKED_VARIABLE, raising=False)
        forget_stale_kernels({"lab": lab})
        return {path.name.partition(".")[0] for path in cache.glob("lab_0a1b/*.nb?")}

    return look


def keep_again(cache: Path) -> None:
    folder = cache / "lab_0a1b"
    folder.mkdir(parents=True, exist_ok=True)
    for name in SOURCES:
        for kind in ("nbi", "1.nbc"):
            (folder / f"{name.removesuffix('.py')}.kernel-3.py311.{kind}").touch()


def test_what_was_kept_before_anybody_knew_of_what_is_forgotten(look):
    assert look() == set()


def test_nothing_is_forgotten_where_nothing_has_changed(lab, cache, look):
    look()
    keep_again(cache)
    assert look() == {name.removesuffix(".py") for name in SOURCES}


def test_who_imports_what_has_changed_is_forgotten_however_far(lab, cache, look):
    look()
    keep_again(cache)
    (lab / "base.py").write_text("# changed\n")
    assert look() == {"__init__", "apart"}


def test_who_imported_what_is_gone_is_forgotten(lab, cache, look):
    look()
    keep_again(cache)
    (lab / "caller.py").unlink()
    assert look() == {"__init__", "apart", "base", "caller"}  # Nobody's file any more.


def test_processes_of_this_one_do_not_look_again(lab, cache, look):
    look()
    keep_again(cache)
    (lab / "base.py").write_text("# changed\n")
    assert forget_stale_kernels({"lab": lab}) == []


def test_an_installation_that_another_one_starts_looks_for_itself(lab, cache, look, monkeypatch):
    look()
    keep_again(cache)
    (lab / "base.py").write_text("# changed\n")
    monkeypatch.setenv(CHECKED_VARIABLE, "/another/installation")
    assert "lab.caller" in forget_stale_kernels({"lab": lab})


def test_the_kernels_of_an_installation_that_is_gone_are_removed(tmp_path, cache, look):
    for name, installation in {"gone": tmp_path / "removed", "there": tmp_path}.items():
        (cache.parent / name).mkdir()
        (cache.parent / name / "installation.txt").write_text(str(installation))
    look()
    assert {path.name for path in cache.parent.iterdir()} == {"there", cache.name}


def test_a_table_that_cannot_be_read_is_made_anew(lab, cache, look):
    look()
    (cache / f"{installation_digest()}.kernel_sources.json").write_text("[")
    keep_again(cache)
    assert look() == set()


def test_a_changed_kernel_is_what_its_caller_calls(lab):
    """numba alone would answer 2 both times: the caller's file is the same."""
    script = (
        "from pathlib import Path\n"
        "from drake_navbench.processes.kernel_cache import forget_stale_kernels\n"
        f"forget_stale_kernels({{'lab': Path({str(lab)!r})}})\n"
        "from lab.caller import two\n"
        "print(two())\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != CHECKED_VARIABLE}

    def answer() -> str:
        done = subprocess.run(
            [sys.executable, "-c", script],
            cwd=lab.parent,
            env=environment | {"PYTHONPATH": str(lab.parent)},
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.strip()

    assert answer() == "2"
    (lab / "base.py").write_text(SOURCES["base.py"].replace("return 1", "return 50"))
    assert answer() == "100"
