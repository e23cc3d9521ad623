"""Whether the map has a way from one point to another at all, however the robot would turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_navbench.controllers.harmony.detour import cell_of
from drake_navbench.kernels.distance_field import DistanceField


def is_connected(
    field: DistanceField,
    clearance: float,
    longest: float,
    start: NDArray[np.float64],
    end: NDArray[np.float64],
) -> bool:
    """Returns whether cells at least `clearance` m from obstacles lead from a point to another.

    start, end: (2,) m. Cells that share a side are connected. A cell does not count if a way from
    start to end through it is longer than `longest` m at best. The start counts as free, however
    near to obstacles it is; a point off the map is connected with nothing.
    """
    (x, y), (end_x, end_y) = cell_of(field, start), cell_of(field, end)
    if x < 0 or end_x < 0:
        return False
    rows, columns = field.distances.shape
    row, column = np.ogrid[:rows, :columns]
    way = np.hypot(row - y, column - x) + np.hypot(row - end_y, column - end_x)
    is_open = (field.distances >= clearance) & (way <= longest / field.resolution)
    is_open[y, x] = True
    islands, _ = ndimage.label(is_open)
    return bool(islands[end_y, end_x] == islands[y, x])
