"""The robot as the optimiser sees it, and its distance to point obstacles.

teb_local_planner's footprint models: a point, a circle, two circles, a line, or the outline of a
polygon (unsigned: inside it the distance grows again, as in the original).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

CIRCLES, SEGMENTS = 0, 1


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


@njit(cache=True, error_model="numpy")
def model_distance(model, x, y, cos_yaw, sin_yaw, point_x, point_y):
    """Returns (distance m, d/dx, d/dy, d/dyaw) of the robot at a pose to a point.

    The slopes are those of the nearest feature; where a distance is zero they are zero.
    """
    dx, dy = point_x - x, point_y - y
    # The point in the base frame.
    ahead, left = cos_yaw * dx + sin_yaw * dy, -sin_yaw * dx + cos_yaw * dy
    best = math.inf
    nearest_x, nearest_y, centre_distance = 0.0, 0.0, 0.0
    for k in range(model.shapes.shape[0]):
        shape = model.shapes[k]
        if model.kind == CIRCLES:
            a_x, a_y, radius = shape[0], shape[1], shape[2]
        else:
            a_x, a_y, radius = shape[0], shape[1], 0.0
            edge_x, edge_y = shape[2] - a_x, shape[3] - a_y
            squared = edge_x * edge_x + edge_y * edge_y
            if squared > 0.0:
                share = ((ahead - a_x) * edge_x + (left - a_y) * edge_y) / squared
                share = min(max(share, 0.0), 1.0)
                a_x, a_y = a_x + share * edge_x, a_y + share * edge_y
        to_feature = math.sqrt((a_x - ahead) ** 2 + (a_y - left) ** 2)
        if to_feature - radius < best:
            best = to_feature - radius
            nearest_x, nearest_y, centre_distance = a_x, a_y, to_feature
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
