"""The robot as discs on its axis, for clearance rows on the distance field."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Between two discs of a line an obstacle 0.25 m away seems farther by 3 cm at most.
LINE_DISC_SPACING_M = 0.25


def footprint_discs(footprint: Array) -> Array:
    """Returns (D, 2) m: offset along x and radius of the discs that stand for a footprint.

    One disc for an outline no longer than wide, else two of half the width that touch front, rear
    and sides (TEB's two_circles). They leave out the corners, by (sqrt(2) - 1) radii; the
    feasibility check with the true outline does not.
    """
    rear, front = float(footprint[:, 0].min()), float(footprint[:, 0].max())
    radius = 0.5 * float(footprint[:, 1].max() - footprint[:, 1].min())
    if front - rear <= 2.0 * radius:
        centre = 0.5 * (front + rear)
        reach = np.hypot(footprint[:, 0] - centre, footprint[:, 1])
        return np.array([[centre, float(reach.max())]])
    return np.array([[rear + radius, radius], [front - radius, radius]])


def line_discs(ends: Array) -> Array:
    """Returns (D, 2) m: discs on the robot's axis that stand for a line, ends (2, 2) m.

    Their radius is how far the line is from the axis; they lie no farther apart than
    LINE_DISC_SPACING_M.
    """
    rear, front = float(ends[:, 0].min()), float(ends[:, 0].max())
    count = math.ceil((front - rear) / LINE_DISC_SPACING_M) + 1
    offsets = np.linspace(rear, front, count)
    return np.column_stack([offsets, np.full(count, float(np.abs(ends[:, 1]).max()))])
