"""Results folders as a list: what they are, and renaming, tagging and deleting them."""

from __future__ import annotations

import json

import pytest

from drake_navbench.commands import runs
from drake_navbench.logs.results import ResultsFolder, only_run_in


@pytest.fixture
def results(tmp_path, monkeypatch):
    """A folder results/ with two runs and a folder that is none."""
    monkeypatch.chdir(tmp_path)
    for name, day in (("b", "01"), ("a", "02")):
        ResultsFolder(tmp_path / "results" / name).write_manifest(
            {
                "scenarios": ["empty"],
                "controllers": ["rpp", "dwb"],
                "created": f"2024-04-{day}T12:00:00+00:00",
                "verdict": "dwb is better than rpp.",
            }
        )
    (tmp_path / "results" / "notes").mkdir()
    return tmp_path / "results"


def told(capsys, *arguments):
    """Returns the exit status of the command, and the lines that it prints."""
    status = runs.main([*arguments])
    shown = capsys.readouterr()
    return status, (shown.out + shown.err).splitlines()


def test_runs_are_listed_with_what_they_are_the_newest_last(results, capsys):
    assert told(capsys) == (
        0,
        [
            "b  2024-04-01T12:00:00+00:00",
            "  rpp, dwb in empty; 0 trials",
            "  dwb is better than rpp.",
            "a  2024-04-02T12:00:00+00:00",
            "  rpp, dwb in empty; 0 trials",
            "  dwb is better than rpp.",
        ],
    )


def test_a_run_of_one_trial_is_called_so(results, capsys):
    for name, trials in (("a", 1), ("b", 2)):
        folder = results / name / "trials" / "empty" / "rpp"
        folder.mkdir(parents=True)
        for number in range(trials):
            (folder / f"trial_{number}.parquet").touch()
    lines = [line for line in told(capsys)[1] if "in empty" in line]
    assert lines == ["  rpp, dwb in empty; 2 trials", "  rpp, dwb in empty; 1 trial"]


def test_runs_are_in_the_order_of_time_wherever_they_were_driven(results, capsys):
    # 11:30 in New York is 15:30 in UTC, after 14:00 in UTC.
    for name, created in (
        ("later", "2024-04-03T11:30:00-04:00"),
        ("c", "2024-04-03T14:00:00+00:00"),
    ):
        ResultsFolder(results / name).write_manifest({"created": created})
    names = [line.split()[0] for line in told(capsys)[1] if "T1" in line]
    assert names == ["b", "a", "c", "later"]


def test_tags_come_and_go_and_choose(results, capsys):
    assert told(capsys, "--tag", "b", "baseline") == (0, ["b: baseline"])
    assert told(capsys, "--only", "baseline")[1][0].startswith("b [baseline]  2024-04-01")
    assert told(capsys, "--only", "other") == (0, ["results: no runs with the tag 'other'"])
    assert told(capsys, "--untag", "b", "baseline") == (0, ["b: no tags"])
    assert told(capsys, "--untag", "b", "baseline")[0] == 2


def test_a_run_gets_another_name_and_is_deleted(results, capsys):
    assert told(capsys, "--rename", "b", "first") == (0, ["results/first"])
    assert (results / "first" / "manifest.json").is_file()
    assert told(capsys, "--delete", "first") == (0, ["deleted results/first"])
    assert sorted(path.name for path in results.iterdir()) == ["a", "notes"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--delete", "notes"], "results: no run 'notes'"),
        (["--delete", "../results/a"], "results: no run '../results/a'"),
        (["--rename", "a", "b"], "--rename a b: results/b exists already"),
        (["--rename", "a", "../c"], "--rename a '../c': expected the name of a folder"),
        (["--rename", "a", "x" * 300], f"results/{'x' * 300}: cannot be written: File name too"),
        (["--tag", "c", "x"], "results: no run 'c'"),
        (["--tag", "a", "x,y"], "a: got the tag 'x,y', expected a word without a comma"),
        (["nowhere"], "nowhere: no such folder; a run makes results/<time>"),
    ],
)
def test_wrong_names_are_one_line_and_change_nothing(results, capsys, arguments, line):
    status, lines = told(capsys, *arguments)
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(line)
    assert sorted(path.name for path in results.iterdir()) == ["a", "b", "notes"]


@pytest.mark.parametrize("change", [["--rename", "a", "c"], ["--delete", "a"]])
def test_a_run_that_is_being_written_is_left_alone(results, capsys, change):
    with only_run_in(results / "a"):
        assert told(capsys, *change)[0] == 2
    assert (results / "a" / "manifest.json").is_file()


def test_a_manifest_that_cannot_be_read_is_told_in_its_place(results, capsys):
    (results / "a" / "manifest.json").write_text(json.dumps([1]))
    status, lines = told(capsys)
    assert status == 0
    assert any("cannot be read" in line for line in lines)
