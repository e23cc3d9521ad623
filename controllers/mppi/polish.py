"""The polish: a small nonlinear program that refines the sampled control sequence.

Sampling finds the basin; the program makes the result feasible and smooth. Its variables are the
control points of two clamped cubic B-splines, v and w over the horizon, without the first of each,
the present speed. They start at the least-squares fit of the sampled sequence: their deviation
from it is the correction. A B-spline stays in the hull of its control points and its derivative in
the hull of their scaled differences, so bounds on the points and one linear row a difference bound
velocity and acceleration. Built as a Drake MathematicalProgram once, updated in place, solved by
IPOPT with a limit on iterations, never on time.

Where accelerations bind nothing, `bounded_descent` leads the way: Newton's method on the same
barrier problem. IPOPT then starts at its solution, with the barrier's multipliers, and finds its
conditions met. Where that does not converge, and with acceleration rows, IPOPT goes its own way. It
gets no second derivatives but estimates them from successive gradients, first as the identity. So
each control point is scaled such that the objective's second derivative by it is 1 in a straight
drive at full speed. Five iterations then reach 99.9 % of the gain of
converged solves, and at least 99 % in each (530 situations of six scenarios).
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from pydrake.solvers import Binding, IpoptSolver, MathematicalProgram, SolverOptions

from drake_navbench.controllers.mppi.bounded_descent import ControlSpline, DescentSettings, descend
from drake_navbench.controllers.mppi.lanes import frozen
from drake_navbench.controllers.mppi.motion_models import MotionLimits
from drake_navbench.controllers.mppi.objective import PolishSituation, Weights, objective
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.program_function import cost_function, solver_warnings_off

_DEGREE = 3
# v and w.
_AXES = 2
# The iterates may start this close to their bounds; IPOPT's default of 1e-2 would throw away a
# warm start, which often lies on a limit. The barrier's own solution is closer still.
_BOUND_PUSH, _LED_BOUND_PUSH = 1e-6, 1e-9
# A barrier that starts this small, and falls monotonically, hardly moves a good start.
_BARRIER_START = 1e-5
_TOLERANCE = 1e-4
# Step of the control points for second derivatives, m/s and rad/s; the gradient is smooth.
_CURVATURE_STEP = 1e-3


class PolishStatus(StrEnum):
    """The result of a polish."""

    ACCEPTED = "accepted"
    NOT_BETTER = "not better"
    COLLIDES = "collides"
    INFEASIBLE = "infeasible"


class PolishOutcome(NamedTuple):
    """One solve: the refined sequence (N, 2), or the sampled one where IPOPT found no point.

    solver: name of the solver that ran. evaluation_count: evaluations of objective and
    gradient.
    """

    sequence: Array
    found: bool
    solver: str
    evaluation_count: int


class Polish:
    """A program for one controller; solves are independent of each other.

    steps: N. dt_s: step of the horizon. first_time_s: when column 0 is driven, 0 for now.
    knot_count: K, control points a spline. max_iterations: IPOPT's limit. weights: weights of the
    objective. limits: accelerations, and the velocities at no speed limit.
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
        # Imported late: it takes 0.2 s, which only a process that drives spends.
        from scipy.interpolate import BSpline

        basis = BSpline.design_matrix(times, knots, _DEGREE).toarray()
        # Sequences (2 N,) and control points (2 K,) one after the other, v and w in turn.
        spline = np.kron(basis, np.eye(_AXES))
        self.weights = weights
        self._by_speed = np.ascontiguousarray(spline[:, :_AXES])
        self._by_variables = np.ascontiguousarray(spline[:, _AXES:])
        straight = _straight_drive(steps, dt_s, float(limits.vx_max))
        self._units = self._curvature_units(straight)
        self._by_variables *= self._units
        self._fit = np.linalg.pinv(self._by_variables)
        self._program = MathematicalProgram()
        self._variables = self._program.NewContinuousVariables(self._units.size, "control_points")
        self._program.AddCost(cost_function(self._cost), vars=self._variables)
        everywhere = np.full(self._units.size, np.inf)
        self._bounds = self._program.AddBoundingBoxConstraint(
            -everywhere, everywhere, self._variables
        )
        self._accelerations = _acceleration_rows(knots, limits)
        self._rows = self._add_rows()
        self._solver = IpoptSolver()
        self._options = _solver_options(max_iterations, _BOUND_PUSH)
        self._led_options = _led_solver_options(max_iterations)
        # The constant curvature of the controls, first where column 0 is in the future, then the
        # present.
        self._control_curvatures = tuple(
            self._curvature_of_controls(straight._replace(starts_now=starts_now))
            for starts_now in (False, True)
        )
        # Scratch of the solve under way; set at its start, so that no result depends on it.
        self._situation = straight
        self._evaluation_count = 0

    def _curvature_units(self, situation: PolishSituation) -> Array:
        """Returns the units of the variables: 1 / sqrt of the objective's second derivatives."""
        points = np.tile(situation.speed, self._by_variables.shape[1] // _AXES)
        _, gradient = self.value_and_gradient(situation, points)
        units = np.ones(points.size)
        for k in range(points.size):
            moved = points.copy()
            moved[k] += _CURVATURE_STEP
            _, there = self.value_and_gradient(situation, moved)
            curvature = (there[k] - gradient[k]) / _CURVATURE_STEP
            if curvature > 0:
                units[k] = 1.0 / math.sqrt(curvature)
        return units

    def _curvature_of_controls(self, situation: PolishSituation) -> Array:
        """Returns the (constant) second derivatives of the objective's terms of controls."""
        weights = self.weights._replace(path=0.0, heading=0.0, obstacle=0.0, progress=0.0)
        gradients = []
        for variables in (np.zeros(self._units.size), *np.eye(self._units.size)):
            _, by_sequence = objective(situation, weights, self.sequence(situation, variables))
            gradients.append(by_sequence.ravel() @ self._by_variables)
        return np.array(gradients[1:]) - gradients[0]

    def _add_rows(self) -> Binding | None:
        """Adds the acceleration rows of the variables; their bounds depend on the speed now."""
        rows, fall, rise = self._accelerations
        if not len(rows):
            return None
        return self._program.AddLinearConstraint(
            rows[:, _AXES:] * self._units, fall, rise, self._variables
        )

    def solve(self, situation: PolishSituation, limits: MotionLimits) -> PolishOutcome:
        """Refines `situation.sampled` within the velocity limits, from its speed on."""
        self._situation = situation
        self._evaluation_count = 0
        free_count = self._units.size // _AXES
        lowest = np.tile([limits.vx_min, -limits.wz_max], free_count) / self._units
        highest = np.tile([limits.vx_max, limits.wz_max], free_count) / self._units
        self._bounds.evaluator().set_bounds(lowest, highest)
        if self._rows is not None:
            rows, fall, rise = self._accelerations
            from_now = rows[:, :_AXES] @ situation.speed
            self._rows.evaluator().set_bounds(fall - from_now, rise - from_now)
        start = np.clip(self.fit(situation), lowest, highest)
        options = self._options
        if self._rows is None and np.all(lowest < highest):
            led, converged = self._lead(situation, start, lowest, highest)
            if converged:
                start, options = led, self._led_options
        with solver_warnings_off():
            result = self._solver.Solve(self._program, start, options)
        variables = result.get_x_val()
        found = bool(np.all(np.isfinite(variables))) and self._is_feasible(variables)
        return PolishOutcome(
            self.sequence(situation, variables) if found else situation.sampled,
            found,
            result.get_solver_id().name(),
            self._evaluation_count,
        )

    def _lead(
        self, situation: PolishSituation, start: Array, lowest: Array, highest: Array
    ) -> tuple[Array, bool]:
        """Returns the solution of IPOPT's first barrier problem, and whether it converged."""
        spline = ControlSpline(
            self._by_speed @ situation.speed,
            self._by_variables,
            self._control_curvatures[situation.starts_now],
        )
        settings = DescentSettings(_BARRIER_START)
        return descend(situation, self.weights, spline, start, lowest, highest, settings)

    def fit(self, situation: PolishSituation) -> Array:
        """Returns the variables (2 K - 2,) whose sequence is closest to the sampled one."""
        return self._fit @ (situation.sampled.ravel() - self._by_speed @ situation.speed)

    def sequence(self, situation: PolishSituation, variables: Array) -> Array:
        """Returns the sequence (N, 2) of variables (2 K - 2,), from the speed now on."""
        flat = self._by_speed @ situation.speed + self._by_variables @ variables
        return flat.reshape(-1, _AXES)

    def value_and_gradient(
        self, situation: PolishSituation, variables: Array
    ) -> tuple[float, Array]:
        """Returns the objective and its gradient (2 K - 2,) at variables (2 K - 2,)."""
        sequence = self.sequence(situation, variables)
        value, by_sequence = objective(situation, self.weights, sequence)
        return value, by_sequence.ravel() @ self._by_variables

    def _cost(self, variables: Array) -> tuple[float, Array]:
        self._evaluation_count += 1
        return self.value_and_gradient(self._situation, variables)

    def _is_feasible(self, variables: Array) -> bool:
        return self._program.CheckSatisfied(
            self._program.GetAllConstraints(), variables, tol=_TOLERANCE
        )


def _clamped_knots(count: int, end_s: float) -> Array:
    """Returns uniform knots on [0, end_s] with the ends repeated, for `count` control points."""
    inner = np.linspace(0.0, end_s, count - _DEGREE + 1)
    return np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, end_s)])


