"""Paired tests: pairing, families, what is decided, and what would be needed."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from paired_tables import METRICS, Law, draw

from drake_navbench.analysis.metrics import efficiency, safety
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.paired_comparison import compare_differences, sign_test_p_value
from drake_navbench.analysis.paired_shares import paired_share_interval
from drake_navbench.analysis.paired_tests import (
    ALARM_RATES,
    Family,
    PairedVerdict,
    fewest_differing,
    judge_pairs,
)
from drake_navbench.analysis.paired_text import lost_lines, undecided_sentence
from drake_navbench.analysis.paired_trials import Contest
from drake_navbench.analysis.pairs import holm

TIME, CLEARANCE = efficiency.time_to_goal_s, safety.min_clearance_m
LENGTH = efficiency.driven_length_m


def trials(outcomes="succeeded", scenario="doorway", count=12, **values) -> pd.DataFrame:
    """Trials of one controller; clearance wanders, so that they are not all one."""
    clearance = 1.0 + 0.01 * np.arange(count)
    columns = {"time_to_goal_s": 10.0, "min_clearance_m": clearance, "driven_length_m": 8.0}
    identity = {"scenario": scenario, "controller": "rpp", "seed": np.arange(count)}
    return pd.DataFrame(identity | {"outcome": outcomes, "reason": ""} | columns | values)


def judged(before, after, metrics=(TIME, CLEARANCE, LENGTH), **options):
    return judge_pairs([Contest(before, after)], metrics=metrics, **options)


def found(result, name):
    (finding,) = (f for f in result.findings if f.quantity.name == name)
    return finding


def outcomes(count, ending, of=12):
    return [ending] * count + ["succeeded"] * (of - count)


@pytest.mark.parametrize(
    ("metric", "change", "verdict"),
    [
        ("time_to_goal_s", 1.0, PairedVerdict.WORSE),
        ("time_to_goal_s", -1.0, PairedVerdict.BETTER),
        ("time_to_goal_s", 0.05, PairedVerdict.SMALL),
        ("min_clearance_m", -0.5, PairedVerdict.WORSE),
        ("driven_length_m", 1.0, PairedVerdict.CHANGED),
        ("driven_length_m", 0.0, PairedVerdict.EQUAL),
    ],
)
def test_a_change_of_every_pair_is_judged_by_its_direction_and_size(metric, change, verdict):
    changed = trials()
    changed[metric] += change
    assert found(judged(trials(), changed), metric).verdict is verdict


@pytest.mark.parametrize("count", [2, 7])
def test_no_verdict_comes_from_less_than_can_decide(count):
    # 7 pairs of one sign have p 2^-6, above the 1% of the listed metrics; 8 have 2^-7.
    slow = trials(count=count, time_to_goal_s=20.0)
    finding = found(judged(trials(count=count), slow), "time_to_goal_s")
    assert finding.verdict is PairedVerdict.UNDECIDED
    assert finding.p_value == 2.0 ** (1 - count)
    decided = judged(trials(count=8), trials(count=8, time_to_goal_s=20.0))
    assert found(decided, "time_to_goal_s").verdict is PairedVerdict.WORSE


def test_cells_in_which_nothing_differs_take_no_power_from_the_others():
    before = pd.concat([trials(scenario=f"s{i}", count=8) for i in range(50)])
    after = before.copy()
    after.loc[after["scenario"] == "s7", "time_to_goal_s"] = 20.0
    (worse,) = judged(before, after).of(PairedVerdict.WORSE)
    assert (worse.scenario, worse.p_value) == ("s7", 2.0**-7)


def test_each_family_is_corrected_over_all_contests_together():
    slow = trials(time_to_goal_s=20.0)
    once = judge_pairs([Contest(trials(), slow, "a")], metrics=[TIME])
    both = judge_pairs([Contest(trials(), slow, "a"), Contest(trials(), slow, "b")], metrics=[TIME])
    assert found(once, "time_to_goal_s").p_value == 2.0**-11
    assert [f.p_value for f in both.of(PairedVerdict.WORSE)] == [2.0**-10] * 2
    assert sum(ALARM_RATES.values()) == pytest.approx(0.05)


def test_a_trial_that_touches_is_worse_and_comes_before_all_else():
    after = trials(outcomes(10, "collided"), time_to_goal_s=20.0)
    worse = judged(trials(), after, listed=["min_clearance_m"]).of(PairedVerdict.WORSE)
    assert [f.quantity.name for f in worse] == ["touch_rate", "success_rate"]
    assert worse[0].p_value == pytest.approx(2 * 2.0**-9)


def test_who_gives_up_is_neither_quick_nor_safe():
    # Eight of twelve stop at once, far from everything; the four others drive as before.
    clearance = np.where(np.arange(12) < 8, 5.0, trials()["min_clearance_m"])
    result = judged(trials(), trials(outcomes(8, "aborted"), min_clearance_m=clearance))
    assert found(result, "min_clearance_m").verdict is PairedVerdict.EQUAL
    assert found(result, "min_clearance_m").comparison.pairs == 4
    assert found(result, "success_rate").verdict is PairedVerdict.WORSE


def test_where_nobody_arrives_it_is_compared_how_they_gave_up():
    before, after = trials("aborted"), trials("aborted", min_clearance_m=0.2)
    assert found(judged(before, after), "min_clearance_m").verdict is PairedVerdict.WORSE


def test_trials_that_are_one_trial_count_once_and_are_certain():
    before, after = trials(min_clearance_m=1.0), trials(min_clearance_m=0.5)
    result = judged(before, after)
    finding = found(result, "min_clearance_m")
    assert (finding.comparison.pairs, finding.is_one_trial) == (1, True)
    assert finding.verdict is PairedVerdict.WORSE
    assert np.isnan(finding.p_value)
    assert result.one_trial_cells == (("", "doorway", "rpp"),)
    assert result.tests(Family.LISTED) == 0


def test_a_single_trial_decides_nothing():
    result = judged(trials(count=1), trials(["collided"], count=1))
    assert found(result, "touch_rate").verdict is PairedVerdict.UNDECIDED
    assert [f.quantity.name for f in result.undecided_losses] == ["touch_rate", "success_rate"]


def test_an_undecided_loss_says_what_would_decide_it():
    loss = judged(trials(), trials(outcomes(3, "aborted"))).undecided_losses[0]
    # One test in the family could be decided at most, at 3%: 7 pairs, p 2^-6; 3 of 12 is 7 of 28.
    assert (loss.fewest_differing, loss.trials_needed) == (7, 28)
    told = undecided_sentence(loss)
    assert "doorway, rpp: success_rate undecided: 100 -> 75 % (-25 [" in told
    assert "in 12 pairs, 0 more and 3 fewer, p 0.25); a decision needs at least 7 pairs" in told
    assert told.endswith("a change of this size about 28 trials")


def test_trials_without_an_end_are_named_with_what_the_base_did():
    before = trials(outcomes(1, "error"))
    after = trials(["error", "error", *["succeeded"] * 10], reason="died")[:-1]
    lost = judged(before, after).lost
    assert [(t.seed, t.is_new, t.is_missing) for t in lost] == [
        (0, False, False),
        (1, True, False),
        (11, True, True),
    ]
    assert all(trial.base_fails for trial in lost)
    assert lost_lines(lost)[0] == "doorway, rpp: 2 trials ended as an error, seeds 0, 1: died"
    assert not any(t.base_fails for t in judged(trials(), after).lost)


def test_an_error_is_no_touch_and_no_measurement():
    result = judged(trials(), trials(outcomes(5, "error"), time_to_goal_s=11.0))
    assert found(result, "touch_rate").comparison.pairs == 7
    assert found(result, "time_to_goal_s").comparison.pairs == 7
    assert found(result, "success_rate").comparison.pairs == 12


def test_a_few_trials_do_not_speak_against_the_many():
    # 23 are a little quicker, one is very slow: the ranks say quicker, the mean slower.
    after = trials(count=24, time_to_goal_s=[9.0] * 23 + [100.0])
    finding = found(judged(trials(count=24), after), "time_to_goal_s")
    assert finding.p_value < 0.01
    assert finding.verdict is PairedVerdict.UNDECIDED


def test_the_correction_counts_tests_that_could_have_been_as_sure():
    # 2^-4 could come of the first three alone, 2^-1 of all four.
    p_values, smallest = [2.0**-4, 0.5, 1.0, 0.5], [2.0**-4, 2.0**-5, 2.0**-6, 0.5]
    assert holm(p_values, smallest).tolist() == [3 * 2.0**-4, 1.0, 1.0, 1.0]
    assert holm(p_values).tolist() == [4 * 2.0**-4, 1.0, 1.0, 1.0]
    assert holm([0.001, 0.5], [0.0005, 0.25]).tolist() == [0.001, 0.5]


def test_fewest_differing_pairs_follow_the_level():
    assert [fewest_differing(level) for level in (0.5, 0.25, 0.03, 2.0**-5)] == [2, 3, 7, 6]


@pytest.mark.parametrize("differences", [[1.0] * 6, [0.5, 1.0, 1.0, 2.0, 0.0, -0.5]])
def test_wilcoxons_p_value_counts_all_signs_also_of_equal_sizes(differences):
    sizes = np.abs([d for d in differences if d])
    ranks = pd.Series(sizes).rank().to_numpy()
    signs = 2 * (np.indices((2,) * len(ranks)).reshape(len(ranks), -1)) - 1
    sums = (ranks[:, None] * signs).sum(axis=0)
    own = (ranks * np.sign([d for d in differences if d])).sum()
    share = (np.abs(sums) >= abs(own) - 1e-9).mean()
    assert compare_differences(np.array(differences)).p_value == pytest.approx(share)


@pytest.mark.parametrize(
    ("wins", "losses", "low", "high"),
    [(0, 4, -0.290, 0.028), (0, 6, -0.364, -0.012), (0, 0, -0.109, 0.109), (32, 0, 0.750, 1.0)],
)
def test_the_interval_of_paired_shares_agrees_with_the_sign_test(wins, losses, low, high):
    interval = paired_share_interval(wins, losses, 32)
    assert interval == pytest.approx((low, high), abs=1e-3)
    assert interval.excludes(0.0) is (sign_test_p_value(wins, losses) < 0.05)


def test_the_interval_of_paired_shares_covers_the_truth():
    # Every result of eight pairs, weighed by its probability under laws with and without a change.
    pairs = 8
    results = [(w, n) for w in range(pairs + 1) for n in range(pairs + 1 - w)]
    intervals = [paired_share_interval(w, n, pairs) for w, n in results]
    counts = np.array([[w, n, pairs - w - n] for w, n in results])
    factorials = np.cumprod([1.0, *range(1, pairs + 1)])
    ways = factorials[pairs] / factorials[counts].prod(axis=1)
    for won, lost in [(0.0, 0.1), (0.1, 0.1), (0.3, 0.1), (0.05, 0.6), (0.5, 0.5), (0.0, 0.0)]:
        chances = ways * (np.array([won, lost, 1.0 - won - lost]) ** counts).prod(axis=1)
        covers = [low <= won - lost <= high for low, high in intervals]
        assert chances @ covers >= 0.95


def test_every_metric_has_a_family():
    laws, names = [Law()], [metric.name for metric in METRICS]
    sides = [draw(np.random.default_rng(side), laws, 4, names) for side in (0, 1)]
    result = judge_pairs([Contest(*sides)], metrics=METRICS)
    assert {f.quantity.family for f in result.findings} == set(Family)
    assert len(result.findings) == len(METRICS) + 2
    assert {f.quantity.better for f in result.findings} == set(Better)
