"""Nav2's simple and its Savitzky-Golay smoother, which go over a path part by part.

Source: nav2_smoother (SimpleSmoother, SavitzkyGolaySmoother), tags 1.1.20, 1.2.10, 1.3.13, 1.4.2
and 1.5.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_smoothing import (
    directional_segments,
    smooth_segment,
    with_headings,
)
from drake_navbench.navigation.smoother import SmoothingError
from drake_navbench.navigation.smoother_parameters import (
    SavitzkyGolaySmootherParameters,
    SimpleSmootherParameters,
)
from drake_navbench.plugins.releases import Release

# The simple smoother leaves shorter parts as they are: index span from the first pose to the last.
MIN_SPAN = 3
MIN_SPAN_UP_TO_IRON = 9
# The Savitzky-Golay smoother does so, too: the span less the window.
LEAST_BEYOND_WINDOW = 2
# The window up to Kilted: cubic, seven points.
FIXED_WEIGHTS = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0


class SimpleSmoother:
    """Relaxes a path. Parts of four poses or fewer, up to Iron of ten, stay as they are.

    Where a point would enter an inscribed or lethal cell, its part keeps the last sweep that was
    free. In Humble all parts share one number of refinements, since Iron each has as many; and in
    Humble the parts behind one whose first pass meets an obstacle stay as they are. Iron refuses a
    path without a smoothed part. Nav2's time limit (SmootherTimedOut) has no counterpart: `max_its`
    bounds the work.
    """

    nav2_plugin = "nav2_smoother::SimpleSmoother"
    Parameters = SimpleSmootherParameters

    def __init__(self, parameters: SimpleSmootherParameters) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad; raises as `copy_and_parts`.

        By Iron's rules it raises SmoothingError where no part is smoothed.
        """
        parameters, release = self._parameters, self._parameters.nav2_release
        smoothed, parts = copy_and_parts(path, is_parted=parameters.enforce_path_inversion)
        least = MIN_SPAN if release >= Release.JAZZY else MIN_SPAN_UP_TO_IRON
        refinements = parameters.refinement_num if parameters.do_refinement else 0
        smoothed_count = 0
        for start, end in parts:
            if end - start <= least:
                continue
            smoothed[start : end + 1], begun, is_cut_short = smooth_segment(
                smoothed[start : end + 1],
                costmap.grid,
                parameters.tolerance,
                parameters.max_its,
                parameters.w_data,
                parameters.w_smooth,
                refinements,
            )
            is_smoothed = begun > 1 or not is_cut_short
            smoothed_count += is_smoothed
            if release is Release.HUMBLE:
                refinements -= begun - 1
                if not is_smoothed:
                    break
        if release is Release.IRON and smoothed_count == 0:
            raise SmoothingError("no part of the path was smoothed")
        return smoothed


class SavitzkyGolaySmoother:
    """Moves each point to the middle of a polynomial through its window; looks at no costmap."""

    nav2_plugin = "nav2_smoother::SavitzkyGolaySmoother"
    Parameters = SavitzkyGolaySmootherParameters

    def __init__(self, parameters: SavitzkyGolaySmootherParameters) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad; raises as `copy_and_parts`."""
        parameters, release = self._parameters, self._parameters.nav2_release
        smoothed, parts = copy_and_parts(path, is_parted=parameters.enforce_path_inversion)
        weights = FIXED_WEIGHTS
        if release >= Release.LYRICAL:
            weights = window_weights(parameters.window_size, parameters.poly_order)
        for start, end in parts:
            if end - start <= len(weights) + LEAST_BEYOND_WINDOW:
                continue
            part = smoothed[start : end + 1]
            for _ in range(1 + (parameters.refinement_num if parameters.do_refinement else 0)):
                if release >= Release.JAZZY:
                    part[1:-1, :2] = _filtered(part[:, :2], weights)[1:-1]
                else:
                    _filter_in_place(part[:, :2], weights)
            part[:] = with_headings(part, is_holonomic=False)
        return smoothed


def copy_and_parts(path: Array, *, is_parted: bool) -> tuple[Array, Sequence[tuple[int, int]]]:
    """Returns a copy of a path (N, 3) and its parts, each as (first, last) index.

    is_parted: a part ends where the robot changes between forward and reverse, which the headings
    tell; otherwise the path is one part. Raises InputError where `path` is no path.
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


def _filter_in_place(points: Array, weights: Array) -> None:
    """Replaces inner points (N, 2) one after another, as up to Iron: each sees those moved before.

    The fourth point from the end is left out, as there.
    """
    last = len(points) - 1
    half = len(weights) // 2
    for i in range(1, last):
        if i != last - half:
            window = points[np.clip(np.arange(i - half, i + half + 1), 0, last)]
            points[i] = _weighted_sum(window, weights)


def _weighted_sum(window: Array, weights: Array) -> Array:
    total = np.zeros(window.shape[1])
    for point, weight in zip(window, weights, strict=True):
        total += weight * point
    return total
