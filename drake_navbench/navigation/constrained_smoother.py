"""Nav2's constrained smoother as a MathematicalProgram solved by IPOPT.

The objective is Nav2's sum of squares (see kernels/constrained_smoothing.py). Its smoothness term
is so stiff that a quasi-Newton method needs thousands of steps in the knots' own coordinates. In
coordinates whitened by the Gauss-Newton Hessian it needs tens; they are whitened anew every few
steps, because the Hessian changes where the curvature's term sets in.
Source: nav2_constrained_smoother (ConstrainedSmoother, Smoother).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions
from scipy.linalg import cholesky, solve_triangular

from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.constrained_smoothing import (
    KnotProblem,
    gauss_newton_hessian,
    value_and_gradient,
)
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.program_function import cost_function
from drake_navbench.kernels.smoothing_knots import (
    Knots,
    driving_signs,
    path_through_knots,
    select_knots,
)
from drake_navbench.navigation.smoother_parameters import (
    ConstrainedSmootherParameters,
    OptimizerParameters,
)

# IPOPT's iterations between two whitenings.
ROUND_ITERATIONS = 10
# Added to the Hessian's diagonal, relative to its largest entry: without w_smooth it may be
# singular.
RIDGE_RATIO = 1e-9
# The value of the program's objective at the start of a round; the tolerance below is relative to
# it.
INITIAL_OBJECTIVE = 1e6
# Largest entry of the whitened gradient at the optimum: half its square is the decrease still to be
# had, far below the objective's scale of 1.
GRADIENT_TOLERANCE = 1e-5
# Makes every iterate acceptable: IPOPT ends a round after so many acceptable ones in a row, as a
# success, where its iteration limit would be logged as a warning every time.
ANY = 1e20


class FailedToSmoothPath(NavbenchError):
    """The optimisation has no usable result; `code` is Nav2's SmoothPath error code."""

    code: ClassVar[int] = 504


