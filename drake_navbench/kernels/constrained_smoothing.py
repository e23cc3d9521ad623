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

# Below this cross product (m^2) three points count as a straight line.
STRAIGHT_CROSS_M2 = 1e-4
# An excess of curvature (1/m) up to this counts as none.
NEGLIGIBLE_CURVATURE = 1e-4

RESIDUALS = 6
COLUMNS = 6


class KnotProblem(NamedTuple):
    """What the residuals need besides the knots (K, 2) themselves; plain values and arrays.

    input_knots: (K, 2) m. spacing_ratios, is_reversing, cost_weights_sqrt: (K - 2,) of the inner
        knots: rho, whether the robot drives backwards after the knot, sqrt of the cost's weight.
    costs, origin_x, origin_y, resolution: the costmap.
    smooth_sqrt, curve_sqrt, dist_sqrt: square roots of weights. max_curvature: 1/m, may be inf.
    check_points: (Q, 3) x m, y m in the body frame and weight; Q = 0 takes the knot itself.
    """

    input_knots: NDArray[np.float64]
    spacing_ratios: NDArray[np.float64]
    is_reversing: NDArray[np.bool_]
    cost_weights_sqrt: NDArray[np.float64]
    costs: NDArray[np.uint8]
    origin_x: float
    origin_y: float
    resolution: float
    smooth_sqrt: float
    curve_sqrt: float
    dist_sqrt: float
    max_curvature: float
    check_points: NDArray[np.float64]


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
    along_x = np.empty(4)
    slope_x = np.empty(4)
    for k in range(4):
        r = min(max(row - 1 + k, 0), rows - 1)
        c0 = min(max(column - 1, 0), columns - 1)
        c1 = min(max(column, 0), columns - 1)
        c2 = min(max(column + 1, 0), columns - 1)
        c3 = min(max(column + 2, 0), columns - 1)
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

    That of the circle through the three points; along the chord of both where they are straight,
    across d1 where that vanishes.
    """
    if abs(d1x * d2y - d1y * d2x) >= STRAIGHT_CROSS_M2:
        q1, q2 = d1x * d1x + d1y * d1y, d2x * d2x + d2y * d2y
        return d1x * q2 + d2x * q1, d1y * q2 + d2y * q1
    if d1x + d2x == 0.0 and d1y + d2y == 0.0:
        return d1y, -d1x
    return d1x + d2x, d1y + d2y


@njit(cache=True)
def _tangent_jacobian(d1, d2):
    """Returns (2, 4): derivatives of `tangent` by (d1x, d1y, d2x, d2y)."""
    jacobian = np.zeros((2, 4))
    if abs(d1[0] * d2[1] - d1[1] * d2[0]) >= STRAIGHT_CROSS_M2:
        q1, q2 = d1[0] ** 2 + d1[1] ** 2, d2[0] ** 2 + d2[1] ** 2
        for i in range(2):
            for j in range(2):
                jacobian[i, j] = 2.0 * d2[i] * d1[j]
                jacobian[i, 2 + j] = 2.0 * d1[i] * d2[j]
            jacobian[i, i] += q2
            jacobian[i, 2 + i] += q1
    elif d1[0] + d2[0] == 0.0 and d1[1] + d2[1] == 0.0:
        jacobian[0, 1], jacobian[1, 0] = 1.0, -1.0
    else:
        for i in range(2):
            jacobian[i, i] = jacobian[i, 2 + i] = 1.0
    return jacobian


@njit(cache=True)
def _by_knots(by_d1, by_d2, sign, row):
    """Adds derivatives by d1 and d2 (each (2,)) to a row by (P, X, N); `sign` is -1 at a cusp."""
    for i in range(2):
        row[i] -= by_d1[i]
        row[2 + i] += by_d1[i] - sign * by_d2[i]
        row[4 + i] += sign * by_d2[i]


@njit(cache=True)
def _curvature_residual(d1, d2, sign, max_curvature, weight_sqrt, row):
    """Returns the curvature residual and writes its derivatives by (P, X, N) into `row` (6,)."""
    cross = d1[0] * d2[1] - d1[1] * d2[0]
    if abs(cross) < STRAIGHT_CROSS_M2:
        return 0.0
    d3 = d1 + d2
    q1 = d1[0] ** 2 + d1[1] ** 2
    q2 = d2[0] ** 2 + d2[1] ** 2
    q3 = d3[0] ** 2 + d3[1] ** 2
    curvature = 2.0 * abs(cross) / math.sqrt(q1 * q2 * q3)
    excess = curvature - max_curvature
    if excess <= NEGLIGIBLE_CURVATURE:
        return 0.0
    scale = weight_sqrt * curvature
    by_d1 = np.array([d2[1] / cross - d1[0] / q1, -d2[0] / cross - d1[1] / q1])
    by_d2 = np.array([-d1[1] / cross - d2[0] / q2, d1[0] / cross - d2[1] / q2])
    # d3 = d1 + d2 moves with both.
    _by_knots(scale * (by_d1 - d3 / q3), scale * (by_d2 - d3 / q3), sign, row)
    return weight_sqrt * excess


@njit(cache=True)
def _cost_residual(problem, knot, d1, d2, sign, is_reversing, weight_sqrt, row):
    """Returns the cost residual and writes its derivatives by (P, X, N) into `row` (6,)."""
    to_cells = 1.0 / problem.resolution
    if problem.check_points.shape[0] == 0:
        x = (knot[0] - problem.origin_x) * to_cells - 0.5
        y = (knot[1] - problem.origin_y) * to_cells - 0.5
        value, slope_x, slope_y = interpolated_cost(problem.costs, x, y)
        row[2] += weight_sqrt * slope_x * to_cells
        row[3] += weight_sqrt * slope_y * to_cells
        return weight_sqrt * value
    tangent_x, tangent_y = tangent(d1[0], d1[1], d2[0], d2[1])
    length = math.hypot(tangent_x, tangent_y)
    if (sign * (d2[0] * tangent_x + d2[1] * tangent_y) < 0.0) != is_reversing:
        length = -length
    ux, uy = tangent_x / length, tangent_y / length
    residual = 0.0
    by_u = np.zeros(2)
    for k in range(problem.check_points.shape[0]):
        ahead, aside, share = problem.check_points[k]
        x = (knot[0] + ahead * ux - aside * uy - problem.origin_x) * to_cells - 0.5
        y = (knot[1] + ahead * uy + aside * ux - problem.origin_y) * to_cells - 0.5
        value, slope_x, slope_y = interpolated_cost(problem.costs, x, y)
        factor = weight_sqrt * share
        residual += factor * value
        slope_x *= factor * to_cells
        slope_y *= factor * to_cells
        row[2] += slope_x
        row[3] += slope_y
        by_u[0] += ahead * slope_x + aside * slope_y
        by_u[1] += ahead * slope_y - aside * slope_x
    # Only the part across the unit tangent turns it.
    across = (by_u[1] * ux - by_u[0] * uy) / length
    by_tangent = np.array([-uy * across, ux * across])
    by_chords = by_tangent @ _tangent_jacobian(d1, d2)
    _by_knots(by_chords[:2], by_chords[2:], sign, row)
    return residual


@njit(cache=True)
def residuals_and_jacobian(knots, problem):
    """Returns residuals (K - 2, 6) and their Jacobian (K - 2, 6, 6) by (P, X, N) of each triple.

    knots: (K, 2) m. problem: a KnotProblem.
    """
    count = knots.shape[0] - 2
    residuals = np.zeros((count, RESIDUALS))
    jacobian = np.zeros((count, RESIDUALS, COLUMNS))
    for k in range(count):
        ratio = problem.spacing_ratios[k]
        sign = -1.0 if ratio < 0.0 else 1.0
        d1 = knots[k + 1] - knots[k]
        step = knots[k + 2] - knots[k + 1]
        d2 = sign * step
        for i in range(2):
            residuals[k, i] = problem.smooth_sqrt * (ratio * step[i] - d1[i])
            jacobian[k, i, i] = problem.smooth_sqrt
            jacobian[k, i, 2 + i] = -problem.smooth_sqrt * (1.0 + ratio)
            jacobian[k, i, 4 + i] = problem.smooth_sqrt * ratio
            moved = knots[k + 1, i] - problem.input_knots[k + 1, i]
            residuals[k, 3 + i] = problem.dist_sqrt * moved
            jacobian[k, 3 + i, 2 + i] = problem.dist_sqrt
        residuals[k, 2] = _curvature_residual(
            d1, d2, sign, problem.max_curvature, problem.curve_sqrt, jacobian[k, 2]
        )
        residuals[k, 5] = _cost_residual(
            problem,
            knots[k + 1],
            d1,
            d2,
            sign,
            problem.is_reversing[k],
            problem.cost_weights_sqrt[k],
            jacobian[k, 5],
        )
    return residuals, jacobian


@njit(cache=True)
def value_and_gradient(knots, problem):
    """Returns half the sum of squared residuals and its gradient (K, 2) by the knots."""
    residuals, jacobian = residuals_and_jacobian(knots, problem)
    gradient = np.zeros_like(knots)
    value = 0.0
    for k in range(residuals.shape[0]):
        for i in range(RESIDUALS):
            r = residuals[k, i]
            value += 0.5 * r * r
            for j in range(COLUMNS):
                gradient[k + j // 2, j % 2] += r * jacobian[k, i, j]
    return value, gradient


@njit(cache=True)
def gauss_newton_hessian(knots, problem):
    """Returns (2 K, 2 K) J^T J of all residuals by the knots' coordinates, x and y in turn."""
    _, jacobian = residuals_and_jacobian(knots, problem)
    size = 2 * knots.shape[0]
    hessian = np.zeros((size, size))
    for k in range(jacobian.shape[0]):
        start = 2 * k
        for i in range(COLUMNS):
            for j in range(COLUMNS):
                total = 0.0
                for r in range(RESIDUALS):
                    total += jacobian[k, r, i] * jacobian[k, r, j]
                hessian[start + i, start + j] += total
    return hessian
