"""The inputs of the network: gaps around the outline, direction to the goal, the robot's speed.

The same numbers come from the points of a scan, when it learns, and from the lethal cells of a
costmap, when it drives as a controller.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import see_point

SECTOR_COUNT = 24
# Gaps enter as exp(-gap / scale): near ones count, and those at the end of a costmap hardly.
GAP_SCALE_M = 0.6
# Points farther than this from the base are not seen, as by a costmap of 6 m.
SIGHT_M = 2.9
# Distances to the goal enter as tanh(d / far) and exp(-(d / near)^2 / 2).
FAR_M = 3.0
NEAR_M = 0.4
GOAL_FEATURE_COUNT = 7
FEATURE_COUNT = SECTOR_COUNT + GOAL_FEATURE_COUNT + 2


def outline_radii(outline: Array, count: int) -> Array:
    """Returns (count,) m: how far an outline (K, 2) m, base frame, reaches in each sector's middle.

    Sectors are counted from the one that begins straight behind, counter-clockwise.
    """
    angles = -math.pi + (np.arange(count) + 0.5) * 2.0 * math.pi / count
    starts, edges = outline, np.roll(outline, -1, axis=0) - outline
    radii = np.empty(count)
    for k, angle in enumerate(angles):
        direction = np.array([math.cos(angle), math.sin(angle)])
        across = direction[0] * edges[:, 1] - direction[1] * edges[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (starts[:, 0] * edges[:, 1] - starts[:, 1] * edges[:, 0]) / across
            share = (starts[:, 0] * direction[1] - starts[:, 1] * direction[0]) / across
        radii[k] = along[(along > 0.0) & (share >= 0.0) & (share <= 1.0)].min()
    return radii


@njit(cache=True)
def sector_closeness(points, x, y, yaw, radii, reach):
    """Returns (S,) exp(-gap/scale) of the nearest point of each sector, 0 where there is none.

    points: (N, 2) m. x, y, yaw: the base in their frame. radii: (S,) of the outline. reach: half
    the size of a point, m.
    """
    count = radii.shape[0]
    closeness = np.zeros(count)
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    for n in range(points.shape[0]):
        ahead, left = see_point(points[n, 0], points[n, 1], x, y, cos_yaw, sin_yaw)
        distance = math.hypot(ahead, left)
        if not distance <= SIGHT_M:
            continue
        sector = int((math.atan2(left, ahead) + math.pi) * count / (2.0 * math.pi)) % count
        gap = max(0.0, distance - reach - radii[sector])
        closeness[sector] = max(closeness[sector], math.exp(-gap / GAP_SCALE_M))
    return closeness


def goal_features(goal: Array) -> Array:
    """Returns (7,) the features of a goal (3,) x m, y m, yaw rad in the base frame."""
    x, y, yaw = goal.tolist()
    distance_m = math.hypot(x, y)
    nearness = math.exp(-0.5 * (distance_m / NEAR_M) ** 2)
    # Right at the goal its direction means nothing.
    share = distance_m / (distance_m + 0.1)
    bearing = math.atan2(y, x)
    return np.array(
        [
            math.tanh(distance_m / FAR_M),
            share * math.cos(bearing),
            share * math.sin(bearing),
            nearness,
            nearness * math.sin(yaw),
            nearness * math.cos(yaw),
            (1.0 - nearness) * math.sin(yaw),
        ]
    )


def features(closeness: Array, goal: Array, twist: Array, limits: Array) -> Array:
    """Returns (33,) the network's inputs: closeness, features of the goal, twist over its limits.

    twist, limits: (2,) v m/s, w rad/s.
    """
    return np.concatenate([closeness, goal_features(goal), twist / limits])
