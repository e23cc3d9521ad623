"""The constrained smoother: its residuals by hand and by differences, its optimum, its output."""

import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares

from drake_navbench.errors import InputError
from drake_navbench.kernels.constrained_smoothing import (
    gauss_newton_hessian,
    interpolated_cost,
    residuals_and_jacobian,
    tangent,
    value_and_gradient,
)
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_geometry import path_from_elements, path_from_polyline
from drake_navbench.kernels.smoothing_knots import driving_signs, select_knots
from drake_navbench.navigation.constrained_smoother import (
    ConstrainedSmootherParameters,
    FailedToSmoothPath,
    knot_problem,
    smooth_path,
)

RESOLUTION_M = 0.05
DEFAULT = ConstrainedSmootherParameters()
EMPTY = Costmap(np.zeros((200, 200), dtype=np.uint8), 0.0, 0.0, RESOLUTION_M)
CHECK_POINTS = (0.3, 0.1, 1.0, -0.2, -0.15, 4.0)


def bumpy_map():
    """Smooth hills between 0 and 200, so that cost gradients are never zero."""
    rows, columns = np.mgrid[0:200, 0:200]
    costs = 100.0 + 60.0 * np.sin(0.31 * columns) + 40.0 * np.cos(0.23 * rows)
    return Costmap(costs.astype(np.uint8), 0.0, 0.0, RESOLUTION_M)


def three_point_turn(spacing=0.25):
    """Forward, backwards and forward again, on arcs of 0.6 m: two cusps."""
    first = path_from_elements((3.0, 3.0, 0.0), [{"arc": 60, "r": 0.6}], spacing)
    back = path_from_elements(
        (*first[-1, :2], first[-1, 2] + math.pi), [{"arc": 60, "r": 0.6}], spacing
    )
    back[:, 2] -= math.pi
    third = path_from_elements(tuple(back[-1]), [{"arc": 60, "r": 0.6}], spacing)
    return np.vstack([first, back[1:], third[1:]])


def problem_of(path, costmap=EMPTY, parameters=DEFAULT):
    signs = driving_signs(
        path,
        reversing_enabled=parameters.reversing_enabled,
        keep_start_orientation=parameters.keep_start_orientation,
    )
    selection = select_knots(
        path[:, :2],
        signs,
        downsampling_factor=parameters.path_downsampling_factor,
        keep_start_orientation=parameters.keep_start_orientation,
        keep_goal_orientation=parameters.keep_goal_orientation,
        cusp_zone_length=parameters.cusp_zone_length,
    )
    knots = np.ascontiguousarray(path[selection.indices, :2])
    return knots, selection, knot_problem(knots, selection, costmap, parameters)


def corner(leg_m=2.0, spacing=0.1):
    return path_from_polyline([[1.0, 1.0], [1.0 + leg_m, 1.0], [1.0 + leg_m, 1.0 + leg_m]], spacing)


@pytest.mark.parametrize("check_points", [(), CHECK_POINTS])
def test_the_gradient_agrees_with_central_differences(check_points):
    parameters = ConstrainedSmootherParameters(
        w_dist=50.0, w_cost=0.5, w_smooth=200.0, cost_check_points=check_points
    )
    knots, selection, problem = problem_of(three_point_turn(), bumpy_map(), parameters)
    assert np.sum(selection.spacing_ratios < 0.0) == 2
    moved = knots + 0.02 * np.random.default_rng(1).normal(size=knots.shape)
    residuals, _ = residuals_and_jacobian(moved, problem)
    assert np.all(np.max(np.abs(residuals), axis=0) > 0.0)
    _, gradient = value_and_gradient(moved, problem)
    step = 1e-6
    for index in np.ndindex(*moved.shape):
        ahead, behind = moved.copy(), moved.copy()
        ahead[index] += step
        behind[index] -= step
        difference = (
            value_and_gradient(ahead, problem)[0] - value_and_gradient(behind, problem)[0]
        ) / (2.0 * step)
        assert gradient[index] == pytest.approx(difference, rel=1e-6, abs=1e-6 * np.max(gradient))


