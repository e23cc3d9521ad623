"""Compiled kernels are kept by the content that they were compiled from."""

from __future__ import annotations

import importlib
import os
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

from drake_navbench.processes import cache_folder, kernel_cache, kernel_sources
from drake_navbench.processes.cache_folder import OWN_VARIABLE, READ_ONLY_VARIABLE
from drake_navbench.processes.kernel_cache import KernelPlace

SOURCES = {
    "__init__.py": "",
    "base.py": "from numba import njit\nfrom drake_navbench.kernels.angles import wrap\n\n"
    "@njit(cache=True)\ndef one():\n    return 1\n",
    "caller.py": "from numba import njit\nfrom lab.base import one\n\n"
    "@njit(cache=True)\ndef two():\n    return 2 * one()\n",
    "far.py": "import lab.caller\n",
    "types_alone.py": "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n"
    "    from lab import far\n\n@njit(cache=True)\ndef three(far): ...\n",
    "inner.py": "from numba.extending import register_jitable\n\nif TYPE_CHECKING:\n"
    "    from lab import far\n\n@register_jitable\ndef four(far): ...\n",
    "later.py": "import lab.apart\n\ndef f():\n    from lab.base import one\n",
    "apart.py": "import drake_navbench.kernels.angles\n",
    "foreign.py": "import numpy\n",
}


@pytest.fixture
def lab(tmp_path) -> Path:
    folder = tmp_path / "lab"
    folder.mkdir()
    for name, text in SOURCES.items():
        (folder / name).write_text(text)
    return folder


def forget() -> None:
    """Lets sources be read again, as in a new process."""
    for remembered in ("digest_of_module", "_read", "_imports", "_file_in", "_with_tuples"):
        getattr(kernel_sources, remembered).cache_clear()


def digests(lab: Path) -> dict[str, str | None]:
    """The digests of the package's modules, as a new process finds them."""
    forget()
    return {
        file.stem: kernel_sources.digest_of_module(f"lab.{file.stem}", file)
        for file in lab.glob("[a-z]*.py")
    }


def changed_by(lab: Path, name: str) -> set[str]:
    """The modules whose digest changes with the text of one."""
    before = digests(lab)
    (lab / name).write_text("# changed\n" + SOURCES[name])
    after = digests(lab)
    return {module for module in before if after[module] != before[module]}


def test_who_imports_what_has_changed_is_compiled_anew_however_far(lab):
    assert changed_by(lab, "base.py") == {"base", "caller", "far", "inner", "types_alone"}
    assert changed_by(lab, "apart.py") == {"apart", "later"}


def test_a_tuple_that_a_kernel_takes_counts_though_it_is_not_imported(tmp_path, monkeypatch):
    controllers = tmp_path / "controllers"
    texts = {
        "mine/kernel.py": "from numba import njit\n\n@njit(cache=True)\ndef x(place):\n"
        "    return place.x\n",
        "mine/place.py": "class Place(NamedTuple):\n    x: float\n    y: float\n",
        "mine/words.py": "x = 1\n",
        "other/place.py": "class Place(NamedTuple):\n    x: float\n",
    }
    for name, text in texts.items():
        (controllers / name).parent.mkdir(parents=True, exist_ok=True)
        (controllers / name).write_text(text)
    folders = {"drake_navbench.controllers": controllers}
    monkeypatch.setattr(kernel_sources, "packages_with_kernels", lambda: folders)

    def digest() -> str | None:
        forget()
        kernel = controllers / "mine" / "kernel.py"
        return kernel_sources.digest_of_module("drake_navbench.controllers.mine.kernel", kernel)

    def changes(name: str) -> bool:
        before = digest()
        (controllers / name).write_text(texts[name].replace("x", "z"))
        return digest() != before

    # With x and y exchanged a kernel that is kept would return y.
    assert [name for name in texts if changes(name)] == ["mine/kernel.py", "mine/place.py"]
    forget()


def test_neither_times_nor_the_folder_enter(lab, tmp_path):
    before = digests(lab)
    os.utime(lab / "base.py", (0, 0))
    assert digests(lab) == before
    assert digests(lab.rename(tmp_path / "moved")) == before


def test_a_module_of_others_that_imports_nothing_of_ours_is_left_to_numba(lab):
    found = digests(lab)
    assert [name for name, digest in found.items() if digest is None] == ["foreign"]
    assert KernelPlace.from_function(test_neither_times_nor_the_folder_enter, "<stdin>") is None


