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
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions
from scipy.linalg import cholesky, solve_triangular

from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.kernels.constrained_smoothing import (
    KnotProblem,
    gauss_newton_hessian,
    value_and_gradient,
)
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.smoothing_knots import (
    Knots,
    driving_signs,
    path_through_knots,
    select_knots,
)

Array = NDArray[np.float64]

# IPOPT's iterations between two whitenings.
ROUND_ITERATIONS = 10
# Added to the Hessian's diagonal, relative to its largest entry: without w_smooth it may be
# singular.
RIDGE_RATIO = 1e-9
# The program's objective where a round starts, so that the tolerance below is relative to it.
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


class OptimizerParameters(BaseModel):
    """Parameters `optimizer.*` with Nav2's names and defaults; IPOPT has no use for some."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    linear_solver_type: Literal["SPARSE_NORMAL_CHOLESKY", "DENSE_QR"] = Field(
        "SPARSE_NORMAL_CHOLESKY", description="Of Ceres; without effect here [-]"
    )
    max_iterations: int = Field(
        100, ge=1, description="Iterations after which the result is taken as it is [iterations]"
    )
    param_tol: float = Field(1e-15, gt=0.0, description="Of Ceres; without effect here [-]")
    fn_tol: float = Field(
        1e-7, gt=0.0, description="Stops where a round gains less, relative to the objective [-]"
    )
    gradient_tol: float = Field(1e-10, gt=0.0, description="Of Ceres; without effect here [-]")
    debug_optimizer: bool = Field(False, description="IPOPT prints its iterations [-]")


class ConstrainedSmootherParameters(BaseModel):
    """Parameters of ConstrainedSmoother, with Nav2's names and defaults."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    minimum_turning_radius: float = Field(
        0.4, ge=0.0, description="Sharper turns are penalised; 0 penalises none [m]"
    )
    w_curve: float = Field(30.0, ge=0.0, description="Weight of excess curvature [m^2]")
    w_cost: float = Field(0.015, ge=0.0, description="Weight of the costmap's cost [-]")
    w_cost_cusp_multiplier: float = Field(
        3.0, ge=0.0, description="Multiplies w_cost at a cusp [-]"
    )
    cusp_zone_length: float = Field(
        2.5, ge=0.0, description="Length around a cusp over which the multiplier fades out [m]"
    )
    w_dist: float = Field(0.0, ge=0.0, description="Weight of the distance from the input [1/m^2]")
    w_smooth: float = Field(
        2_000_000.0,
        ge=0.0,
        description="Weight of second differences; must change with the spacing [1/m^2]",
    )
    cost_check_points: tuple[float, ...] = Field(
        (), description="x [m], y [m], weight [-] of points fixed to the robot, in one row"
    )
    path_downsampling_factor: int = Field(1, ge=1, description="Every n-th pose is a knot [poses]")
    path_upsampling_factor: int = Field(
        1, ge=0, description="Poses returned per input pose; 0 returns the knots alone [-]"
    )
    reversing_enabled: bool = Field(True, description="Headings tell reverse from forward [-]")
    keep_start_orientation: bool = Field(True, description="The start's heading stays [-]")
    keep_goal_orientation: bool = Field(True, description="The goal's heading stays [-]")
    optimizer: OptimizerParameters = OptimizerParameters()

    @model_validator(mode="after")
    def _check_points_are_triples(self) -> Self:
        points = self.cost_check_points
        if len(points) % 3 != 0:
            raise ValueError(
                f"cost_check_points: found {len(points)} numbers, expected a multiple of 3"
            )
        weights = points[2::3]
        if points and (min(weights) < 0.0 or max(weights) == 0.0):
            raise ValueError(
                f"cost_check_points: found weights {weights}, expected none negative, one above 0"
            )
        return self

    @property
    def normalized_check_points(self) -> Array:
        """(Q, 3) x m, y m and the square roots of the weights, scaled to a sum of 1.

        Without any, the robot's own origin.
        """
        if not self.cost_check_points:
            return np.array([[0.0, 0.0, 1.0]])
        points = np.array(self.cost_check_points, dtype=np.float64).reshape(-1, 3)
        points[:, 2] = np.sqrt(points[:, 2])
        points[:, 2] /= np.sum(points[:, 2])
        return points


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
        raise InputError(f"path: found an array of shape {poses.shape}, expected finite (N, 3)")
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
        costs=costmap.costs,
        origin_x=float(costmap.origin_x),
        origin_y=float(costmap.origin_y),
        resolution=float(costmap.resolution),
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

    def objective(z):
        if z.dtype != object:
            return value_and_gradient_at(z)[0]
        value, gradient = value_and_gradient_at(ExtractValue(z).ravel())
        return AutoDiffXd(value, gradient @ ExtractGradient(z))

    program = MathematicalProgram()
    z = program.NewContinuousVariables(count, "z")
    program.AddCost(objective, vars=z)
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
