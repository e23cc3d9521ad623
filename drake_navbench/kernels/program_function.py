"""Numeric functions with analytic derivatives as costs and constraints of a MathematicalProgram.

Drake calls a Python cost or constraint with floats, or with AutoDiffXd where it wants derivatives.
The functions here serve both calls from one kernel that returns value and derivative together.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff

from drake_navbench.kernels.arrays import Array


def cost_function(
    value_and_gradient: Callable[[Array], tuple[float, Array]],
) -> Callable[[np.ndarray], float | AutoDiffXd]:
    """Makes a cost for `AddCost` from a function of (N,) that returns its value and gradient (N,).

    Pass the variables to `AddCost` as well, `vars=...`.
    """

    def cost(variables: np.ndarray) -> float | AutoDiffXd:
        if variables.dtype != object:
            return value_and_gradient(variables)[0]
        value, gradient = value_and_gradient(ExtractValue(variables).ravel())
        return AutoDiffXd(value, _chained(gradient, variables))

    return cost


def constraint_function(
    values_and_jacobian: Callable[[Array], tuple[Array, Array]],
) -> Callable[[np.ndarray], np.ndarray]:
    """Makes a constraint for `AddConstraint` from a function that returns (M,) and (M, N).

    (M,) are the values, (M, N) is their Jacobian.
    """

    def constraint(variables: np.ndarray) -> np.ndarray:
        if variables.dtype != object:
            return values_and_jacobian(variables)[0]
        values, jacobian = values_and_jacobian(ExtractValue(variables).ravel())
        return InitializeAutoDiff(values, _chained(jacobian, variables)).ravel()

    return constraint


@contextmanager
def solver_warnings_off() -> Iterator[None]:
    """Keeps Drake from warning at every solve that meets its iteration limit.

    For programs whose work is bounded by iterations on purpose; the caller looks at the result.
    """
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)


def _chained(slopes: Array, variables: np.ndarray) -> Array:
    """Applies the chain rule: `slopes` by the variables, these by what Drake differentiates by.

    A solver differentiates by the variables themselves, which saves the product.
    """
    outer = ExtractGradient(variables)
    return slopes if _is_identity(outer) else slopes @ outer


def _is_identity(matrix: Array) -> bool:
    size = len(matrix)
    if matrix.shape != (size, size) or np.count_nonzero(matrix) != size:
        return False
    return np.count_nonzero(matrix.diagonal() == 1.0) == size
