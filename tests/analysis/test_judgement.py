"""Findings are judged by means, intervals and sizes; nothing is judged that was not driven."""

from __future__ import annotations

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from trial_tables import published_trials, times, trials

from drake_navbench.analysis.reproduction.findings import (
    findings,
    is_published_tie,
    published_values,
)
from drake_navbench.analysis.reproduction.judgement import (
    ALONE,
    INCLUDES_TIE,
    NO_SPREAD,
    FindingVerdict,
    estimate,
    judge,
    judge_all,
)
from drake_navbench.analysis.reproduction.lineups import GOAL_SCENARIOS, LINEUPS, trial_values
from drake_navbench.analysis.reproduction.relations import parse_relation
from drake_navbench.analysis.verdicts import NOTHING_RANDOM

RPP_IS_FASTEST = 2  # empty, time_taken, lowest: rpp
ALL_ARRIVE = 1  # empty, success_rate, equals 100
TIMES_ARE_SIMILAR = 10  # static_obstacles, time_taken, within 3%
SHORTCUTS = 11  # static_obstacles, path_length, order high to low: rpp dwb teb mppi
RPP_FOLLOWS_BEST = 56  # all, avg_path_error, lowest: rpp
TURN_RATE = 61  # all, max_yaw_rate, highest: dwb; no table prints it
NOISY = next(lineup for lineup in LINEUPS if lineup.scenarios)
RPP_AT_THE_WALL = 34  # restricted_small, time_taken, lowest: rpp


def finding(number):
    return findings()[number - 1]


def claim(relation, controllers):
    """Finding 2 with another relation."""
    relation = parse_relation(relation, controllers, everyone=("dwb", "rpp", "teb", "mppi"))
    return replace(finding(RPP_IS_FASTEST), relation=relation)


def test_the_published_numbers_satisfy_every_finding():
    judged = judge_all(published_trials())
    assert [j.finding.number for j in judged if j.verdict is not FindingVerdict.HOLDS] == []
    assert len(judged) == len(findings()) == 65
    assert all(j.is_one_trial for j in judged)


