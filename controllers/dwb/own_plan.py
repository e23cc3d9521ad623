"""The local plan of the releases up to Kilted, in which DWB cuts the global plan itself.

Unlike the path handler's local plan since then, it begins up to `prune_distance` behind the robot,
at the first pose that is near enough, not at the nearest one, and ends by the distance from the
robot. Source: dwb_core (DWBLocalPlanner::transformGlobalPlan), branches humble to kilted; some
name their exceptions differently, to the same effect.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numba import njit

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_pruning import first_pose_beyond
from drake_navbench.plugins.releases import Release

if TYPE_CHECKING:
    from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters


class OwnPlan:
    """Cuts local plans out of a global one; pure."""

    def __init__(self, parameters: DynamicWindowApproachParameters) -> None:
        forward = parameters.forward_prune_distance
        is_humble = parameters.nav2_release is Release.HUMBLE
        if forward < 0.0 and not is_humble:
            forward = math.inf
        self._prunes = parameters.prune_plan
        self._behind_m = parameters.prune_distance if parameters.prune_plan else math.inf
        self._ahead_m = forward if parameters.shorten_transformed_plan else math.inf
        self._searched_m = parameters.prune_distance if is_humble else forward

    def cut(self, plan: Array, begin: int, pose: Array, costmap: Costmap) -> tuple[Array, int]:
        """Returns the local plan (M, 3), a view, and the index at which the next one may begin.

        plan: (N, 3) the whole plan. begin: index of the first pose left of it. pose: (3,) of the
        robot. Where no pose is near enough, the local plan is empty, and as in Nav2 all poses that
        were looked at are dropped.
        """
        reach_m = 0.5 * max(costmap.costs.shape) * costmap.resolution
        first, stop = own_plan_range(
            plan,
            begin,
            float(pose[0]),
            float(pose[1]),
            self._searched_m,
            min(reach_m, self._behind_m),
            min(reach_m, self._ahead_m),
        )
        return plan[first:stop], first if self._prunes else begin


@njit(cache=True)
def own_plan_range(plan, begin, x, y, searched, behind, ahead):
    """Returns (first, stop): the poses plan[first:stop] that make the local plan.

    The first is nearer than `behind` m to the robot (x, y), m, and lies within the arc length
    `searched` m from `begin` on; where there is none, the one after that. It stops before the first
    pose from there on that is farther than `ahead` m.
    """
    count = plan.shape[0]
    first = first_pose_beyond(plan, begin, count, searched)
    for i in range(begin, first):
        if math.hypot(plan[i, 0] - x, plan[i, 1] - y) < behind:
            first = i
            break
    for i in range(first, count):
        if math.hypot(plan[i, 0] - x, plan[i, 1] - y) > ahead:
            return first, i
    return first, count
