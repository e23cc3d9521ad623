"""The robot as the optimiser sees it, and its distance to point obstacles.

teb_local_planner's footprint models: a point, a circle, two circles, a line, or the outline of a
polygon (unsigned: inside it the distance grows again, as in the original).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.teb_upstream.normal_equations import DIFFERENCE
from drake_navbench.kernels.arrays import Array

CIRCLES, SEGMENTS = 0, 1
# Features whose distances differ by less can change places within a step of DIFFERENCE.
TIE_M = 1e-8
# Nearest points of two edges that are closer are their common corner.
SAME_POINT_M = 1e-9


class RobotModel(NamedTuple):
    """Circles or line segments that are fixed to the robot.

    kind: CIRCLES or SEGMENTS. shapes: (K, 4); of a circle its centre x, y and radius, of a segment
    its ends x0, y0, x1, y1, all m in the base frame. reach: the farthest that any of it is from the
    base, m.
    """

    kind: int
    shapes: Array
    reach: float


def circles(offsets_and_radii: Array) -> RobotModel:
    """Returns the model of circles (K, 2) on the robot's axis: offset along x and radius, m."""
    shapes = np.zeros((len(offsets_and_radii), 4))
    shapes[:, 0], shapes[:, 2] = offsets_and_radii.T
    return RobotModel(CIRCLES, shapes, float(np.max(np.abs(shapes[:, 0]) + shapes[:, 2])))


def outline(vertices: Array) -> RobotModel:
    """Returns the model of a closed outline (K, 2) m; two vertices make one line."""
    ends = np.roll(vertices, -1, axis=0)
    shapes = np.hstack([vertices, ends])[: len(vertices) if len(vertices) > 2 else 1]
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    return RobotModel(SEGMENTS, np.ascontiguousarray(shapes), reach)


@register_jitable(error_model="numpy")
def _nearest_on(model, k, ahead, left):
    """Returns (x m, y m, radius m): the point of shape k nearest to a point, in the base frame.

    Of a circle it is the centre; a segment has no radius.
    """
    shape = model.shapes[k]
    if model.kind == CIRCLES:
        return shape[0], shape[1], shape[2]
    a_x, a_y = shape[0], shape[1]
    edge_x, edge_y = shape[2] - a_x, shape[3] - a_y
    squared = edge_x * edge_x + edge_y * edge_y
    if squared > 0.0:
        share = ((ahead - a_x) * edge_x + (left - a_y) * edge_y) / squared
        share = min(max(share, 0.0), 1.0)
        a_x, a_y = a_x + share * edge_x, a_y + share * edge_y
    return a_x, a_y, 0.0


@register_jitable(error_model="numpy")
def _distance(model, ahead, left):
    """Returns the distance (m) to a point in the base frame."""
    best = math.inf
    for k in range(model.shapes.shape[0]):
        a_x, a_y, radius = _nearest_on(model, k, ahead, left)
        best = min(best, math.sqrt((a_x - ahead) ** 2 + (a_y - left) ** 2) - radius)
    return best


@register_jitable(error_model="numpy")
def _differences(model, ahead, left, cos_yaw, sin_yaw):
    """Returns (d/dx, d/dy, d/dyaw) of the distance by g2o's central differences."""
    step = DIFFERENCE
    # How the point moves in the base frame where the robot moves by a step along x, y and yaw.
    x_ahead, x_left = -step * cos_yaw, step * sin_yaw
    y_ahead, y_left = -step * sin_yaw, -step * cos_yaw
    yaw_ahead, yaw_left = step * left, -step * ahead
    return (
        (
            _distance(model, ahead + x_ahead, left + x_left)
            - _distance(model, ahead - x_ahead, left - x_left)
        )
        / (2.0 * step),
        (
            _distance(model, ahead + y_ahead, left + y_left)
            - _distance(model, ahead - y_ahead, left - y_left)
        )
        / (2.0 * step),
        (
            _distance(model, ahead + yaw_ahead, left + yaw_left)
            - _distance(model, ahead - yaw_ahead, left - yaw_left)
        )
        / (2.0 * step),
    )


@njit(cache=True, error_model="numpy")
def model_distance(model, x, y, cos_yaw, sin_yaw, point_x, point_y):
    """Returns (distance m, d/dx, d/dy, d/dyaw) of the robot at a pose to a point.

    The slopes are those of the nearest feature. Where a second one is as near they are g2o's, by
    central differences: the mean of both. Where a distance is zero they are zero.
    """
    dx, dy = point_x - x, point_y - y
    # The point in the base frame.
    ahead, left = cos_yaw * dx + sin_yaw * dy, -sin_yaw * dx + cos_yaw * dy
    best, second = math.inf, math.inf
    nearest_x, nearest_y, centre_distance = 0.0, 0.0, 0.0
    for k in range(model.shapes.shape[0]):
        a_x, a_y, radius = _nearest_on(model, k, ahead, left)
        to_feature = math.sqrt((a_x - ahead) ** 2 + (a_y - left) ** 2)
        if to_feature - radius < best:
            # A corner is the nearest point of both its edges, which is no second feature.
            if abs(a_x - nearest_x) + abs(a_y - nearest_y) > SAME_POINT_M:
                second = best
            best = to_feature - radius
            nearest_x, nearest_y, centre_distance = a_x, a_y, to_feature
        elif abs(a_x - nearest_x) + abs(a_y - nearest_y) > SAME_POINT_M:
            second = min(second, to_feature - radius)
    if second - best < TIE_M:
        return best, *_differences(model, ahead, left, cos_yaw, sin_yaw)
    if centre_distance == 0.0:
        return best, 0.0, 0.0, 0.0
    normal_x = (nearest_x - ahead) / centre_distance
    normal_y = (nearest_y - left) / centre_distance
    return (
        best,
        cos_yaw * normal_x - sin_yaw * normal_y,
        sin_yaw * normal_x + cos_yaw * normal_y,
        normal_y * nearest_x - normal_x * nearest_y,
    )
