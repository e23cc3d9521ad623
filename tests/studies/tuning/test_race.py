"""The race drops what is behind, and what nobody is better than only as rarely as it says."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from drake_navbench.studies.tuning.race import (
    ERROR,
    evidence,
    evidence_against,
    is_dropped,
    looks_until,
)


def test_looks_come_every_eight_pairs_and_at_the_end():
    assert looks_until(32) == [8, 16, 24, 32]
    assert looks_until(12) == [8, 12]
    assert looks_until(3) == [3]


def test_evidence_is_the_likelihood_of_prevailing_losses_over_that_of_even_ones():
    """Of losses alone: twice the integral of p^n from 1/2 to 1, over 2^-n."""
    assert evidence(0, 0) == pytest.approx(1.0)
    assert evidence(0, 1) == pytest.approx(2.0 * (1.0 - 1.0 / 4.0) / 2.0 * 2.0)
    assert evidence(0, 7) == pytest.approx(2.0**8 / 8.0 * (1.0 - 2.0**-8))
    assert evidence(7, 0) == pytest.approx(1.0 / 8.0)


@pytest.mark.parametrize("pairs", [1, 5, 12])
def test_evidence_is_one_on_average_where_wins_and_losses_are_equally_likely(pairs):
    average = sum(comb(pairs, k) * evidence(pairs - k, k) for k in range(pairs + 1)) / 2**pairs
    assert average == pytest.approx(1.0)


def test_eight_losses_to_the_baseline_drop_a_configuration_and_seven_among_others_do_not():
    """57 shared with an equal rival's 1 is above 20, 32 is not."""
    equal = np.ones((8, 2))
    assert is_dropped(np.ones((8, 2)), [equal])
    assert not is_dropped(np.ones((7, 2)), [equal])


def test_one_of_forty_rivals_has_to_show_more_than_one_alone():
    """Half of the evidence is theirs: of 40 one gives an 80th of it."""
    level = np.zeros((16, 1))
    own = np.full((16, 1), -0.5)
    better, worse = np.full((16, 1), -1.0), level
    assert is_dropped(own[:8], [better])
    assert not is_dropped(own[:8], [better, *[worse] * 39])
    assert is_dropped(own, [better, *[worse] * 39])


def test_who_is_better_in_something_is_not_dropped():
    own = np.tile([1.0, -0.01], (32, 1))
    assert not is_dropped(own, [np.zeros((32, 2))])


def test_a_tie_in_one_objective_does_not_save():
    own = np.tile([1.0, 0.0], (8, 1))
    assert is_dropped(own, [])


def test_a_rival_counts_as_far_as_it_drove_and_one_that_touched_says_nothing():
    own = np.ones((8, 1))
    assert evidence_against(own, np.zeros((4, 1))) == evidence(0, 4)
    assert evidence_against(own, np.zeros((0, 1))) == 1.0


def error_against(rivals, objectives, *, races, worse_by=0.0):
    """The share of races in which a configuration is dropped, and the pairs that it drove.

    Costs are normal; the baseline's, which all differences are taken to, are so, too.
    """
    random = np.random.default_rng(rivals * 10 + objectives)
    looks = looks_until(32)[:-1]
    dropped, pairs = 0, 0
    for _ in range(races):
        drawn = random.normal(size=(rivals + 2, 32, objectives))
        drawn[0] += worse_by
        own, *others = drawn[:-1] - drawn[-1]
        ended = next((end for end in looks if is_dropped(own[:end], others)), 32)
        dropped += ended < 32
        pairs += ended
    return dropped / races, pairs / races


@pytest.mark.parametrize("rivals", [0, 1, 40])
def test_no_number_of_equal_rivals_drops_a_configuration_more_often_than_it_says(rivals):
    """One test a rival, each at 5%, dropped it in 26% of the races with 40."""
    share, _ = error_against(rivals, 1, races=150)
    # Three standard deviations of a share of 5% in 150 races are 5.3%.
    assert share <= ERROR + 0.053


@pytest.mark.long
@pytest.mark.parametrize("objectives", [1, 3])
@pytest.mark.parametrize("rivals", [0, 1, 10, 40, 199])
def test_the_error_and_the_power_that_the_docs_tell(rivals, objectives):
    races = 2000 if rivals <= 40 else 400
    error, _ = error_against(rivals, objectives, races=races)
    assert error <= ERROR
    for worse_by, least in ((1.0, 0.4), (2.0, 0.95)):
        power, pairs = error_against(rivals, objectives, races=races // 4, worse_by=worse_by)
        assert power >= least
        print(
            f"{rivals} rivals, {objectives} objectives: error {error:.2%}, {worse_by:g} sd worse: "
            f"dropped {power:.1%} after {pairs:.1f} pairs"
        )


@pytest.mark.long
def test_a_whole_search_of_equals_drops_at_most_the_share_that_it_says():
    """Sixty, each racing against all before it; a dropped one counts as far as it drove."""
    random = np.random.default_rng(5)
    looks = looks_until(32)[:-1]
    dropped = driven = 0
    for _ in range(40):
        baseline = random.normal(size=(32, 1))
        before: list[np.ndarray] = []
        for _ in range(60):
            own = random.normal(size=(32, 1)) - baseline
            ended = next((end for end in looks if is_dropped(own[:end], before)), 32)
            before.append(own[:ended])
            dropped += ended < 32
            driven += 1
    assert dropped / driven <= ERROR
