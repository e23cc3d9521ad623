"""`drake-navbench replay LOG`: any trial on demand, anything else one line."""

from __future__ import annotations

import pandas as pd
import pytest
from replay_logs import replay_log

from drake_navbench.analysis.worst_trial import worst_trial
from drake_navbench.commands.main import main
from drake_navbench.logs.results import ResultsFolder


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "trial_003.parquet"
    replay_log("rpp", info={"trial": 3, "seed": 77}, end_time_s=1.0).write(path)
    return path


def test_the_page_shows_that_trial_and_stands_beside_its_log(path, capsys):
    assert main(["replay", str(path)]) == 0
    page = path.with_suffix(".html")
    assert capsys.readouterr().out == f"{page}\n"
    assert "trial 3, seed 77" in page.read_text(encoding="utf-8")


def test_it_goes_where_it_is_asked_to(path, tmp_path):
    assert main(["replay", str(path), "--out", str(tmp_path / "own" / "page.html")]) == 0
    assert (tmp_path / "own" / "page.html").is_file()


def refused(capsys, *arguments) -> str:
    assert main(["replay", *map(str, arguments)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    return told


def test_a_page_replaces_none_of_the_files_that_it_draws(path, tmp_path, capsys):
    content = path.read_bytes()
    told = refused(capsys, path, "--out", path.parent / "." / path.name)
    assert told == f"--out {path}: would replace what is drawn; expected another file\n"
    assert path.read_bytes() == content


def test_a_trial_that_cannot_be_driven_again_is_not_explained(path, tmp_path, capsys):
    told = refused(capsys, path, "--why", "--out", tmp_path / "page.html")
    assert told.startswith(f"--why: {path}: ")
    assert not (tmp_path / "page.html").exists()


def test_a_torn_log_is_one_line_and_leaves_no_page(path, tmp_path, capsys):
    torn = tmp_path / "torn.parquet"
    torn.write_bytes(path.read_bytes()[:2000])
    assert "not a readable trial log" in refused(capsys, torn)
    assert list(tmp_path.iterdir()) == [torn]


def test_a_foreign_file_is_one_line(path, tmp_path, capsys):
    foreign = tmp_path / "foreign.parquet"
    pd.DataFrame({"a": [1]}).to_parquet(foreign)
    assert "a Parquet file, but not a trial log" in refused(capsys, foreign)
    assert "no such file" in refused(capsys, tmp_path / "none.parquet")


def test_a_log_whose_robot_is_none_is_one_line(tmp_path, capsys):
    path = tmp_path / "odd.parquet"
    replay_log("rpp", info={"robot": {"model": 3}}, end_time_s=1.0).write(path)
    assert f"{path}: scenario or robot in the log: " in refused(capsys, path)


def test_a_model_that_cannot_be_drawn_is_one_line(path, tmp_path, capsys):
    model = tmp_path / "robot.sdf"
    assert f"--model {model}: no such file" in refused(capsys, path, "--model", model)
    model.write_text("<sdf>")
    assert f"{model}: is not XML" in refused(capsys, path, "--model", model)


def test_of_a_folder_the_worst_trial_is_shown(tmp_path, capsys):
    folder = ResultsFolder(tmp_path / "results")
    for trial, (outcome, clearance_m) in enumerate(
        [("succeeded", 0.01), ("aborted", 0.5), ("collided", 0.3), ("collided", 0.2)]
    ):
        info = {"trial": trial, "seed": trial}
        log = replay_log("rpp", end_time_s=1.0, outcome=outcome, clearance_m=clearance_m, info=info)
        folder.write_log(log)
    folder.write_manifest({"scenarios": ["beside_a_box"], "controllers": ["rpp"]})
    page = tmp_path / "worst.html"
    assert main(["replay", str(folder.path), "--out", str(page)]) == 0
    assert "trial 3, seed 3" in page.read_text()
    # To give up an impossible task is right.
    expected = {"scenario": dict(log.info["scenario"]) | {"expected_outcome": "aborted"}}
    right = replay_log("rpp", end_time_s=1.0, outcome="aborted", info={"trial": 0} | expected)
    late = replay_log("rpp", end_time_s=1.0, outcome="timed_out", info={"trial": 1} | expected)
    other = ResultsFolder(tmp_path / "other")
    other.write_manifest({})
    assert main(["replay", str(other.path)]) == 2
    assert "none of its trials has ended" in capsys.readouterr().err
    for each in (right, late):
        other.write_log(each)
    assert worst_trial(other.path).name == "trial_001.parquet"
