"""The polish: a small nonlinear program that refines the sampled control sequence.

Sampling finds the basin; the program makes the result feasible and smooth. Its variables are the
control points of two clamped cubic B-splines, v and w over the horizon, started at the
least-squares fit of the sampled sequence: their deviation from it is the correction. A B-spline
stays in the hull of its control points and its derivative in the hull of their scaled differences,
so bounds on the points and one linear row a difference bound velocity and acceleration. Built as
a Drake MathematicalProgram once, updated in place, solved by IPOPT with a limit on iterations,
never on time.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions
from scipy.interpolate import BSpline

from drake_navbench.controllers.mppi.motion_models import MotionLimits
from drake_navbench.controllers.mppi.objective import Array, Situation, Weights, objective
from drake_navbench.program_function import cost_function, solver_warnings_off

_DEGREE = 3
# The iterates may start this close to their bounds; IPOPT's default of 1e-2 would throw away a
# warm start, which often lies on a limit.
_BOUND_PUSH = 1e-6
# A barrier that starts this small, and falls monotonically, hardly moves a good start: four
# iterations then reach 99 % of the gain of a converged solve, where Drake's adaptive barrier stops
# at 97 % after eight (29 situations of two scenarios).
_BARRIER_START = 1e-5
_TOLERANCE = 1e-4


class PolishStatus(StrEnum):
    """What became of a polish."""

    ACCEPTED = "accepted"
    NOT_BETTER = "not better"
    COLLIDES = "collides"
    INFEASIBLE = "infeasible"


class PolishOutcome(NamedTuple):
    """One solve: the refined sequence (N, 2), or the sampled one where IPOPT found no point.

    solver: name of the solver that ran. result_status: Drake's SolutionResult. evaluation_count:
    evaluations of objective and gradient.
    """

    sequence: Array
    found: bool
    solver: str
    result_status: str
    evaluation_count: int


class Polish:
    """A program for one controller; solves are independent of each other.

    steps: N. dt_s: step of the horizon. first_time_s: when column 0 is driven, 0 for now.
    knot_count: control points a spline. max_iterations: IPOPT's limit. weights: of the objective.
    limits: accelerations.
    """

    def __init__(
        self,
        steps: int,
        dt_s: float,
        *,
        first_time_s: float,
        knot_count: int,
        max_iterations: int,
        weights: Weights,
        limits: MotionLimits,
    ) -> None:
        times = first_time_s + dt_s * np.arange(steps)
        knots = _clamped_knots(knot_count, float(times[-1]))
        self.basis = BSpline.design_matrix(times, knots, _DEGREE).toarray()
        self._fit = np.linalg.pinv(self.basis[:, 1:])
        self.weights = weights
        self._knot_count = knot_count
        self._program = MathematicalProgram()
        self._points = self._program.NewContinuousVariables(2 * knot_count, "control_points")
        self._program.AddCost(cost_function(self._cost), vars=self._points)
        everywhere = np.full(2 * knot_count, np.inf)
        self._bounds = self._program.AddBoundingBoxConstraint(-everywhere, everywhere, self._points)
        self._add_acceleration_rows(knots, limits)
        self._solver = IpoptSolver()
        self._options = _solver_options(max_iterations)
        # Scratch of the solve under way; set at its start, so that no result depends on it.
        self._situation: Situation | None = None
        self._evaluation_count = 0

    def _add_acceleration_rows(self, knots: Array, limits: MotionLimits) -> None:
        """Adds fall <= 3 (c_{i+1} - c_i) / (knot_{i+4} - knot_{i+1}) <= rise for v and for w."""
        count = self._knot_count
        spans = knots[_DEGREE + 1 : _DEGREE + count] - knots[1:count]
        differences = (np.eye(count)[1:] - np.eye(count)[:-1]) * (_DEGREE / spans)[:, None]
        rows = np.kron(np.eye(2), differences)
        per_axis = count - 1
        fall = np.repeat([limits.ax_min, -limits.az_max], per_axis).astype(float)
        rise = np.repeat([limits.ax_max, limits.az_max], per_axis).astype(float)
        self._program.AddLinearConstraint(rows, fall, rise, self._points)

    def solve(self, situation: Situation, limits: MotionLimits) -> PolishOutcome:
        """Refines `situation.sampled` within the velocity limits, from its speed on."""
        count = self._knot_count
        self._situation = situation
        self._evaluation_count = 0
        lowest = np.repeat([limits.vx_min, -limits.wz_max], count).astype(float)
        highest = np.repeat([limits.vx_max, limits.wz_max], count).astype(float)
        now = [0, count]
        lowest[now] = highest[now] = situation.speed
        self._bounds.evaluator().set_bounds(lowest, highest)
        start = np.clip(self.fit(situation).T.ravel(), lowest, highest)
        with solver_warnings_off():
            result = self._solver.Solve(self._program, start, self._options)
        points = result.get_x_val()
        found = bool(np.all(np.isfinite(points))) and self._is_feasible(points)
        sequence = self.basis @ points.reshape(2, count).T if found else situation.sampled
        return PolishOutcome(
            np.ascontiguousarray(sequence),
            found,
            result.get_solver_id().name(),
            result.get_solution_result().name,
            self._evaluation_count,
        )

    def fit(self, situation: Situation) -> Array:
        """Returns the control points (K, 2), the first at `speed`, closest to the sampled one."""
        speed = np.asarray(situation.speed, dtype=float)
        rest = situation.sampled - self.basis[:, :1] * speed
        return np.vstack([speed, self._fit @ rest])

    def value_and_gradient(self, situation: Situation, points: Array) -> tuple[float, Array]:
        """Returns the objective and its gradient (2 K,) at control points (2 K,), v before w."""
        sequence = np.ascontiguousarray(self.basis @ points.reshape(2, -1).T)
        value, by_sequence = objective(situation, self.weights, sequence)
        return value, (self.basis.T @ by_sequence).T.ravel()

    def _cost(self, points: Array) -> tuple[float, Array]:
        self._evaluation_count += 1
        return self.value_and_gradient(self._situation, points)

    def _is_feasible(self, points: Array) -> bool:
        return self._program.CheckSatisfied(
            self._program.GetAllConstraints(), points, tol=_TOLERANCE
        )


def _clamped_knots(count: int, end_s: float) -> Array:
    """Returns uniform knots on [0, end_s] with the ends repeated, for `count` control points."""
    inner = np.linspace(0.0, end_s, count - _DEGREE + 1)
    return np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, end_s)])


def _solver_options(max_iterations: int) -> SolverOptions:
    options = SolverOptions()
    solver = IpoptSolver.id()
    options.SetOption(solver, "max_iter", max_iterations)
    options.SetOption(solver, "tol", _TOLERANCE)
    options.SetOption(solver, "bound_push", _BOUND_PUSH)
    options.SetOption(solver, "bound_frac", _BOUND_PUSH)
    options.SetOption(solver, "mu_strategy", "monotone")
    options.SetOption(solver, "mu_init", _BARRIER_START)
    options.SetOption(solver, "print_level", 0)
    options.SetOption(solver, "sb", "yes")
    return options
