"""Poses seen from the robot."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.angles import wrap


@njit(cache=True)
def to_robot_frame(poses, x, y, yaw):
    """Returns poses (N, 3) x m, y m, yaw rad in the frame of a robot at (x, y) m, yaw rad."""
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    seen = np.empty((poses.shape[0], 3))
    for i in range(poses.shape[0]):
        delta_x, delta_y = poses[i, 0] - x, poses[i, 1] - y
        seen[i, 0] = cos_yaw * delta_x + sin_yaw * delta_y
        seen[i, 1] = cos_yaw * delta_y - sin_yaw * delta_x
        seen[i, 2] = wrap(poses[i, 2] - yaw)
    return seen
