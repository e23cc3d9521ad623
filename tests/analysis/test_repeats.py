"""Trials without anything random are one trial, however often they were driven."""

from __future__ import annotations

import math

import pandas as pd

from drake_navbench.analysis.repeats import repeated_cells, repeated_controllers


def rows(controller, *trials, scenario="wall"):
    return [
        {"scenario": scenario, "controller": controller, "trial": i, "seed": 7 + i, **trial}
        for i, trial in enumerate(trials)
    ]


def test_equal_trials_are_one_though_seeds_and_compute_times_differ():
    table = pd.DataFrame(
        rows(
            "rpp",
            {"time_taken": 1.0, "abort_time": math.nan, "compute_time_p50_ms": 0.2},
            {"time_taken": 1.0, "abort_time": math.nan, "compute_time_p50_ms": 0.3},
        )
    )
    assert repeated_cells(table) == {("wall", "rpp")}


def test_a_difference_in_the_last_bit_of_one_metric_tells_two_trials_apart():
    last_bit = math.nextafter(1.0, 2.0)
    table = pd.DataFrame(
        rows("rpp", {"time_taken": 1.0, "energy": 1.0}, {"time_taken": 1.0, "energy": last_bit})
        + rows("dwb", {"time_taken": 1.0, "energy": math.nan}, {"time_taken": 1.0, "energy": 1.0})
    )
    assert repeated_cells(table) == frozenset()


def test_one_trial_alone_repeats_nothing():
    assert repeated_cells(pd.DataFrame(rows("rpp", {"time_taken": 1.0}))) == frozenset()


def test_controllers_are_those_of_the_scenario():
    cells = frozenset({("wall", "rpp"), ("wall", "dwb"), ("empty", "teb")})
    assert repeated_controllers(cells, "wall") == {"rpp", "dwb"}
