"""Nav2's standalone simple smoother: relaxes a whole plan, part by part between its turns back.

Source: nav2_smoother (SimpleSmoother).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.errors import InputError
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_smoothing import (
    MIN_SPAN_OF_SEGMENT,
    directional_segments,
    smooth_segment,
)
from drake_navbench.navigation.smoother_parameters import SimpleSmootherParameters


def smooth_path(
    path: ArrayLike, costmap: Costmap, parameters: SimpleSmootherParameters
) -> NDArray[np.float64]:
    """Returns the smoothed path (N, 3) x m, y m, yaw rad; `path` has the same shape.

    The incoming headings tell forward from reverse driving, so they must mean something. Parts of
    four poses or fewer stay as they are. Where a point would enter an inscribed or lethal cell, its
    part keeps the last sweep that was free. Nav2's time limit (SmootherTimedOut) has no
    counterpart: `max_its` bounds the work. Raises InputError where `path` is no path.
    """
    smoothed = np.array(path, dtype=np.float64)
    if smoothed.ndim != 2 or smoothed.shape[1] != 3 or len(smoothed) == 0:
        raise InputError(f"path: got an array of shape {smoothed.shape}, expected (N, 3), N >= 1")
    whole = [(0, len(smoothed) - 1)]
    segments = directional_segments(smoothed) if parameters.enforce_path_inversion else whole
    for start, end in segments:
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
