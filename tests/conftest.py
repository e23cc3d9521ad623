"""Settings of the whole test suite, and what many tests need."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from hypothesis import settings

from drake_navbench.plugins import forget_installed

# The first call of a kernel compiles it; that is no fault of the property under test.
settings.register_profile("no_deadline", deadline=None, derandomize=True)
settings.load_profile("no_deadline")

# Entry points of a package: group -> name -> value, such as "module:Class".
EntryPoints = Mapping[str, Mapping[str, str]]


@pytest.fixture
def install_package(tmp_path, monkeypatch) -> Iterator[Callable[[str, str, EntryPoints], Path]]:
    """A function that installs a package with plugins, as pip lays it out, for one test.

    It takes the package's name, the code of its module of the same name, and its entry points.
    """
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    packages = []

    def install(package: str, code: str, entry_points: EntryPoints) -> Path:
        (tmp_path / package).mkdir()
        (tmp_path / package / f"{package}.py").write_text(textwrap.dedent(code), encoding="utf-8")
        metadata = tmp_path / f"{package}-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n"
        )
        (metadata / "entry_points.txt").write_text(
            "".join(
                f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in points.items())
                for group, points in entry_points.items()
            )
        )
        packages.append(package)
        forget_installed()
        return tmp_path / package

    yield install
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in packages:
            del sys.modules[name]
    forget_installed()
