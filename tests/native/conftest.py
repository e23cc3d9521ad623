"""A build of the tiny checkout, made once for all tests of this folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from drake_navbench.native import flags
from drake_navbench.native.build import build_checkout
from drake_navbench.native.builds import Build
from drake_navbench.native.compiler import Compiler

CHECKOUT = Path(__file__).parent / "checkout"


@pytest.fixture(scope="session")
def build_cache(tmp_path_factory) -> Path:
    """Where builds are kept while tests run.

    Tests that run side by side share the compiled objects, each of which is named by its content.
    """
    cache = tmp_path_factory.mktemp("cache")
    if "PYTEST_XDIST_WORKER" in os.environ:
        objects = tmp_path_factory.getbasetemp().parent / "objects"
        objects.mkdir(exist_ok=True)
        native = cache / "drake_navbench" / "native"
        native.mkdir(parents=True)
        (native / "objects").symlink_to(objects)
    return cache


@pytest.fixture
def builds(build_cache, monkeypatch) -> Path:
    """Lets this test's builds be kept there; without a compiler the test is skipped.

    A host takes 19 s of processor time in place of 34: little is optimized, and nothing when it is
    linked. What optimization must not change is held in test_normal_noise.py.
    """
    if not any(map(shutil.which, ("c++", "g++", "clang++"))):
        pytest.skip("no C++ compiler")
    monkeypatch.setenv("XDG_CACHE_HOME", str(build_cache))
    monkeypatch.setattr(flags, "WHOLE_PROGRAM", ())
    for name in ("RELEASE", "PORTABLE"):
        words = ("-O1" if word == "-O3" else word for word in getattr(flags, name))
        monkeypatch.setattr(flags, name, tuple(words))
    return build_cache


@pytest.fixture
def tiny(builds) -> Build:
    """The build of the tiny controller; compiled by the first test that asks for it."""
    return build_checkout(CHECKOUT, name="tiny")


@pytest.fixture
def copied(builds, tmp_path) -> Path:
    """A copy of the tiny checkout, to be changed."""
    return Path(shutil.copytree(CHECKOUT, tmp_path / "navigation2"))


@pytest.fixture
def sampling(tiny, copied) -> Path:
    """A checkout whose MPPI commands a sample of its noise."""
    shutil.copytree(CHECKOUT.parent / "sampling_package", copied / "nav2_mppi_controller")
    return copied


@pytest.fixture
def nothing_compiled(copied, tmp_path, monkeypatch) -> None:
    """Objects and hosts are empty files, for tests of which of them are made, and with what.

    The compiler still tells its options and which headers there are.
    """

    def run(compiler: Compiler, arguments: Sequence[str], log: Path) -> None:
        places = dict(pairwise(arguments))
        Path(places["-o"]).touch()
        if "-MF" in places:
            Path(places["-MF"]).write_text("a.o: \n")

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "uncompiled"))
    monkeypatch.setattr(Compiler, "run", run)
