"""The robot's outline: padding, radii and its cost on a costmap (nav2_costmap_2d, footprint)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.grid import LETHAL, line_max_cost, world_to_cell
from drake_navbench.kernels.poses import place_point

CIRCLE_VERTEX_COUNT = 16
# Nav2 keeps the inscribed radius of a degenerate footprint at the largest double.
UNBOUNDED_RADIUS = float(np.finfo(np.float64).max)
# For `footprint_cost`. `False` itself would be a constant, for which numba compiles a second form.
FROM_LAST_VERTEX = np.bool_(False)


def circle_footprint(radius: float) -> NDArray[np.float64]:
    """Returns Nav2's regular 16-gon for a robot radius in m: (16, 2) m, vertices on the circle."""
    angles = 2.0 * np.pi * np.arange(CIRCLE_VERTEX_COUNT) / CIRCLE_VERTEX_COUNT
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def pad_footprint(footprint: NDArray[np.float64], padding: float) -> NDArray[np.float64]:
    """Moves each vertex outward by `padding` m per coordinate, by the coordinate's sign."""
    return footprint + np.sign(footprint) * padding


def footprint_radii(footprint: NDArray[np.float64]) -> tuple[float, float]:
    """Returns (inscribed, circumscribed) radius about the base origin, m.

    The inscribed one is the least distance from the origin to an edge, the circumscribed one the
    largest distance to a vertex. Fewer than three vertices give (largest double, 0).
    """
    if len(footprint) <= 2:
        return UNBOUNDED_RADIUS, 0.0
    starts, ends = footprint, np.roll(footprint, -1, axis=0)
    edges = ends - starts
    lengths_squared = np.maximum(np.sum(edges**2, axis=1), np.finfo(np.float64).tiny)
    along = np.clip(-np.sum(starts * edges, axis=1) / lengths_squared, 0.0, 1.0)
    nearest = starts + along[:, None] * edges
    inscribed = float(np.min(np.hypot(nearest[:, 0], nearest[:, 1])))
    return inscribed, float(np.max(np.hypot(footprint[:, 0], footprint[:, 1])))


@njit(cache=True)
def footprint_cost(grid, footprint, x, y, yaw, closing_edge_from_first):
    """Returns the largest cost under the outline of a footprint placed at a pose.

    grid: `Grid` of uint8 costs. footprint: (K, 2) m in the base frame. x, y m, yaw rad.
    closing_edge_from_first: True walks the last edge from vertex 0 to vertex K-1, as
    FootprintCollisionChecker does; False from K-1 to 0, as DWB's ObstacleFootprint critic does.
    A vertex off the map gives LETHAL. Only the outline is read; walking stops at a LETHAL cell, so
    NO_INFORMATION on an earlier edge hides a LETHAL one on a later edge, as in Nav2.
    """
    costs = grid.costs
    rows, columns = costs.shape
    origin_x, origin_y, resolution = grid.origin_x, grid.origin_y, grid.resolution
    vertex_count = footprint.shape[0]
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    largest = 0
    first = previous = (0, 0)
    for k in range(vertex_count):
        vertex_x, vertex_y = place_point(footprint[k, 0], footprint[k, 1], x, y, cos_yaw, sin_yaw)
        cell = world_to_cell(vertex_x, vertex_y, origin_x, origin_y, resolution, columns, rows)
        if cell[0] < 0:
            return LETHAL
        if k == 0:
            first = cell
        else:
            largest = max(largest, line_max_cost(costs, *previous, *cell))
            if largest == LETHAL:
                return LETHAL
        previous = cell
    if closing_edge_from_first:
        return max(largest, line_max_cost(costs, *first, *previous))
    return max(largest, line_max_cost(costs, *previous, *first))
