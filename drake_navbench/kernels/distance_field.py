"""Obstacles as a signed distance field of a local costmap, sampled smoothly.

The field gives every disc of a robot one clearance row, whatever the number of obstacles, so that
a program keeps its size and its sparsity from cycle to cycle. docs/teb.md holds the measurement
that decided for the field and against nearest obstacle features.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import LETHAL, Costmap


class DistanceField(NamedTuple):
    """Signed distance to the nearest lethal cell, sampled at cell centres; read-only.

    distances: (rows, columns) m, [row = y, column = x]; negative inside obstacles. It is 0 on
        the edges of the lethal cells along the axes, half a cell before the nearest centre.
    origin_x, origin_y: lower left corner of cell (0, 0), m. resolution: m.
    """

    distances: Array
    origin_x: float
    origin_y: float
    resolution: float


@register_jitable
def _squared_distance_1d(samples, result, sites, borders):
    """Lower envelope of the parabolas samples[q] + (p - q)^2; Felzenszwalb, Huttenlocher 2012."""
    count = samples.shape[0]
    last = 0
    sites[0] = 0
    borders[0] = -math.inf
    borders[1] = math.inf
    for q in range(1, count):
        while True:
            site = sites[last]
            border = ((samples[q] + q * q) - (samples[site] + site * site)) / (2.0 * (q - site))
            if border > borders[last]:
                break
            last -= 1
        last += 1
        sites[last] = q
        borders[last] = border
        borders[last + 1] = math.inf
    nearest = 0
    for p in range(count):
        while borders[nearest + 1] < p:
            nearest += 1
        offset = p - sites[nearest]
        result[p] = offset * offset + samples[sites[nearest]]


@register_jitable
def _squared_cell_distance(is_source, far_squared):
    """Returns (rows, columns) squared distances in cells to the nearest source cell."""
    rows, columns = is_source.shape
    squared = np.empty((rows, columns))
    for column in range(columns):
        # Along a column the nearest source is the last one met on the way down or on the way up.
        steps = rows + columns
        for row in range(rows):
            steps = 0 if is_source[row, column] else steps + 1
            squared[row, column] = min(float(steps * steps), far_squared)
        steps = rows + columns
        for row in range(rows - 1, -1, -1):
            steps = 0 if is_source[row, column] else steps + 1
            squared[row, column] = min(float(steps * steps), squared[row, column])
    result = np.empty(columns)
    sites, borders = np.empty(columns, dtype=np.int64), np.empty(columns + 1)
    for row in range(rows):
        _squared_distance_1d(squared[row], result, sites, borders)
        for column in range(columns):
            squared[row, column] = min(result[column], far_squared)
    return squared


@register_jitable
def _bounds(is_member):
    """Returns (first row, end row, first column, end column) of a window around all members.

    One cell wider than the members where the map is; all zero without a member.
    """
    rows, columns = is_member.shape
    top, bottom, left, right = rows, -1, columns, -1
    for row in range(rows):
        for column in range(columns):
            if is_member[row, column]:
                top, bottom = min(top, row), row
                left, right = min(left, column), max(right, column)
    if bottom < 0:
        return 0, 0, 0, 0
    return max(top - 1, 0), min(bottom + 2, rows), max(left - 1, 0), min(right + 2, columns)


@njit(cache=True)
def signed_distances(costs, lethal_cost, resolution):
    """Returns (rows, columns) m: signed Euclidean distance of cell centres to lethal cells.

    Half a cell is taken off either side, so that the distance is 0 on edges of lethal cells that
    face along an axis, and never too large. Without a lethal cell every distance is the diagonal of
    the map.
    """
    rows, columns = costs.shape
    far_squared = float(rows * rows + columns * columns)
    distances = np.full((rows, columns), (math.sqrt(far_squared) - 0.5) * resolution)
    lethal = costs == lethal_cost
    top, bottom, left, right = _bounds(lethal)
    if bottom == 0:
        return distances
    outside = _squared_cell_distance(lethal, far_squared)
    # The free cell nearest to a lethal one is never beyond the ring around all of them.
    inside = _squared_cell_distance(~lethal[top:bottom, left:right], far_squared)
    for row in range(rows):
        for column in range(columns):
            if lethal[row, column]:
                cells = 0.5 - math.sqrt(inside[row - top, column - left])
            else:
                cells = math.sqrt(outside[row, column]) - 0.5
            distances[row, column] = cells * resolution
    return distances


def distance_field(costmap: Costmap) -> DistanceField:
    """Returns the signed distance field of a local costmap's lethal cells."""
    distances = signed_distances(costmap.costs, LETHAL, costmap.resolution)
    distances.flags.writeable = False
    return DistanceField(distances, costmap.origin_x, costmap.origin_y, costmap.resolution)


