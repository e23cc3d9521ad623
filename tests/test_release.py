"""A release is made of a tag, and refused where a file speaks of another version."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
FILES = ("pyproject.toml", "drake_navbench/processes/version.py", "CITATION.cff", "CHANGELOG.md")


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("release", REPOSITORY / ".ci" / "release.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def git(folder, *words):
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", "-C", str(folder), *who, *words], check=True, capture_output=True)


@pytest.fixture
def tree(tmp_path):
    """A repository with the four files that name the version, all 0.1.0."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(REPOSITORY / name, tmp_path / name)
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## 0.1.0 (2026-01-01)\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "all")
    return tmp_path


def test_the_version_is_that_of_the_tag(maker, tree):
    git(tree, "tag", "v0.1.0")
    assert maker.version_of_tag(tree) == "0.1.0"
    assert maker.wrong_versions(tree, "0.1.0") == []


def test_without_a_tag_or_with_changes_there_is_no_release(maker, tree, capsys):
    assert maker.release(tree) == 2
    assert "expected one tag vX.Y.Z at HEAD, got none" in capsys.readouterr().err
    git(tree, "tag", "v0.1.0")
    (tree / "CITATION.cff").write_text("version: 0.1.0\n")
    assert maker.release(tree) == 2
    assert "the tree has changes: M CITATION.cff" in capsys.readouterr().err


def test_every_file_of_another_version_is_named(maker, tree, capsys):
    git(tree, "tag", "v0.2.0")
    assert maker.release(tree) == 2
    told = capsys.readouterr().err
    assert all(f"{name}: version 0.1.0, expected 0.2.0" in told for name in FILES)


def test_an_unreleased_changelog_is_refused(maker, tree):
    (tree / "CHANGELOG.md").write_text("# Changelog\n\n## Unreleased\n")
    assert maker.wrong_versions(tree, "0.1.0") == [
        "CHANGELOG.md: version Unreleased, expected 0.1.0"
    ]


def test_a_wheel_or_sdist_that_lacks_a_file_is_found(maker, tmp_path):
    wheel, sdist = tmp_path / "a-1.whl", tmp_path / "a-1.tar.gz"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name in maker.IN_THE_WHEEL[1:]:
            archive.writestr(name, "")
        archive.writestr("drake_navbench-1.dist-info/METADATA", "")
    assert maker.lacking(wheel, "1") == [maker.IN_THE_WHEEL[0]]
    with tarfile.open(sdist, "w:gz"):
        pass
    assert maker.lacking(sdist, "1") == list(maker.IN_THE_SDIST)


@pytest.mark.long
def test_wheel_and_sdist_of_this_commit_are_built_and_drive(maker, tmp_path):
    """Minutes: two environments get Drake and all else."""
    archives = maker.build(REPOSITORY, tmp_path)
    assert len(archives) == 2
    version = maker.wrong_versions(REPOSITORY, "")[0].split("version ")[1].split(",")[0]
    for archive in archives:
        assert maker.lacking(archive, version) == []
        maker.install_and_try(archive, tmp_path)
