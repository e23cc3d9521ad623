"""The package as somebody gets it who has nothing else: a wheel, tried from an empty folder."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from drake_navbench.inputs.presets import DEFAULT_PRESETS

REPOSITORY = Path(__file__).parents[1]
WORLD = "static_obstacles"
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_what_a_package_index_shows_has_no_link_that_leads_nowhere():
    text = (REPOSITORY / PROJECT["readme"]).read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert links
    assert all(link.startswith("https://") for link in links)


def test_the_citation_is_of_this_version():
    citation = (REPOSITORY / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {PROJECT['version']}\n" in citation
    assert f"\nlicense: {PROJECT['license']}\n" in citation
    assert "name: drake_navbench developers" in citation
    assert "doi" not in citation.lower()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this tree, built from a copy that has no more than what is committed."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    files = subprocess.run(
        ["git", "ls-files", "-z"], cwd=REPOSITORY, capture_output=True, text=True, check=True
    ).stdout.split("\0")
    for name in filter(None, files):
        if (REPOSITORY / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((REPOSITORY / name).read_bytes())
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    command += ["--no-build-isolation", "--wheel-dir", folder, source]
    subprocess.run(command, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.long
def test_the_wheel_works_from_an_empty_folder(wheel, tmp_path):
    """Installed apart; what it depends on is taken from where this test runs."""
    site, empty = tmp_path / "site", tmp_path / "empty"
    empty.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, "-m", "drake_navbench", *arguments],
            cwd=empty,
            env=os.environ | {"PYTHONPATH": str(site), "COLUMNS": "100"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    where = "import drake_navbench as own; print(own.__file__)"
    found = subprocess.run(
        [sys.executable, "-c", where],
        cwd=empty,
        env=os.environ | {"PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.startswith(str(site))
    assert "wheelchair" in run("list")
    run("run", "empty", "--controllers", "rpp", "--trials", "1", "--jobs", "1", "--out", "out")
    text = (empty / "out" / "report.html").read_text(encoding="utf-8")
    assert 'id="chart-data"' in text
    assert (empty / "out" / "replays" / "empty.html").is_file()
    log = "out/trials/empty/rpp/trial_000.parquet"
    run("replay", log)
    assert (empty / log).with_suffix(".html").is_file()


@pytest.mark.long
def test_a_wheel_with_kernels_drives_every_default_column_without_compiling(tmp_path):
    spec = importlib.util.spec_from_file_location("wheel", REPOSITORY / ".ci" / "wheel.py")
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    source, site, cache = tmp_path / "source", tmp_path / "site", tmp_path / "cache"
    maker.copy_tracked(REPOSITORY, source)
    brought = source / "drake_navbench" / "compiled_kernels"
    brought.mkdir()
    script = (
        "import importlib.util\n"
        f"spec = importlib.util.spec_from_file_location('wheel', {spec.origin!r})\n"
        "maker = importlib.util.module_from_spec(spec)\n"
        "spec.loader.exec_module(maker)\n"
        f"maker.compile_into(maker.Path({str(brought)!r}), {[*DEFAULT_PRESETS]}, [{WORLD!r}], 2)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
    wheel = maker.build(source, tmp_path / "wheel")
    assert re.search(r"-cp3\d+-none-linux_\w+\.whl$", wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    ask = [sys.executable, "-m", "drake_navbench", "run", WORLD, "--trials", "1"]
    ask += ["--replay", "none", "--figures", "none", "--out"]

    def told(out: str, **environment: str) -> str:
        own = {"PYTHONPATH": str(site), "XDG_CACHE_HOME": str(cache)}
        done = subprocess.run(
            [*ask, str(tmp_path / out)],
            cwd=tmp_path,
            env=os.environ | own | environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout

    assert "Compiling" not in told("first")
    kernels = cache / "drake_navbench" / "kernels"
    there = {path.relative_to(kernels): path.read_bytes() for path in kernels.glob("*/*.nbc")}
    assert len(there) > 200
    assert all((brought / path).read_bytes() == code for path, code in there.items())
    # Elsewhere they are of no use, which is told in a line.
    (site / "drake_navbench" / "compiled_kernels" / "compiler.txt").write_text("numba 0.1\n")
    assert "The wheel's kernels are of numba 0.1; here is numba " in told("second")
