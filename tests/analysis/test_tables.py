"""Tables count every trial and drop none."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from synthetic_logs import straight_log

from drake_navbench.analysis.reproduction.publication import published_findings, published_table
from drake_navbench.analysis.tables import (
    count_name,
    scenario_table,
    suite_tables,
    table_to_markdown,
)
from drake_navbench.analysis.trial_rows import trial_row


def trials_of(*logs):
    return pd.DataFrame([trial_row(log) for log in logs])


def test_a_row_says_who_how_and_how_well():
    row = trial_row(straight_log())
    assert (row["scenario"], row["controller"], row["trial"], row["seed"]) == ("empty", "rpp", 0, 1)
    assert (row["outcome"], row["reason"]) == ("succeeded", "goal reached")
    assert row["avg_linear_speed"] == pytest.approx(0.5)
    assert math.isnan(row["min_obstacle_distance"])


def test_a_published_scenario_has_exactly_the_published_rows_and_then_the_outcomes():
    table = scenario_table(trials_of(straight_log()), "empty")
    published = published_table()
    printed = list(published.loc[published["scenario"] == "empty", "metric"])
    names = list(table.index.get_level_values("metric"))
    assert names[: len(printed)] == printed
    assert names[len(printed) :] == [
        "trials",
        "succeeded",
        "aborted",
        "collided",
        "timed_out",
        "error",
    ]


def test_another_scenario_has_all_published_metrics():
    log = straight_log()
    log.info["scenario"]["name"] = "own"
    table = scenario_table(trials_of(log), "own")
    assert ("abort_time", "s") in table.index
    assert ("std_heading_error", "deg") in table.index


def test_failed_trials_are_part_of_the_means_and_are_counted():
    fast, slow = straight_log(speed_mps=0.5), straight_log(speed_mps=0.3, outcome="aborted")
    table = scenario_table(trials_of(fast, slow), "empty")
    assert table.loc[("avg_linear_speed", "m/s"), "rpp"] == pytest.approx(0.4)
    assert table.loc[("success_rate", "%"), "rpp"] == 50.0
    assert table.loc[("aborted", "trials"), "rpp"] == 1


def test_a_trial_without_a_value_is_counted_beside_the_mean_of_the_others():
    whole, broken = trial_row(straight_log()), trial_row(straight_log(outcome="error"))
    broken.update(path_length=np.nan)
    table = scenario_table(pd.DataFrame([whole, broken]), "empty")
    assert table.loc[("path_length", "m"), "rpp"] == pytest.approx(whole["path_length"])
    assert table.loc[("path_length_defined", "trials"), "rpp"] == 1
    assert ("time_taken_defined", "trials") not in table.index
    assert count_name("path_length_defined") == "with path_length"
    assert count_name("aborted") == "aborted"


def test_heading_error_spread_is_over_the_trials():
    rows = trials_of(straight_log(), straight_log())
    rows["avg_heading_error"] = [1.0, 3.0]
    table = scenario_table(rows, "empty")
    assert table.loc[("std_heading_error", "deg"), "rpp"] == pytest.approx(1.0)


def test_columns_keep_the_order_of_the_trials():
    rows = trials_of(straight_log(), straight_log())
    rows["controller"] = ["teb", "dwb"]
    assert list(scenario_table(rows, "empty").columns) == ["teb", "dwb"]


def test_markdown_shows_numbers_and_a_dash_for_what_is_undefined():
    rows = trials_of(straight_log())
    rows["path_length"] = np.nan
    text = table_to_markdown(scenario_table(rows, "empty"))
    assert "| metric | unit | rpp |" in text
    assert "| path_length | m | – |" in text
    assert "| succeeded | trials | 1 |" in text
    assert "| avg_linear_speed | m/s | 0.500 |" in text


def test_the_packaged_publication_is_whole():
    table, findings = published_table(), published_findings()
    assert list(table.columns) == ["scenario", "metric", "unit", "dwb", "rpp", "teb", "mppi"]
    assert table.groupby("scenario").size().to_dict() == {
        "empty": 12,
        "static_obstacles": 15,
        "one_obstacle": 15,
        "restricted_small": 14,
        "restricted_large": 14,
    }
    assert len(findings) == 65


def test_the_worlds_of_a_suite_count_as_one_scenario_and_a_lone_world_has_no_table():
    trials = pd.DataFrame(
        {
            "suite": ["map", "map", "alone", ""],
            "scenario": ["map_00", "map_01", "one", "empty"],
            "controller": "rpp",
            "outcome": "succeeded",
            "time_to_goal_s": [10.0, 14.0, 99.0, 99.0],
        }
    )
    tables = suite_tables(trials, ["time_to_goal_s"])
    assert list(tables) == ["map"]
    assert tables["map"].loc[("time_to_goal_s", "s"), "rpp"] == 12.0
    assert tables["map"].loc[("succeeded", "trials"), "rpp"] == 2
    assert suite_tables(trials.drop(columns="suite"), ["time_to_goal_s"]) == {}
