"""Studies of open questions: their judgement, by hand-worked rows, and what their pages ship."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.statistics import exact_share_interval

STUDIES = Path(__file__).parents[1] / "studies"
PAGES = Path(__file__).parents[1] / "docs" / "questions"
NAMES = sorted(path.stem for path in PAGES.glob("*.csv"))


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
