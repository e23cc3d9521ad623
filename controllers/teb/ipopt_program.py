"""A program of cost and constraints as a MathematicalProgram for IPOPT, built once and reused."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import (
    IpoptSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    SolverOptions,
)

from drake_navbench.controllers.teb.interior_point import Bounds
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.program_function import (
    constraint_function,
    cost_function,
    solver_warnings_off,
)

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


class SolverSettings(NamedTuple):
    """IPOPT's settings, in its own words: tol, constr_viol_tol and mu_init.

    The defaults stop about 1 % above the minimum, with the constraints met to 1e-4. That distance
    is the barrier's, which is never lowered; a smaller barrier also drives harder on the
    acceleration limits, with twice the jerk in free space. newton_iterations: iterations of
    Newton's method before IPOPT, at most; where it does not converge, stages follow.
    """

    tolerance: float = 0.3
    violation_tolerance: float = 1e-4
    barrier_start: float = 1e-3
    newton_iterations: int = 50


class IpoptProgram:
    """One program for all solves; its functions read the values that change between solves."""

    def __init__(
        self,
        variable_count: int,
        row_count: int,
        *,
        pattern: NDArray[np.int64],
        objective: Callable[[Array], tuple[float, Array]],
        constraints: Callable[[Array], tuple[Array, Array]],
        settings: SolverSettings,
    ) -> None:
        self._program = MathematicalProgram()
        variables = self._program.NewContinuousVariables(variable_count, "z")
        self._bounds = self._program.AddBoundingBoxConstraint(-1.0, 1.0, variables)
        self._program.AddCost(cost_function(objective), vars=variables)
        self._constraint = self._program.AddConstraint(
            constraint_function(constraints),
            np.zeros(row_count),
            np.zeros(row_count),
            variables,
            "band",
        )
        pairs = [(row, column) for row, column in pattern.tolist()]
        self._constraint.evaluator().SetGradientSparsityPattern(pairs)
        self._solver = IpoptSolver()
        self._options = ipopt_options(settings)

    def solve(
        self, start: Array, bounds: Bounds, *, iterations: int, is_at_minimum: bool
    ) -> MathematicalProgramResult:
        """Optimises a start (N,) by IPOPT.

        is_at_minimum: the start is a minimum of IPOPT's barrier problem.
        """
        self._constraint.evaluator().set_bounds(bounds.row_lower, bounds.row_upper)
        self._bounds.evaluator().set_bounds(bounds.lower, bounds.upper)
        self._options.SetOption(IpoptSolver.id(), "max_iter", iterations)
        # At the barrier's minimum, with the barrier's own multipliers, nothing is left to do.
        multipliers = "mu-based" if is_at_minimum else "constant"
        self._options.SetOption(IpoptSolver.id(), "bound_mult_init_method", multipliers)
        with solver_warnings_off():
            return self._solver.Solve(self._program, start, self._options)


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