def test_residuals_of_a_right_angle_are_as_computed_by_hand():
    path = np.array([[1.0, 1.0, 0.0], [1.1, 1.0, 0.0], [1.1, 1.1, 0.0]])
    _, _, problem = problem_of(path)
    residuals, _ = residuals_and_jacobian(path[:, :2].copy(), problem)
    # Smoothness: (N - X) - (X - P) = (0, 0.1) - (0.1, 0), times sqrt 2e6 = 1414.2.
    assert residuals[0, :2] == pytest.approx([-141.42136, 141.42136])
    # The circle through the three has the diameter 0.1 sqrt 2: k = 14.142 1/m, 2.5 are allowed.
    assert residuals[0, 2] == pytest.approx(math.sqrt(30.0) * (2.0 / (0.1 * math.sqrt(2.0)) - 2.5))
    assert residuals[0, 3:] == pytest.approx([0.0, 0.0, 0.0])


def test_a_minimum_turning_radius_of_zero_allows_every_curvature():
    _, _, problem = problem_of(
        corner(), parameters=ConstrainedSmootherParameters(minimum_turning_radius=0.0)
    )
    residuals, jacobian = residuals_and_jacobian(corner()[:, :2].copy(), problem)
    assert not residuals[:, 2].any()
    assert not jacobian[:, 2].any()


def test_a_cusp_has_the_curvature_of_the_arc_continued():
    path = three_point_turn()
    forward = path_from_elements((3.0, 3.0, 0.0), [{"arc": 60, "r": 0.6}], 0.25)
    parameters = ConstrainedSmootherParameters(minimum_turning_radius=10.0, w_curve=1.0)
    _, selection, problem = problem_of(path, parameters=parameters)
    residuals, _ = residuals_and_jacobian(path[:, :2].copy(), problem)
    cusp = int(np.flatnonzero(selection.spacing_ratios < 0.0)[0])
    assert cusp + 1 == len(forward) - 1
    # Off the cusps the three knots lie on the circle of 0.6 m: 1 / 0.6 - 1 / 10.
    assert residuals[0, 2] == pytest.approx(1.0 / 0.6 - 0.1)
    # At the cusp the mirrored third knot bends the other way: P, X and N' lie on an S, less bent.
    assert residuals[cusp, 2] < 1.0 / 0.6 - 0.1


def test_the_cost_is_the_catmull_rom_spline_through_the_cells():
    costs = np.zeros((9, 9), dtype=np.uint8)
    values = np.array([0, 10, 40, 200, 120, 60, 60, 3, 0], dtype=np.uint8)
    costs[:] = values
    slopes = np.gradient(values.astype(float))
    spline = CubicHermiteSpline(np.arange(9), values, slopes)
    for x in (2.0, 3.3, 4.75, 6.5):
        value, slope_x, slope_y = interpolated_cost(costs, x, 4.2)
        assert value == pytest.approx(float(spline(x)))
        assert slope_x == pytest.approx(float(spline(x, 1)))
        assert slope_y == pytest.approx(0.0, abs=1e-12)
        assert interpolated_cost(np.ascontiguousarray(costs.T), 4.2, x)[0] == pytest.approx(value)


def test_cells_beyond_the_map_repeat_its_edge():
    costs = np.array([[10, 20], [10, 20]], dtype=np.uint8)
    assert interpolated_cost(costs, -3.5, 0.0)[0] == 10.0
    assert interpolated_cost(costs, 9.0, 9.0)[0] == 20.0


def test_the_tangent_of_three_points_is_that_of_their_circle():
    # On the circle of radius 2 about the origin, at angles 0, 0.3 and 1.0 rad.
    points = 2.0 * np.array([[math.cos(a), math.sin(a)] for a in (0.0, 0.3, 1.0)])
    d1, d2 = np.diff(points, axis=0)
    along = np.array(tangent(*d1, *d2))
    assert along / np.hypot(*along) == pytest.approx([-math.sin(0.3), math.cos(0.3)])


