"""How harmony is compared among people: rows with known answers."""

from __future__ import annotations

import pandas as pd
import pytest


@pytest.fixture(scope="module")
def living(study):
    return study("harmony_living")


def rows_of(column, times_s):
    """Returns a row a scenario and seed; times_s: by scenario and seed, None for a touch."""
    return pd.DataFrame(
        [
            {
                "scenario": scenario,
                "seed": seed,
                "column": column,
                "outcome": "collided" if time_s is None else "succeeded",
                "time_to_goal_s": time_s,
            }
            for scenario, of_seeds in times_s.items()
            for seed, time_s in enumerate(of_seeds)
        ]
    )


def test_time_is_compared_where_both_arrive_and_a_scenario_counts_once(living):
    # Ratios 1.1 and 1.3 in the first scenario, 1.0 in the second one: means 1.2 and 1.0.
    ours = rows_of("harmony", {"ward": [11.0, 13.0], "hall": [10.0, None]})
    its = rows_of("dwb", {"ward": [10.0, 10.0], "hall": [10.0, 2.0]})
    told = living.compared(pd.concat([ours, its]), "harmony", "dwb")
    # Of two values 0.2 and 0.0 the error of the mean is 0.1; Student's t at 95% with one degree of
    # freedom is 6.314.
    assert "time +10.0% (at most +73.1%) in 2 scenarios" in told


def test_the_seeds_of_a_single_scenario_count_once_each(living):
    ours, its = rows_of("harmony", {"door": [12.0, 10.0]}), rows_of("dwb", {"door": [10.0, 10.0]})
    # Ratios 1.2 and 1.0, with the same limit as above.
    told = living.compared(pd.concat([ours, its]), "harmony", "dwb")
    assert "time +10.0% (at most +73.1%) in 2 seeds" in told


def test_an_arrival_of_the_other_one_alone_is_a_loss_with_an_exact_limit(living):
    ours = rows_of("harmony", {"ward": [10.0] * 59})
    its = rows_of("dwb", {"ward": [10.0] * 59})
    told = living.compared(pd.concat([ours, its]), "harmony", "dwb")
    # The limit of 0 of n is 1 - 0.05^(1/n).
    assert "only the other one arrives in 0 of 59 (at most 5.0%)" in told
    assert "(at most +0.0%) in 59 seeds" in told
    ours.loc[0, ["outcome", "time_to_goal_s"]] = "collided", None
    told = living.compared(pd.concat([ours, its]), "harmony", "dwb")
    assert "only the other one arrives in 1 of 59" in told
    assert "collided: more often in 1 scenarios, less in 0 (p 1.000)" in told


def test_a_touch_stands_with_the_exact_limit_of_its_share(living):
    told = living.table(rows_of("harmony", {"ward": [10.0] * 20})).iloc[0]
    assert (told["arrive"], told["touch"]) == (20, 0)
    assert told["of all, at most"] == pytest.approx(1.0 - 0.05 ** (1.0 / 20))