@register_jitable(error_model="numpy")
def _spline_weights(t):
    """Quadratic B-spline weights of the three nearest samples, t in [-0.5, 0.5], and slopes."""
    before, after = 0.5 - t, 0.5 + t
    values = (0.5 * before * before, before * after + 0.5, 0.5 * after * after)
    return values, (-before, -2.0 * t, after)


@register_jitable(error_model="numpy")
def _nearest_sample(coordinate, origin, resolution):
    """Returns (index, offset in cells) of the sample next to a coordinate, m; maybe off the map."""
    cells = (coordinate - origin) / resolution - 0.5
    index = math.floor(cells + 0.5)
    return int(index), cells - index


@register_jitable(error_model="numpy")
def _neighbours(index, count):
    """Returns the indices of the samples about an index; beyond the border, the outermost one's."""
    last = count - 1
    return (
        min(max(index - 1, 0), last),
        min(max(index, 0), last),
        min(max(index + 1, 0), last),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def sample_distance(field, x, y):
    """Returns (distance m, d/dx, d/dy) at the point (x, y) m by quadratic B-splines.

    Exact on straight walls, with slopes that do not jump, as those of bilinear interpolation do
    at every line between cell centres. Beyond the border the outermost cells repeat: a slope that
    ended there would keep Newton's method from converging.
    """
    distances = field.distances
    rows, columns = distances.shape
    column, along_x = _nearest_sample(x, field.origin_x, field.resolution)
    row, along_y = _nearest_sample(y, field.origin_y, field.resolution)
    near_rows, near_columns = _neighbours(row, rows), _neighbours(column, columns)
    weights_x, slopes_x = _spline_weights(along_x)
    weights_y, slopes_y = _spline_weights(along_y)
    distance, slope_x, slope_y = 0.0, 0.0, 0.0
    for j in range(3):
        for i in range(3):
            sample = distances[near_rows[j], near_columns[i]]
            distance += weights_x[i] * weights_y[j] * sample
            slope_x += slopes_x[i] * weights_y[j] * sample
            slope_y += weights_x[i] * slopes_y[j] * sample
    return distance, slope_x / field.resolution, slope_y / field.resolution


@register_jitable
def sample_curvature(field, x, y):
    """Returns (d2/dx2, d2/dxdy, d2/dy2) of `sample_distance`: they jump between cells."""
    distances = field.distances
    rows, columns = distances.shape
    column, along_x = _nearest_sample(x, field.origin_x, field.resolution)
    row, along_y = _nearest_sample(y, field.origin_y, field.resolution)
    near_rows, near_columns = _neighbours(row, rows), _neighbours(column, columns)
    weights_x, slopes_x = _spline_weights(along_x)
    weights_y, slopes_y = _spline_weights(along_y)
    bends = (1.0, -2.0, 1.0)
    by_xx, by_xy, by_yy = 0.0, 0.0, 0.0
    for j in range(3):
        for i in range(3):
            sample = distances[near_rows[j], near_columns[i]]
            by_xx += bends[i] * weights_y[j] * sample
            by_xy += slopes_x[i] * slopes_y[j] * sample
            by_yy += weights_x[i] * bends[j] * sample
    squared = field.resolution * field.resolution
    return by_xx / squared, by_xy / squared, by_yy / squared


@register_jitable
def pose_clearance(field, discs, x, y, yaw):
    """Returns the least distance between the robot's discs and an obstacle at a pose, m."""
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    clearance = math.inf
    for k in range(discs.shape[0]):
        distance, _, _ = sample_distance(
            field, x + discs[k, 0] * cos_yaw, y + discs[k, 0] * sin_yaw
        )
        clearance = min(clearance, distance - discs[k, 1])
    return clearance


@njit(cache=True)
def path_clearance(field, discs, poses):
    """Returns (N,) m: the least distance between the robot's discs and an obstacle at each pose."""
    clearances = np.empty(poses.shape[0])
    for i in range(poses.shape[0]):
        clearances[i] = pose_clearance(field, discs, poses[i, 0], poses[i, 1], poses[i, 2])
    return clearances