@pytest.mark.long
def test_the_optimum_is_that_of_a_least_squares_solver():
    path = corner()
    knots, selection, problem = problem_of(path, bumpy_map())
    free = np.repeat(~selection.is_fixed, 2)

    def place(x):
        moved = knots.ravel().copy()
        moved[free] = x
        return moved.reshape(-1, 2)

    def jacobian(x):
        _, blocks = residuals_and_jacobian(place(x), problem)
        full = np.zeros((len(blocks), 6, 2 * len(knots)))
        for k, block in enumerate(blocks):
            full[k, :, 2 * k : 2 * k + 6] = block
        return full.reshape(-1, 2 * len(knots))[:, free]

    reference = least_squares(
        lambda x: residuals_and_jacobian(place(x), problem)[0].ravel(),
        knots.ravel()[free],
        jac=jacobian,
        xtol=1e-12,
        ftol=1e-12,
    )
    parameters = ConstrainedSmootherParameters(optimizer={"max_iterations": 1000, "fn_tol": 1e-12})
    smoothed = smooth_path(path, bumpy_map(), parameters)
    initial, _ = value_and_gradient(knots, problem)
    optimum, _ = value_and_gradient(np.ascontiguousarray(smoothed[:, :2]), problem)
    assert optimum == pytest.approx(reference.cost, rel=1e-6)
    assert optimum < 0.2 * initial
    by_default, _ = value_and_gradient(
        np.ascontiguousarray(smooth_path(path, bumpy_map(), DEFAULT)[:, :2]), problem
    )
    assert by_default == pytest.approx(reference.cost, rel=1e-2)


def test_fewer_iterations_leave_a_higher_objective_but_never_one_above_the_input():
    path = corner()
    knots, _, problem = problem_of(path, bumpy_map())
    objectives = [value_and_gradient(knots, problem)[0]]
    for limit in (1, 5, 15):
        parameters = ConstrainedSmootherParameters(optimizer={"max_iterations": limit})
        smoothed = smooth_path(path, bumpy_map(), parameters)
        objectives.append(value_and_gradient(smoothed[:, :2], problem)[0])
    assert np.all(np.diff(objectives) < 0.0)


def test_the_gauss_newton_hessian_is_the_square_of_the_jacobian():
    knots, _, problem = problem_of(corner(), bumpy_map())
    _, blocks = residuals_and_jacobian(knots, problem)
    full = np.zeros((len(blocks), 6, 2 * len(knots)))
    for k, block in enumerate(blocks):
        full[k, :, 2 * k : 2 * k + 6] = block
    full = full.reshape(-1, 2 * len(knots))
    np.testing.assert_allclose(gauss_newton_hessian(knots, problem), full.T @ full, rtol=1e-12)


def test_a_right_angle_becomes_a_turn_that_a_car_can_drive():
    smoothed = smooth_path(corner(), EMPTY, DEFAULT)
    turns = np.abs(np.diff(np.unwrap(smoothed[:, 2])))
    lengths = np.hypot(*np.diff(smoothed[:, :2], axis=0).T)
    # No sharper than the 0.4 m that are asked for (2.5 1/m), but for a percent.
    assert np.max(turns / lengths) < 2.5 * 1.01
    np.testing.assert_array_equal(smoothed[[0, 1, -2, -1], :2], corner()[[0, 1, -2, -1], :2])
    np.testing.assert_allclose(smoothed[[0, -1], 2], corner()[[0, -1], 2], atol=1e-12)


def test_a_straight_path_in_free_space_stays_as_it_is():
    path = path_from_elements((1.0, 1.0, 0.5), [{"s": 3.0}], 0.1)
    np.testing.assert_allclose(smooth_path(path, EMPTY, DEFAULT), path, atol=1e-9)


def test_costs_push_the_path_away():
    costs = np.zeros((200, 200), dtype=np.uint8)
    # A ridge beside the path, falling off towards it: rows 60 to 70 are y from 3 to 3.5 m.
    costs[60:71, 50:90] = np.linspace(100, 250, 11)[:, None].astype(np.uint8)
    path = path_from_elements((1.0, 3.2, 0.0), [{"s": 5.0}], 0.1)
    pushed = smooth_path(path, Costmap(costs, 0.0, 0.0, RESOLUTION_M), DEFAULT)
    assert np.min(pushed[:, 1]) < 3.1
    weightless = ConstrainedSmootherParameters(w_cost=0.0)
    kept = smooth_path(path, Costmap(costs, 0.0, 0.0, RESOLUTION_M), weightless)
    np.testing.assert_allclose(kept[:, 1], 3.2, atol=1e-9)


