"""The card of a run: how far it is, what changed since the run before, what can be opened."""

from __future__ import annotations

import json

import pytest

from drake_navbench.logs.results import only_run_in
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.run_states import run_states


@pytest.fixture
def folder(tmp_path) -> OpenFolder:
    make_run(tmp_path / "results" / "old", "2026-01-01", lookahead=0.6, trials=2)
    make_run(tmp_path / "new", "2026-01-02", lookahead=0.8, trials=1)
    (tmp_path / "new" / "report.html").write_text("")
    (tmp_path / "new" / "replays").mkdir()
    (tmp_path / "new" / "replays" / "door.html").symlink_to("/etc/hostname")
    return OpenFolder.at(tmp_path)


def make_run(path, created, *, lookahead, trials):
    (path / "inputs" / "controllers").mkdir(parents=True)
    (path / "trials" / "door" / "rpp").mkdir(parents=True)
    for number in range(trials):
        (path / "trials" / "door" / "rpp" / f"trial_{number:03d}.parquet").write_bytes(b"")
    text = f"controller: rpp\nparameters: {{lookahead_dist: {lookahead}, stateful: true}}\n"
    (path / "inputs" / "controllers" / "rpp.yaml").write_text(text)
    manifest = {
        "manifest_version": 1,
        "created": created,
        "scenarios": ["door"],
        "controllers": ["rpp"],
        "verdict": "rpp <b>arrived</b>.",
        "request": {"scenarios": ["door"], "controllers": ["rpp"], "trials": 2, "seed": 0},
    }
    (path / "manifest.json").write_text(json.dumps(manifest))


def test_the_newest_run_comes_first_with_what_it_changed(folder):
    new, old = run_states(folder)
    assert (new.run.name, new.done, new.total, new.can_resume) == ("new", 1, 2, True)
    assert new.changed == ("rpp: lookahead_dist 0.6 → 0.8",)
    assert (old.run.name, old.can_resume, old.changed) == ("old", False, ())


def test_a_page_that_is_a_link_out_of_the_folder_is_not_offered(folder):
    new, _ = run_states(folder)
    assert new.pages == (("report", "new/report.html"),)


def test_a_run_that_is_being_written_is_running_and_not_resumed(folder):
    with only_run_in(folder.root / "new"):
        new, _ = run_states(folder)
        assert (new.is_running, new.can_resume) == (True, False)
    assert not run_states(folder)[0].is_running


def test_a_folder_with_a_broken_manifest_says_so(folder):
    (folder.root / "new" / "manifest.json").write_text("{")
    found = {state.run.name: state for state in run_states(folder)}
    assert found["new"].run.what.startswith("cannot be read: ")
    assert not found["new"].can_resume


def test_what_a_manifest_says_is_shown_as_text(folder):
    from drake_navbench.studio.runs_page import _text

    assert "rpp &lt;b&gt;arrived&lt;/b&gt;." in _text(run_states(folder)[0], None)
