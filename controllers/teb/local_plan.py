"""The task of a band in this cycle: the next part of the plan, and where it is blocked."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controller import InvalidPath, Observation
from drake_navbench.controllers.teb.feasibility import OUTLINE_MARGIN_M
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField, path_clearance
from drake_navbench.kernels.path_geometry import path_length

# The share of its wanted clearance that a band always keeps; it gives up the rest at a price.
LEAST_CLEARANCE_RATIO = 0.5
# The local goal moves back at most this far to a pose with more clearance, m.
LONGEST_RETREAT_M = 0.5
# Plan points nearer to the robot say nothing about the direction to take, m.
IGNORED_NEAR_ROBOT_M = 0.15
# The local goal is the plan's end where it is closer to the end than this, m.
SAME_GOAL_M = 1e-3


class LocalPlan(NamedTuple):
    """The part of the plan that a band covers.

    poses: (P, 3). clearances: (P,) m, of the robot's discs at the poses. goal_index: the pose that
    the band ends at. blocked_index: the first pose before it without clearance, or None.
    ends_plan: whether the goal is the end of the whole plan.
    """

    poses: Array
    clearances: Array
    goal_index: int
    blocked_index: int | None
    ends_plan: bool

    @property
    def path(self) -> Array:
        """(P, 2) m, the points from the robot to the goal, without those at the robot."""
        points = self.poses[: self.goal_index + 1, :2]
        far = np.hypot(*(points - self.poses[0, :2]).T) > IGNORED_NEAR_ROBOT_M
        return points[far]

    @property
    def is_cut_short(self) -> bool:
        """Whether the goal had to be moved back from where the plan leads."""
        return self.goal_index < len(self.poses) - 1

    def goal(self, overwrite_orientation: bool) -> Array:
        """Returns (3,) the local goal; its yaw along the plan unless it is the plan's end."""
        goal = self.poses[self.goal_index].copy()
        if overwrite_orientation and not self.ends_plan and self.goal_index > 0:
            step = self.poses[self.goal_index, :2] - self.poses[self.goal_index - 1, :2]
            if np.hypot(*step) > 0.0:
                goal[2] = np.arctan2(step[1], step[0])
        return goal

    def before_the_block(self, min_obstacle_dist: float) -> LocalPlan:
        """Returns the plan cut before the block, at a pose with room to the block if possible."""
        assert self.blocked_index is not None
        last = _roomy_index(self.poses, self.clearances, self.blocked_index - 1, min_obstacle_dist)
        return self._replace(goal_index=max(last, 0), blocked_index=None, ends_plan=False)


def _roomy_index(poses: Array, clearances: Array, last: int, min_obstacle_dist: float) -> int:
    """Returns the index of a blocked plan's last pose: `last`, or one with more room before it.

    That is the last pose within LONGEST_RETREAT_M of `last` with min_obstacle_dist of clearance, or
    else with LEAST_CLEARANCE_RATIO times it.
    """
    for wanted in (min_obstacle_dist, LEAST_CLEARANCE_RATIO * min_obstacle_dist):
        roomy = np.flatnonzero(clearances[: last + 1] >= wanted)
        if roomy.size and path_length(poses[int(roomy[-1]) : last + 1]) <= LONGEST_RETREAT_M:
            return int(roomy[-1])
    return last


def cut_local_plan(
    observation: Observation, parameters: TebParameters, *, discs: Array, field: DistanceField
) -> LocalPlan:
    """Returns the next max_global_plan_lookahead_dist of the plan; raises InvalidPath if empty."""
    plan = observation.plan
    if len(plan) == 0:
        raise InvalidPath("plan: got no poses, expected at least one")
    if not np.isfinite(plan).all():
        raise InvalidPath("plan: got coordinates that are not finite, expected numbers")
    nearest = int(np.argmin(np.sum((plan[:, :2] - observation.pose[:2]) ** 2, axis=1)))
    poses = plan[nearest:]
    if parameters.max_global_plan_lookahead_dist > 0.0:
        lengths = np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))
        beyond = np.searchsorted(lengths, parameters.max_global_plan_lookahead_dist)
        poses = poses[: int(beyond) + 2]
    clearances = path_clearance(field, discs, poses.copy())
    # The plan is blocked at the first pose where the outline check would fail.
    passable = clearances >= min(
        OUTLINE_MARGIN_M, LEAST_CLEARANCE_RATIO * parameters.min_obstacle_dist
    )
    clear = np.flatnonzero(passable)
    goal_index = int(clear[-1]) if clear.size else 0
    at_end = goal_index == len(poses) - 1
    ends_plan = at_end and bool(np.hypot(*(poses[-1, :2] - observation.goal[:2])) < SAME_GOAL_M)
    if not ends_plan:
        goal_index = _roomy_index(poses, clearances, goal_index, parameters.min_obstacle_dist)
    blocked = np.flatnonzero(~passable[: goal_index + 1])
    return LocalPlan(
        poses=poses,
        clearances=clearances,
        goal_index=goal_index,
        blocked_index=int(blocked[0]) if blocked.size else None,
        ends_plan=ends_plan,
    )


def via_points(plan: LocalPlan, separation_m: float) -> Array:
    """Returns (V, 2) m: plan points at least `separation_m` apart; none if it is not positive."""
    if separation_m <= 0.0:
        return np.empty((0, 2))
    # A copy: for read-only poses the kernel would be compiled once more.
    ahead = plan.poses[: plan.goal_index].copy()
    return plan.poses[_spaced_indices(ahead, separation_m), :2]


@njit(cache=True)
def _spaced_indices(poses, separation_m):
    """Returns (V,) the indices of poses at least a distance from the one before, or the first."""
    chosen = np.empty(poses.shape[0], dtype=np.int64)
    count, last = 0, 0
    for i in range(1, poses.shape[0]):
        if math.hypot(poses[i, 0] - poses[last, 0], poses[i, 1] - poses[last, 1]) >= separation_m:
            chosen[count] = last = i
            count += 1
    return chosen[:count]
