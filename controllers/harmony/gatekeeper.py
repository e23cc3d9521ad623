"""The gatekeeper: every command that is sent leaves a verified way to stop.

It accepts a plan if the exact outline stays more than the error bound away from every lethal cell
of the costmap, from now until rest, where the base follows the plan for one cycle and then brakes.
The next cycle begins where that brake begins, so braking is still safe then. By induction there is
always a verified stop (Agrawal, Chen, Panagou: gatekeeper, arXiv 2211.14361; the only backup
manoeuvre here is the command 0).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.grid import LETHAL, world_to_cell
from drake_navbench.kernels.outline_distance import outline_to_edges
from drake_navbench.kernels.poses import place_point

# Larger gaps count as this one: the check makes no larger steps, m.
LONGEST_GAP_M = 0.5


@njit(cache=True)
def lethal_edges(grid, x, y, reach):
    """Returns (E, 4) x0, y0, x1, y1 m: the sides of lethal cells that face other cells.

    Only cells within `reach` m of the point (x, y) m along either axis count. Within this reach the
    sides of the map count as edges, because what lies beyond is unknown.
    """
    costs, resolution = grid.costs, grid.resolution
    rows, columns = costs.shape
    first_row = max(math.floor((y - reach - grid.origin_y) / resolution), 0)
    last_row = min(math.floor((y + reach - grid.origin_y) / resolution), rows - 1)
    first_column = max(math.floor((x - reach - grid.origin_x) / resolution), 0)
    last_column = min(math.floor((x + reach - grid.origin_x) / resolution), columns - 1)
    cells = max(last_row - first_row + 1, 0) * max(last_column - first_column + 1, 0)
    edges = np.empty((4 * cells + 4, 4))
    count = 0
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            if costs[row, column] != LETHAL:
                continue
            west, south = grid.origin_x + column * resolution, grid.origin_y + row * resolution
            east, north = west + resolution, south + resolution
            for beside_row, beside_column, x0, y0, x1, y1 in (
                (row, column - 1, west, south, west, north),
                (row, column + 1, east, south, east, north),
                (row - 1, column, west, south, east, south),
                (row + 1, column, west, north, east, north),
            ):
                is_inside = 0 <= beside_row < rows and 0 <= beside_column < columns
                if not is_inside or costs[beside_row, beside_column] != LETHAL:
                    edges[count, 0], edges[count, 1] = x0, y0
                    edges[count, 2], edges[count, 3] = x1, y1
                    count += 1
    west, south = grid.origin_x, grid.origin_y
    east, north = west + columns * resolution, south + rows * resolution
    for x0, y0, x1, y1 in (
        (west, south, west, north),
        (east, south, east, north),
        (west, south, east, south),
        (west, north, east, north),
    ):
        edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = x0, y0, x1, y1
        count += 1
    return edges[:count].copy()


@njit(cache=True)
def gap_at(edges, outline, x, y, yaw, placed):
    """Returns the distance from an outline (K, 2) m at a pose to the nearest edge, m.

    At most LONGEST_GAP_M. placed: (K, 2) scratch.
    """
    cosine, sine = math.cos(yaw), math.sin(yaw)
    for k in range(outline.shape[0]):
        placed[k, 0], placed[k, 1] = place_point(outline[k, 0], outline[k, 1], x, y, cosine, sine)
    return min(outline_to_edges(placed, edges, LONGEST_GAP_M), LONGEST_GAP_M)


@njit(cache=True)
def is_clear(edges, outline, reach, poses, bound):
    """Returns whether an outline stays more than `bound` m away from all edges along poses (M, 3).

    reach: distance of the farthest corner from the base, m. Between two poses no point of the
    outline moves farther than the base's path plus `reach` times its turn. So a gap of `bound` + d
    m covers the poses within a motion of d m, which are not checked themselves. The result is False
    without poses, or if a pose is not finite.
    """
    placed = np.empty_like(outline)
    count = poses.shape[0]
    allowed = -1.0
    for m in range(count):
        if not math.isfinite(poses[m, 0] + poses[m, 1] + poses[m, 2]):
            return False
        motion = 0.0
        if m > 0:
            motion = math.hypot(poses[m, 0] - poses[m - 1, 0], poses[m, 1] - poses[m - 1, 1])
            motion += reach * abs(poses[m, 2] - poses[m - 1, 2])
        allowed -= motion
        if allowed >= 0.0 and m > 0:
            continue
        # The gap at the pose before covers the step to here, or the gaps at both ends half each.
        gap = gap_at(edges, outline, poses[m, 0], poses[m, 1], poses[m, 2], placed)
        if gap < bound or (m > 0 and allowed + (gap - bound) < 0.0):
            return False
        allowed = gap - bound
    return count > 0


@njit(cache=True)
def is_on_free_cell(grid, x, y):
    """Returns whether a point m lies on a cell of the map that is not lethal.

    Edges alone do not show an outline that lies wholly within lethal cells. Where no edge crosses
    an outline, one point of it decides for all.
    """
    rows, columns = grid.costs.shape
    column, row = world_to_cell(x, y, grid.origin_x, grid.origin_y, grid.resolution, columns, rows)
    return column >= 0 and grid.costs[row, column] != LETHAL
