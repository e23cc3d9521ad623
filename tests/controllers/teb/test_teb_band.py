import math

import numpy as np
import pytest

from drake_navbench.controllers.teb.band import (
    Band,
    Pace,
    drop_repeated_points,
    initialise,
    next_twist,
    resampled,
    shift,
    trapezoid_duration,
    unwrapped_goal,
    warm_start,
)

PACE = Pace(
    speed=0.5, turn_rate=1.0, acceleration=0.5, dt_ref=0.3, dt_hysteresis=0.1, fewest=3, most=40
)
NO_PATH = np.empty((0, 2))


def straight(count=10, step_m=0.15, step_s=0.3):
    poses = np.zeros((count + 1, 3))
    poses[:, 0] = step_m * np.arange(count + 1)
    return Band(poses, np.full(count, step_s))


def test_first_guess_of_a_straight_run_is_even_and_straight():
    band = initialise(NO_PATH, np.zeros(3), np.array([2.0, 0.0, 0.0]), pace=PACE)
    # 2 m at 0.5 m/s and 1 s for speeding up and stopping: 5 s in 0.3 s steps are 17.
    assert len(band.time_steps) == 17
    assert band.duration_s == pytest.approx(5.0)
    np.testing.assert_allclose(band.poses[:, 0], np.linspace(0.0, 2.0, 18), atol=1e-12)
    np.testing.assert_array_equal(band.poses[:, 1:], 0.0)


def test_first_guess_turns_on_the_spot_before_it_drives_back():
    band = initialise(NO_PATH, np.array([0.0, 0.0, 3.0]), np.array([2.0, 0.0, 0.0]), pace=PACE)
    turning = np.hypot(*(band.poses[:, :2]).T) < 1e-9
    assert 3.0 * turning.sum() > len(band.poses)
    assert np.all(np.diff(band.poses[:, 2]) <= 1e-12)
    assert band.poses[-1, 2] == pytest.approx(0.0)


def test_yaws_of_a_guess_do_not_jump_by_a_turn():
    path = np.array([[-0.5, 0.4], [-1.0, 0.0], [-1.5, -0.4]])
    start, goal = np.array([0.0, 0.0, 3.1]), np.array([-2.0, -0.5, -3.1])
    band = initialise(path, start, goal, pace=PACE)
    assert np.abs(np.diff(band.poses[:, 2])).max() < 1.0
    assert math.remainder(band.poses[-1, 2] - goal[2], math.tau) == pytest.approx(0.0)


def test_warm_start_drives_on_along_the_old_band():
    # After 0.3 s the robot stands on the second pose; the goal has moved on by one step as well.
    old = straight()
    guess = warm_start(old, 0.3, np.array([0.15, 0.0, 0.0]), np.array([1.65, 0.0, 0.0]), pace=PACE)
    assert len(guess.time_steps) == 10
    assert guess.duration_s == pytest.approx(3.0)
    np.testing.assert_allclose(guess.poses[:, 0], np.linspace(0.15, 1.65, 11), atol=1e-12)


def test_warm_start_begins_at_the_robot_and_returns_to_the_band_within_three_poses():
    guess = warm_start(
        straight(), 0.0, np.array([0.0, 0.03, 0.1]), np.array([1.5, 0.0, 0.0]), pace=PACE
    )
    np.testing.assert_array_equal(guess.poses[0], [0.0, 0.03, 0.1])
    np.testing.assert_allclose(guess.poses[1, 1:], [0.02, 0.1 * 2 / 3], atol=1e-12)
    np.testing.assert_allclose(guess.poses[3:, 1:], 0.0, atol=1e-12)


def test_warm_start_keeps_its_size_until_the_step_leaves_the_hysteresis():
    old = straight(count=10, step_s=0.3)
    start, goal = np.zeros(3), np.array([1.5, 0.0, 0.0])
    assert len(warm_start(old, 0.9, start, goal, pace=PACE).time_steps) == 10  # steps of 0.21 s
    assert len(warm_start(old, 1.2, start, goal, pace=PACE).time_steps) == 6  # 1.8 / 0.3


