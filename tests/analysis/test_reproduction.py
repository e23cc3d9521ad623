"""The page and the tables of the reproduction say what was judged, and name what was not driven."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest
from trial_tables import published_trials, times, trials

from drake_navbench.analysis.reproduction.judgement import judge_all
from drake_navbench.analysis.reproduction.lineup_results import agreements, lineup_result, shares
from drake_navbench.analysis.reproduction.lineups import LINEUPS, present_lineups, trial_values
from drake_navbench.analysis.reproduction.page import changed_parameters, command_line
from drake_navbench.analysis.reproduction.publication import published_table
from drake_navbench.analysis.reproduction.published_cells import compare_numbers, relative_error
from drake_navbench.analysis.reproduction.reproduction import findings_table, write_reproduction
from drake_navbench.analysis.tables import STD_HEADING_ERROR
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import resolved_parameters

POLISHED = next(lineup for lineup in LINEUPS if lineup.presets["mppi"] == "mppi")
NOISY = next(lineup for lineup in LINEUPS if lineup.scenarios)


def cell(rows, scenario, metric, controller):
    (found,) = [
        r for r in rows if (r.scenario, r.metric, r.controller) == (scenario, metric, controller)
    ]
    return found


def test_shares_count_verdicts_per_scenario_and_in_all():
    rows = shares(judge_all(published_trials()))
    assert [(row.scenario, row.total) for row in rows] == [
        ("empty", 8),
        ("static_obstacles", 13),
        ("one_obstacle", 11),
        ("restricted_small", 14),
        ("restricted_large", 16),
        ("all", 3),
        ("together", 65),
    ]
    # Equal trials are one trial.
    assert rows[-1].holds == rows[-1].from_one_trial == 65


def test_the_published_mppi_is_judged_with_the_sampler_alone_and_mppi_stands_beside():
    table = times(mppi_nav2=[15.66], mppi=[15.0], rpp=[14.5])
    assert [lineup.name for lineup in present_lineups(table)] == [
        "published settings",
        "polished MPPI",
    ]
    assert trial_values(table, "empty", "time_taken")["mppi"][0] == 15.66
    assert trial_values(table, "empty", "time_taken", POLISHED)["mppi"][0] == 15.0


def test_noise_at_the_wall_is_a_lineup_where_it_was_driven():
    table = pd.concat([times(rpp=[14.5]), trials("restricted_small_noisy", "energy", rpp=[0.1])])
    assert present_lineups(table)[1:] == [NOISY]


def test_numbers_stand_side_by_side_with_their_relative_difference():
    rows = compare_numbers(times(rpp=[14.0, 15.0]))
    assert len(rows) == 4 * len(published_table())
    row = cell(rows, "empty", "time_taken", "rpp")
    assert (row.published, row.ours.mean, row.ours.count) == (14.512, 14.5, 2)
    assert row.relative_difference == pytest.approx(14.5 / 14.512 - 1.0)


def test_the_spread_of_the_heading_error_is_over_the_trials():
    rows = compare_numbers(trials("empty", "avg_heading_error", rpp=[1.0, 3.0], dwb=[2.0, 2.0]))
    assert cell(rows, "empty", STD_HEADING_ERROR, "rpp").ours.mean == 1.0
    # One trial has no spread, however often it was driven.
    assert math.isnan(cell(rows, "empty", STD_HEADING_ERROR, "dwb").ours.mean)


def test_nothing_is_divided_by_a_published_zero():
    rows = compare_numbers(trials("restricted_small", "abort_time", rpp=[0.5]))
    row = cell(rows, "restricted_small", "abort_time", "rpp")
    assert row.published == 0.0
    assert math.isnan(row.relative_difference)
    assert relative_error([row]).cells == 0


def test_relative_errors_are_summed_up_by_their_median_whichever_way_they_go():
    # Printed times in the empty scenario: 15.498, 14.512, 15.14, 15.66.
    rows = compare_numbers(
        times(
            dwb=[0.9 * 15.498],
            rpp=[1.02 * 14.512],
            teb_upstream=[0.7 * 15.14],
            mppi_nav2=[1.04 * 15.66],
        )
    )
    errors = [0.1, 0.02, 0.3, 0.04]
    found = relative_error(rows)
    assert found.cells == 4
    assert found.median == pytest.approx(np.median(errors))
    assert found.upper_quartile == pytest.approx(np.quantile(errors, 0.75))


def test_agreement_is_told_by_scenario_by_controller_and_with_noise_beside():
    table = published_trials(8, noise=1e-5)
    is_wall = table["scenario"].str.startswith("restricted")
    noisy = table[is_wall].assign(scenario=table["scenario"] + "_noisy")
    table = pd.concat([table, noisy], ignore_index=True)
    rows = agreements(lineup_result(table), lineup_result(table, NOISY))
    assert [row.title for row in rows] == [
        "empty",
        "static_obstacles",
        "one_obstacle",
        "restricted_small",
        "restricted_small_noisy",
        "restricted_large",
        "restricted_large_noisy",
        "dwb",
        "rpp",
        "teb_upstream",
        "mppi_nav2",
        "claimed in a finding",
        "not claimed",
        "together",
    ]
    by_title = {row.title: row for row in rows}
    together = by_title["together"]
    counts = [by_title[t].concordance.orderings for t in ("claimed in a finding", "not claimed")]
    assert sum(counts) == together.concordance.orderings == 275
    # A pair counts for both of its controllers.
    own = sum(
        by_title[t].concordance.orderings for t in ("dwb", "rpp", "teb_upstream", "mppi_nav2")
    )
    assert own == 2 * 275
    assert together.ceiling.ratio == 1.0
    assert together.error.median < 1e-4


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
        "drake-navbench run empty 'my bend.yaml' --controllers rpp,dwb "
        "--trials 32 --seed 1 --robot wheelchair"
    )


def write_folder(path, table):
    manifest = {"manifest_version": 1, "request": REQUEST, "wall_clock_s": 63.0}
    path.mkdir(exist_ok=True)
    (path / "manifest.json").write_text(json.dumps(manifest))
    table.to_parquet(path / "trials.parquet")
    return path


def test_tables_and_page_are_written(tmp_path):
    folder = write_folder(tmp_path / "run", published_trials())
    page = write_reproduction(folder, parameters_of=resolved_parameters).path.read_text()
    assert "65 of 65 published findings hold with 2 trials" in page
    assert "65 from one trial (n = 1)" in page
    assert "Of the 275 orderings" in page
    assert "100% are found again" in page
    # Two trials have no halves of four.
    assert "<code>--trials 8</code>" in page
    assert "its plan is drawn by hand" in page
    assert "--trials 32 --seed 1" in page
    # 5 scenarios x 4 presets x 2 trials of 30 s; computed in 63 s.
    assert "driving them in real time takes 20 min, computing them took 63 s" in page
    # Neither noise nor the bringup presets were driven; what these change is shown all the same.
    assert "run restricted_small_noisy restricted_large_noisy --controllers" in page
    assert "approach_velocity_scaling_dist" in page
    table = pd.read_csv(folder / "tables/findings.csv")
    assert list(table["id"]) == list(range(1, 66))
    assert set(table["verdict"]) == {"holds"}
    numbers = pd.read_csv(folder / "tables/published_vs_ours.csv")
    assert len(numbers) == 4 * 70
    assert numbers["relative_difference"].abs().max() < 1e-12
    orderings = pd.read_csv(folder / "tables/orderings.csv")
    assert len(orderings) == 275
    assert set(orderings["agreement"]) == {1.0}


def test_sizes_stand_beside_the_published_ones(tmp_path):
    # Every time in the empty scenario at a tenth of its distance from the lowest.
    table = published_trials(4, noise=1e-6)
    is_own = table["scenario"] == "empty"
    table.loc[is_own, "time_taken"] = 14.512 + 0.1 * (table.loc[is_own, "time_taken"] - 14.512)
    folder = write_folder(tmp_path / "run", table)
    page = write_reproduction(folder).path.read_text()
    found = pd.read_csv(folder / "tables/findings.csv").set_index("id").loc[2]
    # 14.512 against 15.14: 4.15% printed, 0.43% here.
    assert found["verdict"] == "level"
    assert found["published_size"] == pytest.approx(0.628 / 15.14, rel=1e-3)
    assert found["size"] == pytest.approx(0.0628 / 14.5748, rel=1e-3)
    assert found["share_of_published"] == pytest.approx(0.1039, abs=1e-3)
    assert "+0.4%" in page
    assert "published +4%" in page
    assert "0.10 of it" in page


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(InputError, match="not a results folder"):
        write_reproduction(tmp_path)


def test_what_presets_change_of_which_nothing_is_known_is_left_out(tmp_path):
    folder = write_folder(tmp_path / "run", published_trials())
    assert "approach_velocity_scaling_dist" not in write_reproduction(folder).path.read_text()
    assert changed_parameters(folder, "rpp", "rpp_bringup") is None


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
    table = published_trials()
    polished = table[table["controller"] == "mppi_nav2"].assign(controller="mppi")
    table = pd.concat([table, polished.assign(time_taken=1.0)])
    rows = findings_table([lineup_result(table), lineup_result(table, POLISHED)])
    assert len(rows) == 2 * 65
    # "RPP is the fastest" is lost to the polished one.
    assert list(rows.loc[rows["id"] == 2, "verdict"]) == ["holds", "does not hold"]


def test_values_stand_beside_those_of_the_same_trial_number():
    rows = [
        {"scenario": "empty", "controller": name, "trial": trial, "time_taken": 10.0 * trial + 1.0}
        for name, trials in (("dwb", (0, 1, 2)), ("rpp", (2, 0)))
        for trial in trials
    ]
    values = trial_values(pd.DataFrame(rows), "empty", "time_taken")
    assert values["dwb"].tolist() == [1.0, 11.0, 21.0]
    assert values["rpp"][[0, 2]].tolist() == [1.0, 21.0]
    assert math.isnan(values["rpp"][1])
    assert values["mppi"].isna().all()
