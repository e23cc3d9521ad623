"""Discs on the robot's axis that cover its outline: the clearance rows of the program."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup

Array = NDArray[np.float64]

COUNT = 5
# The number of points on each edge of the outline by which discs are measured.
POINTS_AN_EDGE = 41
LEAST_WIDTH_M = 1e-3


def covering_discs(setup: ControllerSetup) -> Array:
    """Returns (D, 2) m: offset along x and radius of discs that cover the outline.

    A robot given by its radius has one disc; any other has COUNT discs of equal size, each in the
    middle of an equal part of the length. Raises ValueError for an outline without an area.
    """
    if setup.footprint_is_circle:
        return np.array([[0.0, setup.circumscribed_radius_m]])
    outline = setup.footprint
    extent = np.ptp(outline, axis=0) if len(outline) >= 3 else np.zeros(2)
    if float(extent.min()) < LEAST_WIDTH_M:
        raise ValueError(
            f"footprint: got {outline.tolist()}, which no disc covers; expected an outline of "
            "three or more corners with an area"
        )
    rear, front = float(outline[:, 0].min()), float(outline[:, 0].max())
    offsets = rear + (np.arange(COUNT) + 0.5) * (front - rear) / COUNT
    ends = np.roll(outline, -1, axis=0)
    shares = np.linspace(0.0, 1.0, POINTS_AN_EDGE)[:, None, None]
    points = (outline + shares * (ends - outline)).reshape(-1, 2)
    distances = np.hypot(points[:, :1] - offsets, points[:, 1:])
    # The largest distance of such a point from its nearest disc's centre.
    return np.column_stack([offsets, np.full(COUNT, float(distances.min(axis=1).max()))])


def half_width(setup: ControllerSetup) -> float:
    """Returns the distance from the robot's axis to its farther side, m."""
    return float(np.abs(setup.footprint[:, 1]).max())
