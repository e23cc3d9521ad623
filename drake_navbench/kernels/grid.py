"""The costmap grid: cost values, cell arithmetic and the line that Nav2 walks over cells.

Arrays are `[row = y, column = x]`; the origin is the lower left corner of cell (0, 0).
Source: Nav2's nav2_costmap_2d (Costmap2D::worldToMap, raytraceLine, LineIterator).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FREE = 0
MAX_NON_OBSTACLE = 252
INSCRIBED = 253
LETHAL = 254
NO_INFORMATION = 255

# The default result of `cost_at` for a point off the map.
OFF_MAP = -1


class Grid(NamedTuple):
    """A grid of cells with its place and resolution, in the form that kernels take.

    costs: (rows, columns) the cells' values. origin_x, origin_y: lower left corner of cell
    (0, 0), m. resolution: edge of a cell, m.
    """

    costs: NDArray[Any]
    origin_x: float
    origin_y: float
    resolution: float


@dataclass(frozen=True, slots=True, eq=False)
class Costmap:
    """An immutable snapshot of a costmap.

    costs: (rows, columns) uint8, C-contiguous, read-only.
    origin_x, origin_y: world position of the lower left corner of cell (0, 0), m.
    resolution: edge of a cell, m.
    tracks_unknown: whether NO_INFORMATION means "not seen" (else it does not occur).
    stamp_s: time of the update that made it, s.
    is_current: whether all of its layers have got their data.
    """

    costs: NDArray[np.uint8]
    origin_x: float
    origin_y: float
    resolution: float
    tracks_unknown: bool = False
    stamp_s: float = 0.0
    is_current: bool = True
    grid: Grid = field(init=False, repr=False)
    _lethal_centres: NDArray[np.float64] | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        costs = np.ascontiguousarray(self.costs, dtype=np.uint8)
        if costs is self.costs and costs.flags.writeable:
            costs = costs.copy()
        costs.flags.writeable = False
        object.__setattr__(self, "costs", costs)
        place = (float(self.origin_x), float(self.origin_y), float(self.resolution))
        object.__setattr__(self, "grid", Grid(costs, *place))

    def __deepcopy__(self, memo: dict[int, Any]) -> Costmap:
        """Returns itself: a snapshot never changes, so Drake's state copies cost nothing."""
        return self

    @property
    def lethal_centres(self) -> NDArray[np.float64]:
        """(N, 2) centres of the lethal cells, m, row by row; read-only.

        They are computed at the first read; those of a global costmap are never read.
        """
        if self._lethal_centres is None:
            object.__setattr__(self, "_lethal_centres", _lethal_centres(self.grid))
        assert self._lethal_centres is not None
        return self._lethal_centres

    @property
    def size_x_m(self) -> float:
        """Extent along x, m."""
        return self.costs.shape[1] * self.resolution

    @property
    def size_y_m(self) -> float:
        """Extent along y, m."""
        return self.costs.shape[0] * self.resolution

    @property
    def nav2_size_m(self) -> tuple[float, float]:
        """Extents along x and y as Nav2's getSizeInMeters gives them: half a cell short, m."""
        rows, columns = self.costs.shape
        return (columns - 1 + 0.5) * self.resolution, (rows - 1 + 0.5) * self.resolution


def _lethal_centres(grid: Grid) -> NDArray[np.float64]:
    # Searching the flat array is several times as fast as searching two axes.
    rows, columns = np.divmod(np.flatnonzero(grid.costs == LETHAL), grid.costs.shape[1])
    centres = np.empty((rows.size, 2))
    centres[:, 0] = grid.origin_x + (columns + 0.5) * grid.resolution
    centres[:, 1] = grid.origin_y + (rows + 0.5) * grid.resolution
    centres.flags.writeable = False
    return centres


@njit(cache=True)
def world_to_cell(x, y, origin_x, origin_y, resolution, columns, rows):
    """Returns (column, row) of the cell that holds the point (x, y) m, or (-1, -1) outside.

    A point that is not a number counts as outside. The numbers are apart because loops over many
    points take them out of their `Grid` once, and because a lattice may have no cells yet.
    """
    if x < origin_x or y < origin_y:
        return -1, -1
    column = int((x - origin_x) / resolution)
    row = int((y - origin_y) / resolution)
    # Not a number, or too large for an integer, comes out as some negative one.
    if 0 <= column < columns and 0 <= row < rows:
        return column, row
    return -1, -1


@njit(cache=True)
def cell_at(grid, x, y):
    """Returns (column, row) of the cell of a `Grid` that holds (x, y) m, or (-1, -1) outside."""
    rows, columns = grid.costs.shape
    return world_to_cell(x, y, grid.origin_x, grid.origin_y, grid.resolution, columns, rows)


@njit(cache=True)
def cost_at(grid, x, y, off_map=OFF_MAP):
    """Returns the cost of the cell of a `Grid` that holds (x, y) m, `off_map` where none does."""
    column, row = cell_at(grid, x, y)
    if column < 0:
        return off_map
    return int(grid.costs[row, column])


@njit(cache=True)
def distance_to_cells(distance, resolution):
    """Returns a distance in m as whole cells, rounded up, never negative (Nav2's cellDistance)."""
    return max(0, math.ceil(distance / resolution))


@njit(cache=True)
def line_max_cost(costs, column_0, row_0, column_1, row_1):
    """Returns the largest cost on the cells of a line, both ends included.

    The line is Bresenham's along the dominant axis (x on ties), error starting at half the
    dominant extent; its direction decides which cells a tie visits. Returns LETHAL at once where a
    cell has that cost.
    """
    delta_column = abs(column_1 - column_0)
    delta_row = abs(row_1 - row_0)
    step_column = 1 if column_1 >= column_0 else -1
    step_row = 1 if row_1 >= row_0 else -1
    along_x = delta_column >= delta_row
    major = delta_column if along_x else delta_row
    minor = delta_row if along_x else delta_column
    error = major // 2
    column, row = column_0, row_0
    largest = 0
    for _ in range(major + 1):
        cost = costs[row, column]
        if cost == LETHAL:
            return int(cost)
        if cost > largest:
            largest = int(cost)
        error += minor
        step_minor = error >= major
        if step_minor:
            error -= major
        if along_x:
            column += step_column
            if step_minor:
                row += step_row
        else:
            row += step_row
            if step_minor:
                column += step_column
    return largest


@njit(cache=True)
def distances_to_lethal(grid, x, y):
    """Returns the distances from (x, y) m to the nearest LETHAL cell's centre, and to the nearest
    lower left corner of one, m; inf where there is none."""
    costs = grid.costs
    half = 0.5 * grid.resolution
    to_centre = to_corner = math.inf
    for row in range(costs.shape[0]):
        # Most rows have none; a loop without branches looks at 32 cells at a time.
        is_lethal = False
        for column in range(costs.shape[1]):
            is_lethal |= costs[row, column] == LETHAL
        if not is_lethal:
            continue
        centre_y = grid.origin_y + (row + 0.5) * grid.resolution
        for column in range(costs.shape[1]):
            if costs[row, column] == LETHAL:
                centre_x = grid.origin_x + (column + 0.5) * grid.resolution
                d_x, d_y = centre_x - x, centre_y - y
                to_centre = min(to_centre, d_x * d_x + d_y * d_y)
                # Corners lie half a cell to the lower left; moving the point as far to the upper
                # right is the same.
                d_x, d_y = centre_x - (x + half), centre_y - (y + half)
                to_corner = min(to_corner, d_x * d_x + d_y * d_y)
    return math.sqrt(to_centre), math.sqrt(to_corner)
