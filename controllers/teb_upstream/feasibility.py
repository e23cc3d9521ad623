"""The check of a band's next poses with the true outline (isTrajectoryFeasible)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.teb_upstream.band import normalize
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import FROM_LAST_VERTEX, footprint_cost
from drake_navbench.kernels.grid import LETHAL, Costmap


def is_feasible(
    costmap: Costmap,
    footprint: Array,
    poses: Array,
    *,
    last_index: int,
    distance_m: float,
    inscribed_radius_m: float,
    angular_resolution: float,
) -> bool:
    """Whether the outline keeps off lethal and unknown cells and on the map.

    last_index: feasibility_check_no_poses; negative or too large: all. distance_m:
    feasibility_check_lookahead_distance; where it is positive and a pose is farther, it replaces
    the index, as in the original. The angular resolution is in rad.
    """
    last = last_index if 0 <= last_index < len(poses) else len(poses) - 1
    if distance_m > 0.0:
        far = np.hypot(*(poses[:, :2] - poses[0, :2]).T) > distance_m
        if far.any():
            last = int(np.argmax(far)) - 1
    return bool(
        _outline_is_free(
            costmap.grid, footprint, poses[: last + 1], inscribed_radius_m, angular_resolution
        )
    )


@njit(cache=True, error_model="numpy")
def _outline_is_free(grid, footprint, poses, inscribed_radius, angular_resolution):
    """Checks poses (K, 3) and poses between those farther apart than the robot is wide."""
    for i in range(poses.shape[0]):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        if footprint_cost(grid, footprint, x, y, yaw, FROM_LAST_VERTEX) >= LETHAL:
            return False
        if i == poses.shape[0] - 1:
            break
        turn = normalize(normalize(poses[i + 1, 2]) - normalize(yaw))
        dx, dy = poses[i + 1, 0] - x, poses[i + 1, 1] - y
        distance = math.sqrt(dx * dx + dy * dy)
        if abs(turn) <= angular_resolution and distance <= inscribed_radius:
            continue
        steps = max(
            math.ceil(abs(turn) / angular_resolution), math.ceil(distance / inscribed_radius)
        )
        for _ in range(int(steps) - 1):
            x += dx / steps
            y += dy / steps
            yaw = normalize(yaw + turn / steps)
            if footprint_cost(grid, footprint, x, y, yaw, FROM_LAST_VERTEX) >= LETHAL:
                return False
    return True
