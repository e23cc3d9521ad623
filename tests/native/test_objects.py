"""What of the system an object is compiled with: it serves as long as that is the same."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from drake_navbench.native.objects import Objects, Unit, system_headers


class _Compiler:
    """Compiles nothing, and says that a source includes its neighbour and one other header."""

    def __init__(self, header: Path) -> None:
        self.header = header

    def run(self, arguments: Sequence[str], log: Path) -> None:
        places = dict(pairwise(arguments))
        source = Path(places["-c"])
        Path(places["-o"]).write_text("compiled")
        rule = f"a.o: {source} {source.with_suffix('.hpp')} \\\n {self.header}\n"
        Path(places["-MF"]).write_text(rule)


@pytest.fixture
def unit(tmp_path, monkeypatch) -> Unit:
    """A source of a checkout with a header beside it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for name in ("a.cpp", "a.hpp"):
        (tmp_path / "src" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "src" / name).write_text("")
    return Unit(tmp_path / "src" / "a.cpp", (), ("-O2",), "ab" + 62 * "0")


@pytest.fixture
def header(tmp_path) -> Path:
    """A header of a library of the system."""
    path = tmp_path / "library" / "vendor.hpp"
    path.parent.mkdir()
    path.write_text("one")
    return path


def _compile(unit: Unit, header: Path) -> str:
    objects = Objects()
    assert objects.system_digest(unit) is None
    objects.compile(unit, _Compiler(header), Path("log"))
    digest = objects.system_digest(unit)
    assert digest is not None
    return digest


def test_an_object_serves_as_long_as_the_systems_headers_are_the_same(unit, header):
    first = _compile(unit, header)
    assert Objects().system_digest(unit) == first
    header.write_text("two")
    second = _compile(unit, header)
    assert second != first
    header.unlink()
    assert Objects().system_digest(unit) is None


def test_the_checkouts_own_headers_are_not_the_systems(unit, header):
    first = _compile(unit, header)
    # They are in the unit's own digest.
    unit.source.with_suffix(".hpp").write_text("another")
    assert Objects().system_digest(unit) == first


def test_nothing_is_left_beside_an_object_and_its_record(unit, header):
    _compile(unit, header)
    assert sorted(p.suffix for p in unit.object.parent.iterdir()) == [".json", ".o"]
    unit.object.with_suffix(".json").write_text("[1, 2")
    assert Objects().system_digest(unit) is None


def test_the_compiler_tells_the_systems_headers_and_none_of_ours(tiny, builds):
    folder = builds / "drake_navbench" / "native" / "objects"
    records = [json.loads(path.read_text()) for path in folder.rglob("*.json")]
    headers = {path for record in records for path in record["headers"]}
    assert any(path.endswith("/cmath") for path in headers)
    assert not [path for path in headers if "drake_navbench" in path or "tiny" in path]


def test_headers_of_the_system_are_those_in_no_folder_of_ours():
    rule = (
        "/cache/a.o: /mine/src/a.cpp /usr/include/math.h \\\n"
        " /mine/include/../include/a.hpp /usr/include/c++/12/../12/cmath \\\n"
        " /opt/a\\ library/$$b.hpp\n"
    )
    found = system_headers(rule, [Path("/mine/src"), Path("/mine/src/../include")])
    assert found == ["/opt/a library/$b.hpp", "/usr/include/c++/12/cmath", "/usr/include/math.h"]
