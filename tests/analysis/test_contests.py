"""Which columns and tasks are set against each other, and the verdict in words."""

from __future__ import annotations

import pandas as pd
import pytest
from results_folders import measured_folder

from drake_navbench.analysis.contests import (
    Match,
    by_task,
    contest_of,
    matches_between,
    matches_within,
    read_matches,
)
from drake_navbench.analysis.pair_verdict import pair_verdicts, verdicts_within
from drake_navbench.analysis.paired_tests import judge_pairs
from drake_navbench.commands import compare as command
from drake_navbench.commands import replay
from drake_navbench.errors import InputError
from drake_navbench.logs.log import TrialLog


def trials(times, *, column, failed=(), suite="map"):
    """Returns a table with one trial a task; those in `failed` were aborted."""
    return pd.DataFrame(
        {
            "scenario": [f"{suite}_{number}" for number in range(len(times))],
            "controller": column,
            "seed": range(100, 100 + len(times)),
            "trial": 0,
            "outcome": ["aborted" if n in failed else "succeeded" for n in range(len(times))],
            "reason": "",
            "time_to_goal_s": times,
        }
    )


SUITES = {f"map_{number}": "map" for number in range(40)}
A = trials([10.0 + 0.1 * n for n in range(20)], column="a")
B = trials([9.0 + 0.11 * n for n in range(20)], column="b")


def test_equal_names_are_paired_and_then_the_one_column_that_each_has_left():
    assert matches_between(["rpp", "old"], ["rpp", "new"]) == [
        Match("rpp", "rpp"),
        Match("old", "new"),
    ]
    # Two left on one side: nobody can say which.
    assert matches_between(["old"], ["new", "newer"]) == []
    asked = [Match("old", "newer")]
    assert matches_between(["old"], ["new", "newer"], asked) == asked


def test_columns_of_whole_files_are_paired_by_their_plugin():
    files = {
        "A": {"FollowPath": "A/FollowPath", "Slow": "A/Slow"},
        "B": {"Slow": "B/Slow", "FollowPath": "B/FollowPath"},
    }
    columns = ["A/FollowPath", "A/Slow", "B/Slow", "B/FollowPath"]
    assert matches_within(columns, files) == [
        Match("A/FollowPath", "B/FollowPath"),
        Match("A/Slow", "B/Slow"),
    ]
    # The first file is that of the first column, whatever the order of their names.
    by_alphabet = {"new": {"FollowPath": "new"}, "old": {"FollowPath": "old"}}
    assert matches_within(["old", "new"], by_alphabet) == [Match("old", "new")]
    assert matches_within(["x", "y", "z"], {}) == [Match("x", "y"), Match("x", "z")]


def test_runs_of_single_files_are_paired_by_file_and_then_by_plugin():
    alone = {"old": {"FollowPath": "old/FollowPath", "Slow": "old/Slow"}}
    other = {"new": {"FollowPath": "new/FollowPath", "Fast": "new/Fast", "Slow": "new/Slow"}}
    columns = [list(own.values()) for files in (alone, other) for own in files.values()]
    # Last week's run of the file alone, and this week's of the file beside another one.
    beside = {"old": {"FollowPath": "old"}, "new": {"FollowPath": "new"}}
    before = {"old": {"FollowPath": "old/FollowPath"}}
    assert matches_between(["old/FollowPath"], ["old", "new"], files=(before, beside)) == [
        Match("old/FollowPath", "old")
    ]
    assert matches_between(*columns, files=(alone, other)) == [
        Match("old/FollowPath", "new/FollowPath"),
        Match("old/Slow", "new/Slow"),
    ]


@pytest.mark.parametrize("text", ["a", "a=", "=b"])
def test_a_match_is_two_names(text):
    with pytest.raises(InputError, match="expected OLD=NEW"):
        read_matches([text], ["a"], ["b"])


@pytest.mark.parametrize(
    ("old", "new"),
    [("rpp:a=1", "rpp:a=2"), ("rpp:a=1", "rpp"), ("rpp", "rpp:a=1:b=2"), ("a=b=c", "d")],
)
def test_names_with_equals_signs_are_parted_where_both_are_columns(old, new):
    assert read_matches([f"{old}={new}"], [old, "x"], [new, "y"]) == [Match(old, new)]


def test_a_match_that_may_be_two_is_refused():
    with pytest.raises(InputError, match="means 'a' with 'b=c' or 'a=b' with 'c'"):
        read_matches(["a=b=c"], ["a", "a=b"], ["c", "b=c"])


def test_of_a_match_with_one_known_name_the_other_is_told():
    (found,) = read_matches(["rpp:a=1=dbw"], ["rpp:a=1"], ["dwb"])
    with pytest.raises(InputError, match="no column 'dbw'; did you mean 'dwb'"):
        matches_between(["rpp:a=1"], ["dwb"], [found])


