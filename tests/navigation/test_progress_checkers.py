"""A robot that does not get on is found out, at the same cycle as in Nav2."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.navigation.progress_checkers import (
    PROGRESS_CHECKERS,
    PoseProgressChecker,
    PoseProgressCheckerParameters,
    SimpleProgressChecker,
    SimpleProgressCheckerParameters,
)


def run(checker, poses_and_times):
    """Returns what each check says, one after the other."""
    state, verdicts = checker.initial_state(), []
    for pose, time_s in poses_and_times:
        made_progress, state = checker.check(state, pose=np.array(pose), time_s=time_s)
        verdicts.append(made_progress)
    return verdicts


@pytest.fixture
def simple():
    return SimpleProgressChecker(SimpleProgressCheckerParameters())


@pytest.fixture
def turning():
    return PoseProgressChecker(PoseProgressCheckerParameters())


def test_standing_is_progress_for_ten_seconds_and_not_longer(simple):
    at = (0.0, 0.0, 0.0)
    assert run(simple, [(at, 0.05), (at, 10.05), (at, 10.1)]) == [True, True, False]


def test_moving_more_than_the_radius_starts_the_time_anew(simple):
    moves = [((0.0, 0.0, 0.0), 0.0), ((0.3, 0.41, 0.0), 9.0), ((0.3, 0.41, 0.0), 19.0)]
    assert run(simple, moves) == [True, True, True]  # hypot(0.3, 0.41) = 0.508 > 0.5


def test_moving_just_the_radius_does_not(simple):
    moves = [((0.0, 0.0, 0.0), 0.0), ((0.3, 0.4, 0.0), 9.0), ((0.3, 0.4, 0.0), 10.5)]
    assert run(simple, moves) == [True, True, False]


def test_progress_counts_from_the_last_baseline_not_from_the_last_pose(simple):
    # 0.2 m every 6 s: 0.6 m from the baseline at the fourth check, but 18 s have passed by then.
    moves = [((0.2 * i, 0.0, 0.0), 6.0 * i) for i in range(3)]
    assert run(simple, moves) == [True, True, False]


def test_turning_in_place_is_progress_only_for_the_pose_checker(simple, turning):
    moves = [((0.0, 0.0, 0.1 * i), 1.0 * i) for i in range(13)]
    assert run(simple, moves)[-1] is False
    assert run(turning, moves)[-1] is True


def test_a_turn_across_the_wrap_is_a_small_one(turning):
    moves = [((0.0, 0.0, 3.1), 0.0), ((0.0, 0.0, -3.1), 9.0), ((0.0, 0.0, -3.1), 10.5)]
    assert run(turning, moves) == [True, True, False]  # 2 pi - 6.2 = 0.083 rad


def test_a_check_leaves_the_given_state_as_it_was(simple):
    _, state = simple.check(None, pose=np.zeros(3), time_s=0.0)
    before = tuple(state)
    first = simple.check(state, pose=np.array([2.0, 0.0, 0.0]), time_s=1.0)
    assert tuple(state) == before
    assert simple.check(state, pose=np.array([2.0, 0.0, 0.0]), time_s=1.0) == first


def test_checkers_are_found_by_their_nav2_type():
    assert PROGRESS_CHECKERS.load("nav2_controller::SimpleProgressChecker") is SimpleProgressChecker
    assert PROGRESS_CHECKERS.load("nav2_controller::PoseProgressChecker") is PoseProgressChecker


def test_an_allowance_is_cut_to_whole_nanoseconds():
    # 2.05e9 in floating point is 2,049,999,999.9999998.
    checker = SimpleProgressChecker(SimpleProgressCheckerParameters(movement_time_allowance=2.05))
    at = (0.0, 0.0, 0.0)
    assert run(checker, [(at, 0.0), (at, 2.0), (at, 2.05)]) == [True, True, False]