def test_a_clear_difference_holds_with_its_size_beside_the_published_one():
    table = times(
        dwb=[15.0, 15.2],
        rpp=[14.0, 14.2],
        teb_upstream=[14.54, 14.76],
        mppi_nav2=[16.0, 16.2],
        mppi=[1, 1],
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is FindingVerdict.HOLDS
    deciding = found.deciding
    assert deciding.text == "rpp < teb"
    assert deciding.difference.mean == pytest.approx(0.55)
    assert deciding.difference.count == 2
    assert deciding.size == pytest.approx(0.55 / 14.65)
    # Printed: 14.512 and 15.14.
    assert deciding.published_size == pytest.approx(0.628 / 15.14)
    assert deciding.share_of_published == pytest.approx((0.55 / 14.65) / (0.628 / 15.14))
    assert found.ours["rpp"].mean == pytest.approx(14.1)


def test_the_interval_is_students_over_pairs():
    # Differences 1.0, 1.2, 1.4, 1.2: mean 1.2, sd 0.16330, t(0.975, 3) = 3.18245.
    table = times(
        rpp=[10.0, 11.0, 12.0, 13.0],
        teb_upstream=[11.0, 12.2, 13.4, 14.2],
        dwb=[20.0, 21.0, 22.0, 23.1],
        mppi_nav2=[30.0, 31.0, 32.0, 33.1],
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    half_width = 3.18245 * 0.16330 / 2.0
    expected = (1.2 - half_width, 1.2 + half_width)
    assert found.deciding.difference.interval == pytest.approx(expected, abs=1e-4)
    # The times themselves spread by 3.
    assert found.ours["rpp"].interval.high - found.ours["rpp"].interval.low > 2.0


def test_an_interval_over_the_tie_is_undecided():
    table = times(
        rpp=[10.0, 12.0, 11.0],
        dwb=[11.0, 10.5, 12.5],
        teb_upstream=[20.0, 21, 22],
        mppi_nav2=[20.0, 22, 21],
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.deciding.difference.mean > 0.0
    assert (found.verdict, found.note) == (FindingVerdict.UNDECIDED, INCLUDES_TIE)


def test_a_clear_difference_the_other_way_does_not_hold():
    table = times(
        rpp=[20.0, 20.5, 20.2],
        dwb=[10.0, 10.1, 10.2],
        teb_upstream=[31, 31.5, 32],
        mppi_nav2=[41, 42, 43],
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is FindingVerdict.CONTRADICTED
    assert found.deciding.text == "rpp < dwb"
    assert found.deciding.size == pytest.approx(-(20.0 + 20.5 + 20.2 - 30.3) / (20.0 + 20.5 + 20.2))


def test_of_many_inequalities_one_that_fails_must_fail_by_more():
    # Differences -2, -2.5, -3 with t(0.975, 2) = 4.303: [-3.74, -1.26], and with t = 7.65, at
    # 1 - 0.05/3, [-4.71, -0.29]. Differences -1.6, -2.5, -3: [-4.13, -0.60] and [-5.50, 0.77].
    def verdict_of(*differences):
        rpp = 20.0 + np.array([0.0, 1.0, 2.0])
        far = {"teb_upstream": 2.0 * rpp, "mppi_nav2": 3.0 * rpp}
        return judge(finding(RPP_IS_FASTEST), times(rpp=rpp, dwb=rpp + differences, **far))

    assert verdict_of(-2.0, -2.5, -3.0).verdict is FindingVerdict.CONTRADICTED
    undecided = verdict_of(-1.6, -2.5, -3.0)
    assert undecided.deciding.difference.interval.high < 0.0
    assert undecided.verdict is FindingVerdict.UNDECIDED
    assert undecided.note == "its interval includes the tie, as one of 3 differences looked at"


def test_less_than_one_per_cent_is_level_whichever_way():
    # 0.05 of 10.05 s: 0.5%.
    base = np.array([10.0, 10.1, 10.2, 10.3])
    far = {"teb_upstream": base + 5.0 + 0.1 * base**2, "mppi_nav2": base + 9.0 + 0.1 * base**2}
    near = np.array([0.05, 0.051, 0.049, 0.05])
    for sign in (1.0, -1.0):
        found = judge(finding(RPP_IS_FASTEST), times(rpp=base, dwb=base + sign * near, **far))
        assert found.verdict is FindingVerdict.LEVEL
        assert found.deciding.text == "rpp < dwb"
        assert abs(found.deciding.size) == pytest.approx(0.005, abs=1e-4)


def test_a_small_difference_that_is_not_known_to_be_small_is_undecided():
    base = np.array([10.0, 10.1, 10.2, 10.3])
    far = {"teb_upstream": base + 5.0 + 0.1 * base**2, "mppi_nav2": base + 9.0 + 0.1 * base**2}
    wild = np.array([1.0, -1.0, 0.9, -0.7])
    found = judge(finding(RPP_IS_FASTEST), times(rpp=base, dwb=base + wild, **far))
    assert abs(found.deciding.size) < 0.01
    assert found.verdict is FindingVerdict.UNDECIDED


def test_trials_that_are_all_the_same_are_one_trial_without_an_interval():
    table = times(rpp=[1.0] * 4, dwb=[2.0] * 4, teb_upstream=[3.0] * 4, mppi_nav2=[4.0] * 4)
    found = judge(finding(RPP_IS_FASTEST), table)
    assert (found.verdict, found.note) == (FindingVerdict.HOLDS, NOTHING_RANDOM)
    assert found.is_one_trial
    assert found.deciding.difference.count == found.ours["rpp"].count == 1
    assert math.isnan(found.deciding.difference.interval.low)
    assert math.isnan(found.ours["rpp"].interval.low)


def test_the_same_trial_again_beside_random_ones_is_a_constant():
    table = times(
        rpp=[1.0] * 4,
        dwb=[2.0, 2.1, 2.2, 2.1],
        teb_upstream=[3.0] * 4,
        mppi_nav2=[4.0, 4.1, 4.2, 4.3],
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.deciding.text == "rpp < dwb"
    assert found.deciding.difference.count == 4
    assert found.deciding.difference.interval.low > 0.9
    # rpp against teb: one trial.
    assert next(p for p in found.parts if p.text == "rpp < teb").difference.count == 1


def test_a_metric_without_spread_in_different_trials_is_decided_by_its_means_and_it_is_said():
    other = {"energy": np.tile([1.0, 2.0, 3.0, 4.0], 4)}
    table = times(rpp=[1.0] * 4, dwb=[2.0] * 4, teb_upstream=[3.0] * 4, mppi_nav2=[4.0] * 4).assign(
        **other
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert (found.verdict, found.note) == (FindingVerdict.HOLDS, NO_SPREAD)
    assert not found.is_one_trial


def test_an_exact_tie_is_level():
    table = times(rpp=[0.0] * 2, dwb=[0.0] * 2, teb_upstream=[3.0] * 2, mppi_nav2=[4.0] * 2)
    found = judge(finding(RPP_IS_FASTEST), table)
    assert (found.verdict, found.deciding.size) == (FindingVerdict.LEVEL, 0.0)


def test_one_random_trial_decides_nothing():
    found = judge(
        finding(RPP_IS_FASTEST), times(rpp=[1.0], dwb=[2.0], teb_upstream=[3.0], mppi_nav2=[4.0])
    )
    assert (found.verdict, found.note) == (FindingVerdict.UNDECIDED, ALONE)


def test_a_controller_that_was_not_driven_leaves_the_finding_undecided():
    found = judge(finding(RPP_IS_FASTEST), times(rpp=[1.0, 1.1], dwb=[2.0, 2.0]))
    assert found.verdict is FindingVerdict.UNDECIDED
    notes = {part.text: part.note for part in found.parts}
    assert notes["rpp < teb"] == "no value for teb"
    assert notes["rpp < dwb"] == ""
    assert math.isnan(found.ours["teb"].mean)


def test_each_inequality_uses_the_trials_that_have_both_values():
    nan = math.nan
    table = times(
        rpp=[1.0, 1.1, 1.2], dwb=[2.0, 2.1, nan], teb_upstream=[nan] * 3, mppi_nav2=[4.0, 4.1, 4.3]
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    parts = {part.text: part for part in found.parts}
    assert parts["rpp < dwb"].difference.count == 2
    assert "1 trial lacks a value" in parts["rpp < dwb"].note
    assert parts["rpp < mppi"].difference.count == 3
    assert found.verdict is FindingVerdict.UNDECIDED


def test_no_common_trial_is_undecided():
    nan = math.nan
    table = times(rpp=[1.0, nan], dwb=[nan, 2.0], teb_upstream=[3.0, 3.1], mppi_nav2=[4.0, 4.1])
    found = judge(claim("lower than", "rpp < dwb"), table)
    assert (found.verdict, found.note) == (
        FindingVerdict.UNDECIDED,
        "no trial in which both have one",
    )


def test_within_is_judged_by_the_two_that_are_farthest_apart():
    # 29.0 and 30.2: 4.1% apart, sure to a few tenths of a per cent.
    values = {"rpp": 30.0, "dwb": 30.2, "teb_upstream": 29.0, "mppi_nav2": 29.5}
    spread = np.array([0.0, 0.01, 0.02, 0.01])
    table = trials(
        "static_obstacles",
        "time_taken",
        **{name: value + (1 + i) * spread for i, (name, value) in enumerate(values.items())},
    )
    found = judge(finding(TIMES_ARE_SIMILAR), table)
    assert found.verdict is FindingVerdict.CONTRADICTED
    assert found.deciding.text == "dwb < 1.03 teb"
    assert found.deciding.size == pytest.approx(30.2 / 29.0, abs=1e-3)
    # Printed: 30.704 and 30.637.
    assert found.deciding.published_size == pytest.approx(30.704 / 30.637)
    assert math.isnan(found.deciding.share_of_published)


def test_a_printed_rate_is_about_every_trial():
    table = trials(
        "empty", "success_rate", dwb=[100.0] * 4, rpp=[100.0] * 4, teb_upstream=[100.0] * 4,
        mppi_nav2=[100.0, 100.0, 0.0, 100.0],
    ).assign(energy=np.arange(16.0))  # fmt: skip
    found = judge(finding(ALL_ARRIVE), table)
    assert found.verdict is FindingVerdict.CONTRADICTED
    assert found.note == "1 of 4 trials have another value"
    assert judge(claim("equals 100", "dwb"), table.rename(columns={"success_rate": "time_taken"}))\
        .verdict is FindingVerdict.HOLDS  # fmt: skip
    # Wilson's interval of 4 of 4 begins at 51%.
    assert found.ours["rpp"].interval == pytest.approx((51.0, 100.0), abs=0.1)


def test_what_the_printed_numbers_do_not_support_is_not_judged():
    # 14.883, 14.776, 14.685: 0.7 and 0.6% apart.
    ordered = finding(SHORTCUTS)
    assert {part.text for part in ordered.ties} == {"dwb < rpp", "teb < dwb"}
    table = trials(
        "static_obstacles", "path_length",
        # dwb is longest here; teb < rpp and mppi below all of them is what counts.
        rpp=[14.9, 14.91], dwb=[16.0, 16.02], teb_upstream=[14.5, 14.52], mppi_nav2=[14.0, 14.03],
    )  # fmt: skip
    found = judge(ordered, table)
    assert found.verdict is FindingVerdict.HOLDS
    assert {part.text for part in found.parts}.isdisjoint(p.text for p in ordered.ties)
    assert "not judged, a tie in the publication: teb < dwb, dwb < rpp" in found.note


@pytest.mark.parametrize(
    ("first", "second", "unit", "is_tie"),
    [
        (0.857, 0.856, 0.001, True),
        (0.017, 0.019, 0.001, False),
        (0.017, 0.018, 0.001, True),
        (30.0, 30.29, 0.001, True),
        (30.0, 30.31, 0.001, False),
        (0.0, 0.0, 0.001, True),
        (80.0, 81.0, 1.0, True),
        (math.nan, 1.0, 0.001, False),
    ],
)
def test_printed_values_are_ties_below_their_last_digit_or_one_per_cent(
    first, second, unit, is_tie
):
    assert is_published_tie(first, second, printed_unit=unit) is is_tie


def test_a_claim_of_the_text_alone_has_no_published_size():
    rates = {
        "dwb": [0.55, 0.56],
        "rpp": [0.4, 0.41],
        "teb_upstream": [0.3, 0.31],
        "mppi_nav2": [0.2, 0.21],
    }
    table = pd.concat(trials(name, "max_yaw_rate", **rates) for name in GOAL_SCENARIOS)
    found = judge(finding(TURN_RATE), table)
    assert found.verdict is FindingVerdict.HOLDS
    assert math.isnan(found.deciding.published_size)
    assert math.isnan(found.deciding.share_of_published)


def test_findings_of_all_scenarios_are_about_the_mean_over_the_goal_scenarios():
    parts = [
        trials(
            name,
            "avg_path_error",
            rpp=[0.01 * k, 0.012 * k],
            dwb=[0.1, 0.101],
            teb_upstream=[0.1, 0.102],
            mppi_nav2=[0.1, 0.103],
        )
        for k, name in enumerate(GOAL_SCENARIOS)
    ]
    elsewhere = trials("restricted_small", "avg_path_error", rpp=[9.0, 9.0])
    table = pd.concat([*parts, elsewhere])
    # Trial 0: (0 + 0.01 + 0.02)/3; trial 1: (0 + 0.012 + 0.024)/3.
    values = trial_values(table, "all", "avg_path_error")
    np.testing.assert_allclose(values["rpp"], [0.01, 0.012])
    assert judge(finding(RPP_FOLLOWS_BEST), table).verdict is FindingVerdict.HOLDS
    assert math.isnan(trial_values(parts[0], "all", "avg_path_error")["rpp"][0])
    assert published_values("all", "avg_path_error")["rpp"] == pytest.approx(
        (0.017 + 0.026 + 0.019) / 3
    )


def test_a_lineup_may_put_another_scenario_in_the_place_of_a_published_one():
    still = trials("restricted_small", "time_taken", rpp=[9.0, 9.1], dwb=[1, 1.1],
                   teb_upstream=[2, 2.1], mppi_nav2=[2, 2.1])  # fmt: skip
    noisy = trials("restricted_small_noisy", "time_taken", rpp=[0.5, 0.6], dwb=[9.0, 9.2],
                   teb_upstream=[2.0, 2.2], mppi_nav2=[12.0, 12.1])  # fmt: skip
    table = pd.concat([still, noisy])
    assert judge(finding(RPP_AT_THE_WALL), table).verdict is FindingVerdict.CONTRADICTED
    found = judge(finding(RPP_AT_THE_WALL), table, NOISY)
    assert found.verdict is FindingVerdict.HOLDS
    assert found.ours["rpp"].mean == pytest.approx(0.55)


def test_an_estimate_without_values_is_undefined():
    assert estimate(np.array([math.nan])).count == 0


@pytest.mark.long
def test_the_published_numbers_themselves_hold_best_with_the_names_as_they_are():
    """24 assignments of columns to names; two trials with a spread of 1 per mille."""
    path = Path(__file__).parents[2] / "studies" / "reproduction_exchanged.py"
    study = runpy.run_path(str(path))
    found = study["verdicts_by_assignment"](published_trials(noise=0.001))
    own, *others = (counts[FindingVerdict.HOLDS] for counts in found.values())
    assert len(others) == 23
    assert own > max(others)
