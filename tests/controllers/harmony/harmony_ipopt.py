"""The program of one cycle as a MathematicalProgram, solved by IPOPT.

The same costs and limits as in interior_point.py, in the same numbers, with the jerks as variables:
Drake gets their linear rows as linear constraints; the nonlinear rows and the cost are two Python
functions with analytic derivatives. Built once and reused; a cycle only changes bounds and the data
that the functions read. It serves to check our own method.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions

from drake_navbench.controllers.harmony.interior_point import (
    CLEARANCE_SHARE,
    Solution,
    SolverSettings,
)
from drake_navbench.controllers.harmony.motion import (
    ALPHA,
    JERK,
    STAGE_SIZE,
    STATE_SIZE,
    A,
    V,
    W,
    roll_out,
    slopes_of_advance,
)
from drake_navbench.controllers.harmony.rows import (
    FIRST_DISC_ROW,
    FIRST_LATERAL_ROW,
    SLOPES_A_ROW,
    row_count,
    stage_rows,
)
from drake_navbench.controllers.harmony.scene import Scene
from drake_navbench.controllers.harmony.terms import stage_cost
from drake_navbench.kernels.program_function import (
    constraint_function,
    cost_function,
    solver_warnings_off,
)

Array = NDArray[np.float64]

# An interior-point method pushes its guess away from the bounds; a warm start must stay near it.
BOUND_PUSH = 1e-6
TOLERANCE, FIRST_BARRIER = 1e-4, 1e-3
# Rows of v and w, a and alpha, both wheels.
LINEAR_ROWS = 6


@njit(cache=True)
def cost_and_gradient(scene, plan):
    """Returns (cost, gradient (2 N,) by the jerks) of a plan, by the adjoint recursion."""
    last = plan.shape[0] - 1
    gradients, hessian = np.zeros((last + 1, STAGE_SIZE)), np.zeros((STAGE_SIZE, STAGE_SIZE))
    slopes = np.empty((STATE_SIZE, STAGE_SIZE))
    cost = 0.0
    for k in range(last + 1):
        reference = scene.references[k]
        cost += stage_cost(scene, k, last, plan[k], reference, gradients[k], hessian)
    by_jerks = np.empty(2 * last)
    adjoint = gradients[last, :STATE_SIZE].copy()
    for k in range(last - 1, -1, -1):
        slopes_of_advance(plan[k], scene.dt, slopes)
        total = gradients[k] + slopes.T @ adjoint
        by_jerks[2 * k], by_jerks[2 * k + 1] = total[JERK], total[JERK + 1]
        adjoint = total[:STATE_SIZE].copy()
    return cost, by_jerks


@njit(cache=True)
def rows_and_jacobian(scene, plan):
    """Returns ((M,), (M, 2 N)): the rows that are not linear, of all stages but the first."""
    last, rows = plan.shape[0] - 1, row_count(scene)
    count = rows - FIRST_LATERAL_ROW
    values, columns = np.empty(rows), np.zeros((rows, SLOPES_A_ROW), dtype=np.int64)
    slopes = np.empty((rows, SLOPES_A_ROW))
    step = np.empty((STATE_SIZE, STAGE_SIZE))
    by_jerks = np.zeros((STATE_SIZE, 2 * last))
    found, jacobian = np.empty(count * last), np.zeros((count * last, 2 * last))
    for k in range(last):
        slopes_of_advance(plan[k], scene.dt, step)
        by_jerks = np.ascontiguousarray(step[:, :STATE_SIZE]) @ by_jerks
        for i in range(STATE_SIZE):
            by_jerks[i, 2 * k] += step[i, JERK]
            by_jerks[i, 2 * k + 1] += step[i, JERK + 1]
        stage_rows(scene, k + 1, plan[k + 1], values, columns, slopes)
        for row in range(count):
            source, place = FIRST_LATERAL_ROW + row, k * count + row
            found[place] = values[source]
            for i in range(SLOPES_A_ROW):
                if slopes[source, i] != 0.0:
                    for j in range(2 * last):
                        jacobian[place, j] += slopes[source, i] * by_jerks[columns[source, i], j]
    return found, jacobian


class IpoptProgram:
    """The program of all plans with one number of steps and of discs."""

    def __init__(self, step_count: int, disc_count: int) -> None:
        self._step_count = step_count
        row_total = step_count * (disc_count + FIRST_DISC_ROW - FIRST_LATERAL_ROW)
        self._program = MathematicalProgram()
        self._jerks = self._program.NewContinuousVariables(2 * step_count, "jerks")
        infinite = np.full(2 * step_count, np.inf)
        self._bounds = self._program.AddBoundingBoxConstraint(-infinite, infinite, self._jerks)
        self._program.AddCost(cost_function(self._cost), vars=self._jerks)
        self._program.AddConstraint(
            constraint_function(self._rows),
            lb=np.zeros(row_total),
            ub=np.full(row_total, np.inf),
            vars=self._jerks,
        )
        size = LINEAR_ROWS * step_count + STATE_SIZE - V
        self._linear_rows = self._program.AddLinearConstraint(
            np.zeros((size, 2 * step_count)),
            np.full(size, -np.inf),
            np.full(size, np.inf),
            self._jerks,
        )
        self._solver = IpoptSolver()
        # The inputs of the functions in the present solve; set at its start.
        self._scene: Scene | None = None
        self._plan = np.zeros((step_count + 1, STAGE_SIZE))
        self._evaluations = 0

    def solve(self, scene: Scene, guess: Array, settings: SolverSettings) -> Solution:
        """Optimises a guess (N + 1, 9) by IPOPT; only the guess's inputs are read."""
        self._scene, self._evaluations = scene, 0
        self._plan = guess.copy()
        limits = scene.limits
        top = np.tile([limits.jerk, limits.angular_jerk], self._step_count)
        self._bounds.evaluator().set_bounds(-top, top)
        self._set_linear_rows(scene)
        start = np.clip(guess[:-1, JERK:].ravel(), -top, top)
        with solver_warnings_off():
            result = self._solver.Solve(self._program, start, _options(settings.iterations))
        jerks = result.get_x_val()
        if not np.isfinite(jerks).all():
            return Solution(guess, np.inf, np.inf, self._evaluations, False)
        plan = self._driven(np.clip(jerks, -top, top))
        violation = self._violation(plan)
        cost, _ = cost_and_gradient(scene, plan)
        return Solution(plan, cost, violation, self._evaluations, violation <= settings.tolerance)

    def _driven(self, jerks: Array) -> Array:
        """Returns the plan of jerks (2 N,)."""
        assert self._scene is not None
        plan = self._plan.copy()
        plan[:-1, JERK:] = jerks.reshape(-1, 2)
        plan[-1, JERK:] = 0.0
        roll_out(plan, self._scene.dt)
        return plan

    def _cost(self, jerks: Array) -> tuple[float, Array]:
        assert self._scene is not None
        self._evaluations += 1
        cost, gradient = cost_and_gradient(self._scene, self._driven(jerks))
        return float(cost), gradient

    def _rows(self, jerks: Array) -> tuple[Array, Array]:
        assert self._scene is not None
        values, jacobian = rows_and_jacobian(self._scene, self._driven(jerks))
        return values, jacobian

    def _set_linear_rows(self, scene: Scene) -> None:
        """Sets the rows of velocities, accelerations, wheels and rest at the end."""
        limits, count, dt = scene.limits, self._step_count, scene.dt
        coasting = self._driven(np.zeros(2 * count))
        since = np.arange(1, count + 1)[:, None] - np.arange(1, count + 1)[None, :]
        reaches = since >= 0
        rate = np.where(reaches, dt, 0.0)
        velocity = np.where(reaches, dt * dt * (since + 0.5), 0.0)
        by_v, by_w = np.kron(velocity, [[1.0, 0.0]]), np.kron(velocity, [[0.0, 1.0]])
        by_a, by_alpha = np.kron(rate, [[1.0, 0.0]]), np.kron(rate, [[0.0, 1.0]])
        half = limits.half_track
        matrix = np.vstack([by_v, by_w, by_a, by_alpha, by_v + half * by_w, by_v - half * by_w])
        v, w = coasting[1:, V], coasting[1:, W]
        offsets = np.concatenate(
            [v, w, coasting[1:, A], coasting[1:, ALPHA], v + half * w, v - half * w]
        )
        wheel = np.full(2 * count, limits.wheel_speed)
        acceleration = np.full(count, limits.acceleration)
        angular = np.full(count, limits.angular_acceleration)
        low = [scene.low[1:, 0], scene.low[1:, 1], -acceleration, -angular, -wheel]
        high = [scene.high[1:, 0], scene.high[1:, 1], acceleration, angular, wheel]
        ends = np.vstack([by_v[-1], by_w[-1], by_a[-1], by_alpha[-1]])
        rest = -coasting[-1, V:STATE_SIZE]
        self._linear_rows.evaluator().UpdateCoefficients(
            np.vstack([matrix, ends]),
            np.concatenate([np.concatenate(low) - offsets, rest]),
            np.concatenate([np.concatenate(high) - offsets, rest]),
        )

    def _violation(self, plan: Array) -> float:
        """Returns the largest violation, as `Solution.violation`."""
        assert self._scene is not None
        rows = row_count(self._scene)
        values, columns = np.empty(rows), np.zeros((rows, SLOPES_A_ROW), dtype=np.int64)
        slopes = np.empty((rows, SLOPES_A_ROW))
        worst = float(np.abs(plan[-1, V:STATE_SIZE]).max())
        for k in range(1, len(plan)):
            stage_rows(self._scene, k, plan[k], values, columns, slopes)
            values[FIRST_DISC_ROW:] *= CLEARANCE_SHARE
            worst = max(worst, -float(values.min()))
        return worst


def _options(iterations: int) -> SolverOptions:
    options = SolverOptions()
    for name, value in {
        "max_iter": iterations,
        "tol": TOLERANCE,
        "bound_push": BOUND_PUSH,
        "bound_frac": BOUND_PUSH,
        # The rows are in parts of their limits already.
        "nlp_scaling_method": "none",
        "spral_scaling": "none",
        "limited_memory_max_history": 10,
        "mu_init": FIRST_BARRIER,
        "max_soc": 0,
        "print_level": 0,
        "sb": "yes",
    }.items():
        options.SetOption(IpoptSolver.id(), name, value)
    return options
