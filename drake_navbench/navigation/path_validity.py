"""Whether a path is free of collisions: the validity service of Nav2's planner server."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION, Costmap, cost_at


def is_path_valid(
    path: NDArray[np.float64],
    costmap: Costmap,
    *,
    footprint: NDArray[np.float64],
    is_circle: bool,
    max_cost: int = LETHAL,
    consider_unknown_as_obstacle: bool = False,
) -> bool:
    """Tells whether the robot could stand at every pose of a path (N, 3) x m, y m, yaw rad.

    footprint: (K, 2) padded, m; is_circle: look at the cell under the centre instead, which is
    blocked from INSCRIBED on. Costs from max_cost on block as well; 0 blocks everything. Unknown
    cells are free unless consider_unknown_as_obstacle; poses off the map are blocked. An empty path
    is not valid.
    """
    if len(path) == 0:
        return False
    blocked_from = min(max_cost, INSCRIBED if is_circle else LETHAL)
    for x, y, yaw in path:
        if is_circle:
            cost = cost_at(costmap.grid, x, y, LETHAL)
        else:
            cost = footprint_cost(costmap.grid, footprint, x, y, yaw, True)
        if cost == NO_INFORMATION:
            cost = LETHAL if consider_unknown_as_obstacle else FREE
        if cost >= blocked_from:
            return False
    return True