def _acceleration_rows(knots: Array, limits: MotionLimits) -> tuple[Array, Array, Array]:
    """Returns (rows (M, 2 K), fall (M,), rise (M,)): fall <= rows @ control points <= rise.

    A row is the acceleration 3 (c_{i+1} - c_i) / (knot_{i+4} - knot_{i+1}) of v or w. Those whose
    bounds are out of reach between any two velocities are left out: an iteration without rows
    takes less time.
    """
    count = len(knots) - _DEGREE - 1
    spans = knots[_DEGREE + 1 : _DEGREE + count] - knots[1:count]
    differences = (np.eye(count)[1:] - np.eye(count)[:-1]) * (_DEGREE / spans)[:, None]
    rows = np.kron(differences, np.eye(_AXES))
    fall, rise, width = (
        np.tile(np.asarray(pair, dtype=float), count - 1)
        for pair in (
            (limits.ax_min, -limits.az_max),
            (limits.ax_max, limits.az_max),
            (limits.vx_max - limits.vx_min, 2 * limits.wz_max),
        )
    )
    binds = rows.max(axis=1) * width > np.minimum(rise, -fall)
    return rows[binds], fall[binds], rise[binds]


def _straight_drive(steps: int, dt_s: float, speed_mps: float) -> PolishSituation:
    """Returns a drive along a straight path in the open, its carrot one horizon beyond its end."""
    speed = np.array([speed_mps, 0.0])
    x = speed_mps * dt_s * np.arange(1, steps + 1)
    return PolishSituation(
        # Read-only as in a cycle, so that `objective` is compiled once.
        pose=frozen(np.zeros(3)),
        speed=speed,
        earlier_speed=frozen(speed.copy()),
        references=np.column_stack([x, np.zeros((steps, 2))]),
        carrot=np.array([2 * x[-1], 0.0]),
        sampled=np.tile(speed, (steps, 1)),
        field=Grid(np.zeros((1, 1)), 0.0, 0.0, 1.0),
        dt=dt_s,
        starts_now=True,
    )