def test_another_compiler_or_instruction_set_has_kernels_of_its_own(lab, monkeypatch):
    before = digests(lab)
    monkeypatch.setattr(kernel_sources, "compiler", lambda: "numba 1, another processor")
    after = digests(lab)
    assert all(after[name] != digest for name, digest in before.items() if digest)


@pytest.fixture
def folders(tmp_path, monkeypatch) -> tuple[Path, Path]:
    """The folder of compiled kernels, and that of a wheel."""
    ours, wheel = tmp_path / "kernels", tmp_path / "wheel"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(ours))
    monkeypatch.delenv(OWN_VARIABLE, raising=False)
    monkeypatch.delenv(READ_ONLY_VARIABLE, raising=False)
    monkeypatch.setattr(cache_folder, "IN_THE_WHEEL", wheel)
    return ours, wheel


def place() -> Path:
    """The folder of the kernels of a module of ours."""
    from drake_navbench.kernels import angles

    found = KernelPlace.from_function(angles.wrap.py_func, angles.__file__)
    assert found is not None
    return Path(found.get_cache_path())


def test_what_a_wheel_brings_is_copied_when_it_is_asked_for(folders):
    ours, wheel = folders
    name = place().name
    assert not ours.exists()
    for folder in (name, "drake_navbench.kernels.angles-0123456789abcdef"):
        (wheel / folder).mkdir(parents=True)
        (wheel / folder / "angles.wrap-1.py311.1.nbc").write_bytes(b"code")
    assert place() == ours / name
    assert [path.name for path in ours.iterdir()] == [name]
    assert (ours / name / "angles.wrap-1.py311.1.nbc").read_bytes() == b"code"


def test_kernels_of_another_compiler_are_told_in_a_line(folders):
    _, wheel = folders
    assert kernel_cache.notice_of_wheel() == ""
    wheel.mkdir()
    (wheel / "compiler.txt").write_text(f"{kernel_sources.compiler()}\n")
    assert kernel_cache.notice_of_wheel() == ""
    (wheel / "compiler.txt").write_text("numba 0.1, llvmlite 0.1, Python 3.11, x86-64-v3\n")
    told = kernel_cache.notice_of_wheel()
    assert told.startswith("The wheel's kernels are of numba 0.1, llvmlite 0.1, Python 3.11, x86-")
    assert len(told.splitlines()) == 1


def test_older_sources_kernels_are_removed_after_a_month_without_use(folders):
    ours, _ = folders
    module = "drake_navbench.kernels.angles"
    for days, name in {31: f"{module}-old", 29: f"{module}-used", 99: f"{module}_b-x"}.items():
        (ours / name).mkdir(parents=True)
        then = time.time() - days * kernel_cache.DAY_S
        os.utime(ours / name, (then, then))
    new = place()
    from drake_navbench.kernels import angles

    KernelPlace.from_function(angles.wrap.py_func, angles.__file__).ensure_cache_path()
    left = {path.name for path in ours.iterdir()}
    assert left == {f"{module}-used", f"{module}_b-x", new.name}


@pytest.mark.usefixtures("folders")
def test_a_kernel_in_use_is_noted_once_a_day():
    found = place()
    found.mkdir(parents=True)
    os.utime(found, (1.0, 1.0))
    assert time.time() - place().stat().st_mtime < kernel_cache.DAY_S


@pytest.mark.usefixtures("folders", "site_folder")
def test_a_changed_kernel_is_what_its_caller_calls(lab):
    """numba alone would answer 2 both times: the caller's file is the same."""

    def answer() -> int:
        # As a new process, which has imported none of them.
        forget()
        for module in ("lab.caller", "lab.base", "lab"):
            sys.modules.pop(module, None)
        importlib.invalidate_caches()
        return import_module("lab.caller").two()

    assert answer() == 2
    caller = sys.modules["lab.caller"].two
    assert answer() == 2
    # Of the same sources the second process compiles nothing.
    assert caller.stats.cache_misses
    assert sys.modules["lab.caller"].two.stats.cache_hits
    # A file of another length, so that Python reads it again within the same second.
    (lab / "base.py").write_text(SOURCES["base.py"].replace("return 1", "return 50"))
    assert answer() == 100


def test_a_module_with_kernels_is_imported_by_name_alone():
    """The sources of a kernel are found by the words of its imports: none may be hidden."""
    hidden = [
        name
        for name, file in kernel_sources.modules_with_kernels()
        if any(word in file.read_text() for word in ("import_module(", "__import__(", "\nfrom ."))
    ]
    assert hidden == []
