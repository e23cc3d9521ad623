"""Which of two columns is better: gaps beyond the bars, and all pairs corrected together."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.paired_comparison import paired_comparison
from drake_navbench.analysis.pairs import (
    compare_every_pair,
    confidence_of_each,
    fewest_alike,
    gap,
    shares_differ,
)

REPOSITORY = Path(__file__).parents[2]
# A correction that stands elsewhere: a Bonferroni share, a Holm, or a test of scipy's.
CORRECTION = re.compile(
    r"\(1\.0 - CONFIDENCE\) / |0\.05 / (max|len)|^def _?holm\b|multipletests|wilcoxon\(|ttest_rel",
    re.MULTILINE,
)


def corrections(files):
    """Returns the files that correct or test pairs by themselves."""
    return [str(f) for f in files if CORRECTION.search(f.read_text(encoding="utf-8"))]


def test_of_three_columns_three_pairs_are_corrected_together():
    seeds = np.arange(8)
    columns = {
        "a": pd.Series(0.0 * seeds),
        "b": pd.Series(1.0 + seeds),
        "c": pd.Series(2.0 + seeds),
    }
    pairs = compare_every_pair(columns)
    assert [(pair.first, pair.second) for pair in pairs] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert pairs[2].comparison.difference == 1.0
    # Eight differences of one sign: 2 / 2^8 each, times the three of them.
    assert [pair.p_holm for pair in pairs] == pytest.approx([6 / 256] * 3)
    assert all(pair.can_be_decided for pair in pairs)


def test_of_one_column_there_is_no_pair():
    assert compare_every_pair({"a": pd.Series([1.0])}) == []


def test_a_difference_that_one_pair_alone_shows_is_not_shown_among_many():
    """Of -1, 0, ..., 6 the mean is 2.5 +- 2.05 at 95%, and +- 3.49 at 99.5%, as one of ten."""
    noise = pd.Series([-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    two = compare_every_pair({"a": 0.0 * noise, "b": noise})
    five = compare_every_pair({name: 0.0 * noise for name in "acde"} | {"b": noise})
    (among_five,) = (pair for pair in five if (pair.first, pair.second) == ("a", "b"))
    assert two[0].is_shown
    assert among_five.comparison.interval == two[0].comparison.interval
    assert not among_five.is_shown


def test_so_many_intervals_hold_together():
    assert confidence_of_each(1) == confidence_of_each(0) == pytest.approx(0.95)
    assert confidence_of_each(10) == pytest.approx(0.995)


def test_a_gap_within_one_percent_is_level_and_one_beyond_it_is_shown():
    leader = pd.Series([10.0, 10.2, 9.8, 10.1])
    within = gap(leader, 1.005 * leader, is_higher_better=False)
    beyond = gap(leader, 1.05 * leader, is_higher_better=False)
    assert (within.is_level, within.is_shown, within.is_ahead) == (True, False, True)
    assert (beyond.is_level, beyond.is_shown) == (False, True)
    # Where more is better it is the other one that leads.
    assert not gap(leader, 1.05 * leader, is_higher_better=True).is_shown
    # 0.5 m is less than what matters here.
    assert gap(leader, 1.05 * leader, is_higher_better=False, relevant=0.6).is_level


def test_one_pair_decides_only_where_nothing_is_random():
    leader, other = pd.Series([10.0, 10.0]), pd.Series([11.0, 11.0])
    assert gap(leader, other, is_higher_better=False, is_one_trial=True).is_shown
    assert not gap(leader[:1], other[:1], is_higher_better=False).is_shown


def test_two_pairs_that_are_nearly_alike_show_nothing_and_three_do():
    leader, other = pd.Series([10.0, 10.0, 10.0]), pd.Series([12.0, 12.01, 12.02])
    assert not gap(leader[:2], other[:2], is_higher_better=False).is_shown
    assert gap(leader, other, is_higher_better=False).is_shown
    (two,) = compare_every_pair({"a": leader[:2], "b": other[:2]})
    (three,) = compare_every_pair({"a": leader, "b": other})
    assert (two.is_shown, three.is_shown) == (False, True)
    # Differences that are all equal need a fourth pair among five rivals: 2 / 4^4 < 1%.
    assert (fewest_alike(0.95), fewest_alike(0.99)) == (3, 4)


def test_two_equal_differences_of_shares_are_no_proof():
    nothing, all_of_it = pd.Series([0.0, 0.0]), pd.Series([1.0, 1.0])
    assert not shares_differ(nothing, all_of_it, paired_comparison(nothing, all_of_it))
    eight = [pd.concat([own] * 4, ignore_index=True) for own in (nothing, all_of_it)]
    assert shares_differ(*eight, paired_comparison(*eight))


def test_pairs_are_corrected_in_one_place():
    found = [
        path
        for house in ("analysis", "drake_navbench", "studies")
        for path in sorted((REPOSITORY / house).rglob("*.py"))
    ]
    assert corrections(found) == [str(REPOSITORY / "analysis" / "pairs.py")]


def test_a_correction_elsewhere_is_found(tmp_path):
    path = tmp_path / "planted.py"
    path.write_text("confidence = 1.0 - (1.0 - CONFIDENCE) / count\n")
    assert corrections([path]) == [str(path)]
