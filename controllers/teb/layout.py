"""The places of a band's variables and constraint rows in the program's vectors.

A band of n poses has m = n - 1 intervals; its first and last pose are given. Variables, in order:
m time steps, then x, y and yaw of the n - 2 inner poses, then one slack of the clearance rows.
Rows, in order: m arc, m speed, m turn rate, m + 1 acceleration, m + 1 angular acceleration, and
n - 2 clearance rows for each disc of the robot, as many again where something moves, and for a car
twice m turning rows. Row k of the accelerations is the change of speed into interval k: row 0
starts from the twist that the band starts with, row m ends in the final one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.kernels.arrays import Array

VARIABLES_PER_POSE = 3


@njit(cache=True)
def variable_count(interval_count):
    """Returns N, the number of variables of a band with m intervals."""
    return interval_count + VARIABLES_PER_POSE * (interval_count - 1) + 1


@njit(cache=True)
def row_count(interval_count, disc_count, is_car=False, meets_moving=False):
    """Returns the number of constraint rows of a band with m intervals."""
    m = interval_count
    clearances = disc_count * (m - 1) * (2 if meets_moving else 1)
    return 3 * m + 2 * (m + 1) + clearances + (2 * m if is_car else 0)


@njit(cache=True)
def pose_columns(i, interval_count):
    """Returns the columns (x, y, yaw) of pose i, or (-1, -1, -1) for the given first and last."""
    if i == 0 or i == interval_count:
        return -1, -1, -1
    inner_count = interval_count - 1
    column = interval_count + i - 1
    return column, column + inner_count, column + 2 * inner_count


@njit(cache=True)
def unpack_poses(z, start, goal, interval_count):
    """Returns (n, 3) poses: the start, the inner poses held in z, the goal."""
    inner_count = interval_count - 1
    poses = np.empty((interval_count + 1, 3))
    for axis in range(3):
        poses[0, axis] = start[axis]
        poses[interval_count, axis] = goal[axis]
    for i in range(1, interval_count):
        column = interval_count + i - 1
        poses[i, 0] = z[column]
        poses[i, 1] = z[column + inner_count]
        poses[i, 2] = z[column + 2 * inner_count]
    return poses


def pack_band(poses: Array, time_steps: Array, slack_m: float) -> Array:
    """Returns (N,) the variables of a band: poses (n, 3), time_steps (m,) s, clearance slack m."""
    return np.concatenate([time_steps, poses[1:-1].T.ravel(), [slack_m]])


def row_slices(
    interval_count: int, disc_count: int, is_car: bool = False, meets_moving: bool = False
) -> dict[str, slice]:
    """Returns the rows of each kind by name, in the order of the constraint vector."""
    m = interval_count
    lengths = {
        "arc": m,
        "speed": m,
        "turn_rate": m,
        "acceleration": m + 1,
        "angular_acceleration": m + 1,
        "clearance": disc_count * (m - 1),
        "moving_clearance": disc_count * (m - 1) if meets_moving else 0,
        "turning": 2 * m if is_car else 0,
    }
    slices, first = {}, 0
    for name, length in lengths.items():
        slices[name] = slice(first, first + length)
        first += length
    return slices
