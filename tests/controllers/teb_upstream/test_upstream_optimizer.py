"""Resizing, warm start, the linear solver, and whole optimisations against the original."""

import numpy as np
import pytest
from upstream_scenes import OBSTACLES, around, record_of, straight

from drake_navbench.controllers.teb_upstream.band import (
    band_command,
    band_from_plan,
    band_from_points,
    resize,
    warm_start,
)
from drake_navbench.controllers.teb_upstream.optimizer import optimize_band, solve_banded
from drake_navbench.controllers.teb_upstream.robot_models import outline
from drake_navbench.kernels.band_cholesky import BANDWIDTH


def resized(time_steps, *, once=True, fewest=3, most=500):
    """Returns (x of the poses, time steps) after resizing to 0.3 +- 0.1 s; poses lie 1 m apart."""
    poses, steps = np.zeros((20, 3)), np.zeros(20)
    count = len(time_steps) + 1
    poses[:count, 0] = np.arange(count)
    steps[: count - 1] = time_steps
    count = resize(poses, steps, count, 0.3, 0.1, fewest, most, once)
    return poses[:count, 0].tolist(), steps[: count - 1].tolist()


def test_a_long_step_is_halved_at_the_mean_pose():
    assert resized([0.3, 0.6, 0.3]) == ([0.0, 1.0, 1.5, 2.0, 3.0], [0.3, 0.3, 0.3, 0.3])
    # The second half follows in the same sweep.
    assert resized([0.3, 1.0, 0.3])[1] == [0.3, 0.5, 0.25, 0.25, 0.3]


def test_a_short_step_joins_the_next_and_the_last_one_the_one_before():
    assert resized([0.3, 0.1, 0.2, 0.3, 0.3]) == (
        [0.0, 1.0, 3.0, 4.0, 5.0],
        pytest.approx([0.3, 0.3, 0.3, 0.3]),
    )
    assert resized([0.3, 0.3, 0.3, 0.1]) == ([0.0, 1.0, 2.0, 4.0], pytest.approx([0.3, 0.3, 0.4]))


def test_sweeps_go_on_until_nothing_changes_where_asked_to():
    _, steps = resized([0.3, 1.0, 0.3], once=False)
    assert max(steps) <= 0.4
    assert sum(steps) == pytest.approx(1.6)


def test_the_numbers_of_intervals_are_bounded():
    assert len(resized([0.1, 0.1, 0.1, 0.1], once=False)[1]) == 3
    assert len(resized([0.9, 0.9, 0.9], once=False, most=4)[1]) == 4


def test_a_warm_start_drops_passed_poses_and_keeps_the_first_time_step():
    poses = straight(2.0, 0.25)
    steps = 0.1 * np.arange(1, 9)
    start, goal = np.array([0.52, 0.01, 0.1]), np.array([2.1, 0.0, 0.0])
    kept_poses, kept_steps = warm_start(poses, steps, start, goal, 3)
    np.testing.assert_array_equal(kept_poses[:, 0], [0.52, 0.75, 1.0, 1.25, 1.5, 1.75, 2.1])
    np.testing.assert_allclose(kept_steps, [0.1, 0.4, 0.5, 0.6, 0.7, 0.8])


def test_a_first_guess_takes_the_longer_of_driving_and_turning():
    plan = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.4, 0.4, 0.0]])
    poses, steps = band_from_plan(plan, True, False, 3, 0.4, 1.0)
    # To the corner, where it already looks along the next piece; then back to the goal's yaw.
    np.testing.assert_allclose(steps, [np.pi / 2, np.pi / 2])
    np.testing.assert_allclose(poses[:, 2], [0.0, np.pi / 2, 0.0])


def test_a_way_of_a_roadmap_speeds_up_from_rest_in_each_piece():
    points = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]])
    poses, steps = band_from_points(points, 0.0, 0.0, False, 3, 0.5, 0.5)
    np.testing.assert_allclose(steps, [2.0, 2.0])
    np.testing.assert_allclose(poses[:, 2], [0.0, np.pi / 2, 0.0])


def test_the_banded_solver_agrees_with_a_dense_one():
    rng = np.random.default_rng(0)
    size, offset = 21, 3
    rows = size + offset + 4
    dense = np.zeros((rows, rows))
    for row in range(rows):
        for column in range(max(0, row - BANDWIDTH), row + 1):
            dense[row, column] = dense[column, row] = rng.normal()
    dense += 30.0 * np.eye(rows)
    banded = np.zeros((rows, BANDWIDTH + 1))
    for row in range(rows):
        for k in range(min(row, BANDWIDTH) + 1):
            banded[row, k] = dense[row, row - k]
    right, solution = rng.normal(size=rows), np.zeros(rows)
    inner = slice(offset, offset + size)
    scratch = np.zeros_like(banded)
    assert solve_banded(banded, 0.7, right, size, scratch, solution)
    expected = np.linalg.solve(dense[inner, inner] + 0.7 * np.eye(size), right[inner])
    np.testing.assert_allclose(solution[inner], expected)
    assert not solve_banded(-banded, 0.0, right, size, scratch, solution)


def test_optimised_bands_are_those_of_the_original():
    """The numbers come from teb_local_planner (ros2-master) with g2o."""
    record = record_of()
    plan = straight()
    free = optimize_band(plan, np.full(8, 0.625), record, around())
    assert free.cost == pytest.approx(1.6116076687, rel=1e-6)
    assert len(free.poses) == 17
    _, speed, rate = band_command(free.poses, free.time_steps, 1, 0.3)
    assert (speed, rate) == pytest.approx((0.245233673, 0.0), abs=1e-6)

    bent = plan.copy()
    bent[1:-1, 1:] = 0.1, 0.05
    box = outline(np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]))
    scene = around(
        twist=(0.2, 0.1), obstacles=OBSTACLES, via_points=np.array([[1.0, -0.2]]), robot=box
    )
    beside = optimize_band(bent, np.full(8, 0.5), record, scene)
    assert len(beside.poses) == 32
    assert beside.cost == pytest.approx(453.2233590658, rel=1e-3)
    _, speed, rate = band_command(beside.poses, beside.time_steps, 1, 0.3)
    assert (speed, rate) == pytest.approx((-0.0794755388, -0.1407424051), abs=1e-3)


def test_too_slow_a_robot_is_not_optimised_for():
    record = record_of(max_vel_x=0.005)
    assert not optimize_band(straight(), np.ones(8), record, around()).succeeded


def test_the_command_is_the_displacement_with_the_sign_of_its_first_heading():
    poses = np.array([[0.0, 0.0, np.pi], [0.3, 0.4, np.pi - 0.1], [0.6, 0.8, np.pi]])
    assert band_command(poses, np.full(2, 0.5), 1, 0.3) == pytest.approx((True, -1.0, -0.2))
    # The second pose is reached after 0.6 s, twice dt_ref: no look-ahead beyond it.
    assert band_command(poses, np.array([0.6, 9.0]), 2, 0.3)[1] == pytest.approx(-0.5 / 0.6)
    assert not band_command(poses, np.array([-0.1, 0.5]), 1, 0.3)[0]
