"""Numeric functions in Drake's calling convention: values, derivatives and the chain rule."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.solvers import IpoptSolver, MathematicalProgram

from drake_navbench.kernels.program_function import (
    constraint_function,
    cost_function,
    solver_warnings_off,
)


def square(z):
    """(x - 1)^2 + (y + 2)^2 and its gradient."""
    offset = z - np.array([1.0, -2.0])
    return float(offset @ offset), 2.0 * offset


def product(z):
    """x y and its Jacobian."""
    return np.array([z[0] * z[1]]), np.array([[z[1], z[0]]])


def test_a_cost_of_floats_is_its_value():
    assert cost_function(square)(np.array([2.0, 0.0])) == 5.0


def test_a_cost_of_autodiff_carries_its_gradient():
    # At (2, 0): 2 (2 - 1) = 2 and 2 (0 + 2) = 4.
    cost = cost_function(square)(InitializeAutoDiff([2.0, 0.0]).ravel())
    assert cost.value() == 5.0
    np.testing.assert_array_equal(cost.derivatives(), [2.0, 4.0])


def test_derivatives_by_something_else_go_through_the_chain_rule():
    # x = s, y = 3 s: d(x y)/ds = y + 3 x = 3 + 3 = 6 and the cost's 2 (1 - 1) + 3 x 2 (3 + 2) = 30.
    by_s = InitializeAutoDiff([1.0, 3.0], np.array([[1.0], [3.0]])).ravel()
    np.testing.assert_array_equal(ExtractGradient(constraint_function(product)(by_s)), [[6.0]])
    assert cost_function(square)(by_s).derivatives() == pytest.approx([30.0])


def test_derivatives_by_the_variables_in_another_order_are_not_taken_for_the_jacobian():
    # x = t and y = s: the slopes y = 5 by x and x = 2 by y change places.
    swapped = InitializeAutoDiff([2.0, 5.0], np.array([[0.0, 1.0], [1.0, 0.0]])).ravel()
    slopes = ExtractGradient(constraint_function(product)(swapped))
    np.testing.assert_array_equal(slopes, [[2.0, 5.0]])


def test_a_constraint_carries_values_and_jacobian():
    values = constraint_function(product)(InitializeAutoDiff([2.0, 5.0]).ravel())
    np.testing.assert_array_equal(ExtractValue(values), [[10.0]])
    np.testing.assert_array_equal(ExtractGradient(values), [[5.0, 2.0]])
    np.testing.assert_array_equal(constraint_function(product)(np.array([2.0, 5.0])), [10.0])


def test_ipopt_solves_a_program_made_of_both():
    # The closest point to (1, -2) with x y = -2 is (1, -2) itself.
    program = MathematicalProgram()
    z = program.NewContinuousVariables(2, "z")
    program.AddCost(cost_function(square), vars=z)
    program.AddConstraint(constraint_function(product), [-2.0], [-2.0], z)
    result = IpoptSolver().Solve(program, np.array([2.0, -2.0]))
    assert result.is_success()
    assert result.get_x_val() == pytest.approx([1.0, -2.0], abs=1e-5)


def test_drakes_logger_is_quiet_for_the_while():
    logger = logging.getLogger("drake")
    before = logger.level
    with solver_warnings_off():
        assert logger.level == logging.ERROR
    assert logger.level == before
