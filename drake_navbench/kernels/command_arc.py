"""The arc that a command leads along, and the first place on it that is in collision.

Pure pursuit controllers look along it before they send the command. Source:
nav2_regulated_pure_pursuit_controller's CollisionChecker; vector_pursuit_controller has the same.
Poses are (x m, y m, yaw rad); v is in m/s, w in rad/s.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.collision_check import is_pose_in_collision

# The robot turns in place where its speed is below the first and its turn rate above the second.
IN_PLACE_SPEED_MPS = 0.01
IN_PLACE_TURN_RATE_RADPS = 0.01


@register_jitable
def arc_period(circumscribed_radius, resolution, v, w):
    """Returns the time in which no point of the robot moves farther than a cell, s; inf at rest."""
    if abs(v) < IN_PLACE_SPEED_MPS and abs(w) > IN_PLACE_TURN_RATE_RADPS:
        half_angle = 0.5 * resolution / circumscribed_radius
        return 2.0 * math.sin(half_angle) / abs(w)
    return resolution / abs(v) if v != 0.0 else math.inf


@njit(cache=True)
def project_arc(x, y, yaw, v, w, period, time_limit, distance_limit):
    """Returns (N, 3) the poses that a command (v, w) leads to, the present one first.

    One pose each `period` s until `time_limit` s, as long as they are within `distance_limit` m of
    the start. Each step is straight, along the heading at its start.
    """
    arc = np.empty((2 + (int(time_limit / period) if period < time_limit else 0), 3))
    arc[0, 0], arc[0, 1], arc[0, 2] = x, y, yaw
    count = 1
    while count * period < time_limit:
        previous_yaw = arc[count - 1, 2]
        # The collision check stops at a distance that is often a multiple of the step: this
        # grouping decides the last bit, and so whether the pose at that distance is checked.
        arc[count, 0] = arc[count - 1, 0] + period * (v * math.cos(previous_yaw))
        arc[count, 1] = arc[count - 1, 1] + period * (v * math.sin(previous_yaw))
        arc[count, 2] = previous_yaw + period * w
        if math.hypot(arc[count, 0] - x, arc[count, 1] - y) > distance_limit:
            break
        count += 1
    return arc[:count]


@register_jitable
def first_collision(grid, tracks_unknown, footprint, arc):
    """Returns the index of the first pose of an arc (N, 3) in collision, -1 where there is none."""
    for i in range(arc.shape[0]):
        if is_pose_in_collision(grid, tracks_unknown, footprint, arc[i, 0], arc[i, 1], arc[i, 2]):
            return i
    return -1
