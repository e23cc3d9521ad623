"""Findings are judged by means and intervals alone, and nothing is judged that was not driven."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.findings import (
    GOAL_SCENARIOS,
    LINEUPS,
    NO_SPREAD,
    PUBLISHED_SETTINGS,
    Verdict,
    estimate,
    findings,
    judge,
    percentile_interval,
    published_values,
    resampled_means,
    trial_values,
)
from drake_navbench.analysis.reproduction import (
    changed_parameters,
    command_line,
    compare_numbers,
    findings_table,
    judge_all,
    present_lineups,
    shares,
    write_reproduction,
)
from drake_navbench.analysis.tables import STD_HEADING_ERROR, published_table
from drake_navbench.errors import InputError

RPP_IS_FASTEST = 2  # empty, time_taken, lowest: rpp
RPP_FOLLOWS_BEST = 56  # all, avg_path_error, lowest: rpp


def finding(number):
    return findings()[number - 1]


def trials(scenario, metric, **values):
    """Rows of one metric; values: by preset, one a trial."""
    return pd.DataFrame(
        [
            {"scenario": scenario, "controller": name, "trial": trial, metric: value}
            for name, column in values.items()
            for trial, value in enumerate(column)
        ]
    )


def times(**values):
    return trials("empty", "time_taken", **values)


def published_trials(count=2):
    """Trials without spread that have exactly the published numbers."""
    rows = []
    for scenario, table in published_table().groupby("scenario"):
        for controller, preset in PUBLISHED_SETTINGS.presets.items():
            numbers = dict(zip(table["metric"], table[controller].astype(float), strict=True))
            rows += [
                {"scenario": scenario, "controller": preset, "trial": trial, **numbers}
                for trial in range(count)
            ]
    return pd.DataFrame(rows).assign(outcome="succeeded", duration_s=30.0)


def test_the_published_numbers_satisfy_every_finding():
    judged = judge_all(published_trials())
    assert [j.finding.number for j in judged if j.verdict is not Verdict.HOLDS] == []
    assert len(judged) == 57
    assert all(j.note == NO_SPREAD for j in judged)


def test_a_clear_difference_holds_with_margin_and_deciding_pair():
    table = times(
        dwb=[15.0, 15.2], rpp=[14.0, 14.2], teb=[14.5, 14.7], mppi_nav2=[16.0, 16.2], mppi=[1, 1]
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is Verdict.HOLDS
    assert found.deciding == "rpp < teb"
    assert found.margin.mean == pytest.approx(0.5)
    assert found.pairs == 2
    assert found.ours["rpp"].mean == pytest.approx(14.1)


def test_pairing_decides_what_unpaired_trials_could_not():
    noise = np.array([-3.0, -1.0, 0.0, 1.0, 3.0])
    table = times(
        rpp=10.0 + noise, dwb=10.2 + noise, teb=11.0 + noise, mppi_nav2=[20.0, 20.1, 20, 20, 20]
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is Verdict.HOLDS
    # Every trial has the same difference, 0.2, though the times themselves spread by 6.
    assert found.margin.interval == pytest.approx((0.2, 0.2))
    assert found.ours["rpp"].interval.high - found.ours["rpp"].interval.low > 1.0


def test_an_interval_over_the_tie_is_undecided():
    table = times(
        rpp=[10.0, 12.0, 11.0], dwb=[11.0, 10.0, 12.5], teb=[20.0] * 3, mppi_nav2=[20.0] * 3
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.margin.mean > 0.0
    assert found.verdict is Verdict.UNDECIDED
    assert found.note == "the interval of the deciding difference includes the tie"


def test_a_clear_difference_the_other_way_does_not_hold():
    table = times(rpp=[20.0, 20.5], dwb=[10.0, 10.1], teb=[21.0, 21.0], mppi_nav2=[22.0, 22.0])
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is Verdict.CONTRADICTED
    assert found.deciding == "rpp < dwb"


def test_without_spread_the_means_decide_and_it_is_said():
    table = times(rpp=[1.0, 1.0], dwb=[2.0, 2.0], teb=[3.0, 3.0], mppi_nav2=[4.0, 4.0])
    found = judge(finding(RPP_IS_FASTEST), table)
    assert (found.verdict, found.note) == (Verdict.HOLDS, NO_SPREAD)


def test_a_tie_without_spread_is_undecided():
    table = times(rpp=[1.0, 1.0], dwb=[1.0, 1.0], teb=[3.0, 3.0], mppi_nav2=[4.0, 4.0])
    found = judge(finding(RPP_IS_FASTEST), table)
    assert (found.verdict, found.note) == (Verdict.UNDECIDED, "a tie in every trial")


def test_one_trial_decides_nothing():
    found = judge(finding(RPP_IS_FASTEST), times(rpp=[1.0], dwb=[2.0], teb=[3.0], mppi_nav2=[4.0]))
    assert (found.verdict, found.note) == (Verdict.UNDECIDED, "one trial alone has no interval")


def test_a_controller_that_was_not_driven_leaves_the_finding_undecided():
    found = judge(finding(RPP_IS_FASTEST), times(rpp=[1.0, 1.0], dwb=[2.0, 2.0]))
    assert found.verdict is Verdict.UNDECIDED
    assert found.note == "no value for teb, mppi_nav2"
    assert found.ours["rpp"].mean == 1.0
    assert math.isnan(found.ours["teb"].mean)


def test_trials_without_a_value_are_left_out_and_counted():
    table = times(
        rpp=[1.0, 1.1, 99.0], dwb=[2.0, 2.1, math.nan], teb=[3.0] * 3, mppi_nav2=[4.0] * 3
    )
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.verdict is Verdict.HOLDS
    assert found.pairs == 2
    assert found.note == "1 trials lack a value and are left out"


def test_no_common_trial_is_undecided():
    nan = math.nan
    table = times(rpp=[1.0, nan], dwb=[nan, 2.0], teb=[3.0, 3.0], mppi_nav2=[4.0, 4.0])
    found = judge(finding(RPP_IS_FASTEST), table)
    assert found.note == "no trial in which all of them have a value"


def test_findings_of_all_scenarios_are_about_the_mean_over_the_goal_scenarios():
    parts = [
        trials(
            name,
            "avg_path_error",
            rpp=[0.01 * k, 0.02 * k],
            dwb=[0.1, 0.1],
            teb=[0.1, 0.1],
            mppi_nav2=[0.1, 0.1],
        )
        for k, name in enumerate(GOAL_SCENARIOS)
    ]
    elsewhere = trials("restricted_small", "avg_path_error", rpp=[9.0, 9.0])
    table = pd.concat([*parts, elsewhere])
    # Trial 0: (0 + 0.01 + 0.02)/3; trial 1: (0 + 0.02 + 0.04)/3.
    values = trial_values(table, "all", "avg_path_error")
    np.testing.assert_allclose(values["rpp"], [0.01, 0.02])
    assert judge(finding(RPP_FOLLOWS_BEST), table).verdict is Verdict.HOLDS
    assert math.isnan(trial_values(parts[0], "all", "avg_path_error")["rpp"][0])
    assert published_values("all", "avg_path_error")["rpp"] == pytest.approx(
        (0.017 + 0.026 + 0.019) / 3
    )


def test_resampling_keeps_rows_together_and_repeats_itself():
    rows = np.array([[1.0, 11.0], [2.0, 12.0], [4.0, 14.0]])
    means = resampled_means(rows)
    np.testing.assert_allclose(means[:, 1] - means[:, 0], 10.0)
    np.testing.assert_array_equal(means, resampled_means(rows))
    assert means[:, 0].min() == 1.0
    assert means[:, 0].max() == 4.0


def test_the_percentile_interval_is_the_middle_95_percent():
    assert percentile_interval(np.arange(1001.0)) == pytest.approx((25.0, 975.0))


def test_an_estimate_without_values_is_undefined():
    assert estimate(pd.Series([math.nan])).count == 0


def test_shares_count_verdicts_per_scenario_and_in_all():
    judged = judge_all(published_trials())
    rows = shares(judged)
    assert [(row.scenario, row.total) for row in rows] == [
        ("empty", 8),
        ("static_obstacles", 11),
        ("one_obstacle", 10),
        ("restricted_small", 12),
        ("restricted_large", 14),
        ("all", 2),
        ("together", 57),
    ]
    assert rows[-1].holds == 57


def test_the_published_mppi_is_judged_with_the_sampler_alone_and_mppi_stands_beside():
    table = times(mppi_nav2=[15.66], mppi=[15.0], rpp=[14.5])
    assert [lineup.name for lineup in present_lineups(table)] == [
        "published settings",
        "polished MPPI",
    ]
    assert trial_values(table, "empty", "time_taken")["mppi"][0] == 15.66
    assert trial_values(table, "empty", "time_taken", LINEUPS[1])["mppi"][0] == 15.0


def test_numbers_stand_side_by_side_with_their_relative_difference():
    rows = compare_numbers(times(rpp=[14.0, 15.0]))
    assert len(rows) == 4 * len(published_table())
    (row,) = [r for r in rows if (r.scenario, r.metric, r.controller) == (
        "empty", "time_taken", "rpp")]  # fmt: skip
    assert (row.published, row.ours.mean) == (14.512, 14.5)
    assert row.relative_difference == pytest.approx(14.5 / 14.512 - 1.0)


def test_the_spread_of_the_heading_error_is_over_the_trials():
    rows = compare_numbers(trials("empty", "avg_heading_error", rpp=[1.0, 3.0]))
    (row,) = [r for r in rows if (r.scenario, r.metric, r.controller) == (
        "empty", STD_HEADING_ERROR, "rpp")]  # fmt: skip
    assert row.ours.mean == 1.0


def test_nothing_is_divided_by_a_published_zero():
    rows = compare_numbers(trials("restricted_small", "abort_time", rpp=[0.5]))
    (row,) = [r for r in rows if (r.scenario, r.metric, r.controller) == (
        "restricted_small", "abort_time", "rpp")]  # fmt: skip
    assert row.published == 0.0
    assert math.isnan(row.relative_difference)


REQUEST = {
    "scenarios": ["empty", "my bend.yaml"],
    "controllers": ["rpp", "dwb"],
    "parameter_files": [],
    "trials": 32,
    "seed": 1,
    "robot": "wheelchair",
    "replay": "none",
}


def test_the_command_can_be_typed_again():
    assert command_line(REQUEST) == (
        "python -m drake_navbench.run empty 'my bend.yaml' --controllers rpp,dwb "
        "--trials 32 --seed 1 --robot wheelchair"
    )


@pytest.fixture
def folder(tmp_path):
    """A results folder with the published numbers as trials."""
    manifest = {"manifest_version": 1, "request": REQUEST, "wall_clock_s": 63.0}
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    published_trials().to_parquet(tmp_path / "trials.parquet")
    return tmp_path


def test_tables_and_page_are_written(folder):
    page = write_reproduction(folder).read_text()
    assert "57 of 57 published findings hold with 2 trials" in page
    assert "--trials 32 --seed 1" in page
    # 5 scenarios x 4 presets x 2 trials of 30 s; computed in 63 s.
    assert "driving them in real time takes 20 min, computing them took 63 s" in page
    # The bringup presets were not driven; what they change is shown all the same.
    assert "approach_velocity_scaling_dist" in page
    table = pd.read_csv(folder / "tables/findings.csv")
    assert list(table["id"]) == list(range(1, 58))
    assert set(table["verdict"]) == {"holds"}
    numbers = pd.read_csv(folder / "tables/published_vs_ours.csv")
    assert len(numbers) == 4 * 70
    assert (
        numbers["relative_difference"].abs().max() < 1e-12
        or numbers["metric"].eq(STD_HEADING_ERROR).any()
    )


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(InputError, match="not a results folder"):
        write_reproduction(tmp_path)


def test_presets_are_compared_by_their_resolved_parameters(tmp_path):
    inputs = tmp_path / "inputs/controllers"
    inputs.mkdir(parents=True)
    (inputs / "rpp.yaml").write_text("parameters: {a: 1, block: {b: 2, c: 3}}")
    (inputs / "rpp_bringup.yaml").write_text("parameters: {a: 1, block: {b: 4, c: 3}, d: 5}")
    assert changed_parameters(tmp_path, "rpp", "rpp_bringup") == [
        ("block.b", 2, 4),
        ("d", None, 5),
    ]


def test_the_table_of_findings_shows_every_lineup():
    judged = {"a": judge_all(published_trials()), "b": judge_all(times(rpp=[1.0]))}
    table = findings_table(judged)
    assert len(table) == 2 * 57
    assert (table.loc[table["lineup"] == "b", "verdict"] == "undecided").all()
