"""The update of the cells in the cone of a sonar or infrared sensor by one reading.

Probabilities of being occupied are kept as costs, 0 to LETHAL, and are updated by Bayes' rule.
Source: nav2_costmap_2d (RangeSensorLayer), equal in Humble to Lyrical.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import LETHAL, Grid, world_to_cell
from drake_navbench.kernels.layer_grid import grow_box

# The cost of the cell that a reading points at, before the cone's update.
TARGET_COST = 233
# The length of the triangle in which cells are looked at, as a multiple of the reading.
CONE_LENGTH_RATIO = 1.2
EVEN_ODDS = 0.5


class Cone(NamedTuple):
    """A reading on the plane: apex x, y m, heading rad, range m, half the field of view rad.

    clears: whether it says that all of the cone is free.
    """

    x: float
    y: float
    yaw: float
    range_m: float
    half_angle: float
    clears: bool


def cost_of(probability: float) -> int:
    """Returns the cost that stands for a probability of being occupied."""
    return int(probability * LETHAL)


def update_by_cone(grid: Grid, cone: Cone, *, phi: float, inflate_cone: float) -> Array:
    """Updates the cells of `grid` in place by a reading; returns the box touched, (4,) m.

    phi: distance from the sensor at which a reading is trusted by half, m. inflate_cone: the margin
    around the cone's triangle in which cells count, as a share of its area; 1 takes all cells in
    the box around it. The box is min_x, min_y, max_x, max_y.
    """
    return np.asarray(_update(grid, cone, float(phi), float(inflate_cone)))


@njit(cache=True, error_model="numpy")
def _update(grid, cone, phi, inflate_cone):
    costs = grid.costs
    rows, columns = costs.shape
    target_x = cone.x + cone.range_m * math.cos(cone.yaw)
    target_y = cone.y + cone.range_m * math.sin(cone.yaw)
    delta_x, delta_y = target_x - cone.x, target_y - cone.y
    heading = math.atan2(delta_y, delta_x)
    length = CONE_LENGTH_RATIO * math.sqrt(delta_x * delta_x + delta_y * delta_y)
    box = np.array([cone.x, cone.y, cone.x, cone.y])
    corners = np.empty((3, 2), dtype=np.int64)
    _set_cell(corners, 0, grid, cone.x, cone.y)
    place = grid.origin_x, grid.origin_y, grid.resolution, columns, rows
    column, row = world_to_cell(target_x, target_y, *place)
    if column >= 0:
        costs[row, column] = TARGET_COST
        grow_box(box, target_x, target_y)
    for n in range(2):
        side = heading - cone.half_angle if n == 0 else heading + cone.half_angle
        x, y = cone.x + math.cos(side) * length, cone.y + math.sin(side) * length
        _set_cell(corners, n + 1, grid, x, y)
        grow_box(box, x, y)
    slack = -np.float32(np.float32(inflate_cone) * _area(corners))
    first_column, last_column = max(corners[:, 0].min(), 0), min(corners[:, 0].max(), columns - 1)
    first_row, last_row = max(corners[:, 1].min(), 0), min(corners[:, 1].max(), rows - 1)
    for column in range(first_column, last_column + 1):
        for row in range(first_row, last_row + 1):
            if inflate_cone < 1.0 and not _is_near_triangle(corners, column, row, slack):
                continue
            offset_x = grid.origin_x + (column + 0.5) * grid.resolution - cone.x
            offset_y = grid.origin_y + (row + 0.5) * grid.resolution - cone.y
            distance = math.sqrt(offset_x * offset_x + offset_y * offset_y)
            bearing = _normalized(math.atan2(offset_y, offset_x) - heading)
            seen = 0.0
            if not cone.clears:
                seen = _occupied_as_seen(
                    cone.range_m, distance, bearing, grid.resolution, cone.half_angle, phi
                )
            costs[row, column] = _updated_cost(costs[row, column], seen)
    return box


@njit(cache=True)
def _updated_cost(cost, seen):
    """Returns the cost after Bayes' rule; seen: the probability that the reading alone gives."""
    prior = cost / LETHAL
    occupied, free = seen * prior, (1.0 - seen) * (1.0 - prior)
    total = occupied + free
    # A cell that is surely occupied and is seen surely free has no probability; it counts as free.
    return 0 if total == 0.0 else int(occupied / total * LETHAL)


@njit(cache=True, error_model="numpy")
def _occupied_as_seen(reading, distance, bearing, resolution, half_angle, phi):
    """Returns the probability of being occupied that a reading gives a cell.

    It is 1/2 where the reading says nothing, less before the reading, more around it. The widths of
    both bands are the cell's edge times the reading, lengths though both are.
    """
    trust = 0.0
    if abs(bearing) <= half_angle:
        share = bearing / half_angle
        trust = (1.0 - (1.0 + math.tanh(2.0 * (distance - phi))) / 2.0) * (1.0 - share * share)
    width = resolution * reading
    if 0.0 <= distance < reading - 2.0 * resolution * reading:
        return (1.0 - trust) * EVEN_ODDS
    if distance < reading - width:
        rise = (distance - (reading - 2.0 * resolution * reading)) / width
        return trust * EVEN_ODDS * (rise * rise) + (1.0 - trust) * EVEN_ODDS
    if distance < reading + width:
        off = (reading - distance) / width
        return trust * ((1.0 - EVEN_ODDS * (off * off)) - EVEN_ODDS) + EVEN_ODDS
    return EVEN_ODDS


@njit(cache=True)
def _normalized(angle):
    """Returns an angle within (-pi, pi], rounded as ROS does."""
    turned = np.fmod(angle + math.pi, 2.0 * math.pi)
    return turned + math.pi if turned <= 0.0 else turned - math.pi


@njit(cache=True)
def _set_cell(corners, n, grid, x, y):
    """Sets a row to column and row of a point, m, which may lie outside; fractions are cut to 0.

    Number by number: for a row that is set as a whole numba compiles strings of an error message.
    """
    corners[n, 0] = int((x - grid.origin_x) / grid.resolution)
    corners[n, 1] = int((y - grid.origin_y) / grid.resolution)


@njit(cache=True)
def _area(corners):
    """Returns the area of a triangle of cells (3, 2), cells^2, in single precision."""
    x, y = corners[:, 0], corners[:, 1]
    twice = x[0] * (y[1] - y[2]) + x[1] * (y[2] - y[0]) + x[2] * (y[0] - y[1])
    return np.float32(abs(twice / 2.0))


@njit(cache=True)
def _is_near_triangle(corners, column, row, slack):
    """Tells whether a cell lies within a triangle of cells (3, 2), or by `slack` beside it."""
    for n in range(3):
        start, end = corners[(n + 1) % 3], corners[(n + 2) % 3]
        along = (end[0] - start[0]) * (row - start[1])
        across = (end[1] - start[1]) * (column - start[0])
        if np.float32(along - across) < slack:
            return False
    return True
