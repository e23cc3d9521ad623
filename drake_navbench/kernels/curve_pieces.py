"""The pieces of a car's curves: arcs of radius 1 and straight lines, up to five in a row.

Arrays `kinds` (5,) hold LEFT, STRAIGHT, RIGHT or NONE, `lengths` (5,) rad of an arc or radii of a
line, negative where it is driven backwards.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TWO_PI = 2.0 * math.pi

LEFT, STRAIGHT, RIGHT, NONE = 1, 0, -1, 2
PIECES = 5
FARTHEST = float(np.finfo(np.float64).max)


@njit(cache=True)
def total_length(lengths):
    """Returns the length of a curve in radii."""
    total = 0.0
    for i in range(PIECES):
        total += abs(lengths[i])
    return total


@njit(cache=True)
def remainder(angle):
    """Returns fmod(angle, 2 pi), at once below two turns, where that is exact."""
    size = abs(angle)
    if size < TWO_PI:
        return angle
    if size < 2.0 * TWO_PI:
        return math.copysign(size - TWO_PI, angle)
    return np.fmod(angle, TWO_PI)
