"""What of the system an object is compiled with: it is compiled again where that has changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_navbench.native.build import build_checkout
from drake_navbench.native.objects import system_headers


@pytest.fixture
def library(copied, tmp_path, monkeypatch) -> Path:
    """The header of a library of the system, which one source of the checkout includes."""
    header = tmp_path / "library" / "vendor" / "vendor.hpp"
    header.parent.mkdir(parents=True)
    header.write_text("#define VENDOR 1\n")
    monkeypatch.setenv("CPATH", str(tmp_path / "library"))
    source = copied / "tiny_controller" / "src" / "tiny_controller.cpp"
    lines = "#include <vendor/vendor.hpp>\nextern const int vendor; const int vendor = VENDOR;\n"
    source.write_text(lines + source.read_text())
    return header


def _compiled(checkout: Path) -> tuple[list[str], Path]:
    told: list[str] = []
    build = build_checkout(checkout, name="vendors", tell=told.append)
    return told, build.host


def test_another_header_of_the_system_compiles_what_includes_it(tiny, copied, library):
    first, host = _compiled(copied)
    assert first[0] == "[1/1] tiny_controller.cpp"
    assert _compiled(copied) == (["0 files compiled, 3 taken from the cache"], host)
    library.write_text("#define VENDOR 2\n")
    again, other = _compiled(copied)
    assert again == ["[1/1] tiny_controller.cpp", "1 files compiled, 2 taken from the cache"]
    assert other != host


def test_a_header_that_is_gone_counts_as_another(tiny, copied, library, monkeypatch):
    _compiled(copied)
    moved = library.parents[2] / "newer" / "vendor" / "vendor.hpp"
    moved.parent.mkdir(parents=True)
    library.rename(moved)
    monkeypatch.setenv("CPATH", str(moved.parents[1]))
    assert _compiled(copied)[0][0] == "[1/1] tiny_controller.cpp"


def test_headers_of_the_system_are_those_in_no_folder_of_ours():
    rule = (
        "/cache/a.o: /mine/src/a.cpp /usr/include/math.h \\\n"
        " /mine/include/../include/a.hpp /usr/include/c++/12/../12/cmath \\\n"
        " /opt/a\\ library/$$b.hpp\n"
    )
    found = system_headers(rule, [Path("/mine/src"), Path("/mine/src/../include")])
    assert found == ["/opt/a library/$b.hpp", "/usr/include/c++/12/cmath", "/usr/include/math.h"]
