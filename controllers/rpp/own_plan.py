"""The local plan of the releases up to Kilted, in which the controller cuts the plan itself.

Unlike the path handler's since then, it reaches to the circle of half the local costmap's side
about the robot, however long the way there is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.releases import RELEASES
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_pruning import closest_pose, first_closest_pose, first_pose_beyond

Array = NDArray[np.float64]


class CutPlan(NamedTuple):
    """A local plan (M, 3), a view of the whole one, and where the next one may begin."""

    poses: Array
    begin: int


class OwnPlan:
    """Cuts local plans out of a global one; pure."""

    def __init__(self, parameters: RegulatedPurePursuitParameters) -> None:
        self._release = RELEASES[parameters.nav2_release]
        self._is_humble = parameters.nav2_release == "humble"
        self._searched_m = parameters.max_robot_pose_search_dist

    def cut(self, plan: Array, begin: int, pose: Array, costmap: Costmap) -> CutPlan:
        """Returns the poses from the closest one on; none where it is itself out of reach.

        plan: (N, 3) the whole plan. begin: of what was left of it. pose: (3,) of the robot.
        """
        reach_m = 0.5 * max(costmap.size_x_m, costmap.size_y_m)
        first, stop = own_plan_range(
            plan,
            begin,
            float(pose[0]),
            float(pose[1]),
            self._search_distance_m(costmap, reach_m),
            reach_m,
            self._release.takes_first_of_equals,
            self._release.keeps_two_poses,
        )
        return CutPlan(plan[first:stop], first)

    def _search_distance_m(self, costmap: Costmap, reach_m: float) -> float:
        if self._searched_m is None:
            return reach_m if self._is_humble else 0.5 * costmap.size_x_m
        if self._searched_m < 0.0 and not self._is_humble:
            return math.inf
        return self._searched_m


@njit(cache=True)
def own_plan_range(plan, begin, x, y, searched, reach, takes_first, keeps_two):
    """Returns (first, stop): the poses plan[first:stop] that make the local plan.

    The first is the closest to the robot (x, y), m, within the arc length `searched` m from `begin`
    on; takes_first: of equals the first. keeps_two: the last one of these does not begin it. It
    stops before the first pose from there on that is farther than `reach` m from the robot.
    """
    count = plan.shape[0]
    end = first_pose_beyond(plan, begin, count, searched)
    if takes_first:
        first = first_closest_pose(plan, begin, end, x, y)
    else:
        first = closest_pose(plan, begin, end, x, y)
    if keeps_two and first == end - 1 and first > begin:
        first -= 1
    for i in range(first, count):
        if math.hypot(plan[i, 0] - x, plan[i, 1] - y) > reach:
            return first, i
    return first, count
