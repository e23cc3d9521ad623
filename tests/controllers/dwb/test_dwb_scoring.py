"""How scores become a choice: order, rounding, ties, early stops, rules."""

import numpy as np
import pytest

from drake_navbench.controllers.dwb.local_planner import choose


def run(raw, *, scales=None, violations=None, short_circuit=False):
    """Returns (best, totals, judged counts) for raw scores given as one list a critic."""
    raw = np.array(raw, dtype=float)
    scales = np.ones(len(raw)) if scales is None else np.array(scales)
    violations = np.zeros(raw.shape) if violations is None else np.array(violations)
    totals = np.empty(raw.shape[1], dtype=np.float32)
    judged = np.empty(raw.shape[1], dtype=np.int64)
    best = choose(
        raw, violations.astype(np.uint8), scales.astype(np.float32), short_circuit, totals, judged
    )
    return best, totals.tolist(), judged.tolist()


def test_least_weighted_sum_wins():
    # 2 * 1 + 0.5 * 4 = 4; 2 * 0 + 0.5 * 6 = 3; 2 * 1.5 + 0 = 3.
    assert run([[1, 0, 1.5], [4, 6, 0]], scales=[2.0, 0.5]) == (1, [4.0, 3.0, 3.0], [2, 2, 2])


def test_equal_totals_keep_the_earlier_trajectory():
    assert run([[3, 2, 2]])[0] == 1


def test_totals_are_rounded_to_float32_after_every_critic():
    # 16777216 = 2^24: adding 1 twice is lost in float32, in double it would make 16777218.
    assert run([[2.0**24], [1.0], [1.0]])[1] == [2.0**24]


def test_difference_below_float32_is_a_tie():
    assert run([[1.0 + 1e-9, 1.0]])[0] == 0
    assert run([[1.0 + 1e-6, 1.0]])[0] == 1


def test_early_stop_leaves_a_partial_total_and_hides_a_later_violation():
    raw, violations = [[1, 5], [1, 7]], [[0, 0], [0, 1]]
    assert run(raw, violations=violations, short_circuit=True) == (0, [2.0, 5.0], [2, 1])
    assert run(raw, violations=violations) == (0, [2.0, -1.0], [2, 2])


def test_no_early_stop_before_a_best_above_zero():
    # The best total 0 is not above zero, so the second trajectory is judged to the end.
    assert run([[0, 5], [0, 7]], short_circuit=True)[1:] == ([0.0, 12.0], [2, 2])


def test_critic_with_scale_zero_neither_scores_nor_rejects():
    best, totals, _ = run([[np.nan], [1]], scales=[0.0, 1.0], violations=[[1], [0]])
    assert (best, totals) == (0, [1.0])


def test_nothing_is_chosen_where_all_are_illegal_or_there_is_no_trajectory():
    assert run([[1, 2]], violations=[[1, 2]])[0] == -1
    assert run(np.empty((1, 0)))[0] == -1


def test_infinite_total_may_be_chosen_for_want_of_a_better_one():
    assert run([[1e300]])[:2] == (0, [np.inf])
    assert run([[1e300, 5.0]])[0] == 1


@pytest.mark.parametrize("short_circuit", [False, True])
def test_choice_does_not_depend_on_stopping_early(short_circuit):
    raw = np.random.default_rng(3).integers(0, 9, (4, 300)).astype(float)
    sums = raw.sum(axis=0)
    assert run(raw, short_circuit=short_circuit)[0] == np.flatnonzero(sums == sums.min())[0]
