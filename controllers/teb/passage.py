"""The clearance that a band can keep: min_obstacle_dist, or less where the plan's way is narrow.

A band that asked for more than a corridor offers would pay for the missing clearance at every pose:
it would cling to the corridor's middle and not leave it for a goal beside the middle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controllers.teb.feasibility import OUTLINE_MARGIN_M
from drake_navbench.controllers.teb.local_plan import LocalPlan
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField, pose_clearance

# The largest slide of a band's pose along the plan while the band is optimised, m.
SLIDE_M = 0.15


class Passage(NamedTuple):
    """The places of the plan that are too narrow for min_obstacle_dist.

    points: (K, 2) m. shares: (K,) of min_obstacle_dist that a band can keep there.
    """

    points: Array
    shares: Array

    def shares_at(self, poses: Array) -> Array:
        """Returns (M,) the share of min_obstacle_dist that each of the poses (M, 3) shall keep."""
        if len(self.points) == 0:
            return np.ones(len(poses))
        offsets = poses[:, None, :2] - self.points[None, :, :]
        is_near = np.sum(offsets * offsets, axis=2) <= SLIDE_M * SLIDE_M
        return np.where(is_near, self.shares, 1.0).min(axis=1)


WIDE = Passage(np.empty((0, 2)), np.empty(0))


def plan_passage(
    plan: LocalPlan, field: DistanceField, discs: Array, min_obstacle_dist: float
) -> Passage:
    """Returns the poses at which the plan's way is too narrow for min_obstacle_dist.

    `Passage` holds these poses and the share of min_obstacle_dist that each of them keeps. A pose
    offers the clearance of the robot's discs there, or at the best pose beside it. On the way to a
    goal that is closer to an obstacle, a pose offers no more than the goal's clearance plus the
    distance to the goal. A band keeps half a cell less than offered, the room that it needs to
    bend, but at least what the check of the outline asks for. Where the plan is blocked, bands look
    for other ways, whose clearance is not known: the passage is WIDE.
    """
    poses = plan.poses[: plan.goal_index + 1]
    clearances = plan.clearances[: plan.goal_index + 1]
    if plan.blocked_index is not None or clearances.min() >= min_obstacle_dist:
        return WIDE
    offered = best_clearances(field, discs, poses, clearances, min_obstacle_dist)
    if clearances[-1] < min_obstacle_dist:
        steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        to_goal = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
        offered = np.minimum(offered, clearances[-1] + to_goal)
    is_narrow = offered < min_obstacle_dist
    kept = np.maximum(offered - 0.5 * field.resolution, min(OUTLINE_MARGIN_M, min_obstacle_dist))
    return Passage(poses[is_narrow, :2], kept[is_narrow] / min_obstacle_dist)


@njit(cache=True)
def best_clearances(field, discs, poses, clearances, enough):
    """Returns (P,) m: the largest clearance at each pose (P, 3) or straight to its left or right.

    discs: (D, 2) offset along x and radius of the robot's discs, m. clearances: (P,) m at the poses
    themselves. The robot is moved sideways by half a cell at a time
    until it has `enough` m, has moved by as much, or touches an obstacle.
    """
    best = clearances.copy()
    step = 0.5 * field.resolution
    count = int(enough / step) + 1
    for i in range(poses.shape[0]):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        for side in (-1.0, 1.0):
            for k in range(1, count + 1):
                if best[i] >= enough:
                    break
                offset = side * k * step
                clearance = pose_clearance(
                    field, discs, x - offset * math.sin(yaw), y + offset * math.cos(yaw), yaw
                )
                if clearance < 0.0:
                    break
                best[i] = max(best[i], clearance)
    return best
