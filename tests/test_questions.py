"""Studies of open questions: their judgement, by hand-worked rows, and what their pages ship."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.statistics import exact_share_interval
from drake_navbench.ros2.recordings.drive_data import DriveData
from drake_navbench.ros2.recordings.drive_fit import AxisFit, DriveFit

STUDIES = Path(__file__).parents[1] / "studies"
PAGES = Path(__file__).parents[1] / "docs" / "questions"
# Of the recordings no trial is driven.
NAMES = sorted(path.stem for path in PAGES.glob("*.csv") if not path.stem.startswith("recordings"))


@pytest.fixture
def shared(monkeypatch):
    monkeypatch.syspath_prepend(str(STUDIES))
    return import_module("question_trials")


@pytest.fixture
def study_of(shared):
    return lambda name: import_module(f"question_{name}").STUDY


def rows_of(arm, outcomes, times_s):
    return pd.DataFrame(
        {
            "arm": arm,
            "seed": np.arange(len(outcomes)),
            "outcome": outcomes,
            "near_time_s": times_s,
        }
    )


def test_a_share_has_its_exact_interval(shared):
    # 0 of n: the upper end u has (1 - u)^n = 0.025.
    low, high = exact_share_interval(0, 12)
    assert (low, high) == (0.0, pytest.approx(1.0 - 0.025 ** (1 / 12)))
    low, high = exact_share_interval(12, 12, confidence=1.0 - 0.05 / 50)
    assert (low, high) == (pytest.approx((0.025 / 50) ** (1 / 12)), 1.0)
    assert shared.share_cell(12, 12) == "12 of 12 (74 to 100%)"


def test_arms_are_paired_by_seed_whatever_their_order(shared):
    times_s = 5.0 + np.arange(12)
    before = rows_of("a", ["aborted"] * 12, times_s)
    after = rows_of("b", ["succeeded"] * 12, times_s).iloc[::-1]
    found = shared.judged(
        pd.concat([before, after]), [("a", "b")], [shared.metric("near_time_s", "s")]
    )
    (arrivals,) = [f for f in found.findings if f.quantity.name == "success_rate"]
    # Twelve coins that all fall alike, on either side: 2 / 2^12, of one test.
    assert arrivals.p_value == pytest.approx(2 / 2**12)
    assert arrivals.comparison.difference == 100.0


def test_equal_rows_are_those_with_every_value_equal(shared):
    rows = rows_of("a", ["succeeded", "aborted", "aborted"], [1.0, math.nan, 3.0])
    other = rows.assign(near_time_s=[1.0, math.nan, 4.0])
    assert shared.equal_rows(rows, rows) == 3
    assert shared.equal_rows(rows, other) == 2
    assert shared.equal_rows(rows, rows.assign(arm="b")) == 0


def test_tables_go_where_the_page_has_a_place_for_them(shared):
    page = "a\n<!-- x -->\nold\n<!-- end of x -->\nb"
    assert shared.filled(page, {"x": "new"}) == "a\n<!-- x -->\nnew\n<!-- end of x -->\nb"
    with pytest.raises(ValueError, match="no place"):
        shared.filled(page, {"y": "new"})


@pytest.mark.parametrize("name", NAMES)
def test_a_page_tells_what_its_rows_tell(shared, study_of, name):
    study = study_of(name)
    rows = shared.read_rows(PAGES / f"{name}.csv")
    assert sorted({*rows["arm"]}) == sorted(arm.name for arm in study.arms)
    assert sorted({*rows["seed"]}) == list(study.seeds)
    assert len(rows) == len(study.arms) * len(study.seeds)
    page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    assert shared.filled(page, study.tell(rows)) == page


@pytest.fixture
def recordings(shared):
    return import_module("question_recordings")


def a_drive(end_s, speed_mps=0.2, commands_every_s=2.0):
    """A drive at a constant speed, every 0.1 s, whose commands alternate about it."""
    time_s = np.arange(0.0, end_s, 0.1)
    still = np.zeros_like(time_s)
    command_time_s = np.arange(0.0, end_s, commands_every_s)
    commands = np.zeros((len(command_time_s), 3))
    commands[:, 0] = speed_mps + 0.05 * (-1.0) ** np.arange(len(command_time_s))
    return DriveData(
        time_s,
        np.column_stack([speed_mps * time_s, still, still]),
        np.column_stack([still + speed_mps, still, still]),
        command_time_s,
        commands,
    )


def test_a_drive_is_cut_in_the_middle_of_its_motion(recordings):
    halves = recordings.halves_of(a_drive(20.0))
    # From 0 to 19.9 s.
    assert halves.first.time_s[-1] == pytest.approx(9.9)
    assert halves.second.time_s[0] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("drive", "reason"),
    [
        (a_drive(10.0), "it moves for 10 s"),
        (a_drive(20.0, speed_mps=0.0), "it never moves"),
        (a_drive(20.0, commands_every_s=9.0), "too little happens in the first half"),
    ],
)
def test_a_drive_that_shows_too_little_is_left_out_with_the_reason(recordings, drive, reason):
    assert recordings.halves_of(drive) == reason


def test_commands_reach_the_base_after_the_dead_time_and_not_within_the_deadband(recordings):
    fit = DriveFit(0.1, 0.3, AxisFit(None, 0.2, 0.0, 0.15), AxisFit(None, None, 0.0, 0.0))
    data = recordings.as_the_base_gets_them(a_drive(4.0), fit)
    assert data.command_time_s.tolist() == [0.3, 2.3]
    assert data.commands[:, 0].tolist() == [0.25, 0.0]


def test_the_page_of_the_recordings_tells_what_its_rows_tell(shared, recordings):
    page = (PAGES / "recordings.md").read_text(encoding="utf-8")
    rows = shared.read_rows(PAGES / "recordings.csv")
    assert shared.filled(page, recordings.tell(rows)) == page


def test_units_that_would_decide_are_at_least_those_that_can(shared):
    rows = pd.concat(
        [
            rows_of("a", ["aborted"] * 8, np.arange(8.0)),
            rows_of("b", ["succeeded"] * 4 + ["aborted"] * 4, np.arange(8.0) + 1.0),
        ]
    )
    found = shared.judged(rows, [("a", "b")], [shared.metric("near_time_s", "s")]).findings
    (arrivals,) = [f for f in found if f.quantity.name == "success_rate"]
    # 2 / 2^7 is within 3%, 2 / 2^6 is not: 7 pairs that differ, of which every second does.
    assert shared.units_needed(arrivals) == 14


def test_a_trial_that_ended_in_an_error_is_judged_by_nobody(shared, tmp_path):
    rows = rows_of("a", ["succeeded", "error", "aborted"], [1.0, 2.0, 3.0])
    with pytest.raises(SystemExit, match=r"trials\.csv, line 3: 1 of 3 trials ended in an error"):
        shared.require_no_errors(rows, tmp_path / "trials.csv")
    shared.require_no_errors(rows.drop(index=1), tmp_path / "trials.csv")
