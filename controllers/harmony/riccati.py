"""Solves the linear-quadratic problem of a Newton step by a Riccati recursion over the stages."""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.motion import STAGE_SIZE, STATE_SIZE


@njit(cache=True, error_model="numpy")
def feedback_gains(hessians, gradients, slopes, damping, offsets, gains):
    """Fills offsets (N, 2) and gains (N, 2, 7): the step of the inputs is offset + gain @ step.

    hessians (N + 1, 9, 9) symmetric, gradients (N + 1, 9): of the stages. slopes: (N, 7, 9) of
    each step. damping: added to the second derivatives by the inputs. Returns the change of the
    quadratic model that the step predicts, and whether each problem of the inputs was convex.
    """
    count = slopes.shape[0]
    n, full = STATE_SIZE, STAGE_SIZE
    value = hessians[count, :n, :n].copy()
    slope = gradients[count, :n].copy()
    product = np.empty((n, full))
    matrix, vector = np.empty((full, full)), np.empty(full)
    predicted = 0.0
    for k in range(count - 1, -1, -1):
        f = slopes[k]
        for i in range(n):
            for j in range(full):
                total = 0.0
                for m in range(n):
                    total += value[i, m] * f[m, j]
                product[i, j] = total
        for i in range(full):
            total = gradients[k, i]
            for m in range(n):
                total += f[m, i] * slope[m]
            vector[i] = total
            for j in range(i, full):
                total = hessians[k, i, j]
                for m in range(n):
                    total += f[m, i] * product[m, j]
                matrix[i, j] = total
                matrix[j, i] = total
        a, b, d = matrix[n, n] + damping, matrix[n, n + 1], matrix[n + 1, n + 1] + damping
        determinant = a * d - b * b
        if a <= 0.0 or determinant <= 0.0:
            return predicted, False
        u0, u1 = vector[n], vector[n + 1]
        offsets[k, 0] = -(d * u0 - b * u1) / determinant
        offsets[k, 1] = -(a * u1 - b * u0) / determinant
        predicted += 0.5 * (offsets[k, 0] * u0 + offsets[k, 1] * u1)
        for j in range(n):
            m0, m1 = matrix[n, j], matrix[n + 1, j]
            gains[k, 0, j] = -(d * m0 - b * m1) / determinant
            gains[k, 1, j] = -(a * m1 - b * m0) / determinant
        for i in range(n):
            slope[i] = vector[i] + matrix[i, n] * offsets[k, 0] + matrix[i, n + 1] * offsets[k, 1]
            for j in range(i, n):
                total = matrix[i, j] + matrix[i, n] * gains[k, 0, j]
                total += matrix[i, n + 1] * gains[k, 1, j]
                value[i, j] = total
                value[j, i] = total
    return predicted, True
