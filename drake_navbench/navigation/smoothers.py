"""Nav2's simple and its Savitzky-Golay smoother, which go over a path part by part.

Source: nav2_smoother (SimpleSmoother; SavitzkyGolaySmoother, branch lyrical). In Jazzy and Kilted
the window of the latter is always 7 and the order 3. Humble reads points that it has already moved;
that is not here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_smoothing import (
    MIN_SPAN_OF_SEGMENT,
    directional_segments,
    smooth_segment,
    with_headings,
)
from drake_navbench.navigation.smoother_parameters import (
    SavitzkyGolaySmootherParameters,
    SimpleSmootherParameters,
)

# The Savitzky-Golay smoother leaves shorter parts as they are: index span from the first pose to
# the last, less the window.
LEAST_BEYOND_WINDOW = 2


class SimpleSmoother:
    """Relaxes a path. Parts of four poses or fewer stay as they are.

    Where a point would enter an inscribed or lethal cell, its part keeps the last sweep that was
    free. Nav2's time limit (SmootherTimedOut) has no counterpart: `max_its` bounds the work.
    """

    nav2_plugin = "nav2_smoother::SimpleSmoother"
    Parameters = SimpleSmootherParameters

    def __init__(self, parameters: SimpleSmootherParameters) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad; raises as `copy_and_parts`."""
        parameters = self._parameters
        smoothed, parts = copy_and_parts(path, is_parted=parameters.enforce_path_inversion)
        for start, end in parts:
            if end - start <= MIN_SPAN_OF_SEGMENT:
                continue
            smoothed[start : end + 1] = smooth_segment(
                smoothed[start : end + 1],
                costmap.grid,
                parameters.tolerance,
                parameters.max_its,
                parameters.w_data,
                parameters.w_smooth,
                parameters.refinement_num if parameters.do_refinement else 0,
            )
        return smoothed


class SavitzkyGolaySmoother:
    """Moves each point to the middle of a polynomial through its window; looks at no costmap."""

    nav2_plugin = "nav2_smoother::SavitzkyGolaySmoother"
    Parameters = SavitzkyGolaySmootherParameters

    def __init__(self, parameters: SavitzkyGolaySmootherParameters) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad; raises as `copy_and_parts`."""
        parameters = self._parameters
        smoothed, parts = copy_and_parts(path, is_parted=parameters.enforce_path_inversion)
        weights = window_weights(parameters.window_size, parameters.poly_order)
        for start, end in parts:
            if end - start <= parameters.window_size + LEAST_BEYOND_WINDOW:
                continue
            part = smoothed[start : end + 1]
            for _ in range(1 + (parameters.refinement_num if parameters.do_refinement else 0)):
                part[1:-1, :2] = _filtered(part[:, :2], weights)[1:-1]
            part[:] = with_headings(part, is_holonomic=False)
        return smoothed


def copy_and_parts(path: Array, *, is_parted: bool) -> tuple[Array, Sequence[tuple[int, int]]]:
    """Returns a copy of a path (N, 3) and its parts from one turn back to the next, by indices.

    The headings tell forward from reverse driving, so they must mean something. Raises InputError
    where `path` is no path.
    """
    copy = np.array(path, dtype=np.float64)
    if copy.ndim != 2 or copy.shape[1] != 3 or len(copy) == 0:
        raise InputError(f"path: got an array of shape {copy.shape}, expected (N, 3), N >= 1")
    return copy, directional_segments(copy) if is_parted else [(0, len(copy) - 1)]


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
