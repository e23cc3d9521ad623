"""The simple smoothers, against their closed form and their stop at obstacles."""

import math

import numpy as np
import pytest
from scipy.linalg import solveh_banded

from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.path_smoothing import (
    directional_segments,
    smooth_grid_path,
    smooth_segment,
    with_headings,
)

W_DATA, W_SMOOTH = 0.2, 0.3
RESOLUTION_M = 0.05
CENTRE_ONLY = np.empty((0, 2))
EMPTY_MAP = np.zeros((100, 100), dtype=np.uint8)


def closed_form(points):
    """Minimum of w_data/2 sum |y - x|^2 + w_smooth/2 sum |y_(i+1) - y_i|^2, ends fixed."""
    inner = len(points) - 2
    bands = np.empty((2, inner))
    bands[0], bands[1] = -W_SMOOTH, W_DATA + 2.0 * W_SMOOTH
    right = W_DATA * points[1:-1]
    right[0] += W_SMOOTH * points[0]
    right[-1] += W_SMOOTH * points[-1]
    smoothed = points.copy()
    smoothed[1:-1] = solveh_banded(bands, right)
    return smoothed


def grid_of(costs, resolution_m=RESOLUTION_M):
    """Returns the map as planners have it: nobody writes to it."""
    costs = costs.view()
    costs.flags.writeable = False
    return Grid(costs, 0.0, 0.0, resolution_m)


def smooth_grid(path, costs=EMPTY_MAP, footprint=CENTRE_ONLY, max_iterations=1000, refinements=2):
    return smooth_grid_path(
        path,
        grid_of(costs),
        footprint,
        1e-10,
        max_iterations,
        W_DATA,
        W_SMOOTH,
        refinements,
    )


def smooth_one_way(path, costs=EMPTY_MAP, max_iterations=1000, refinements=2):
    smoothed, _, _ = smooth_segment(
        path,
        grid_of(costs),
        1e-10,
        max_iterations,
        W_DATA,
        W_SMOOTH,
        refinements,
    )
    return smoothed


def corner_path(leg=10):
    """A right angle of 2 leg + 1 poses, 5 cm apart: along x to x = 3, then along y; headings 0."""
    path = np.zeros((2 * leg + 1, 3))
    path[:, 0] = 3.0 - RESOLUTION_M * np.maximum(leg - np.arange(2 * leg + 1), 0)
    path[:, 1] = 2.0 + RESOLUTION_M * np.maximum(np.arange(2 * leg + 1) - leg, 0)
    return path


def random_path(count=40):
    rng = np.random.default_rng(7)
    path = np.zeros((count, 3))
    path[:, 0] = np.linspace(0.5, 4.5, count)
    path[:, 1] = 2.5 + 0.1 * rng.normal(size=count)
    return path


def test_one_pass_of_the_grid_smoother_is_the_tridiagonal_solution():
    path = random_path()
    smoothed = smooth_grid(path, refinements=0)
    np.testing.assert_allclose(smoothed[:, :2], closed_form(path[:, :2]), atol=1e-9)


def test_each_refinement_applies_the_tridiagonal_solution_once_more():
    path = random_path()
    expected = path[:, :2]
    for _ in range(3):
        expected = closed_form(expected)
    np.testing.assert_allclose(smooth_grid(path)[:, :2], expected, atol=1e-9)
    np.testing.assert_allclose(smooth_one_way(path)[:, :2], expected, atol=1e-9)


def test_one_sweep_is_the_hand_computed_gauss_seidel_step():
    path = corner_path()
    smoothed = smooth_grid(path, max_iterations=2)
    # Only the corner, index 10 at (3, 2), and what follows it moves in the first sweep:
    # x_10 = 3 + 0.3 (2.95 + 3 - 6) = 2.985; y_10 = 2 + 0.3 (2 + 2.05 - 4) = 2.015
    assert smoothed[9, :2] == pytest.approx([2.95, 2.0])
    assert smoothed[10, :2] == pytest.approx([2.985, 2.015])
    # x_11 = 3 + 0.3 (2.985 + 3 - 6) = 2.9955; y_11 = 2.05 + 0.3 (2.015 + 2.1 - 4.1) = 2.0545
    assert smoothed[11, :2] == pytest.approx([2.9955, 2.0545])


def test_end_points_and_input_stay_as_they_are():
    path = random_path()
    before = path.copy()
    smoothed = smooth_grid(path)
    np.testing.assert_array_equal(path, before)
    np.testing.assert_array_equal(smoothed[[0, -1], :2], path[[0, -1], :2])


def test_a_mirrored_path_is_smoothed_into_the_mirrored_result():
    path = random_path()
    mirrored = path * [1.0, -1.0, 1.0] + [0.0, 5.0, 0.0]
    smoothed = smooth_grid(path)
    np.testing.assert_allclose(
        smooth_grid(mirrored)[:, :2], smoothed[:, :2] * [1.0, -1.0] + [0.0, 5.0], atol=1e-12
    )


