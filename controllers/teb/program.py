"""The band as a MathematicalProgram, solved by IPOPT.

One program for each number of intervals, built once and reused: a cycle only changes the scene
that the two Python functions read, the bounds and the guess. Drake hands IPOPT no second
derivatives, so that it would build its own over many evaluations; interior_point.py has them, and
leads the guess to where IPOPT finds its conditions met.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.solvers import SolutionResult

from drake_navbench.controllers.teb.constraints import BandScene, band_constraints, sparsity_pattern
from drake_navbench.controllers.teb.continuation import Problem, descend_in_stages
from drake_navbench.controllers.teb.interior_point import (
    Bounds,
    Descent,
    DescentSettings,
    structure_of,
)
from drake_navbench.controllers.teb.ipopt_program import IpoptProgram, SolverSettings
from drake_navbench.controllers.teb.layout import (
    row_count,
    row_slices,
    unpack_poses,
    variable_count,
)
from drake_navbench.controllers.teb.objective import Weights, band_objective
from drake_navbench.kernels.arrays import Array

# The tolerance of Newton's method, as a share of IPOPT's.
NEWTON_TOLERANCE_RATIO = 0.1


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
    """The solver's result for one band.

    poses (n, 3), time_steps (m,) s, slack m; cost: the objective; violation: the largest excess of
    a row over its bounds, in the row's unit; status: Drake's SolutionResult by name; evaluations:
    number of times that IPOPT had the constraints evaluated; newton_steps: of Newton's method
    before.
    """

    poses: Array
    time_steps: Array
    slack: float
    cost: float
    violation: float
    status: str
    evaluations: int
    newton_steps: int = 0


class NewtonResult(NamedTuple):
    """A problem and where Newton's method ended on it."""

    problem: Problem
    descent: Descent


class BandProgram:
    """The program of all bands with one number of intervals and of discs.

    is_car: it has turning rows. meets_moving: it has rows for moving obstacles.
    """

    def __init__(
        self,
        interval_count: int,
        disc_count: int,
        *,
        settings: SolverSettings,
        is_car: bool = False,
        meets_moving: bool = False,
    ) -> None:
        self._interval_count, self._disc_count = interval_count, disc_count
        self._scene: BandScene | None = None
        self._weights: Weights | None = None
        self._evaluations = 0
        self._rows = row_slices(interval_count, disc_count, is_car, meets_moving)
        self._row_count = row_count(interval_count, disc_count, is_car, meets_moving)
        self._pattern = sparsity_pattern(interval_count, disc_count, is_car, meets_moving)
        self._structure = structure_of(self._pattern, self._row_count, interval_count)
        self._settings = settings
        self._ipopt: IpoptProgram | None = None

    def run_newton(
        self, guess: Array, *, scene: BandScene, weights: Weights, limits: BandLimits
    ) -> NewtonResult:
        """Runs Newton's method from a guess, to tighter tolerances than those of IPOPT."""
        settings = self._settings
        problem = Problem(
            guess,
            self._interval_count,
            scene,
            weights,
            self._bounds_of(limits, scene.clearance_shares),
            self._structure,
        )
        wanted = DescentSettings(
            barrier=settings.barrier_start,
            iterations=settings.newton_iterations,
            error_tolerance=NEWTON_TOLERANCE_RATIO * settings.tolerance,
            violation_tolerance=settings.violation_tolerance,
        )
        return NewtonResult(problem, descend_in_stages(problem, wanted))

    def unconfirmed(self, newton: NewtonResult) -> BandSolution:
        """Returns the point at which Newton's method ended as a solution, without IPOPT."""
        self._scene, self._weights, self._evaluations = (
            newton.problem.scene,
            newton.problem.weights,
            0,
        )
        z = newton.descent.z
        converged = newton.descent.converged
        status = SolutionResult.kSolutionFound if converged else SolutionResult.kIterationLimit
        return self._solution(newton, z, self._objective(z)[0], status)

    def confirm(self, newton: NewtonResult, iterations: int) -> BandSolution:
        """Returns IPOPT's solution from Newton's last iterate, or from the guess if Newton failed.

        iterations: the largest number of iterations of IPOPT.
        """
        problem, descent = newton.problem, newton.descent
        self._scene, self._weights, self._evaluations = problem.scene, problem.weights, 0
        if self._ipopt is None:
            self._ipopt = self._ipopt_program()
        start = descent.z if descent.converged else problem.guess
        result = self._ipopt.solve(
            start, problem.bounds, iterations=iterations, is_at_minimum=descent.converged
        )
        cost = float(result.get_optimal_cost())
        return self._solution(newton, result.get_x_val(), cost, result.get_solution_result())

    def _solution(
        self, newton: NewtonResult, z: Array, cost: float, status: SolutionResult
    ) -> BandSolution:
        problem, m = newton.problem, self._interval_count
        return BandSolution(
            poses=unpack_poses(z, problem.scene.start, problem.scene.goal, m),
            time_steps=z[:m].copy(),
            slack=float(z[-1]),
            cost=cost,
            violation=self._violation(z, problem.bounds),
            status=status.name,
            evaluations=self._evaluations,
            newton_steps=newton.descent.iterations,
        )

    def _violation(self, z: Array, bounds: Bounds) -> float:
        """Returns the largest excess of a row over its bounds."""
        values, _ = band_constraints(z, self._interval_count, self._scene)
        below = float(np.max(bounds.row_lower - values))
        return max(0.0, below, float(np.max(values - bounds.row_upper)))

    def _bounds_of(self, limits: BandLimits, shares: Array) -> Bounds:
        """Returns the limits as bounds of the rows and variables."""
        lower = np.zeros(self._row_count)
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
        lower[self._rows["moving_clearance"]] = limits.clearance
        upper[self._rows["moving_clearance"]] = np.inf
        upper[self._rows["turning"]] = np.inf
        if not limits.stops_at_goal:
            for name in ("acceleration", "angular_acceleration"):
                last = self._rows[name].stop - 1
                lower[last], upper[last] = -np.inf, np.inf
        m = self._interval_count
        size = variable_count(m)
        z_lower, z_upper = np.full(size, -np.inf), np.full(size, np.inf)
        z_lower[:m], z_upper[:m] = limits.shortest_step, limits.longest_step
        z_lower[-1], z_upper[-1] = 0.0, limits.largest_slack
        return Bounds(lower, upper, z_lower, z_upper)

    def _ipopt_program(self) -> IpoptProgram:
        return IpoptProgram(
            variable_count(self._interval_count),
            self._row_count,
            pattern=self._pattern,
            objective=self._objective,
            constraints=self._constraints,
            settings=self._settings,
        )

    def _objective(self, z: Array) -> tuple[float, Array]:
        return band_objective(z, self._interval_count, self._scene, self._weights)

    def _constraints(self, z: Array) -> tuple[Array, Array]:
        self._evaluations += 1
        return band_constraints(z, self._interval_count, self._scene)
