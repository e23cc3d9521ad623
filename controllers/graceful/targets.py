"""Targets on the plan, in the base frame: headings of its poses, distances, the point ahead.

Source: nav2_graceful_controller (validateOrientations, computeDistanceAlongPath) and nav2_util's
getLookAheadPoint, branch lyrical. A plan is (M, 3): x m, y m, yaw rad.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.angles import wrap

# Headings that differ by less than this are one heading, rad.
SAME_HEADING_RAD = 1e-6
# With fewer poses, only the first and the last, there is nothing to orient.
LEAST_POSES_TO_ORIENT = 3


@njit(cache=True)
def has_orientations(plan):
    """Tells whether the poses between first and last have headings of their own.

    As in Nav2 a difference counts with its sign: a plan that only turns left seems to have none.
    """
    for i in range(2, plan.shape[0] - 1):
        if wrap(plan[1, 2] - plan[i, 2]) > SAME_HEADING_RAD:
            return True
    return False


@njit(cache=True)
def orient(plan):
    """Points each pose but the last at the next one, in place, where the plan has no headings."""
    if plan.shape[0] < LEAST_POSES_TO_ORIENT or has_orientations(plan):
        return
    for i in range(plan.shape[0] - 1):
        plan[i, 2] = math.atan2(plan[i + 1, 1] - plan[i, 1], plan[i + 1, 0] - plan[i, 0])


@njit(cache=True)
def distances_along(plan):
    """Returns (M,) each pose's distance from the robot, to the first pose and along the plan, m."""
    distances = np.empty(plan.shape[0])
    distances[0] = math.hypot(plan[0, 0], plan[0, 1])
    for i in range(1, plan.shape[0]):
        distances[i] = distances[i - 1] + math.hypot(
            plan[i - 1, 0] - plan[i, 0], plan[i - 1, 1] - plan[i, 1]
        )
    return distances


@njit(cache=True)
def point_ahead(plan, lookahead):
    """Returns (x, y, yaw, distance): the target `lookahead` m along the plan from its first pose.

    It faces along its segment. On a shorter plan the target is the last pose. distance: along the
    plan, m.
    """
    travelled = 0.0
    for i in range(1, plan.shape[0]):
        delta_x, delta_y = plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1]
        length = math.hypot(delta_x, delta_y)
        if travelled + length >= lookahead:
            # Two poses in one place, at a lookahead of 0, are one target.
            ratio = (lookahead - travelled) / length if length > 0.0 else 0.0
            return (
                plan[i - 1, 0] + ratio * delta_x,
                plan[i - 1, 1] + ratio * delta_y,
                math.atan2(delta_y, delta_x),
                lookahead,
            )
        travelled += length
    return plan[-1, 0], plan[-1, 1], plan[-1, 2], travelled
