"""Ranks by arrivals and then by time, and whether the trials show that they change."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.rank_changes import rank_changes, sentence

CLEAN_OF = {"everyday": "clean"}


def trials(*cells):
    """Returns rows; cells: scenario, controller, times of its seeds, None where not arrived."""
    return pd.DataFrame(
        [
            {
                "scenario": scenario,
                "controller": controller,
                "seed": seed,
                "outcome": "aborted" if time_s is None else "succeeded",
                "time_to_goal_s": float("nan") if time_s is None else time_s,
            }
            for scenario, controller, times in cells
            for seed, time_s in enumerate(times)
        ]
    )


def ranks(changes):
    return {change.controller: (change.clean.rank, change.harsh.rank) for change in changes}


def test_who_arrives_more_often_is_ahead_of_who_is_quicker():
    found = rank_changes(
        trials(
            ("clean", "quick", [10.0] * 16),
            ("clean", "sure", [12.0] * 16),
            ("everyday", "quick", [10.0, None] * 8),
            ("everyday", "sure", [15.0] * 16),
        ),
        CLEAN_OF,
    )
    assert ranks(found) == {"quick": (1, 2), "sure": (2, 1)}
    # Each changes its place in 8 of 16 seeds, always in one direction: p = 2 / 2^8 for both of two.
    assert [change.p_value for change in found] == [pytest.approx(2 * 2 / 2**8)] * 2
    assert [change.words for change in found] == ["falls", "rises"]
    assert sentence(found) == (
        "From clean to everyday quick falls from rank 1 to 2; sure rises from rank 2 to 1, and 8 "
        "more of 32 trials do not arrive."
    )


def test_less_than_a_percent_is_no_difference():
    found = rank_changes(
        trials(
            *(
                (name, c, [t] * 4)
                for name in ("clean", "everyday")
                for c, t in (("a", 10.0), ("b", 10.05), ("c", 10.2))
            )
        ),
        CLEAN_OF,
    )
    # 10.2 s is 2% behind 10.0 s and 1.5% behind 10.05 s.
    assert ranks(found) == {"a": (1, 1), "b": (1, 1), "c": (3, 3)}
    assert sentence(found) == "From clean to everyday no change of a rank is shown."


def test_one_failure_of_one_seed_shows_no_change():
    found = rank_changes(
        trials(
            ("clean", "a", [10.0] * 8),
            ("clean", "b", [12.0] * 8),
            ("everyday", "a", [None] + [10.0] * 7),
            ("everyday", "b", [12.0] * 8),
        ),
        CLEAN_OF,
    )
    assert ranks(found) == {"a": (1, 2), "b": (2, 1)}
    assert not any(change.is_shown for change in found)


@pytest.mark.parametrize(("seeds", "is_shown"), [(4, False), (6, False), (7, True)])
def test_a_few_seeds_show_no_change_however_much_they_agree(seeds, is_shown):
    """Of two controllers, that takes p = 2 * 2 / 2^n below 5%."""
    late = [0.01 * seed for seed in range(seeds)]
    found = rank_changes(
        trials(
            ("clean", "a", [10.0 + s for s in late]),
            ("clean", "b", [12.0 + s for s in late]),
            ("everyday", "a", [12.0 + s for s in late]),
            ("everyday", "b", [10.0 + s for s in late]),
        ),
        CLEAN_OF,
    )
    assert ranks(found) == {"a": (1, 2), "b": (2, 1)}
    assert [change.is_shown for change in found] == [is_shown] * 2


def test_trials_in_which_nothing_is_random_show_their_change():
    cells = [("clean", "a", 10.0), ("clean", "b", 12.0), ("everyday", "a", 12.0)]
    found = rank_changes(trials(*((s, c, [t] * 2) for s, c, t in cells)), CLEAN_OF)
    assert [change.is_shown for change in found] == [False]
    cells.append(("everyday", "b", 10.0))
    found = rank_changes(trials(*((s, c, [t] * 2) for s, c, t in cells)), CLEAN_OF)
    assert [change.words for change in found] == ["falls", "rises"]


def test_equal_controllers_are_seldom_told_to_change_places():
    random = np.random.default_rng(0)
    alarms = 0
    for _ in range(30):
        cells = [
            (s, c, 20.0 + random.standard_normal(8))
            for s in ("clean", "everyday")
            for c in "abcdef"
        ]
        alarms += any(change.is_shown for change in rank_changes(trials(*cells), CLEAN_OF))
    # 1.5 of 30 are allowed; 6 or more would be seen by chance once in 300 times.
    assert alarms < 6


def test_without_the_clean_scenario_nothing_is_said():
    assert rank_changes(trials(("everyday", "a", [10.0])), CLEAN_OF) == []
    assert rank_changes(trials(), CLEAN_OF) == []


def test_without_a_seed_in_common_nothing_is_said():
    rows = trials(("clean", "a", [10.0]), ("everyday", "a", [10.0]))
    rows.loc[0, "seed"] = 7
    assert rank_changes(rows, CLEAN_OF) == []


def test_only_controllers_and_seeds_of_both_count():
    found = rank_changes(
        trials(
            ("clean", "a", [10.0, 10.0, 10.0]),
            ("clean", "b", [9.0, 9.0, 9.0]),
            ("everyday", "a", [10.0, 11.0]),
        ),
        CLEAN_OF,
    )
    assert [(change.controller, change.clean.trials) for change in found] == [("a", 2)]


@pytest.mark.parametrize("arrived", [True, False])
def test_where_everybody_ends_alike_all_share_the_first_place(arrived):
    times = [10.0 if arrived else None] * 3
    cells = ((name, c, times) for name in CLEAN_OF.keys() | {"clean"} for c in "abc")
    assert set(ranks(rank_changes(trials(*cells), CLEAN_OF)).values()) == {(1, 1)}
