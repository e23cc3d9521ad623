"""The carrot up to Kilted: at a straight distance, on the circle about the robot.

`poses_B` (M, 3) is the local plan in the robot's base frame: x m, y m, yaw rad.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def point_on_circle(x1, y1, x2, y2, radius):
    """Returns (x, y), m, where the line from inside to outside crosses the circle about (0, 0).

    (x1, y1) lies within `radius` m, (x2, y2) does not. Weisstein: Circle-Line Intersection.
    """
    dx, dy = x2 - x1, y2 - y1
    squared = dx * dx + dy * dy
    cross = x1 * y2 - x2 * y1
    farther = (x2 * x2 + y2 * y2) - (x1 * x1 + y1 * y1)
    root = math.copysign(1.0, farther) * math.sqrt(radius * radius * squared - cross * cross)
    return (cross * dy + dx * root) / squared, (-cross * dx + dy * root) / squared


@njit(cache=True)
def point_at(poses_B, distance, interpolates, goes_beyond):
    """Returns (x, y), m, of the first place of a plan that is `distance` m from the robot.

    interpolates: the place may lie between two poses; otherwise it is the farther of them.
    goes_beyond: a plan that ends nearer than `distance` goes on along its last segment; otherwise,
    and for a plan of one pose, the place is the last pose.
    """
    last = poses_B.shape[0] - 1
    for i in range(last + 1):
        x, y = poses_B[i, 0], poses_B[i, 1]
        if math.hypot(x, y) >= distance:
            if i == 0 or not interpolates:
                return x, y
            return point_on_circle(poses_B[i - 1, 0], poses_B[i - 1, 1], x, y, distance)
    x, y = poses_B[last, 0], poses_B[last, 1]
    if not goes_beyond or last == 0:
        return x, y
    direction = math.atan2(y - poses_B[last - 1, 1], x - poses_B[last - 1, 0])
    beyond_x = x + math.cos(direction) * distance
    beyond_y = y + math.sin(direction) * distance
    return point_on_circle(x, y, beyond_x, beyond_y, distance)


@njit(cache=True)
def distance_to_cusp(poses_B, heeds_turns):
    """Returns the straight distance from the robot to the plan's first cusp, m; inf without a cusp.

    A cusp is a pose at which the plan turns by more than a right angle; with heeds_turns also a
    pose whose neighbour has the same place, but another heading.
    """
    for i in range(1, poses_B.shape[0] - 1):
        to_x, to_y = poses_B[i, 0] - poses_B[i - 1, 0], poses_B[i, 1] - poses_B[i - 1, 1]
        on_x, on_y = poses_B[i + 1, 0] - poses_B[i, 0], poses_B[i + 1, 1] - poses_B[i, 1]
        is_cusp = to_x * on_x + to_y * on_y < 0.0
        if heeds_turns:
            is_cusp |= to_x == 0.0 and to_y == 0.0 and poses_B[i - 1, 2] != poses_B[i, 2]
            is_cusp |= on_x == 0.0 and on_y == 0.0 and poses_B[i, 2] != poses_B[i + 1, 2]
        if is_cusp:
            return math.hypot(poses_B[i, 0], poses_B[i, 1])
    return math.inf
