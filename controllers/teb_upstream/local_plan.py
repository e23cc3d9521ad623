"""The part of the global plan that a cycle's bands cover, as teb_local_planner cuts it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controller import Observation
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.kernels.read_only import read_only

# The radius of the region as a share of half the costmap's side, so that the map shows the
# obstacles at its edge.
REGION_RATIO = 0.85
# Squared distance at which the robot counts as on the plan, m^2.
ON_PLAN_M2 = 0.05
# The heading of a local goal is the mean over this many pieces of the plan behind it.
HEADING_PIECES = 3


class LocalPlan(NamedTuple):
    """poses: (P, 3), the robot's first, the local goal last. via_points: (V, 2) m.

    begin: index of the first pose that is kept of the whole plan.
    """

    poses: Array
    via_points: Array
    begin: int


def cut_local_plan(
    observation: Observation, parameters: TebUpstreamParameters, begin: int = 0
) -> LocalPlan:
    """Returns the local plan; the observation's whole plan must hold a pose.

    begin: index of the first pose that earlier cycles have kept of the whole plan.
    """
    whole, pose = read_only(observation.whole_plan), read_only(observation.pose)
    begin = pruned_begin(whole, begin, pose, parameters.global_plan_prune_distance)
    plan, costmap = whole[begin:], observation.costmap
    region = REGION_RATIO * 0.5 * max(costmap.size_x_m, costmap.size_y_m)
    first, end = plan_window(plan, pose, region, parameters.max_global_plan_lookahead_dist)
    if end <= first:
        first, end = len(plan) - 1, len(plan)
    poses = plan[first:end].copy()
    via_points = spaced_points(poses, parameters.global_plan_viapoint_sep)
    if parameters.global_plan_overwrite_orientation:
        poses[-1, 2] = goal_heading(plan, end - 1)
    if len(poses) == 1:
        poses = np.vstack([pose, poses])
    poses[0] = pose
    return LocalPlan(poses, via_points, begin)


@njit(cache=True)
def pruned_begin(plan, begin, pose, behind):
    """Returns the index of the first pose from `begin` on that is nearer than `behind` m.

    Without such a pose `begin` stays. Passed poses stay dropped until there is a new plan.
    """
    for i in range(begin, plan.shape[0]):
        dx, dy = pose[0] - plan[i, 0], pose[1] - plan[i, 1]
        if dx * dx + dy * dy < behind * behind:
            return i
    return begin


@njit(cache=True)
def plan_window(plan, pose, region, longest):
    """Returns (first, end) of the plan's poses (M, 3) within the region (m) about the robot.

    It starts at the nearest pose before the plan leaves the region, or, where the robot is near the
    plan, before the plan leads away; it ends with the first pose beyond the region or the length
    (m; not positive: any).
    """
    first, nearest = 0, 1e10
    on_plan = False
    for j in range(plan.shape[0]):
        squared = (pose[0] - plan[j, 0]) ** 2 + (pose[1] - plan[j, 1]) ** 2
        if squared > region * region or (on_plan and squared > nearest):
            break
        if squared < nearest:
            nearest, first = squared, j
            on_plan = on_plan or squared < ON_PLAN_M2
    end, length, squared = first, 0.0, nearest
    while (
        end < plan.shape[0] and squared <= region * region and (longest <= 0.0 or length <= longest)
    ):
        squared = (pose[0] - plan[end, 0]) ** 2 + (pose[1] - plan[end, 1]) ** 2
        if end > 0:
            length += math.hypot(plan[end, 0] - plan[end - 1, 0], plan[end, 1] - plan[end - 1, 1])
        end += 1
    return first, end


def goal_heading(plan: Array, index: int) -> float:
    """Returns the yaw (rad) of a local goal, plan[index]: the mean direction behind it.

    Near the end of the plan it is that of the plan's last pose.
    """
    if index > len(plan) - HEADING_PIECES - 2:
        return float(plan[-1, 2])
    pieces = np.diff(plan[index : index + HEADING_PIECES + 1, :2], axis=0)
    angles = np.arctan2(pieces[:, 1], pieces[:, 0])
    x, y = float(np.cos(angles).sum()), float(np.sin(angles).sum())
    return math.atan2(y, x) if x != 0.0 or y != 0.0 else 0.0


def spaced_points(poses: Array, separation_m: float) -> Array:
    """Returns (V, 2) m: positions of poses (P, 3) at a distance apart; none for 0 or less."""
    if separation_m <= 0.0:
        return np.empty((0, 2))
    chosen, previous = [], 0
    for i in range(1, len(poses)):
        if math.hypot(*(poses[i, :2] - poses[previous, :2])) >= separation_m:
            chosen.append(i)
            previous = i
    return poses[chosen, :2].copy()


@njit(cache=True)
def lethal_points(grid, pose, behind):
    """Returns (N, 2) m, the centres of the lethal cells, column by column.

    Without the last row and column, and without those behind the robot and farther than `behind` m.
    """
    rows, columns = grid.costs.shape
    points = np.empty((rows * columns, 2))
    heading_x, heading_y = math.cos(pose[2]), math.sin(pose[2])
    used = 0
    for column in range(columns - 1):
        for row in range(rows - 1):
            if grid.costs[row, column] != LETHAL:
                continue
            x = grid.origin_x + (column + 0.5) * grid.resolution
            y = grid.origin_y + (row + 0.5) * grid.resolution
            dx, dy = x - pose[0], y - pose[1]
            if dx * heading_x + dy * heading_y < 0.0 and dx * dx + dy * dy > behind * behind:
                continue
            points[used, 0], points[used, 1] = x, y
            used += 1
    return points[:used].copy()