def test_warm_start_takes_the_measured_yaw_with_it_across_the_wrap():
    old = straight()
    old = Band(old.poses + np.array([0.0, 0.0, math.pi - 0.01]), old.time_steps)
    start = np.array([0.0, 0.0, -math.pi + 0.01])
    guess = warm_start(old, 0.0, start, np.append(old.poses[-1, :2], start[2]), pace=PACE)
    assert guess.poses[0, 2] == start[2]
    assert np.abs(np.diff(guess.poses[:, 2])).max() < 0.02


def test_goal_yaw_is_taken_nearest_to_the_guess():
    guess = Band(np.array([[0, 0, 0], [1, 0, 3.1]]), np.ones(1))
    assert unwrapped_goal(np.array([1.0, 0.0, -3.1]), guess)[2] == pytest.approx(math.tau - 3.1)


def test_the_command_is_on_the_way_to_the_twist_of_the_first_interval():
    # 0.5 m/s in the first interval, 0.3 m/s in the second, from 0.4 m/s; middles at 0.15, 0.45 s.
    poses = np.array([[0, 0, 0], [0.15, 0, 0], [0.24, 0, 0]], dtype=float)
    band = Band(poses, np.array([0.3, 0.3]))
    start = np.array([0.4, 0.0])
    assert next_twist(band, start, 0.05)[0] == pytest.approx(0.4 + 0.1 / 3.0)
    assert next_twist(band, start, 0.15)[0] == pytest.approx(0.5)
    # A slow controller is well on the way to the second.
    assert next_twist(band, start, 0.3)[0] == pytest.approx(0.4)
    # Looking one interval ahead, at 0.3 m/s after 0.45 s.
    assert next_twist(band, start, 0.15, 2)[0] == pytest.approx(0.4 - 0.1 / 3.0)
    assert next_twist(band, start, 0.15, 99)[0] == pytest.approx(0.4 - 0.1 / 3.0)


def test_the_command_turns_with_the_arc():
    # A quarter of a circle of radius 1 m in 4 s.
    band = Band(np.array([[0, 0, 0], [1, 1, math.pi / 2]]), np.array([4.0]))
    np.testing.assert_allclose(next_twist(band, np.zeros(2), 2.0), [math.pi / 8, math.pi / 8])


@pytest.mark.parametrize(
    ("length_m", "start_speed", "expected"),
    [
        # To 0.5 m/s and to rest at 0.5 m/s^2 takes 0.5 m and 2 s, the rest 1.5 / 0.5 s.
        (2.0, 0.0, 5.0),
        # Too short for full speed: twice sqrt(0.08 / 0.5).
        (0.08, 0.0, 0.8),
        # From full speed, 0.25 m of braking.
        (2.0, 0.5, 4.5),
        # Too short to brake in: what braking takes.
        (0.1, 0.5, 1.0),
    ],
)
def test_the_least_time_for_a_length_is_that_of_a_trapezoid(length_m, start_speed, expected):
    assert trapezoid_duration(length_m, start_speed, 0.5, 0.5) == pytest.approx(expected)


def test_the_steps_of_a_grid_path_cost_no_time():
    # 3 m along the cells of a grid, in steps of 5 cm to the side and ahead in turn.
    x = np.repeat(np.arange(0.0, 3.0, 0.05), 2)[1:]
    path = np.column_stack([x, 0.05 * (np.arange(len(x)) // 1 % 2)])
    band = initialise(path, np.zeros(3), np.array([3.0, 0.0, 0.0]), pace=PACE)
    straight_on = initialise(NO_PATH, np.zeros(3), np.array([3.0, 0.0, 0.0]), pace=PACE)
    assert band.duration_s < 1.5 * straight_on.duration_s


def test_a_band_is_cut_anew_without_changing_the_motion():
    band = resampled(straight(10), 5)
    np.testing.assert_allclose(band.time_steps, 0.6)
    np.testing.assert_allclose(band.poses[:, 0], np.linspace(0.0, 1.5, 6))


def test_shifted_band_is_the_rest_of_it():
    rest = shift(straight(count=4), 0.4)
    np.testing.assert_allclose(rest.poses[:, 0], [0.2, 0.3, 0.45, 0.6])
    np.testing.assert_allclose(rest.time_steps, [0.2, 0.3, 0.3])
    assert shift(straight(count=4), 1.0) is None


def test_repeated_points_of_a_path_are_dropped():
    path = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    np.testing.assert_array_equal(drop_repeated_points(path), [[0.0, 0.0], [1.0, 0.0]])
