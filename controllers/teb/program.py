"""The band as a MathematicalProgram, solved by IPOPT.

One program for each number of intervals, built once and reused: a cycle only changes the scene
that the two Python functions read, the bounds and the guess. Drake hands IPOPT no second
derivatives, so it builds its own (limited-memory BFGS): few variables and few evaluations count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions

from drake_navbench.controllers.teb.constraints import BandScene, band_constraints, sparsity_pattern
from drake_navbench.controllers.teb.layout import (
    row_count,
    row_slices,
    unpack_poses,
    variable_count,
)
from drake_navbench.controllers.teb.objective import Weights, band_objective
from drake_navbench.program_function import (
    constraint_function,
    cost_function,
    solver_warnings_off,
)

Array = NDArray[np.float64]

# An interior-point method pushes its guess away from the bounds; a warm start must stay there.
BOUND_PUSH = 1e-6
# IPOPT's own bound on complementarity, 1e-4, would ask for a smaller barrier than the first one.
COMPLEMENTARITY_TOLERANCE = 1e-2
# Pairs of steps and gradient changes that the approximated second derivatives are built from. A
# warm start takes few steps, and each pair costs two more solutions of the linear system in each.
HISTORY_LENGTH = 2
# The linear systems are small (300 rows): without scaling and with small supernodes SPRAL, the only
# linear solver in Drake's IPOPT, takes half the time.
SPRAL_NODE_SIZE = 4


class BandLimits(NamedTuple):
    """Limits of the band: the bounds of its rows and variables.

    Speeds m/s (backwards as a positive number), turn rate rad/s, accelerations m/s^2 and rad/s^2,
    clearance m, time steps s, slack m; stops_at_goal: the change to the final twist is limited.
    """

    forward_speed: float
    backward_speed: float
    turn_rate: float
    acceleration: float
    angular_acceleration: float
    clearance: float
    shortest_step: float
    longest_step: float
    largest_slack: float
    stops_at_goal: bool = True


class BandSolution(NamedTuple):
    """What the solver returned for one band.

    poses (n, 3), time_steps (m,) s, slack m; cost: the objective; violation: the largest excess of
    a row over its bounds, in the row's unit; status: Drake's SolutionResult by name; evaluations:
    how often the constraints were evaluated.
    """

    poses: Array
    time_steps: Array
    slack: float
    cost: float
    violation: float
    status: str
    evaluations: int


class SolverSettings(NamedTuple):
    """IPOPT's settings, in its own words: tol, constr_viol_tol and mu_init.

    The defaults stop about 1 % above the minimum after 3 to 6 iterations of a warm start, with the
    constraints met to 1e-4. That distance is the barrier's, which is never lowered; a smaller
    barrier also drives harder on the acceleration limits, with twice the jerk in free space.
    """

    tolerance: float = 0.3
    violation_tolerance: float = 1e-4
    barrier_start: float = 1e-3


class BandProgram:
    """The program of all bands with one number of intervals and of discs, of cars or others."""

    def __init__(
        self,
        interval_count: int,
        disc_count: int,
        *,
        settings: SolverSettings,
        is_car: bool = False,
    ) -> None:
        self._interval_count, self._disc_count = interval_count, disc_count
        self._scene: BandScene | None = None
        self._weights: Weights | None = None
        self._evaluations = 0
        self._rows = row_slices(interval_count, disc_count, is_car)
        size = variable_count(interval_count)
        rows = row_count(interval_count, disc_count, is_car)
        self._program = MathematicalProgram()
        self._variables = self._program.NewContinuousVariables(size, "z")
        self._bounds = self._program.AddBoundingBoxConstraint(-1.0, 1.0, self._variables)
        self._program.AddCost(cost_function(self._objective), vars=self._variables)
        self._constraint = self._program.AddConstraint(
            constraint_function(self._constraints),
            np.zeros(rows),
            np.zeros(rows),
            self._variables,
            "band",
        )
        self._constraint.evaluator().SetGradientSparsityPattern(
            sparsity_pattern(interval_count, disc_count, is_car)
        )
        self._solver = IpoptSolver()
        self._options = ipopt_options(settings)

    def solve(
        self,
        guess: Array,
        *,
        scene: BandScene,
        weights: Weights,
        limits: BandLimits,
        iterations: int,
    ) -> BandSolution:
        """Solves from the guess (N,); returns what IPOPT ends with after `iterations` at most."""
        self._scene, self._weights, self._evaluations = scene, weights, 0
        lower, upper = self._set_bounds(limits, scene.clearance_shares)
        self._options.SetOption(IpoptSolver.id(), "max_iter", iterations)
        with solver_warnings_off():
            result = self._solver.Solve(self._program, guess, self._options)
        z = result.get_x_val()
        m = self._interval_count
        values, _ = band_constraints(z, m, scene)
        violation = max(0.0, float(np.max(lower - values)), float(np.max(values - upper)))
        return BandSolution(
            poses=unpack_poses(z, scene.start, scene.goal, m),
            time_steps=z[:m].copy(),
            slack=float(z[-1]),
            cost=float(result.get_optimal_cost()),
            violation=violation,
            status=result.get_solution_result().name,
            evaluations=self._evaluations,
        )

    def _set_bounds(self, limits: BandLimits, shares: Array) -> tuple[Array, Array]:
        lower = np.zeros(self._constraint.evaluator().num_constraints())
        upper = lower.copy()
        symmetric = {
            "turn_rate": limits.turn_rate,
            "acceleration": limits.acceleration,
            "angular_acceleration": limits.angular_acceleration,
        }
        for name, limit in symmetric.items():
            lower[self._rows[name]], upper[self._rows[name]] = -limit, limit
        lower[self._rows["speed"]] = -limits.backward_speed
        upper[self._rows["speed"]] = limits.forward_speed
        lower[self._rows["clearance"]] = limits.clearance * np.repeat(shares, self._disc_count)
        upper[self._rows["clearance"]] = np.inf
        upper[self._rows["turning"]] = np.inf
        if not limits.stops_at_goal:
            for name in ("acceleration", "angular_acceleration"):
                last = self._rows[name].stop - 1
                lower[last], upper[last] = -np.inf, np.inf
        self._constraint.evaluator().set_bounds(lower, upper)
        size, m = len(self._variables), self._interval_count
        z_lower, z_upper = np.full(size, -np.inf), np.full(size, np.inf)
        z_lower[:m], z_upper[:m] = limits.shortest_step, limits.longest_step
        z_lower[-1], z_upper[-1] = 0.0, limits.largest_slack
        self._bounds.evaluator().set_bounds(z_lower, z_upper)
        return lower, upper

    def _objective(self, z: Array) -> tuple[float, Array]:
        return band_objective(z, self._interval_count, self._scene, self._weights)

    def _constraints(self, z: Array) -> tuple[Array, Array]:
        self._evaluations += 1
        return band_constraints(z, self._interval_count, self._scene)


def ipopt_options(settings: SolverSettings) -> SolverOptions:
    """Returns the options of every solve. Work is bounded by iterations, never by the clock."""
    options = SolverOptions()
    for key, value in {
        # Whole steps: after a jump of the measured pose, a search along each step takes twice the
        # evaluations and meets the limits less often.
        "accept_every_trial_step": "yes",
        "acceptable_iter": 0,
        "bound_frac": BOUND_PUSH,
        "bound_push": BOUND_PUSH,
        "compl_inf_tol": COMPLEMENTARITY_TOLERANCE,
        "constr_viol_tol": settings.violation_tolerance,
        "limited_memory_max_history": HISTORY_LENGTH,
        "mu_init": settings.barrier_start,
        "mu_strategy": "monotone",
        # All rows are of the order of one; to find out takes IPOPT an evaluation.
        "nlp_scaling_method": "none",
        "print_level": 0,
        "slack_bound_frac": BOUND_PUSH,
        "slack_bound_push": BOUND_PUSH,
        "spral_nemin": SPRAL_NODE_SIZE,
        "spral_scaling": "none",
        "tol": settings.tolerance,
    }.items():
        options.SetOption(IpoptSolver.id(), key, value)
    return options