def smooth_path(
    path: ArrayLike, costmap: Costmap, parameters: ConstrainedSmootherParameters
) -> Array:
    """Returns the smoothed path (M, 3) x m, y m, yaw rad of a path (N, 3).

    Pure: iterations bound the work, not time. A path of fewer than two poses comes back as it is;
    one with too few free knots is only sampled anew. As in Nav2, nothing keeps the result off
    obstacles but its cost. Raises FailedToSmoothPath where the optimisation is of no use (or a knot
    coincides with the next: turns in place are not supported), InputError where `path` is no path.
    """
    poses = np.array(path, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 3 or not np.all(np.isfinite(poses)):
        raise InputError(f"path: got an array of shape {poses.shape}, expected finite (N, 3)")
    if len(poses) < 2:
        return poses
    signs = driving_signs(
        poses,
        reversing_enabled=parameters.reversing_enabled,
        keep_start_orientation=parameters.keep_start_orientation,
    )
    selection = select_knots(
        poses[:, :2],
        signs,
        downsampling_factor=parameters.path_downsampling_factor,
        keep_start_orientation=parameters.keep_start_orientation,
        keep_goal_orientation=parameters.keep_goal_orientation,
        cusp_zone_length=parameters.cusp_zone_length,
    )
    stuck = np.flatnonzero(~np.isfinite(selection.spacing_ratios))
    if len(stuck):
        raise FailedToSmoothPath(
            f"path: pose {selection.indices[stuck[0] + 1]} coincides with the next knot, expected "
            "a path without turns in place"
        )
    knots = np.ascontiguousarray(poses[selection.indices, :2])
    if not np.all(selection.is_fixed):
        knots = _optimized(knots, selection, costmap, parameters)
    return path_through_knots(
        knots,
        selection.indices,
        signs[selection.indices],
        upsampling_factor=parameters.path_upsampling_factor,
        start_yaw=float(poses[0, 2]) if parameters.keep_start_orientation else None,
        goal_yaw=float(poses[-1, 2]) if parameters.keep_goal_orientation else None,
    )


def knot_problem(
    knots: Array, selection: Knots, costmap: Costmap, parameters: ConstrainedSmootherParameters
) -> KnotProblem:
    """Returns the least-squares problem of knots (K, 2) m at their input positions."""
    radius = parameters.minimum_turning_radius
    cost_sqrt = math.sqrt(parameters.w_cost)
    cusp_sqrt = cost_sqrt * math.sqrt(parameters.w_cost_cusp_multiplier)
    return KnotProblem(
        input_knots=knots,
        spacing_ratios=selection.spacing_ratios,
        is_reversing=selection.is_reversing,
        cost_weights_sqrt=cost_sqrt + (cusp_sqrt - cost_sqrt) * selection.cusp_shares,
        grid=costmap.grid,
        smooth_sqrt=math.sqrt(parameters.w_smooth),
        curve_sqrt=math.sqrt(parameters.w_curve),
        dist_sqrt=math.sqrt(parameters.w_dist),
        max_curvature=1.0 / radius if radius > 0.0 else math.inf,
        check_points=parameters.normalized_check_points,
    )


def _optimized(
    knots: Array, selection: Knots, costmap: Costmap, parameters: ConstrainedSmootherParameters
) -> Array:
    """Returns the knots (K, 2) with the free ones where the objective is least."""
    problem = knot_problem(knots, selection, costmap, parameters)
    is_free = np.repeat(~selection.is_fixed, 2)
    optimizer = parameters.optimizer
    value, _ = value_and_gradient(knots, problem)
    if not math.isfinite(value):
        raise FailedToSmoothPath("the objective of the input path is not finite")
    for iterations_before in range(0, optimizer.max_iterations, ROUND_ITERATIONS):
        if value == 0.0:
            break
        iterations = min(ROUND_ITERATIONS, optimizer.max_iterations - iterations_before)
        trial = _whitened_round(knots, problem, is_free, value, iterations, optimizer)
        trial_value, _ = value_and_gradient(trial, problem)
        gain = value - trial_value
        if gain > 0.0:
            knots, value = trial, trial_value
        if not gain > optimizer.fn_tol * (value + gain):
            break
    return knots


def _whitened_round(
    knots: Array,
    problem: KnotProblem,
    is_free: NDArray[np.bool_],
    value: float,
    iterations: int,
    optimizer: OptimizerParameters,
) -> Array:
    """Returns the knots (K, 2) after some iterations of IPOPT.

    The free coordinates are x = x_start + L^-T z sqrt(scale), L L^T the Gauss-Newton Hessian at the
    start, and the program's objective is the sum of squares over `scale`: its Hessian by z is near
    the identity. value: the objective at the start.
    """
    hessian = gauss_newton_hessian(knots, problem)[np.ix_(is_free, is_free)]
    np.fill_diagonal(hessian, np.diag(hessian) + RIDGE_RATIO * np.max(np.diag(hessian)))
    scale = value / INITIAL_OBJECTIVE
    lower = cholesky(hessian, lower=True)
    unwhiten = math.sqrt(scale) * solve_triangular(lower, np.eye(len(lower)), lower=True).T

    def knots_at(z: Array) -> Array:
        moved = knots.ravel().copy()
        moved[is_free] += unwhiten @ z
        return moved.reshape(-1, 2)

    def scaled_value_and_gradient(z: Array) -> tuple[float, Array]:
        value, gradient = value_and_gradient(knots_at(z), problem)
        return value / scale, gradient.ravel()[is_free] @ unwhiten / scale

    return knots_at(_minimize(scaled_value_and_gradient, len(lower), iterations, optimizer))


def _minimize(
    value_and_gradient_at: Callable[[Array], tuple[float, Array]],
    count: int,
    iterations: int,
    optimizer: OptimizerParameters,
) -> Array:
    """Returns the (count,) iterate at which IPOPT, started from zero, stops."""
    program = MathematicalProgram()
    z = program.NewContinuousVariables(count, "z")
    program.AddCost(cost_function(value_and_gradient_at), vars=z)
    options = SolverOptions()
    for name, option in {
        "tol": GRADIENT_TOLERANCE,
        "nlp_scaling_method": "none",
        "limited_memory_max_history": ROUND_ITERATIONS,
        "acceptable_iter": iterations,
        "acceptable_tol": ANY,
        "acceptable_dual_inf_tol": ANY,
        "print_level": 5 if optimizer.debug_optimizer else 0,
    }.items():
        options.SetOption(IpoptSolver.id(), name, option)
    result = IpoptSolver().Solve(program, np.zeros(count), options)
    minimiser = result.GetSolution(z)
    if not np.all(np.isfinite(minimiser)):
        raise FailedToSmoothPath(f"IPOPT: {result.get_solution_result().name}, no finite solution")
    return minimiser