def test_a_mirrored_world_gives_the_mirrored_path():
    costmap = bumpy_map()
    mirrored_map = Costmap(np.ascontiguousarray(costmap.costs[::-1]), 0.0, 0.0, RESOLUTION_M)
    path = corner()
    mirrored = path * [1.0, -1.0, -1.0] + [0.0, 10.0, 0.0]
    smoothed = smooth_path(path, costmap, DEFAULT)
    reflection = smooth_path(mirrored, mirrored_map, DEFAULT)
    np.testing.assert_allclose(
        reflection[:, :2], smoothed[:, :2] * [1.0, -1.0] + [0.0, 10.0], atol=1e-3
    )


def test_smoothing_twice_gives_the_same_bits_and_leaves_the_input_alone():
    path = corner()
    first = smooth_path(path, bumpy_map(), DEFAULT)
    np.testing.assert_array_equal(path, corner())
    np.testing.assert_array_equal(first, smooth_path(path, bumpy_map(), DEFAULT))


def test_cusps_are_knots_and_keep_the_direction_of_driving():
    path = three_point_turn(spacing=0.05)
    parameters = ConstrainedSmootherParameters(path_downsampling_factor=4)
    _, selection, _ = problem_of(path, parameters=parameters)
    signs = driving_signs(path, reversing_enabled=True, keep_start_orientation=True)
    cusps = np.flatnonzero(signs[1:] != signs[:-1]) + 1
    assert len(cusps) == 2
    assert set(cusps) <= set(selection.indices.tolist())
    smoothed = smooth_path(path, EMPTY, parameters)
    assert len(smoothed) == len(path)
    np.testing.assert_array_equal(
        driving_signs(smoothed, reversing_enabled=True, keep_start_orientation=True), signs
    )


def test_without_reversing_every_heading_points_ahead():
    parameters = ConstrainedSmootherParameters(reversing_enabled=False)
    path = path_from_elements((3.0, 3.0, 0.0), [{"s": 2.0}], 0.1)
    path[1:-1, 2] = math.pi
    assert np.cos(smooth_path(path, EMPTY, parameters)[:, 2]) == pytest.approx(np.ones(21))


@pytest.mark.parametrize(("downsampling", "upsampling"), [(1, 1), (1, 3), (5, 1), (5, 2), (5, 0)])
def test_factors_set_the_number_of_poses(downsampling, upsampling):
    path = path_from_elements((1.0, 1.0, 0.0), [{"s": 2.0}, {"arc": 90, "r": 1.0}], 0.1)
    parameters = ConstrainedSmootherParameters(
        path_downsampling_factor=downsampling, path_upsampling_factor=upsampling
    )
    _, selection, _ = problem_of(path, parameters=parameters)
    smoothed = smooth_path(path, EMPTY, parameters)
    knot_count = len(selection.indices)
    expected = (len(path) - 1) * upsampling + 1 if upsampling else knot_count
    assert len(smoothed) == expected
    # Knots at 0, 1, 6, 11, ..., and the last two: the holders of the orientations stay.
    if downsampling == 5:
        assert selection.indices[:4].tolist() == [0, 1, 6, 11]
        assert selection.indices[-2:].tolist() == [len(path) - 2, len(path) - 1]
    steps = np.diff(smoothed[:, :2], axis=0)
    assert np.all(np.sum(steps[1:] * steps[:-1], axis=1) > 0.0)


def test_a_path_upsampled_on_a_circle_stays_on_it():
    path = path_from_elements((0.0, 0.0, 0.0), [{"arc": 90, "r": 2.0}], 0.4)[:-1]
    costmap = Costmap(np.zeros((200, 200), dtype=np.uint8), -5.0, -5.0, RESOLUTION_M)
    parameters = ConstrainedSmootherParameters(path_upsampling_factor=4, w_dist=1e12)
    smoothed = smooth_path(path, costmap, parameters)
    # Arc handles are 4/3 tan(turn / 4) = 0.0667 r for turns of 0.2 rad; Nav2's 0.4 chord is 0.08 r.
    assert np.hypot(smoothed[:, 0], smoothed[:, 1] - 2.0) == pytest.approx(
        np.full(len(smoothed), 2.0), abs=3e-3
    )


