"""The race drops what is behind, and what is as good only as rarely as it says."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.tuning.race import ERROR, is_dominated, is_dropped, looks_until, sign_test


def test_looks_double_and_end_with_the_last_pair():
    assert looks_until(32) == [4, 8, 16, 32]
    assert looks_until(20) == [4, 8, 16, 20]
    assert looks_until(3) == [3]


def test_the_sign_test_is_the_binomial_tail():
    assert sign_test(0, 3) == 1 / 8
    assert sign_test(1, 3) == 5 / 16
    assert sign_test(0, 0) == 1.0


def test_seven_losses_in_a_row_drop_a_configuration_and_six_do_not():
    """With four looks the level is 0.0125, between 1/128 and 1/64."""
    rival = np.zeros((7, 2))
    assert is_dominated(np.ones((7, 2)), rival, looks=4)
    assert not is_dominated(np.ones((6, 2)), rival[:6], looks=4)


def test_who_is_better_in_something_is_not_dropped():
    own = np.tile([1.0, -0.01], (32, 1))
    assert not is_dominated(own, np.zeros((32, 2)), looks=4)


def test_a_tie_in_one_objective_does_not_save():
    own = np.tile([1.0, 0.0], (8, 1))
    assert is_dominated(own, np.zeros((8, 2)), looks=4)


def test_a_rival_that_has_driven_less_drops_nobody():
    assert not is_dropped(np.ones((8, 1)), [np.zeros((7, 1))], looks=4)
    assert is_dropped(np.ones((8, 1)), [np.zeros((7, 1)), np.zeros((32, 1))], looks=4)


@pytest.mark.parametrize("objectives", [1, 3])
def test_an_equal_rival_drops_a_configuration_at_most_as_often_as_it_says(objectives):
    random = np.random.default_rng(0)
    looks = looks_until(32)
    races = 2000
    dropped = sum(
        any(is_dominated(own[:end], rival[:end], looks=len(looks)) for end in looks)
        for own, rival in random.normal(size=(races, 2, 32, objectives))
    )
    # Three standard deviations of a share of 5% in 2000 races are 1.5%.
    assert dropped / races <= ERROR + 0.015
