"""Nav2's Savitzky-Golay smoother: each point becomes the middle of a polynomial through its window.

Source: nav2_smoother (SavitzkyGolaySmoother), branch lyrical. In Jazzy and Kilted the window is
always 7 and the order 3. Humble reads points that it has already moved; this smoother does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.errors import InputError
from drake_navbench.kernels.path_smoothing import directional_segments, with_headings
from drake_navbench.navigation.smoother_parameters import SavitzkyGolaySmootherParameters

Array = NDArray[np.float64]
# Shorter parts stay as they are: the span of indices from the first to the last pose, less the
# window.
LEAST_BEYOND_WINDOW = 2


def smooth_path(path: ArrayLike, parameters: SavitzkyGolaySmootherParameters) -> Array:
    """Returns the smoothed path (N, 3) x m, y m, yaw rad; `path` has the same shape.

    The incoming headings tell forward from reverse driving. Short parts stay as they are; obstacles
    have no effect. Raises InputError where `path` is no path.
    """
    smoothed = np.array(path, dtype=np.float64)
    if smoothed.ndim != 2 or smoothed.shape[1] != 3 or len(smoothed) == 0:
        raise InputError(f"path: got an array of shape {smoothed.shape}, expected (N, 3), N >= 1")
    whole = [(0, len(smoothed) - 1)]
    segments = directional_segments(smoothed) if parameters.enforce_path_inversion else whole
    weights = window_weights(parameters.window_size, parameters.poly_order)
    for start, end in segments:
        if end - start <= parameters.window_size + LEAST_BEYOND_WINDOW:
            continue
        part = smoothed[start : end + 1]
        for _ in range(1 + (parameters.refinement_num if parameters.do_refinement else 0)):
            part[1:-1, :2] = _filtered(part[:, :2], weights)[1:-1]
        part[:] = with_headings(part, is_holonomic=False)
    return smoothed


def window_weights(window_size: int, order: int) -> Array:
    """Returns (window_size,) the points' weights in the least-squares value at the middle.

    Numerical Recipes, 14.9: the first row of the pseudo-inverse of the Vandermonde matrix.
    """
    half = window_size // 2
    powers = np.vander(np.arange(-half, half + 1, dtype=float), order + 1, increasing=True)
    orthogonal, upper = np.linalg.qr(powers)
    weights: Array = np.linalg.solve(upper, orthogonal.T)[0]
    return weights


def _filtered(points: Array, weights: Array) -> Array:
    """Returns (N, 2) the weighted sums; beyond an end its point is repeated."""
    half = len(weights) // 2
    padded = np.pad(points, ((half, half), (0, 0)), mode="edge")
    total = np.zeros_like(points)
    for k, weight in enumerate(weights):
        total += weight * padded[k : k + len(points)]
    return total
