"""The residuals of Nav2's constrained smoother with their Jacobian.

Three neighbouring knots P, X, N of a path give six residuals; the objective is half the sum of
their squares. With d1 = X - P, d2 = N - X (d2 and with it N mirrored about X at a cusp, where the
robot turns back), d3 = N - P and D = d1 x d2:

    smoothness (2)  sqrt(w_smooth) (rho (N - X) - (X - P)), rho the ratio of the input's spacings,
                    negative at a cusp
    curvature  (1)  sqrt(w_curve) max(0, k - k_max), k = 2 |D| / (|d1| |d2| |d3|)
    distance   (2)  sqrt(w_dist) (X - X_input)
    cost       (1)  sqrt(w_cost) c(X), or the weighted sum of c at check points fixed to the robot

Gradient of the curvature: dk/dd1 = k ((d2y, -d2x) / D - d1 / |d1|^2), and alike for d2 and d3.
Tangent of the circle through the three knots in X: d1 |d2|^2 + d2 |d1|^2, because the angles
between tangent and chords have sines in the ratio of the chords' lengths.
Source: nav2_constrained_smoother (SmootherCostFunction, arcCenter, tangentDir), Ceres
(BiCubicInterpolator: Catmull-Rom splines).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Grid

# Below this cross product (m^2) three points count as a straight line.
STRAIGHT_CROSS_M2 = 1e-4
# An excess of curvature (1/m) up to this counts as none.
NEGLIGIBLE_CURVATURE = 1e-4

RESIDUALS = 6
# The number of coordinates of the three knots of a triple.
COORDINATES = 6


class KnotProblem(NamedTuple):
    """The inputs of the residuals besides the knots (K, 2): plain values and arrays.

    input_knots: (K, 2) m. spacing_ratios, is_reversing, cost_weights_sqrt: (K - 2,) of the inner
        knots: rho, whether the robot drives backwards after the knot, sqrt of the cost's weight.
    grid: grid of the costmap.
    smooth_sqrt, curve_sqrt, dist_sqrt: square roots of weights. max_curvature: 1/m, may be inf.
    check_points: (Q, 3) x m, y m in the body frame and weight, Q >= 1.
    """

    input_knots: Array
    spacing_ratios: Array
    is_reversing: NDArray[np.bool_]
    cost_weights_sqrt: Array
    grid: Grid
    smooth_sqrt: float
    curve_sqrt: float
    dist_sqrt: float
    max_curvature: float
    check_points: Array


@njit(cache=True)
def _cubic(p0, p1, p2, p3, t):
    """Returns (value, derivative) at t in [0, 1] of the Catmull-Rom spline between p1 and p2."""
    a = 0.5 * (p3 - p0) + 1.5 * (p1 - p2)
    b = p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3
    c = 0.5 * (p2 - p0)
    return p1 + t * (c + t * (b + t * a)), c + t * (2.0 * b + t * 3.0 * a)


@njit(cache=True)
def interpolated_cost(costs, x, y):
    """Returns (value, d/dx, d/dy) of the bicubic interpolation of a grid, cells off it repeated.

    costs: (rows, columns), values at whole x (column) and y (row).
    """
    rows, columns = costs.shape
    column, row = math.floor(x), math.floor(y)
    c0 = min(max(column - 1, 0), columns - 1)
    c1 = min(max(column, 0), columns - 1)
    c2 = min(max(column + 1, 0), columns - 1)
    c3 = min(max(column + 2, 0), columns - 1)
    along_x = np.empty(4)
    slope_x = np.empty(4)
    for k in range(4):
        r = min(max(row - 1 + k, 0), rows - 1)
        along_x[k], slope_x[k] = _cubic(
            float(costs[r, c0]),
            float(costs[r, c1]),
            float(costs[r, c2]),
            float(costs[r, c3]),
            x - column,
        )
    value, slope_y = _cubic(along_x[0], along_x[1], along_x[2], along_x[3], y - row)
    slope, _ = _cubic(slope_x[0], slope_x[1], slope_x[2], slope_x[3], y - row)
    return value, slope, slope_y


@njit(cache=True)
def tangent(d1x, d1y, d2x, d2y):
    """Returns a tangent (x, y), of any length and sign, where chord d1 ends and chord d2 starts.

    It is that of the circle through the three points: along both chords where they are straight,
    across d1 where their sum vanishes.
    """
    if abs(d1x * d2y - d1y * d2x) >= STRAIGHT_CROSS_M2:
        q1, q2 = d1x * d1x + d1y * d1y, d2x * d2x + d2y * d2y
        return d1x * q2 + d2x * q1, d1y * q2 + d2y * q1
    if d1x + d2x == 0.0 and d1y + d2y == 0.0:
        return d1y, -d1x
    return d1x + d2x, d1y + d2y


@njit(cache=True)
def _add_by_chords(by_d1x, by_d1y, by_d2x, by_d2y, sign, row):
    """Adds derivatives by the chords d1 and d2 to a row by (P, X, N); `sign` is -1 at a cusp."""
    row[0] -= by_d1x
    row[1] -= by_d1y
    row[2] += by_d1x - sign * by_d2x
    row[3] += by_d1y - sign * by_d2y
    row[4] += sign * by_d2x
    row[5] += sign * by_d2y


@njit(cache=True)
def _curvature_residual(d1x, d1y, d2x, d2y, sign, max_curvature, weight_sqrt, row):
    """Returns the curvature residual and writes its derivatives by (P, X, N) into `row` (6,)."""
    cross = d1x * d2y - d1y * d2x
    if abs(cross) < STRAIGHT_CROSS_M2:
        return 0.0
    d3x, d3y = d1x + d2x, d1y + d2y
    q1 = d1x * d1x + d1y * d1y
    q2 = d2x * d2x + d2y * d2y
    q3 = d3x * d3x + d3y * d3y
    curvature = 2.0 * abs(cross) / math.sqrt(q1 * q2 * q3)
    excess = curvature - max_curvature
    if excess <= NEGLIGIBLE_CURVATURE:
        return 0.0
    scale = weight_sqrt * curvature
    # d3 = d1 + d2 moves with both.
    _add_by_chords(
        scale * (d2y / cross - d1x / q1 - d3x / q3),
        scale * (-d2x / cross - d1y / q1 - d3y / q3),
        scale * (-d1y / cross - d2x / q2 - d3x / q3),
        scale * (d1x / cross - d2y / q2 - d3y / q3),
        sign,
        row,
    )
    return weight_sqrt * excess


@njit(cache=True)
def _add_by_tangent(bx, by, d1x, d1y, d2x, d2y, sign, row):
    """Adds derivatives (bx, by) by `tangent` to a row by (P, X, N); `sign` is -1 at a cusp."""
    if abs(d1x * d2y - d1y * d2x) >= STRAIGHT_CROSS_M2:
        q1, q2 = d1x * d1x + d1y * d1y, d2x * d2x + d2y * d2y
        b_d1 = 2.0 * (bx * d1x + by * d1y)
        b_d2 = 2.0 * (bx * d2x + by * d2y)
        _add_by_chords(
            q2 * bx + b_d2 * d1x,
            q2 * by + b_d2 * d1y,
            q1 * bx + b_d1 * d2x,
            q1 * by + b_d1 * d2y,
            sign,
            row,
        )
    elif d1x + d2x == 0.0 and d1y + d2y == 0.0:
        _add_by_chords(-by, bx, 0.0, 0.0, sign, row)
    else:
        _add_by_chords(bx, by, bx, by, sign, row)


@njit(cache=True)
def _cost_residual(grid, check_points, knot, steps, sign, is_reversing, weight_sqrt, row):
    """Returns the cost residual of a knot (x, y) and writes its derivatives into `row` (6,).

    steps: (d1x, d1y, d2x, d2y), from the knot before and, times `sign`, to the one after, m.
    """
    x, y = knot
    d1x, d1y, d2x, d2y = steps
    tangent_x, tangent_y = tangent(d1x, d1y, d2x, d2y)
    length = math.hypot(tangent_x, tangent_y)
    if (sign * (d2x * tangent_x + d2y * tangent_y) < 0.0) != is_reversing:
        length = -length
    ux, uy = tangent_x / length, tangent_y / length
    residual, by_ux, by_uy = 0.0, 0.0, 0.0
    for k in range(check_points.shape[0]):
        ahead, aside = check_points[k, 0], check_points[k, 1]
        factor = weight_sqrt * check_points[k, 2]
        value, slope_x, slope_y = interpolated_cost(
            grid.costs,
            (x + ahead * ux - aside * uy - grid.origin_x) / grid.resolution - 0.5,
            (y + ahead * uy + aside * ux - grid.origin_y) / grid.resolution - 0.5,
        )
        residual += factor * value
        slope_x *= factor / grid.resolution
        slope_y *= factor / grid.resolution
        row[2] += slope_x
        row[3] += slope_y
        by_ux += ahead * slope_x + aside * slope_y
        by_uy += ahead * slope_y - aside * slope_x
    # Only the part across the unit tangent turns it.
    across = (by_uy * ux - by_ux * uy) / length
    _add_by_tangent(-uy * across, ux * across, d1x, d1y, d2x, d2y, sign, row)
    return residual


@njit(cache=True)
def _fill_residuals(knots, problem, residuals, jacobian):
    """Writes the results of `residuals_and_jacobian` into zeroed arrays."""
    smooth_sqrt, dist_sqrt = problem.smooth_sqrt, problem.dist_sqrt
    input_knots = problem.input_knots
    for k in range(residuals.shape[0]):
        ratio = problem.spacing_ratios[k]
        sign = -1.0 if ratio < 0.0 else 1.0
        x, y = knots[k + 1, 0], knots[k + 1, 1]
        d1x, d1y = x - knots[k, 0], y - knots[k, 1]
        step_x, step_y = knots[k + 2, 0] - x, knots[k + 2, 1] - y
        residuals[k, 0] = smooth_sqrt * (ratio * step_x - d1x)
        residuals[k, 1] = smooth_sqrt * (ratio * step_y - d1y)
        residuals[k, 3] = dist_sqrt * (x - input_knots[k + 1, 0])
        residuals[k, 4] = dist_sqrt * (y - input_knots[k + 1, 1])
        for i in range(2):
            jacobian[k, i, i] = smooth_sqrt
            jacobian[k, i, 2 + i] = -smooth_sqrt * (1.0 + ratio)
            jacobian[k, i, 4 + i] = smooth_sqrt * ratio
            jacobian[k, 3 + i, 2 + i] = dist_sqrt
        d2x, d2y = sign * step_x, sign * step_y
        residuals[k, 2] = _curvature_residual(
            d1x, d1y, d2x, d2y, sign, problem.max_curvature, problem.curve_sqrt, jacobian[k, 2]
        )
        residuals[k, 5] = _cost_residual(
            problem.grid,
            problem.check_points,
            (x, y),
            (d1x, d1y, d2x, d2y),
            sign,
            problem.is_reversing[k],
            problem.cost_weights_sqrt[k],
            jacobian[k, 5],
        )


def residuals_and_jacobian(knots: Array, problem: KnotProblem) -> tuple[Array, Array]:
    """Returns residuals (K - 2, 6) and their Jacobian (K - 2, 6, 6).

    knots: (K, 2) m. Row k belongs to the neighbours k, k + 1 and k + 2: the last axis of the
    Jacobian are their coordinates x, y, x, y, x, y.
    """
    residuals = np.zeros((len(knots) - 2, RESIDUALS))
    jacobian = np.zeros((len(knots) - 2, RESIDUALS, COORDINATES))
    _fill_residuals(np.ascontiguousarray(knots), problem, residuals, jacobian)
    return residuals, jacobian


def value_and_gradient(knots: Array, problem: KnotProblem) -> tuple[float, Array]:
    """Returns half the sum of squared residuals and its gradient (K, 2) by the knots (K, 2)."""
    residuals, jacobian = residuals_and_jacobian(knots, problem)
    by_triple = np.einsum("ki,kij->kj", residuals, jacobian)
    gradient = np.zeros(np.shape(knots))
    gradient[:-2] += by_triple[:, 0:2]
    gradient[1:-1] += by_triple[:, 2:4]
    gradient[2:] += by_triple[:, 4:6]
    return 0.5 * float(np.sum(residuals * residuals)), gradient


def gauss_newton_hessian(knots: Array, problem: KnotProblem) -> Array:
    """Returns (2 K, 2 K) J^T J of all residuals by the knots' coordinates, x and y in turn."""
    _, jacobian = residuals_and_jacobian(knots, problem)
    hessian = np.zeros((np.size(knots), np.size(knots)))
    for k, block in enumerate(jacobian):
        mine = slice(2 * k, 2 * k + COORDINATES)
        hessian[mine, mine] += block.T @ block
    return hessian
