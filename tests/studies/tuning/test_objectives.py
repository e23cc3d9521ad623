"""Objectives are relative differences on equal seeds; failing never pays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.studies.tuning.objectives import (
    CENSORED,
    chosen_objectives,
    excess_failures,
    pair_difference,
    require_comparable,
    scales_of,
)

OBJECTIVES = chosen_objectives(("time", "clearance"))


def row(time_s=10.0, clearance_m=0.5, outcome="succeeded", scenario="doorway"):
    return {
        "scenario": scenario,
        "outcome": outcome,
        "time_to_goal_s": time_s,
        "min_clearance_m": clearance_m,
    }


def test_shorter_and_farther_are_lower():
    scale = scales_of([row(10.0, 0.4), row(30.0, 0.6)], OBJECTIVES)["doorway"]
    assert scale == pytest.approx([20.0, 0.5])
    found = pair_difference(row(8.0, 0.6), row(10.0, 0.5), OBJECTIVES, scale)
    assert found == pytest.approx([-0.1, -0.2])


def test_a_failure_is_the_worst_and_a_rescue_the_best():
    scale = np.array([20.0, 0.5])
    failed = row(math.nan, 0.9, outcome="aborted")
    assert pair_difference(failed, row(), OBJECTIVES, scale) == [CENSORED, CENSORED]
    assert pair_difference(row(), failed, OBJECTIVES, scale) == [-CENSORED, -CENSORED]
    assert pair_difference(failed, failed, OBJECTIVES, scale) == [0.0, 0.0]


def test_no_pair_counts_for_more_than_a_failure():
    assert pair_difference(row(1000.0), row(), OBJECTIVES, np.array([1.0, 1.0]))[0] == CENSORED


def test_an_objective_without_a_value_neither_gains_nor_loses():
    empty = [row(10.0, math.nan), row(11.0, math.nan)]
    require_comparable(empty, OBJECTIVES)
    scale = scales_of(empty, OBJECTIVES)["doorway"]
    assert pair_difference(*empty, OBJECTIVES, scale) == pytest.approx([-1.0 / 10.5, 0.0])


def test_two_points_of_success_may_be_lost():
    baseline = [row()] * 100
    failing = [row(outcome="collided")] * 2 + [row()] * 98
    assert excess_failures(failing, baseline) == pytest.approx(0.0)
    assert excess_failures([row(outcome="collided"), *failing[1:]], baseline) <= 1e-12
    assert (
        excess_failures([*failing[1:], row(outcome="timed_out"), row(outcome="aborted")], baseline)
        > 0
    )


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([row(), row()], "nothing in it is random"),
        ([row(outcome="aborted"), row(11.0, outcome="aborted")], "in none of its trials"),
    ],
)
def test_a_scenario_that_cannot_tell_is_refused(rows, told):
    with pytest.raises(InputError, match=f"scenario doorway: .*{told}"):
        require_comparable(rows, OBJECTIVES)


def test_an_unknown_objective_is_one_line():
    with pytest.raises(InputError, match=r"'tme' is not known; did you mean 'time'\?"):
        chosen_objectives(["tme"])
