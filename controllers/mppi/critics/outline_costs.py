"""The costs under the outline, remembered edge by edge, as samples need the same ones often.

The outline's cost at a pose only depends on the cells of its vertices, and the cost of an edge on
the cells of its two ends. Samples lie close to each other, and a costmap serves several cycles, so
most edges were met before.

The cells are found for a row of lanes at a time with the sine and cosine of `float32_math`, which
are not those of `math`. Where a vertex lies so close to the border of its cell that the difference
might matter, or off the map, the outline is walked as `footprint_cost` does it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.mppi.critics.base import MapView
from drake_navbench.controllers.mppi.float32_math import sin_cos
from drake_navbench.controllers.mppi.lanes import LANES
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import LETHAL, Costmap, line_max_cost

# A power of two: the upper bits of a product choose the place.
_PLACE_BITS = 15
PLACES = 1 << _PLACE_BITS
# Above it a search for a place takes longer than it saves; later outlines are not remembered.
MOST_REMEMBERED = PLACES * 3 // 4
NOTHING = -1
# The bound of the error of the rounded sine and cosine; the coordinates are float64.
_TRIGONOMETRIC_ERROR = 1e-6
# The bound of the other rounding differences to float64, in cells.
_ROUNDING = 1e-8
# The sine and cosine are good below it, rad.
_LARGEST_YAW = np.float32(8000.0)
# 2^64 over the golden ratio, odd (Knuth, The Art of Computer Programming 3, 6.4).
_MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(64 - _PLACE_BITS)


class OutlineCosts(NamedTuple):
    """A hash table of one costmap, open addressing: the cells of an edge's ends to its cost.

    edges: (PLACES,) int64, the cell of the first end times the number of cells plus that of the
    second, NOTHING at a free place. costs: (PLACES,) uint8. taken: (1,) number of remembered edges.
    margin: least distance of a vertex from the border of its cell, in cells. cells: (K, LANES)
    cell of each vertex, and is_doubtful: (LANES,) where they are not certain: scratch.
    """

    edges: NDArray[np.int64]
    costs: NDArray[np.uint8]
    taken: NDArray[np.int64]
    margin: float
    cells: NDArray[np.int32]
    is_doubtful: NDArray[np.bool_]

    @classmethod
    def of(cls, view: MapView) -> OutlineCosts:
        """Returns an empty table for the costmap of a view."""
        footprint = view.footprint
        radius_m = np.hypot(footprint[:, 0], footprint[:, 1]).max(initial=0.0)
        return cls(
            np.full(PLACES, NOTHING, np.int64),
            np.empty(PLACES, np.uint8),
            np.zeros(1, np.int64),
            2.0 * _TRIGONOMETRIC_ERROR * float(radius_m / view.grid.resolution) + _ROUNDING,
            np.empty((len(footprint), LANES), np.int32),
            np.empty(LANES, np.bool_),
        )


class OutlineView:
    """The last costmap as a critic sees it: its view, and the costs of outlines on it.

    Kept from cycle to cycle while the costmap is the same: a cache that no result depends on.
    footprint: (K, 2) m in the base frame.
    """

    def __init__(self, footprint: NDArray[np.float64]) -> None:
        self._footprint = footprint
        self._last: tuple[Costmap, MapView, OutlineCosts] | None = None

    def of(self, costmap: Costmap) -> tuple[MapView, OutlineCosts]:
        """Returns the view of a costmap and the table of outline costs on it."""
        if self._last is None or self._last[0] is not costmap:
            view = MapView.of(costmap, self._footprint)
            self._last = costmap, view, OutlineCosts.of(view)
        return self._last[1:]


@njit(cache=True)
def outline_cost_row(view, remembered, wanted, x, y, yaw, found):
    """Writes the largest cost under the outline at poses of a row, as `footprint_cost` does.

    x, y, yaw: (LANES,) float32, m, m, rad. wanted: (W,) the lanes. found: (LANES,) int64,
    written in those lanes alone.
    """
    _find_cells(view, remembered, x, y, yaw)
    edges, costs, taken = remembered.edges, remembered.costs, remembered.taken
    cells, is_doubtful = remembered.cells, remembered.is_doubtful
    vertices, cell_count = cells.shape[0], np.int64(view.outside)
    # One loop without calls: passing the arrays takes longer than the work on them.
    for lane in wanted:
        if is_doubtful[lane]:
            found[lane] = footprint_cost(
                view.grid,
                view.footprint,
                np.float64(x[lane]),
                np.float64(y[lane]),
                np.float64(yaw[lane]),
                True,
            )
            continue
        largest = np.int64(0)
        for k in range(1, vertices + 1):
            is_closing = k == vertices
            start = np.int64(cells[0 if is_closing else k - 1, lane])
            end = np.int64(cells[k - 1 if is_closing else k, lane])
            edge = start * cell_count + end
            place = np.int64((np.uint64(edge) * _MULTIPLIER) >> _SHIFT)
            while edges[place] != edge and edges[place] != NOTHING:
                place = (place + 1) & (PLACES - 1)
            if edges[place] == edge:
                cost = np.int64(costs[place])
            else:
                cost = _walked(view, start, end)
                if taken[0] < MOST_REMEMBERED:
                    taken[0] += 1
                    edges[place], costs[place] = edge, cost
            largest = max(largest, cost)
            if largest == LETHAL:
                # footprint_cost stops here: unknown cells on a later edge are not seen.
                break
        found[lane] = largest


@register_jitable
def _walked(view, start, end):
    """Returns the largest cost on the line from one cell to another, both row by row."""
    columns = np.int64(view.columns)
    start_row, end_row = start // columns, end // columns
    start_column, end_column = start - start_row * columns, end - end_row * columns
    return line_max_cost(view.grid.costs, start_column, start_row, end_column, end_row)


@register_jitable(forceinline=True)
def _find_cells(view, remembered, x, y, yaw):
    """Finds the cells of the vertices, and where they are doubtful, for a row of poses."""
    sines, cosines = np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    _sin_cos_row(yaw, sines, cosines, remembered.is_doubtful)
    grid, footprint = view.grid, view.footprint
    for k in range(footprint.shape[0]):
        _cells_of_vertex(
            (footprint[k, 0], footprint[k, 1]),
            (x, y, sines, cosines),
            (grid.origin_x, grid.origin_y, 1.0 / grid.resolution, view.rows, view.columns),
            remembered.margin,
            remembered.cells[k],
            remembered.is_doubtful,
        )


@register_jitable(forceinline=True)
def _sin_cos_row(yaw, sines, cosines, is_doubtful):
    for lane in range(LANES):
        sines[lane], cosines[lane] = sin_cos(yaw[lane])
        is_doubtful[lane] = not (-_LARGEST_YAW < yaw[lane] < _LARGEST_YAW)


@register_jitable(forceinline=True)
def _cells_of_vertex(vertex, poses, place, margin, cells, is_doubtful):
    vertex_x, vertex_y = vertex
    x, y, sines, cosines = poses
    origin_x, origin_y, cells_per_metre, rows, columns = place
    least, most = margin, 1.0 - margin
    for lane in range(LANES):
        sine, cosine = np.float64(sines[lane]), np.float64(cosines[lane])
        from_x = x[lane] + (vertex_x * cosine - vertex_y * sine) - origin_x
        from_y = y[lane] + (vertex_x * sine + vertex_y * cosine) - origin_y
        along_x, along_y = from_x * cells_per_metre, from_y * cells_per_metre
        column, row = np.int32(along_x), np.int32(along_y)
        rest_x, rest_y = along_x - column, along_y - row
        is_inside = (along_x >= 0.0) & (along_y >= 0.0) & (along_x < columns) & (along_y < rows)
        is_clear = (rest_x > least) & (rest_x < most) & (rest_y > least) & (rest_y < most)
        is_doubtful[lane] |= not (is_inside & is_clear)
        cells[lane] = row * columns + column
