"""The number of points inside a shape, and the time until a moving shape holds enough of them.

Source: nav2_collision_monitor (Polygon, Circle, kinematics), branch lyrical.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.poses import see_point

NO_COLLISION = -1.0


@njit(cache=True)
def count_inside(points, vertices, radius):
    """Returns the number of points (N, 2) inside a shape, all in m.

    vertices: (K, 2) of a polygon, tested by even-odd ray casting; with none, the shape is the open
    disc of `radius` about the origin.
    """
    count = 0
    for k in range(points.shape[0]):
        if _is_inside(points[k, 0], points[k, 1], vertices, radius):
            count += 1
    return count


@njit(cache=True)
def _is_inside(x, y, vertices, radius):
    if vertices.shape[0] == 0:
        return x * x + y * y < radius * radius
    inside = False
    i = vertices.shape[0] - 1
    for j in range(vertices.shape[0]):
        if (y <= vertices[i, 1]) == (y > vertices[j, 1]):
            # In Nav2's order, so that a point on an edge lies on the same side of it.
            run = (y - vertices[i, 1]) * (vertices[j, 0] - vertices[i, 0])
            if vertices[i, 0] + run / (vertices[j, 1] - vertices[i, 1]) > x:
                inside = not inside
        i = j
    return inside


@njit(cache=True)
def time_to_collision(points, vertices, radius, min_points, velocity, time_limit, time_step):
    """Returns the time, s, until a shape with (v m/s, w rad/s, vy m/s) holds `min_points`.

    points, vertices, radius: as in `count_inside`, in the base frame now. 0 where it holds them
    already, NO_COLLISION where it never does up to `time_limit`. As in Nav2 the time is one step
    short of the pose that was tested, and steps are added up in floating point.
    """
    if count_inside(points, vertices, radius) >= min_points:
        return 0.0
    x, y, yaw = 0.0, 0.0, 0.0
    velocity_x, w, velocity_y = velocity
    turn = w * time_step
    cos_turn, sin_turn = math.cos(turn), math.sin(turn)
    moved = np.empty_like(points)
    time = 0.0
    while time <= time_limit:
        x += velocity_x * time_step
        y += velocity_y * time_step
        yaw += turn
        velocity_x, velocity_y = (
            velocity_x * cos_turn - velocity_y * sin_turn,
            velocity_x * sin_turn + velocity_y * cos_turn,
        )
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        for k in range(points.shape[0]):
            moved[k, 0], moved[k, 1] = see_point(points[k, 0], points[k, 1], x, y, cos_yaw, sin_yaw)
        if count_inside(moved, vertices, radius) >= min_points:
            return time
        time += time_step
    return NO_COLLISION
