"""Angles in radians."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.arrays import Array

TWO_PI = 2.0 * math.pi


def absolute_turns(start: float | Array, end: float | Array) -> Array:
    """Returns the sizes of the shortest turns from one heading to another, 0 to pi, rad.

    start, end: scalars or arrays, of which NumPy makes one shape.
    """
    turns: Array = np.abs(np.remainder(end - start + math.pi, TWO_PI) - math.pi)
    return turns


@njit(cache=True)
def wrap(angle):
    """Wraps a scalar angle into (-pi, pi]; an angle already inside is returned bit for bit."""
    if -math.pi < angle <= math.pi:
        return angle
    wrapped = np.fmod(angle + math.pi, TWO_PI)
    if wrapped <= 0.0:
        return wrapped + math.pi
    return wrapped - math.pi