def test_a_column_that_is_not_there_is_named():
    with pytest.raises(InputError, match="--match: no column 'olt'; did you mean 'old'"):
        matches_between(["old"], ["new"], [Match("olt", "new")])


def test_a_task_counts_once_however_many_trials_it_has():
    twice = pd.concat([A, A.assign(seed=A["seed"] + 1000, time_to_goal_s=A["time_to_goal_s"] + 2)])
    twice.iloc[0, twice.columns.get_loc("outcome")] = "collided"
    found = by_task(twice, SUITES)
    assert len(found) == 20
    assert set(found["scenario"]) == {"map"}
    # The mean of 10 and 12 s; one trial of two touched something.
    assert found["time_to_goal_s"].iloc[0] == pytest.approx(11.0)
    assert list(found["outcome"][:2]) == ["collided", "succeeded"]


def test_the_verdict_pools_the_tasks_of_a_map():
    (verdict,) = verdicts_within(pd.concat([A, B]), {}, SUITES)
    assert (
        verdict.text
        == "b is better than a, in time to the goal, and is not shown to be worse in anything."
    )
    (detail,) = verdict.details
    assert detail.startswith("time to the goal better in map: 10.9 -> 10 s (-0.9, 95% ")


def test_what_is_better_and_worse_is_told_together():
    late = trials(list(B["time_to_goal_s"]), column="b", failed=range(10))
    (verdict,) = pair_verdicts(
        judge_pairs([contest_of(A, late, [Match("a", "b")], SUITES, "folder")])
    )
    assert verdict.text.startswith("b is ")
    assert "worse" in verdict.text
    assert "arrivals worse in map: 20 -> 10 of 20" in verdict.details


def test_nothing_shown_says_how_many_trials_would_decide():
    late = trials(list(A["time_to_goal_s"]), column="b", failed=[3])
    (verdict,) = verdicts_within(pd.concat([A, late]), {}, SUITES)
    assert verdict.text.startswith(
        "no difference is shown between a and b in 20 pairs (arrivals 20 -> 19; about "
    )


def folder_of(path, column, **how):
    """Writes a results folder of which one column is left."""
    folder = measured_folder(path, **how)
    for log in folder.glob("trials/*/*/*.parquet"):
        if TrialLog.read(log).info["controller"] != column:
            log.unlink()
    return folder


@pytest.fixture(scope="module")
def renamed(tmp_path_factory):
    """Two folders with the same scenarios and one column each, of different names."""
    root = tmp_path_factory.mktemp("renamed")
    return folder_of(root / "first", "rpp"), folder_of(root / "second", "rpp:v=0.4")


def test_folders_with_one_column_each_are_compared_whatever_its_name(renamed, capsys):
    assert command.main([*map(str, renamed), "--jobs", "1"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith(
        "3 pairs are too few to show a difference between rpp and rpp:v=0.4 (time to the goal 5.99 "
        "-> 7.49 s in empty; about 8 pairs would decide).\n"
    )


def test_columns_of_other_names_are_compared_where_they_are_matched(tmp_path, capsys):
    folder = measured_folder(tmp_path / "both")
    arguments = [str(folder), str(folder), "--jobs", "1", "--match", "rpp:v=0.4=rpp"]
    assert command.main(arguments) == 0
    assert "a difference between rpp:v=0.4 and rpp (time" in capsys.readouterr().out


def test_a_page_says_the_verdict_first_and_names_what_makes_the_replays(renamed, tmp_path):
    page = tmp_path / "compare.html"
    command.main([*map(str, renamed), "--jobs", "1", "--html", str(page)])
    text = page.read_text(encoding="utf-8")
    body = text[text.index("<body>") :]
    assert body.index('class="lead verdict"') < body.index("Parameters that differ")
    # Each word of the command in an element of its own, so that no option is broken.
    assert "<span>drake-navbench</span> <span>replay</span>" in body
    assert "<span>--beside</span>" in body
    # 3 m at 0.5 and at 0.4 m/s.
    assert "Time to the goal in empty" in body
    assert "<script" not in text


def test_columns_of_one_folder_are_compared_with_its_first(renamed, tmp_path, capsys):
    folder = measured_folder(tmp_path / "both")
    assert command.main([str(folder), "--jobs", "1"]) == 0
    assert "between rpp and rpp:v=0.4" in capsys.readouterr().out
    assert command.main([str(renamed[0]), "--jobs", "1"]) == 2
    assert "has one column; expected a second folder" in capsys.readouterr().err


def test_two_trials_of_one_column_are_no_race(renamed, tmp_path, capsys):
    log = str(next(renamed[0].glob("trials/empty/*/*.parquet")))
    assert replay.main([log, "--beside", log, "--out", str(tmp_path / "x.html")]) == 2
    assert "both are of the column 'rpp'" in capsys.readouterr().err
