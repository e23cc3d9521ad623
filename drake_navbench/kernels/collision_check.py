"""Collisions at a pose on a costmap, and the distance that a cost stands for."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, OFF_MAP, cost_at

# Nav2 takes this logarithm in single precision, and of INSCRIBED, not of the largest inflated cost.
LOG_INSCRIBED = float(np.log(np.float32(INSCRIBED)))


@njit(cache=True)
def distance_from_cost(cost, inscribed_radius, cost_scaling_factor):
    """Returns the distance from the robot's centre to an obstacle, by the inflated cost there, m.

    cost: 1..254. inscribed_radius: inscribed radius of the padded footprint, m.
    cost_scaling_factor: decay of the inflation layer, 1/m, above 0. Inverts the decay as Nav2's
    controllers do (RPP's costConstraint, MPPI's ObstaclesCritic): they start it at 253, the
    inflation layer at 252.
    """
    return (
        cost_scaling_factor * inscribed_radius - math.log(cost) + LOG_INSCRIBED
    ) / cost_scaling_factor


@njit(cache=True)
def is_pose_in_collision(grid, tracks_unknown, footprint, x, y, yaw):
    """Tells whether a footprint (K, 2) m at a pose touches a lethal cell.

    Its outline counts as lethal off the map, and on unknown cells unless the costmap tracks them. A
    pose whose centre is off the map counts as free. Source: RPP's CollisionChecker::inCollision.
    """
    if cost_at(grid, x, y) == OFF_MAP:
        return False
    cost = footprint_cost(grid, footprint, x, y, yaw, True)
    if cost == NO_INFORMATION and tracks_unknown:
        return False
    return cost >= LETHAL
