"""The check of the averaged trajectory (DefaultOptimalTrajectoryValidator)."""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, cost_at


@njit(cache=True)
def is_trajectory_clear(grid, footprint, poses, checked, consider_footprint):
    """Returns whether the first `checked` of the poses (N, 3) float32 are free of collision.

    grid: `Grid` of uint8 costs. footprint: (K, 2) m in the base frame.
    With `consider_footprint` only a lethal cell under the outline counts, or a vertex off the map;
    without it an inscribed or lethal cell under the centre, and off the map nothing does.
    """
    for t in range(checked):
        x, y = np.float64(poses[t, 0]), np.float64(poses[t, 1])
        if consider_footprint:
            cost = footprint_cost(grid, footprint, x, y, np.float64(poses[t, 2]), True)
            if cost == LETHAL:
                return False
            continue
        cost = cost_at(grid, x, y)
        if cost in (LETHAL, INSCRIBED):
            return False
    return True