def _solver_options(max_iterations: int, bound_push: float) -> SolverOptions:
    options = SolverOptions()
    for name, value in {
        "max_iter": max_iterations,
        "tol": _TOLERANCE,
        "bound_push": bound_push,
        "bound_frac": bound_push,
        "mu_strategy": "monotone",
        "mu_init": _BARRIER_START,
        # The first guess of the Hessian, by the variables' units.
        "limited_memory_initialization": "constant",
        "limited_memory_init_val": 1.0,
        # Steps within linear constraints need no second-order correction.
        "max_soc": 0,
        # The units are the scale; looking for another one takes a quarter of the time.
        "nlp_scaling_method": "none",
        "spral_scaling": "none",
        "print_level": 0,
        "sb": "yes",
    }.items():
        options.SetOption(IpoptSolver.id(), name, value)
    return options


def _led_solver_options(max_iterations: int) -> SolverOptions:
    """Returns options for a start at the first barrier problem's solution."""
    options = _solver_options(max_iterations, _LED_BOUND_PUSH)
    # There the barrier's own multipliers are the right ones, by the distance to the very bounds.
    options.SetOption(IpoptSolver.id(), "bound_mult_init_method", "mu-based")
    options.SetOption(IpoptSolver.id(), "bound_relax_factor", 0.0)
    return options
