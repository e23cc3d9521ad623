"""A goal counts as reached in the same cycle as with Nav2's goal checkers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.navigation.adaptive_goal_checker import AdaptiveToleranceGoalChecker
from drake_navbench.navigation.goal_checkers import (
    GOAL_CHECKERS,
    AxisGoalChecker,
    PositionGoalChecker,
    SimpleGoalChecker,
    StoppedGoalChecker,
)

GOAL = np.array([5.0, 1.0, 0.5])
AT_REST = np.zeros(3)
SHORT_PLAN = np.array([[4.6, 1.0, 0.0], [4.8, 1.0, 0.0], [5.0, 1.0, 0.5]])  # 0.4 m long
LONG_PLAN = np.array([[3.9, 1.0, 0.0], [5.0, 1.0, 0.5]])  # 1.1 m, above the 1.0 m of the default


def make(checker_class, **parameters):
    return checker_class(checker_class.Parameters(**parameters))


def run(checker, offsets, *, twist=AT_REST, local_plan=SHORT_PLAN, yaw_offset=0.0):
    """Returns (reached, xy_reached) for robot positions given relative to the goal, in turn."""
    state, verdicts = checker.initial_state(), []
    for offset_x, offset_y in offsets:
        result = checker.check(
            state,
            pose=GOAL + np.array([offset_x, offset_y, yaw_offset]),
            goal=GOAL,
            twist=np.asarray(twist),
            local_plan=local_plan,
        )
        state = result.state
        verdicts.append((result.reached, result.xy_reached))
    return verdicts


NOWHERE, POSITION_ONLY, REACHED = (False, False), (False, True), (True, True)


@pytest.mark.parametrize(
    ("offset", "yaw_offset", "expected"),
    [
        ((-0.25, 0.0), 0.25, REACHED),  # both bounds inclusive
        ((-0.14, -0.2), 0.0, REACHED),  # hypot = 0.244
        ((-0.16, -0.2), 0.0, NOWHERE),  # hypot = 0.256
        ((-0.2, 0.0), 0.26, POSITION_ONLY),
        ((-0.2, 0.0), 2.0 * math.pi - 0.2, REACHED),
    ],
)
def test_simple_checker_asks_for_position_and_heading(offset, yaw_offset, expected):
    assert run(make(SimpleGoalChecker), [offset], yaw_offset=yaw_offset) == [expected]


def test_a_long_local_plan_is_never_at_the_goal():
    assert run(make(SimpleGoalChecker), [(0.0, 0.0)], local_plan=LONG_PLAN) == [NOWHERE]


def test_a_stateful_checker_forgives_leaving_the_position_again():
    offsets = [(0.2, 0.0), (0.6, 0.0)]
    assert run(make(SimpleGoalChecker), offsets) == [REACHED, REACHED]
    assert run(make(SimpleGoalChecker, stateful=False), offsets) == [REACHED, NOWHERE]


def test_a_buffer_limits_how_far_the_robot_may_leave():
    checker = make(SimpleGoalChecker, xy_goal_tolerance_buffer=0.25)
    offsets = [(0.2, 0.0), (0.5, 0.0), (0.6, 0.0), (0.4, 0.0)]
    assert run(checker, offsets) == [REACHED, REACHED, NOWHERE, NOWHERE]


def test_a_symmetric_robot_may_face_backwards():
    offsets = [(0.0, 0.0)]
    back = math.pi - 0.2
    assert run(make(SimpleGoalChecker), offsets, yaw_offset=back) == [POSITION_ONLY]
    symmetric = make(SimpleGoalChecker, symmetric_yaw_tolerance=True)
    assert run(symmetric, offsets, yaw_offset=back) == [REACHED]


def test_a_new_path_starts_without_the_latch():
    checker = make(SimpleGoalChecker)
    run(checker, [(0.0, 0.0)])
    assert run(checker, [(0.6, 0.0)]) == [NOWHERE]


@pytest.mark.parametrize(
    ("twist", "expected"),
    [
        ((0.25, 0.25, 0.0), REACHED),
        ((-0.3, 0.0, 0.0), POSITION_ONLY),
        ((0.0, -0.3, 0.0), POSITION_ONLY),
        ((0.0, 0.0, 0.3), POSITION_ONLY),
        # hypot(0.2, 0.2) = 0.28
        ((0.2, 0.0, 0.2), POSITION_ONLY),
    ],
)
def test_stopped_checker_waits_for_standstill(twist, expected):
    assert run(make(StoppedGoalChecker), [(0.0, 0.0)], twist=twist) == [expected]


def test_position_checker_takes_any_heading():
    assert run(make(PositionGoalChecker), [(0.2, 0.0)], yaw_offset=3.0) == [REACHED]
    assert run(make(PositionGoalChecker), [(0.3, 0.0)]) == [NOWHERE]


@pytest.mark.parametrize(
    ("offset", "is_overshoot_valid", "expected"),
    [
        ((-0.2, 0.2), False, REACHED),  # farther than 0.25 m, but within both bounds
        ((-0.25, 0.0), False, NOWHERE),  # bounds are exclusive
        ((0.0, 0.26), False, NOWHERE),
        ((0.4, 0.0), False, NOWHERE),  # beyond the goal
        ((0.4, 0.0), True, REACHED),
        ((-0.4, 0.0), True, NOWHERE),
    ],
)
def test_axis_checker_tells_along_from_across(offset, is_overshoot_valid, expected):
    checker = make(AxisGoalChecker, is_overshoot_valid=is_overshoot_valid)
    assert run(checker, [offset]) == [expected]


def test_axis_checker_takes_the_distance_where_the_path_has_no_direction():
    # The diagonal of 0.25 and 0.25 is 0.3536.
    single_pose = GOAL[None]
    checker = make(AxisGoalChecker)
    assert run(checker, [(0.35, 0.0)], local_plan=single_pose) == [REACHED]
    assert run(checker, [(0.36, 0.0)], local_plan=single_pose) == [NOWHERE]


MOVING = (0.3, 0.0, 0.0)


def test_adaptive_checker_takes_a_fine_position_at_once():
    checker = make(AdaptiveToleranceGoalChecker)
    assert run(checker, [(-0.1, 0.0)], twist=MOVING) == [REACHED]


def test_adaptive_checker_waits_while_the_robot_gets_nearer():
    checker = make(AdaptiveToleranceGoalChecker, required_stagnation_cycles=2)
    offsets = [(-0.24, 0.1 - 0.02 * i) for i in range(4)]
    assert run(checker, offsets, twist=MOVING)[-1] == NOWHERE


def test_adaptive_checker_takes_a_coarse_position_that_gets_no_better():
    checker = make(AdaptiveToleranceGoalChecker, required_stagnation_cycles=2)
    # Entering does not count; then two cycles without getting nearer.
    assert run(checker, 3 * [(-0.2, 0.0)], twist=MOVING) == [NOWHERE, NOWHERE, REACHED]


def test_adaptive_checker_takes_a_coarse_position_at_standstill():
    checker = make(AdaptiveToleranceGoalChecker, required_stagnation_cycles=2)
    nearing = [(-0.2, 0.0), (-0.19, 0.0), (-0.18, 0.0)]
    assert run(checker, nearing) == [NOWHERE, NOWHERE, REACHED]


def test_adaptive_checker_takes_a_coarse_position_beyond_the_goal():
    checker = make(AdaptiveToleranceGoalChecker)
    # Entered from behind, then level with the goal: the finish line is crossed.
    assert run(checker, [(-0.2, 0.14), (0.0, 0.13)], twist=MOVING)[-1] == NOWHERE
    assert run(checker, [(-0.2, 0.1), (0.1, 0.13)], twist=MOVING)[-1] == REACHED


def test_adaptive_checker_starts_again_after_leaving_the_coarse_position():
    checker = make(AdaptiveToleranceGoalChecker, required_stagnation_cycles=2)
    offsets = [(-0.2, 0.0), (-0.2, 0.0), (-0.3, 0.0), (-0.2, 0.0), (-0.2, 0.0)]
    assert run(checker, offsets, twist=MOVING)[-1] == NOWHERE


def test_adaptive_checker_forgets_a_position_left_by_more_than_the_buffer():
    checker = make(AdaptiveToleranceGoalChecker, xy_goal_tolerance_buffer=0.05)
    offsets = [(-0.1, 0.0), (-0.14, 0.0), (-0.16, 0.0)]
    assert run(checker, offsets, twist=MOVING) == [REACHED, REACHED, NOWHERE]


@pytest.mark.parametrize("checker_class", GOAL_CHECKERS.built_in.values())
def test_a_mirrored_world_gives_the_same_verdicts(checker_class):
    mirror = np.array([1.0, -1.0, -1.0])
    checker = make(checker_class)
    here, there = checker.initial_state(), checker.initial_state()
    for offset_x in np.linspace(-0.6, 0.3, 19):
        pose = GOAL + np.array([offset_x, 0.1, 0.1])
        one = checker.check(here, pose=pose, goal=GOAL, twist=AT_REST, local_plan=SHORT_PLAN)
        other = checker.check(
            there,
            pose=pose * mirror,
            goal=GOAL * mirror,
            twist=AT_REST,
            local_plan=np.ascontiguousarray(SHORT_PLAN * mirror),
        )
        here, there = one.state, other.state
        assert one[:2] == other[:2]


def test_checkers_tell_controllers_their_tolerances():
    told = {
        name.split("::")[1]: (make(c).xy_tolerance_m, make(c).yaw_tolerance_rad)
        for name, c in GOAL_CHECKERS.built_in.items()
    }
    assert told == {
        "SimpleGoalChecker": (0.25, 0.25),
        "StoppedGoalChecker": (0.25, 0.25),
        "PositionGoalChecker": (0.25, math.pi),
        "AxisGoalChecker": (0.25, math.pi / 2),
        "AdaptiveToleranceGoalChecker": (0.25, 0.25),
    }
