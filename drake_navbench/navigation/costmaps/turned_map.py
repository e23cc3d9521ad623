"""A map that is turned in its frame, on a grid along the axes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drake_navbench.navigation.costmaps.grid_size import require_grid_size

# A corner on the lattice, up to rounding, needs no further cell.
ROUNDING_CELLS = 1e-6


def turned_along_axes(
    occupancy: NDArray[np.int8],
    *,
    resolution: float,
    origin: tuple[float, float, float],
    outside: int,
    source: str,
) -> tuple[NDArray[np.int8], float, float]:
    """Returns (cells, x, y): a turned map on a grid along the axes, and its lower left corner.

    occupancy: (rows, columns), row 0 at the lower edge. origin: x m, y m of the lower left corner
    and yaw rad, counter-clockwise about it. outside: the value of cells that are not on the map.
    Each cell of the result, of the same size, has the map's value at its centre; its lower left
    corner is a multiple of whole cells away from the origin. Raises InputError, which `source`
    begins, where the grid would have too many cells.
    """
    rows, columns = occupancy.shape
    origin_x, origin_y, yaw = origin
    cosine, sine = math.cos(yaw), math.sin(yaw)
    corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], dtype=float)
    turned = corners @ np.array([[cosine, sine], [-sine, cosine]])
    low = np.floor(turned.min(axis=0) + ROUNDING_CELLS).astype(int)
    high = np.ceil(turned.max(axis=0) - ROUNDING_CELLS).astype(int)
    require_grid_size(source, *(high - low))
    # In cells of the turned map: x to the right and y up from the origin, then turned back.
    x = np.arange(low[0], high[0]) + 0.5
    y = (np.arange(low[1], high[1]) + 0.5)[:, None]
    column = np.floor(cosine * x + sine * y).astype(int)
    row = np.floor(cosine * y - sine * x).astype(int)
    is_inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    result = np.full(is_inside.shape, outside, dtype=np.int8)
    result[is_inside] = occupancy[row[is_inside], column[is_inside]]
    return result, origin_x + low[0] * resolution, origin_y + low[1] * resolution
