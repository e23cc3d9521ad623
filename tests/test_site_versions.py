"""The versions of the site: each appears whole, or is built again."""

from __future__ import annotations

import subprocess
from importlib import import_module
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[1] / "studies"


def test_a_version_whose_build_fails_is_not_taken_for_built(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(STUDIES)
    site_versions = import_module("site_versions")
    monkeypatch.setattr(site_versions, "FOLDER", tmp_path)
    ends_with_error = True

    def run(command, **_):
        if "--site-dir" not in command:
            return
        place = Path(command[command.index("--site-dir") + 1])
        place.mkdir(exist_ok=True)
        (place / "index.html").write_text("begun")
        if ends_with_error:
            raise subprocess.CalledProcessError(1, "mkdocs")

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(subprocess.CalledProcessError):
        site_versions.build(tmp_path, "v1.0.0")
    assert not (tmp_path / "v1.0.0").exists()
    ends_with_error = False
    for _ in range(2):
        site_versions.build(tmp_path, "v1.0.0")
    assert (tmp_path / "v1.0.0" / "index.html").is_file()
