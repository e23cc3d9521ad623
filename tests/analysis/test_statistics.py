"""Statistics against scipy's and statsmodels' values and against arithmetic on paper."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from drake_navbench.analysis import paired_comparison, pairs, statistics


def test_a_summary_counts_what_it_leaves_out():
    summary = statistics.summarize([1.0, 2.0, math.nan, 6.0])
    assert (summary.count, summary.left_out) == (3, 1)
    assert (summary.mean, summary.median) == (3.0, 2.0)
    # Deviations -2, -1, 3: (4 + 1 + 9) / 2 = 7.
    assert summary.sd == pytest.approx(math.sqrt(7.0))


def test_nothing_and_one_value_have_no_interval():
    nothing, one = statistics.summarize([math.nan]), statistics.summarize([2.0])
    assert (nothing.count, nothing.left_out) == (0, 1)
    assert math.isnan(nothing.mean)
    assert one.mean == 2.0
    assert math.isnan(one.sd)
    assert math.isnan(one.interval.low)
    assert not one.interval.excludes(0.0)


def test_equal_values_have_an_interval_without_width():
    assert statistics.summarize([0.1 + 0.2, 0.3, 0.3]).interval == pytest.approx((0.3, 0.3))


def test_the_interval_of_a_mean_is_students():
    values = np.array([1.0, 4.0, 2.0, 8.0, 5.0, 7.0])
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert statistics.summarize(values).interval == pytest.approx(tuple(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("draw", "mean", "least", "most"),
    [
        # 1000 samples tell a share of 95% to 1.4 points either way (two standard deviations).
        (lambda rng, size: rng.normal(size=size), 0.0, 0.93, 0.97),
        (lambda rng, size: rng.uniform(size=size), 0.5, 0.91, 0.97),
        # Skewed values are covered less often than it says: docs/reproduction.md gives the shares.
        (lambda rng, size: rng.exponential(size=size), 1.0, 0.85, 0.91),
        (lambda rng, size: rng.lognormal(size=size), math.exp(0.5), 0.79, 0.86),
    ],
    ids=["normal", "uniform", "exponential", "lognormal"],
)
def test_the_interval_of_four_values_covers_the_mean_about_as_often_as_it_says(
    draw, mean, least, most
):
    samples = draw(np.random.default_rng(7), (1000, 4))
    covered = np.mean([not statistics.mean_interval(row).excludes(mean) for row in samples])
    assert least <= covered <= most


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # statsmodels 0.14, proportion_confint(..., method="wilson").
    [(4, 4, 0.510109, 1.0), (0, 4, 0.0, 0.489891), (8, 10, 0.490162, 0.943318)],
)
def test_wilsons_interval_is_wide_for_four_trials(successes, trials, low, high):
    assert statistics.success_interval(successes, trials) == pytest.approx((low, high), abs=1e-6)


def test_no_trials_have_no_success_interval():
    assert math.isnan(statistics.success_interval(0, 0).low)


def test_pairs_are_made_by_seed_and_those_left_out_are_counted():
    first = pd.Series([1.0, 2.0, 3.0, math.nan], index=[7, 8, 9, 10])
    second = pd.Series([5.0, 3.5, 2.0], index=[9, 8, 7])
    found = paired_comparison.paired_comparison(first, second)
    # Seeds 7, 8, 9: 1, 1.5, 2.
    assert (found.pairs, found.left_out) == (3, 1)
    assert found.difference == pytest.approx(1.5)
    assert found.sd == pytest.approx(0.5)
    # t(0.975, 2) = 4.302653.
    half_width = 4.302653 * 0.5 / math.sqrt(3.0)
    assert found.interval == pytest.approx((1.5 - half_width, 1.5 + half_width), abs=1e-6)
    assert found.effect == 1.0
    # All three of one sign: 2 / 2^3.
    assert found.p_value == pytest.approx(0.25)


def test_the_paired_interval_agrees_with_scipys_paired_t_test():
    rng = np.random.default_rng(1)
    first, second = pd.Series(rng.normal(size=12)), pd.Series(rng.normal(1.0, size=12))
    expected = stats.ttest_rel(second, first).confidence_interval(0.95)
    assert paired_comparison.paired_comparison(first, second).interval == pytest.approx(
        tuple(expected)
    )


def test_what_never_differs_has_p_one_and_no_effect():
    same = pd.Series([1.0, 2.0, 3.0])
    found = paired_comparison.paired_comparison(same, same)
    assert (found.p_value, found.effect, found.interval) == (1.0, 0.0, (0.0, 0.0))


def test_rounding_repeated_is_no_difference():
    # Without noise its interval would exclude zero.
    first, second = pd.Series([0.0] * 4), pd.Series([8e-19] * 4)
    found = paired_comparison.paired_comparison(first, second)
    assert (found.difference, found.interval) == (0.0, (0.0, 0.0))
    assert (found.p_value, found.effect) == (1.0, 0.0)


def test_without_a_common_seed_nothing_is_compared():
    found = paired_comparison.paired_comparison(pd.Series([1.0], [1]), pd.Series([2.0], [2]))
    assert (found.pairs, found.left_out) == (0, 2)
    assert math.isnan(found.p_value)
    assert math.isnan(found.effect)


def test_the_sign_test_counts_pairs_that_one_side_alone_has():
    # 4 of 4 one way: 2 of 2^4 signs. Agreeing pairs do not count, so nothing changed says nothing.
    assert paired_comparison.sign_test_p_value(0, 4) == pytest.approx(2 / 16)
    assert paired_comparison.sign_test_p_value(4, 0) == pytest.approx(2 / 16)
    assert paired_comparison.sign_test_p_value(3, 3) == 1.0
    assert paired_comparison.sign_test_p_value(0, 0) == 1.0


def test_rank_biserial_weighs_differences_by_rank():
    # |d| ranks 1, 2, 3; signs +, -, +: (1 - 2 + 3) / 6.
    assert paired_comparison.compare_differences(
        np.array([0.5, -1.0, 4.0])
    ).effect == pytest.approx(2 / 6)


def test_holm_multiplies_by_the_number_of_hypotheses_still_standing():
    # statsmodels multipletests(..., method="holm") gives the same.
    assert pairs.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert pairs.holm([0.9, 0.8]) == pytest.approx([1.0, 1.0])


def test_holm_does_not_count_undefined_p_values():
    adjusted = pairs.holm([0.02, math.nan, 0.03])
    assert adjusted[[0, 2]] == pytest.approx([0.04, 0.04])
    assert math.isnan(adjusted[1])


@pytest.mark.parametrize(
    ("sd", "difference", "trials"),
    # statsmodels 0.14, TTestPower().solve_power(effect, power=0.8, alpha=0.05), rounded up.
    [(1.0, 0.5, 34), (1.0, 0.8, 15), (5.0, 1.0, 199), (0.0, 1.0, 2)],
)
def test_trials_needed_for_a_difference(sd, difference, trials):
    assert paired_comparison.trials_needed(sd, difference) == trials


def test_more_confidence_needs_more_trials():
    # Guenther (1981): ((z_a + z_b) / effect)^2 + z_a^2 / 2 with z_a = 2.498, z_b = 0.842:
    # 44.6 + 3.1 = 47.7.
    assert paired_comparison.trials_needed(1.0, 0.5, confidence=0.9875) == 48


def test_trials_needed_refuses_no_difference():
    with pytest.raises(ValueError, match="difference > 0"):
        paired_comparison.trials_needed(1.0, 0.0)


def test_the_pareto_front_keeps_what_nothing_beats_in_everything():
    costs = np.array([[1.0, 4.0], [2.0, 2.0], [3.0, 3.0], [4.0, 1.0], [0.5, math.nan]])
    assert list(statistics.pareto_front(costs)) == [True, True, False, True, False]


def test_equal_points_are_both_on_the_front():
    assert list(statistics.pareto_front(np.array([[1.0, 1.0], [1.0, 1.0]]))) == [True, True]


@settings(max_examples=30, deadline=None)
@given(
    values=st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=6),
    shift=st.floats(-5.0, 5.0),
)
def test_summaries_move_with_their_values(values, shift):
    here = statistics.summarize(values)
    there = statistics.summarize(np.array(values) + shift)
    assert there.mean == pytest.approx(here.mean + shift, abs=1e-9)
    assert there.interval.low <= there.mean + 1e-9
    assert there.interval.high >= there.mean - 1e-9


def test_the_smallest_p_value_is_that_of_differences_of_one_sign():
    for count in (3, 6, 8):
        smallest = paired_comparison.compare_differences(np.arange(1.0, count + 1.0)).p_value
        assert pairs.smallest_p_value(count, 1) == pytest.approx(smallest)
    # Holm multiplies the smallest of ten by ten.
    assert pairs.smallest_p_value(8, 10) == pytest.approx(10 / 128)


@pytest.mark.parametrize(
    "differences",
    [[0.3], [1.0, -2.0, 3.0, 4.0], [-1.0, 1.0, 2.0, 2.0], [0.0, 1.0, 3.0, -2.0, 5.0]],
)
def test_the_p_value_is_scipys_whatever_was_asked_before(differences):
    wanted = float(stats.wilcoxon(differences).pvalue)
    for order in (differences, differences[::-1], [10.0 * d for d in differences]):
        assert paired_comparison.compare_differences(np.array(order)).p_value == wanted