def test_the_weight_of_costs_fades_out_from_a_cusp():
    path = three_point_turn(spacing=0.1)
    parameters = ConstrainedSmootherParameters(cusp_zone_length=0.6)
    _, selection, problem = problem_of(path, parameters=parameters)
    cusp = int(np.flatnonzero(selection.spacing_ratios < 0.0)[0])
    # Nav2 counts from the pose before the cusp: 1 there, and 1 - spacing / 0.3 m on both sides.
    step = np.hypot(*(path[cusp + 1, :2] - path[cusp, :2]))
    shares = selection.cusp_shares[cusp - 2 : cusp + 2]
    before = np.hypot(*(path[cusp, :2] - path[cusp - 1, :2]))
    assert shares[1] == 1.0
    assert shares[2] == pytest.approx(1.0 - step / 0.3)
    assert shares[0] == pytest.approx(1.0 - step / 0.3)
    assert before == pytest.approx(0.1, rel=1e-2)
    low, high = math.sqrt(0.015), math.sqrt(0.015 * 3.0)
    assert problem.cost_weights_sqrt[cusp - 1] == pytest.approx(high)
    assert np.min(problem.cost_weights_sqrt) == pytest.approx(low)


def test_orientations_of_the_ends_are_kept_only_where_asked():
    path = corner()
    path[0, 2], path[-1, 2] = 0.4, 1.1
    kept = smooth_path(path, EMPTY, DEFAULT)
    assert kept[[0, -1], 2] == pytest.approx([0.4, 1.1])
    free = ConstrainedSmootherParameters(keep_start_orientation=False, keep_goal_orientation=False)
    freed = smooth_path(path, EMPTY, free)
    first, last = np.diff(freed[[0, 1, -2, -1], :2], axis=0)[[0, 2]]
    assert freed[0, 2] == pytest.approx(math.atan2(first[1], first[0]))
    assert freed[-1, 2] == pytest.approx(math.atan2(last[1], last[0]))


@pytest.mark.parametrize("count", [0, 1])
def test_a_path_of_fewer_than_two_poses_comes_back(count):
    path = np.ones((count, 3))
    np.testing.assert_array_equal(smooth_path(path, EMPTY, DEFAULT), path)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_path_without_free_knots_is_only_sampled_anew(count):
    path = path_from_elements((1.0, 1.0, 0.0), [{"s": 0.5 * (count - 1)}], 0.5)
    path[:, 1] += 0.01 * np.arange(count) ** 2
    np.testing.assert_array_equal(smooth_path(path, EMPTY, DEFAULT)[:, :2], path[:, :2])


def test_a_turn_in_place_is_refused():
    path = path_from_elements((1.0, 1.0, 0.0), [{"s": 1.0}], 0.1)
    path[5] = path[4]
    with pytest.raises(FailedToSmoothPath, match="pose 4 coincides") as caught:
        smooth_path(path, EMPTY, DEFAULT)
    assert caught.value.code == 504


def test_an_array_that_is_no_path_is_refused():
    with pytest.raises(InputError, match="path: got an array of shape"):
        smooth_path(np.zeros((5, 2)), EMPTY, DEFAULT)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"cost_check_points": (0.1, 0.2)}, "got 2 numbers, expected a multiple of 3"),
        ({"cost_check_points": (0.1, 0.2, -1.0)}, "expected none negative"),
        ({"w_smooth": -1.0}, "greater than or equal to 0"),
        ({"optimizer": {"linear_solver_type": "QR"}}, "DENSE_QR"),
        ({"w_smoth": 1.0}, "Extra inputs"),
    ],
)
def test_wrong_parameters_are_refused(wrong, text):
    with pytest.raises(ValidationError, match=text):
        ConstrainedSmootherParameters(**wrong)


def test_check_point_weights_are_roots_that_sum_to_one():
    parameters = ConstrainedSmootherParameters(cost_check_points=CHECK_POINTS)
    # sqrt 1 and sqrt 4 are 1 and 2, together 3.
    assert parameters.normalized_check_points[:, 2] == pytest.approx([1.0 / 3.0, 2.0 / 3.0])
