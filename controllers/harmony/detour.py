"""A detour around an obstacle on the path, for plans that get nowhere: searched once, and kept.

A plan sees as far as its horizon, and the distance to its target draws it into any dead end on
the way. A robot that is trapped there searches the cells in which it has room in any heading, for
a way to the path's first free point behind the obstacle. This way is the path until it is driven.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_navbench.kernels.astar import FOUND, SearchRules, search
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.grid import FREE, INSCRIBED, Grid, world_to_cell
from drake_navbench.kernels.path_geometry import path_from_polyline, path_length
from drake_navbench.kernels.path_smoothing import smooth_grid_path
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# Ways keep off obstacles by costs with this weight. Ways that keep to the plan cost more, where the
# robot can turn in place, by this share of a metre for each metre off the plan.
TRAVEL_MULTIPLIER, OFF_PLAN_SHARE = 4.0, 0.25
# Nav2's smoother of grid paths: tolerance m, most sweeps, both weights, passes after the first.
SMOOTHING = (1e-4, 1000, 0.2, 0.3, 2)
NO_OUTLINE = np.empty((0, 2))
# A detour may end on the path at MOST_ENDS points, REJOIN_M apart. A later end is taken only if it
# makes the whole way shorter by more than WORTH_M.
REJOIN_M, MOST_ENDS, WORTH_M = 0.5, 8, 0.2
# A detour may lead or end up to BEYOND_M outside the map, m, if it is no longer than
# LONGEST_BEYOND_M. The limit is needed because unknown space nearly always offers a way.
BEYOND_M, LONGEST_BEYOND_M = 1.0, 6.5
# The plan counts as unchanged while it passes within this of the detour's end, m.
SAME_PLAN_M = 0.25
# A robot farther from its detour needs another one, m.
OFF_DETOUR_M = 0.2
# Cells within this of a robot that is closer to obstacles than required count as free, m.
START_FREE_M = 0.15


class Keeping(NamedTuple):
    """Distances from obstacles, m, that shape a way.

    inflation_m: over which costs fall to 0. turning_m: farther off the way keeps to the plan.
    """

    inflation_m: float
    turning_m: float


def detour_costs(
    field: DistanceField, clearance: float, start: Array, ahead: Array, keeping: Keeping
) -> NDArray[np.uint8]:
    """Returns (rows, columns) costs: INSCRIBED nearer than `clearance` m to obstacles.

    ahead: (P, 2) m, the plan.
    """
    missing = np.maximum(1.0 - (field.distances - clearance) / keeping.inflation_m, 0.0)
    off_m = np.where(field.distances > keeping.turning_m, off_plan(field, ahead), 0.0)
    missing += OFF_PLAN_SHARE / TRAVEL_MULTIPLIER * off_m
    costs = np.clip((INSCRIBED - 1) * missing, FREE, INSCRIBED - 1).astype(np.uint8)
    costs[field.distances < clearance] = INSCRIBED
    rows, columns = np.indices(costs.shape)
    x = field.origin_x + (columns + 0.5) * field.resolution
    y = field.origin_y + (rows + 0.5) * field.resolution
    is_here = np.hypot(x - start[0], y - start[1]) <= START_FREE_M
    costs[is_here & (costs == INSCRIBED) & (field.distances > 0.0)] = INSCRIBED - 1
    return costs


def off_plan(field: DistanceField, points: Array) -> Array:
    """Returns (rows, columns) m the distances of cells from those that hold points (P, 2) m."""
    is_off = np.ones(field.distances.shape, dtype=np.bool_)
    for column, row in (cell_of(field, point) for point in points):
        if column >= 0:
            is_off[row, column] = False
    return np.asarray(field.resolution * ndimage.distance_transform_edt(is_off))


def beyond_map(field: DistanceField) -> DistanceField:
    """Returns a field that goes on for BEYOND_M outside the map, where nothing is known.

    The distance of a cell there is that of the nearest cell of the map plus the way from there:
    the largest that it can be.
    """
    count = round(BEYOND_M / field.resolution)
    off = [
        np.maximum(np.abs(np.arange(-count, n + count) - 0.5 * (n - 1)) - 0.5 * (n - 1), 0.0)
        for n in field.distances.shape
    ]
    return DistanceField(
        np.pad(field.distances, count, mode="edge")
        + field.resolution * np.hypot(off[0][:, None], off[1]),
        field.origin_x - count * field.resolution,
        field.origin_y - count * field.resolution,
        field.resolution,
    )


def points_behind(ahead: Array, field: DistanceField, clearance: float) -> tuple[Array, Array]:
    """Returns points (E, 2) m at which a plan (P, 2) has room again, and their stations (E,) m.

    They begin with the first point with room behind the first points without room, and are
    REJOIN_M apart. There are none if all points have room, or if none behind has. If the robot
    itself starts too close to an obstacle, the points without room there do not count, as long as
    there are others.
    """
    stations = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ahead, axis=0).T))])
    has_room = distances_at(field, ahead) >= clearance
    first = int(np.argmin(has_room))
    if first == 0 and not has_room[0]:
        first = _behind_tight_start(has_room, stations)
    found, least_m = [], 0.0
    for index in (first + np.flatnonzero(has_room[first:])).tolist():
        if not has_room[first] and stations[index] >= least_m:
            found.append(index)
            least_m = stations[index] + REJOIN_M
    return ahead[found], stations[found]


def whole_plan(plan: Array, global_plan: Array) -> Array:
    """Returns (P, 2) m the points of a local plan and of the global one that continues it."""
    ahead = plan[:, :2]
    if len(global_plan):
        nearest = int(np.argmin(np.hypot(*(global_plan[:, :2] - ahead[-1]).T)))
        ahead = np.concatenate([ahead, global_plan[nearest + 1 :, :2]])
    return ahead


def _behind_tight_start(has_room: NDArray[np.bool_], stations: Array) -> int:
    """Returns the index of the first point without room behind a tight start; 0 if there is none.

    A start is no longer than REJOIN_M along the plan.
    """
    free = int(np.argmax(has_room))
    again = free + int(np.argmin(has_room[free:]))
    return again if stations[free] <= REJOIN_M and not has_room[again] else 0


def distances_at(field: DistanceField, points: Array) -> Array:
    """Returns (M,) the distances of the cells that points (M, 2) are in, m; NaN off the map."""
    rows, columns = field.distances.shape
    column = np.floor((points[:, 0] - field.origin_x) / field.resolution).astype(int)
    row = np.floor((points[:, 1] - field.origin_y) / field.resolution).astype(int)
    seen = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = np.full(len(points), np.nan)
    found[seen] = field.distances[row[seen], column[seen]]
    return found


def find_detour(
    ahead: Array, field: DistanceField, clearance: float, start: Array, keeping: Keeping
) -> Array | None:
    """Returns (M, 3) a way from a point (2,) m to the plan behind its points without room, or None.

    It ends at the first point that it can reach, unless a later one makes the whole way shorter by
    more than WORTH_M. Except near its start it is at least `clearance` m from obstacles. It may
    lead beyond the map. ahead: (P, 2) m, the whole plan.
    """
    beyond = _find_on(ahead, beyond_map(field), clearance, start, keeping)
    if beyond is None or path_length(beyond) <= LONGEST_BEYOND_M:
        return beyond
    return _find_on(ahead, field, clearance, start, keeping)


def _find_on(
    ahead: Array, field: DistanceField, clearance: float, start: Array, keeping: Keeping
) -> Array | None:
    ends, stations = points_behind(ahead, field, clearance)
    if not len(ends):
        return None
    costs = detour_costs(field, clearance, start, ahead, keeping)
    ways = [_way_between(costs, field, start, end) for end in ends[:MOST_ENDS]]
    lengths = np.array([np.inf if way is None else path_length(way) for way in ways])
    lengths -= stations[:MOST_ENDS]
    if not np.isfinite(lengths).any():
        return None
    chosen = ways[int(np.argmax(lengths <= lengths.min() + WORTH_M))]
    assert chosen is not None
    points = np.column_stack([chosen, np.zeros(len(chosen))])
    grid = Grid(costs, field.origin_x, field.origin_y, field.resolution)
    smooth = smooth_grid_path(points, grid, NO_OUTLINE, *SMOOTHING)
    return read_only(path_from_polyline(smooth[:, :2], field.resolution))


def _way_between(
    costs: NDArray[np.uint8], field: DistanceField, start: Array, end: Array
) -> Array | None:
    """Returns (M, 2) m the cheapest way over the centres of cells from one point to another."""
    cells = [cell_of(field, point) for point in (start, end)]
    if cells[0][0] < 0 or cells[1][0] < 0:
        return None
    status, found, _ = search(
        costs,
        cells[0],
        cells[1],
        (float(cells[1][0]), float(cells[1][1])),
        SearchRules(
            tolerance=0.0,
            cost_travel_multiplier=TRAVEL_MULTIPLIER,
            allow_unknown=True,
            corner_cutting=False,
            max_iterations=0,
            max_on_approach_iterations=0,
            terminal_checking_interval=costs.size,
            expansion_budget=costs.size,
        ),
    )
    if status != FOUND or len(found) < 2:
        return None
    points = np.array([field.origin_x, field.origin_y]) + (found + 0.5) * field.resolution
    points[0], points[-1] = start, end
    return points


def cell_of(field: DistanceField, point: Array) -> tuple[int, int]:
    """Returns (column, row) of the cell that holds a point (2,) m, (-1, -1) off the map."""
    rows, columns = field.distances.shape
    x, y = float(point[0]), float(point[1])
    return world_to_cell(x, y, field.origin_x, field.origin_y, field.resolution, columns, rows)


def is_connected(
    field: DistanceField, clearance: float, longest: float, start: Array, end: Array
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


def still_ahead(detour: Array, position: Array, plan: Array, global_plan: Array) -> Array:
    """Returns the part of a detour (M, 3) ahead of a position (2,); empty if the detour is over.

    It is over if its end is reached, or if its end is no longer on the plan.
    """
    nearest = int(np.argmin(np.hypot(*(detour[:, :2] - position).T)))
    rest = detour[nearest:]
    whole = np.concatenate([plan, global_plan])[:, :2]
    off_plan_m = float(np.hypot(*(whole - detour[-1, :2]).T).min())
    return rest[:0] if len(rest) < 2 or off_plan_m > SAME_PLAN_M else rest


def is_good(detour: Array, position: Array, field: DistanceField, clearance: float) -> bool:
    """Returns whether a detour (M, 3) begins near a position (2,) m and is still free.

    It must keep `clearance` m from obstacles; near the robot it must only not lead into one.
    """
    off_m = np.hypot(*(detour[:, :2] - position).T)
    distances = distances_at(field, detour[:, :2])
    is_closed = distances < np.where(off_m <= START_FREE_M + field.resolution, 1e-9, clearance)
    return bool(off_m[0] <= OFF_DETOUR_M) and not is_closed.any()


def joined(detour: Array, plan: Array, global_plan: Array) -> Array:
    """Returns a detour (M, 3) and the rest of the plan behind the detour's end.

    plan: (P, 3), the local one. Where the detour ends beyond it, the rest is that of global_plan
    (N, 3).
    """
    ends = [np.hypot(*(poses[:, :2] - detour[-1, :2]).T) for poses in (plan, global_plan)]
    if ends[0].min() > SAME_PLAN_M and len(global_plan):
        return np.concatenate([detour, global_plan[int(np.argmin(ends[1])) + 1 :]])
    return np.concatenate([detour, plan[int(np.argmin(ends[0])) + 1 :]])
