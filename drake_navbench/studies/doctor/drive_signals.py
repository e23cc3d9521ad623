"""Pieces, turning points and the start of a drive's signals, which several measures take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.studies.doctor.drives import Array, Drive

# A swing of the heading so small nobody sees, rad.
SEEN_RAD = 0.05
# What counts as at the goal beyond its tolerance, m.
NEAR_GOAL_M = 0.6


def pieces(where: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Returns the indices of each run of samples without a gap."""
    index = np.flatnonzero(where)
    return np.split(index, np.flatnonzero(np.diff(index) > 1) + 1) if len(index) else []


def turning_points(values: Array, least: float = SEEN_RAD) -> list[float]:
    """Returns the extremes of a signal that differ by more than `least`, one after another."""
    if len(values) == 0:
        return []
    extremes, low, high, rising = [float(values[0])], values[0], values[0], 0
    for value in values[1:]:
        low, high = min(low, value), max(high, value)
        if rising <= 0 and value - low > least:
            extremes.append(float(low))
            rising, high = 1, value
        elif rising >= 0 and high - value > least:
            extremes.append(float(high))
            rising, low = -1, value
        if rising > 0:
            low = high
        elif rising < 0:
            high = low
    return extremes


def moved_at(d: Drive) -> int:
    """The index of the first sample with the robot moved or turned; of samples their number."""
    moved = np.hypot(*(d.xy_m - d.xy_m[0]).T) > 0.1
    turned = np.abs(d.yaw_rad - d.yaw_rad[0]) > 0.25
    found = np.flatnonzero(moved | turned)
    return int(found[0]) if len(found) else len(d.time_s)
