"""Totals over the worlds of a suite: a world counts once, and the intervals are over worlds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.statistics import share_interval, success_interval
from drake_navbench.analysis.totals import (
    MAX_WORLDS_ONE_BY_ONE,
    differences,
    scenarios_in_totals,
    totals,
    totals_csv,
)


def row(world, controller="rpp", outcome="succeeded", score=0.25, density="15%", trial=0):
    return {
        "suite": "BARN",
        "density": density,
        "scenario": f"barn_{world}",
        "controller": controller,
        "trial": trial,
        "outcome": outcome,
        "barn_score": score,
        "time_to_goal_s": 20.0 if outcome == "succeeded" else np.nan,
    }


def test_shares_and_scores_are_means_over_worlds():
    rows = [row(0), row(1), row(2, outcome="collided", score=0.0), row(3, outcome="aborted")]
    (total,) = totals(pd.DataFrame(rows))
    assert (total.worlds, total.trials) == (4, 4)
    assert total.success.value == 0.5
    assert total.collision.value == 0.25
    # The one that gave up was near enough by BARN's own rule.
    assert total.scored.value == 0.75
    assert total.score.mean == pytest.approx(3 * 0.25 / 4)
    assert total.success.interval == pytest.approx(success_interval(2, 4))


def test_a_world_counts_once_however_often_it_was_driven():
    often = [row(0, outcome="collided", score=0.0, trial=trial) for trial in range(9)]
    (total,) = totals(pd.DataFrame([*often, row(1)]))
    assert (total.worlds, total.trials) == (2, 10)
    assert total.success.value == 0.5
    assert total.score.mean == pytest.approx(0.125)


def test_densities_stand_apart_below_all():
    rows = [row(0), row(1, outcome="timed_out", score=0.0, density="30%"), row(2, density="30%")]
    found = {total.density: total.success.value for total in totals(pd.DataFrame(rows))}
    assert found == {"": pytest.approx(2 / 3), "15%": 1.0, "30%": 0.5}


def test_controllers_are_compared_world_by_world():
    rows = [row(world, score=0.2 + 0.01 * world) for world in range(10)]
    rows += [row(w, controller="dwb", score=0.1 + 0.01 * w, outcome="collided") for w in range(10)]
    found = {entry.quantity: entry for entry in differences(pd.DataFrame(rows))}
    assert found["score"].compared.comparison.difference == pytest.approx(-0.1)
    assert found["score"].compared.is_shown
    assert found["collision"].compared.comparison.difference == 1.0
    assert found["score"].compared[:2] == ("rpp", "dwb")


def test_what_is_in_no_suite_or_alone_in_it_has_no_totals():
    alone = row(0) | {"suite": "other"}
    none = [row(world) | {"suite": ""} for world in range(3)]
    assert totals(pd.DataFrame([alone, *none])) == []
    assert totals(pd.DataFrame(none).drop(columns="suite")) == []


def test_only_suites_of_many_worlds_are_told_by_their_totals_alone():
    many = {f"barn_{n}": "BARN" for n in range(MAX_WORLDS_ONE_BY_ONE + 1)}
    few = {"ward_1": "ward", "ward_2": "ward", "empty": ""}
    assert scenarios_in_totals(many | few) == frozenset(many)


@pytest.mark.parametrize(("successes", "count"), [(0, 5), (3, 7), (50, 50)])
def test_wilsons_interval_of_shares_is_that_of_successes(successes, count):
    assert share_interval(successes / count, count) == pytest.approx(
        success_interval(successes, count), abs=1e-12
    )


def test_the_csv_has_a_row_each_with_both_ends_of_every_interval():
    table = totals_csv(totals(pd.DataFrame([row(0), row(1)])))
    header, line = table.splitlines()
    assert header.startswith("suite,density,controller,worlds,trials,success,success_low")
    assert line.startswith("BARN,all,rpp,2,2,1.0,0.34")


@pytest.mark.parametrize(("scores", "interval"), [((0.5, 0.4), 0.5), ((0.0, 0.1), 0.0)])
def test_a_scores_interval_ends_where_scores_do(scores, interval):
    # Of two worlds Student's interval reaches 0.6 to either side.
    (total,) = totals(pd.DataFrame([row(world, score=s) for world, s in enumerate(scores)]))
    low, high = total.score.interval
    assert interval in (low, high)
    assert 0.0 <= low < high <= 0.5


def test_the_interval_of_a_time_ends_at_zero():
    # Of 10 s and 30 s Student's interval reaches from -107 to 147 s.
    rows = [{**row(world), "time_to_goal_s": t} for world, t in enumerate((10.0, 30.0))]
    (total,) = totals(pd.DataFrame(rows))
    assert total.time_s.interval == (0.0, pytest.approx(147.1, abs=0.1))
