"""The last word before a command: the true outline on the costmap along the next poses.

As upstream's isTrajectoryFeasible, with finer steps between the poses.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import FROM_LAST_VERTEX, footprint_cost, pad_footprint
from drake_navbench.kernels.grid import LETHAL, Costmap

# The margin of the outline check: the error of a pose estimate within a cycle, m.
OUTLINE_MARGIN_M = 0.02


@njit(cache=True)
def _first_collision(grid, footprint, reach, poses):
    """Returns the index of the interval in which the outline first meets a lethal cell, or -1.

    Between two poses the outline moves by at most one cell per step. reach: the distance of the
    farthest vertex from the base, m.
    """
    for i in range(poses.shape[0] - 1):
        dx, dy = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        turn = poses[i + 1, 2] - poses[i, 2]
        motion = math.hypot(dx, dy) + abs(turn) * reach
        steps = int(motion / grid.resolution) + 1
        for k in range(steps + 1):
            share = k / steps
            cost = footprint_cost(
                grid,
                footprint,
                poses[i, 0] + share * dx,
                poses[i, 1] + share * dy,
                poses[i, 2] + share * turn,
                FROM_LAST_VERTEX,
            )
            if cost >= LETHAL:
                return i
    return -1


def is_free(costmap: Costmap, footprint: Array, poses: Array) -> bool:
    """Whether the outline keeps off lethal cells, with a margin for the error of the pose.

    poses: (N, 3), the first is the robot's. Where the robot already stands within the margin, the
    bare outline must stay free and the last pose must have the margin again.
    """
    padded = pad_footprint(footprint, OUTLINE_MARGIN_M)
    if first_collision(costmap, padded, poses[[0, 0]]) is None:
        return first_collision(costmap, padded, poses) is None
    leads_out = first_collision(costmap, padded, poses[[-1, -1]]) is None
    return leads_out and first_collision(costmap, footprint, poses) is None


def checked_pose_count(poses: Array, last_index: int, distance_m: float) -> int:
    """Returns the number of poses of a band that the feasibility check covers.

    last_index: feasibility_check_no_poses (negative or too large: all). distance_m:
    feasibility_check_lookahead_distance (not positive: no limit); the smaller of the two holds.
    """
    count = len(poses) if last_index < 0 else min(last_index + 1, len(poses))
    if distance_m > 0.0:
        far = np.hypot(*(poses[:, :2] - poses[0, :2]).T) > distance_m
        if far.any():
            count = min(count, int(np.argmax(far)))
    return max(count, 2)


def first_collision(costmap: Costmap, footprint: Array, poses: Array) -> int | None:
    """Returns the interval in which the outline first meets a lethal cell or leaves the map."""
    reach = float(np.hypot(footprint[:, 0], footprint[:, 1]).max())
    # A copy: for read-only poses the kernel would be compiled once more.
    index = _first_collision(costmap.grid, footprint, reach, poses.copy())
    return None if index < 0 else int(index)