def test_a_grid_path_of_eleven_poses_is_left_alone_and_one_of_twelve_is_not():
    path = random_path(12)
    np.testing.assert_array_equal(smooth_grid(path[:11]), path[:11])
    assert np.max(np.abs(smooth_grid(path) - path)) > 0.01


def test_grid_smoothing_that_collides_at_once_returns_the_path_without_headings():
    path = corner_path()
    costs = EMPTY_MAP.copy()
    # The corner leaves for (2.985, 2.015), cell [40, 59], in the first sweep.
    costs[40, 59] = 253
    np.testing.assert_array_equal(smooth_grid(path, costs), path)


@pytest.mark.parametrize("cost", [252, 255])
def test_inflated_and_unknown_cells_do_not_stop_the_smoothing(cost):
    path = corner_path()
    costs = EMPTY_MAP.copy()
    costs[40, 59] = cost
    np.testing.assert_array_equal(smooth_grid(path, costs), smooth_grid(path))


def test_grid_smoothing_that_collides_later_returns_the_last_free_sweep():
    path = random_path()
    free_sweeps = [smooth_grid(path, max_iterations=n + 1, refinements=0) for n in range(1, 6)]
    before, after = free_sweeps[2], free_sweeps[3]
    rows_before = (before[:, 1] / 0.002).astype(int)
    rows_after = (after[:, 1] / 0.002).astype(int)
    moved = int(np.flatnonzero(rows_before != rows_after)[0])
    # A fine map blocks the one cell which pose `moved` enters in the fourth sweep.
    costs = np.zeros((2500, 2500), dtype=np.uint8)
    costs[rows_after[moved], int(after[moved, 0] / 0.002)] = 254
    stopped = smooth_grid_path(
        path, grid_of(costs, 0.002), CENTRE_ONLY, 1e-10, 1000, W_DATA, W_SMOOTH, 2
    )
    np.testing.assert_array_equal(stopped, before)


def test_a_footprint_stops_the_smoothing_where_the_centre_would_not():
    path = corner_path()
    costs = EMPTY_MAP.copy()
    costs[:, 66] = 254
    square = np.array([[0.32, 0.32], [-0.32, 0.32], [-0.32, -0.32], [0.32, -0.32]])
    assert np.max(np.abs(smooth_grid(path, costs)[:, :2] - path[:, :2])) > 0.01
    np.testing.assert_array_equal(smooth_grid(path, costs, square), path)


def test_headings_point_to_the_next_pose_and_the_last_one_stays():
    path = np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [1.0, 2.0, 9.0], [0.0, 1.0, 0.3]])
    headed = with_headings(path, True)
    assert headed[:, 2] == pytest.approx([0.0, math.pi / 2, -3 * math.pi / 4, 0.3])


def test_a_pose_on_top_of_the_next_one_keeps_its_heading():
    path = np.array([[0.0, 0.0, 0.7], [0.00005, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert with_headings(path, True)[0, 2] == 0.7


def test_a_path_headed_backwards_keeps_its_headings_backwards():
    backwards = np.array([[float(x), 0.0, math.pi] for x in range(5)])
    headed = with_headings(backwards, False)
    assert np.abs(headed[:, 2]) == pytest.approx([math.pi] * 5)
    assert with_headings(backwards, True)[:4, 2] == pytest.approx([0.0] * 4)


def test_the_one_way_smoother_stops_inside_the_sweep_but_still_assigns_headings():
    path = corner_path()
    costs = EMPTY_MAP.copy()
    costs[40, 59] = 254
    stopped = smooth_one_way(path, costs)
    np.testing.assert_array_equal(stopped[:, :2], path[:, :2])
    assert stopped[12, 2] == pytest.approx(math.pi / 2)


def test_the_iteration_limit_counts_one_sweep_less_as_in_nav2():
    path = random_path()
    np.testing.assert_array_equal(smooth_one_way(path, max_iterations=1)[:, :2], path[:, :2])
    assert np.max(np.abs(smooth_one_way(path, max_iterations=2)[:, :2] - path[:, :2])) > 0.01


def there_and_back():
    """0, 1, 2, 1, 0 m along x: turns back at index 2."""
    return np.array([[float(x), 0.0, 0.0] for x in (0, 1, 2, 1, 0)])


def test_a_path_is_cut_where_it_turns_back():
    assert directional_segments(there_and_back()) == [(0, 2), (2, 4)]


def test_a_right_angle_does_not_cut_a_path_but_a_sharper_one_does():
    right = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    sharper = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.99, 1.0, 0.0]])
    assert directional_segments(right) == [(0, 2)]
    assert directional_segments(sharper) == [(0, 1), (1, 2)]


def test_a_turn_in_place_cuts_a_path_and_a_repeated_pose_does_not():
    turn = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    repeat = turn.copy()
    repeat[2, 2] = 0.0
    assert directional_segments(turn) == [(0, 1), (1, 3)]
    assert directional_segments(repeat) == [(0, 3)]


@pytest.mark.parametrize("count", [1, 2])
def test_a_short_path_is_one_segment(count):
    assert directional_segments(np.zeros((count, 3))) == [(0, count - 1)]
