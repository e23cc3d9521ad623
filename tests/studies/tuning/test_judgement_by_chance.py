"""How often a point of the front is said to beat a preset that drives alike: by simulation."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from drake_navbench.studies.tuning.judgement import judge, least_pairs
from drake_navbench.studies.tuning.objectives import chosen_objectives

OBJECTIVES = chosen_objectives(("time", "clearance", "jerk"))


def drawn(random, pairs: int, columns: list[str], *, fails: float, spread: float, faster=1.0):
    """A table of tasks on one map: each its own length, all columns with the same law.

    spread: of the logarithms of a trial's metrics. faster: by how much the times of the columns
    behind the first are shorter.
    """
    rows = []
    lengths = random.lognormal(0.0, 0.4, pairs)
    for column in columns:
        for task, length in enumerate(lengths):
            own = random.lognormal(0.0, spread, 3)
            rows.append(
                {
                    "controller": column,
                    "scenario": f"hall_{task}",
                    "seed": 0,
                    "trial": 0,
                    "outcome": "aborted" if random.uniform() < fails else "succeeded",
                    "reason": "",
                    "time_to_goal_s": 10.0
                    * length
                    * own[0]
                    / (1.0 if column == "mine" else faster),
                    "min_clearance_m": 0.3 * own[1],
                    "jerk_rms_mps3": own[2],
                }
            )
    return pd.DataFrame(rows)


def share_that_beats(runs: int, pairs: int, points: int, **law) -> float:
    columns = ["mine", *(f"tuned_{number}" for number in range(points))]
    suites = {f"hall_{task}": "hall" for task in range(pairs)}
    hits = 0
    for run in range(runs):
        table = drawn(np.random.default_rng(run), pairs, columns, **law)
        judged = judge(table, "mine", columns[1:], OBJECTIVES, suites)
        hits += any(entry.beats_baseline for entry in judged)
    return hits / runs


def test_three_tasks_never_show_that_a_point_beats_the_preset():
    """Before, 13% of the judgements of eight equal points said so."""
    assert share_that_beats(6, 3, 8, fails=0.1, spread=0.6) == 0.0
    # Even where every one of three trials takes half the time.
    assert share_that_beats(1, 3, 1, fails=0.0, spread=0.01, faster=2.0) == 0.0


def test_a_point_that_takes_half_the_time_is_shown_to_beat_it():
    assert share_that_beats(1, least_pairs(1, 1, 3), 1, fails=0.0, spread=0.01, faster=2.0) == 1.0


def test_a_point_that_crashes_once_in_sixty_four_tasks_beats_nothing():
    table = drawn(np.random.default_rng(0), 64, ["mine", "tuned"], fails=0.0, spread=0.01, faster=2)
    suites = {f"hall_{task}": "hall" for task in range(64)}
    (sound,) = judge(table, "mine", ["tuned"], OBJECTIVES, suites)
    table.loc[table.index[-1], "outcome"] = "error"
    (crashing,) = judge(table, "mine", ["tuned"], OBJECTIVES, suites)
    assert (sound.beats_baseline, crashing.beats_baseline) == (True, False)
    assert "tuned alone ended as an error in 1 pair" in crashing.text


def test_fewer_pairs_than_can_decide_are_not_asked_for():
    # 24 tests at 1%: a level of 1/2400; 2 / 2^13 is below it, 2 / 2^12 above.
    assert least_pairs(8, 1, 3) == 13
    assert least_pairs(1, 1, 1) == 8


@pytest.mark.long
@pytest.mark.parametrize("pairs", [13, 32])
@pytest.mark.parametrize(("fails", "spread"), [(0.0, 0.1), (0.1, 0.6)])
def test_of_equal_laws_at_most_one_judgement_in_twenty_says_beats(pairs, fails, spread):
    share = share_that_beats(100, pairs, 8, fails=fails, spread=spread)
    print(f"{pairs} tasks, 8 points, {fails:.0%} fail, spread {spread}: beats {share:.1%}")
    assert share <= 0.05


@pytest.mark.long
def test_five_percent_faster_is_found_by_thirty_two_tasks():
    share = share_that_beats(50, 32, 1, fails=0.0, spread=0.04, faster=1.05)
    print(f"5% faster, spread of the pairs 5.7%, 32 tasks: beats {share:.0%}")
    assert share >= 0.8
