"""Ranks of a leaderboard: shared where nothing shows who is better."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.analysis.leaderboard.ranking import RUN_SEED, rank

SPREAD = np.array([-0.3, 0.1, 0.4, -0.2, 0.2, -0.1, 0.3, -0.4])


def table(times, scenarios=("empty",)):
    """times: by controller, one a trial; NaN aborts. Every scenario has the same ones."""
    rows = [
        {
            "scenario": scenario,
            "controller": name,
            "trial": trial,
            "seed": trial,
            RUN_SEED: "0",
            "outcome": "aborted" if math.isnan(time_s) else "succeeded",
            "time_to_goal_s": time_s,
        }
        for scenario in scenarios
        for name, column in times.items()
        for trial, time_s in enumerate(column)
    ]
    return pd.DataFrame(rows)


def places(ranking):
    return {entry.controller: (entry.rank, *entry.interval) for entry in ranking.standings}


def test_ties_share_a_rank_and_the_next_one_is_left_out():
    common = 20.0 + SPREAD
    ranking = rank(table({"slow": common + 5.0, "a": common, "b": common + 0.01 * SPREAD}))
    assert places(ranking) == {"a": (1, 1, 2), "b": (1, 1, 2), "slow": (3, 3, 3)}
    assert [(place, len(group)) for place, group in ranking.groups] == [(1, 2), (3, 1)]


def test_a_difference_below_one_percent_is_a_tie_however_certain():
    common = 20.0 + SPREAD
    nearly = rank(table({"a": common, "b": common + 0.15}))
    assert {entry.rank for entry in nearly.standings} == {1}
    more = rank(table({"a": common, "b": common + 0.25}))
    assert places(more) == {"a": (1, 1, 1), "b": (2, 2, 2)}


def test_arrivals_count_before_times():
    common = 20.0 + SPREAD
    hasty = np.where(np.arange(8) < 1, common - 10.0, math.nan)
    ranking = rank(table({"hasty": hasty, "safe": common}))
    assert places(ranking) == {"safe": (1, 1, 1), "hasty": (2, 2, 2)}
    assert ranking.duels[0].decided_by == "arrivals"
    assert (ranking.standings[1].arrived, ranking.standings[1].trials) == (1, 8)


def touching(ranked, controller, trials):
    """The table with some trials of a controller ended at a contact."""
    is_its = (ranked["controller"] == controller) & ranked["trial"].isin(trials)
    return ranked.assign(outcome=ranked["outcome"].where(~is_its, "collided"))


def test_of_equal_arrivals_touches_decide():
    stops = [math.nan] * 6 + [20.0, 20.1]
    rows = touching(table({"touches": stops, "stops": stops}), "touches", range(6))
    ranking = rank(rows)
    assert places(ranking) == {"stops": (1, 1, 1), "touches": (2, 2, 2)}
    assert (ranking.duels[0].winner, ranking.duels[0].decided_by) == ("stops", "touches")
    assert {entry.controller: entry.touched for entry in ranking.standings} == {
        "stops": 0,
        "touches": 6,
    }


def test_who_arrives_more_often_but_touches_more_often_beats_nobody():
    # bold arrives in 10 of 16 and touches in the others; shy stands still.
    bold = [20.0] * 10 + [math.nan] * 6
    rows = touching(table({"bold": bold, "shy": [math.nan] * 16}), "bold", range(10, 16))
    ranking = rank(rows)
    assert {entry.rank for entry in ranking.standings} == {1}
    assert (ranking.duels[0].winner, ranking.duels[0].denied) == ("", "bold")


def test_who_stands_still_does_not_win_by_touching_nothing():
    bold = [20.0] * 15 + [math.nan]
    rows = touching(table({"bold": bold, "shy": [math.nan] * 16}), "bold", [15])
    assert places(rank(rows)) == {"bold": (1, 1, 1), "shy": (2, 2, 2)}


def test_a_time_beyond_one_percent_has_to_be_shown():
    # 1.2% on average, but the interval begins below 1%.
    common = 20.0 + SPREAD
    nearly = rank(table({"a": common, "b": 1.012 * common + 0.3 * SPREAD[::-1]}))
    assert nearly.duels[0].time_s.interval.low > 0.0
    assert nearly.duels[0].winner == ""


def test_two_trials_without_spread_show_nothing_of_arrivals():
    ranking = rank(table({"fails": [math.nan] * 2, "arrives": [20.0, 20.5]}))
    assert {entry.rank for entry in ranking.standings} == {1}


def test_one_trial_alone_shows_nothing():
    ranking = rank(table({"a": [20.0], "b": [30.0]}))
    assert places(ranking) == {"a": (1, 1, 2), "b": (1, 1, 2)}


def test_where_nothing_is_random_one_trial_decides():
    ranking = rank(table({"a": [20.0] * 3, "b": [30.0] * 3}, scenarios=("empty", "doorway")))
    assert places(ranking) == {"a": (1, 1, 1), "b": (2, 2, 2)}
    assert ranking.duels[0].time_s.pairs == 1


def test_scenarios_of_one_trial_are_one_pair():
    common = 20.0 + SPREAD
    ranking = rank(table({"a": common, "b": common + SPREAD}, scenarios=("x", "y", "z")))
    assert ranking.duels[0].time_s.pairs == len(SPREAD)


def test_times_are_compared_where_both_arrive():
    # Each is slow in one half; b fails where it would be slow, and is not quicker for that.
    slow = np.where(np.arange(8) < 4, 10.0, 30.0) + SPREAD
    picky = np.where(np.arange(8) < 7, slow, math.nan)
    duel = rank(table({"a": slow, "b": picky})).duels[0]
    assert duel.time_s.difference == 0.0
    assert duel.winner == ""


# Each example resamples a whole ranking, 0.1 s.
@settings(max_examples=10)
@given(
    st.lists(
        st.lists(st.sampled_from([math.nan, 10.0, 11.0, 12.5, 19.0]), min_size=4, max_size=4),
        min_size=2,
        max_size=5,
    )
)
def test_a_rank_lies_in_its_interval_and_somebody_is_first_of_two(columns):
    ranking = rank(table({f"c{number}": column for number, column in enumerate(columns)}))
    for entry in ranking.standings:
        assert 1 <= entry.interval.low <= entry.rank <= entry.interval.high <= len(columns)
    if len(columns) == 2:
        assert ranking.standings[0].rank == 1
