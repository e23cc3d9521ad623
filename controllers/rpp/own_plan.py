"""The local plan of the releases up to Kilted, in which the controller cuts the plan itself.

Unlike the path handler's since then, it reaches to the circle of half the local costmap's side
about the robot, however long the way there is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.releases import RULES
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_pruning import range_in_circle
from drake_navbench.releases import Release

Array = NDArray[np.float64]


class CutPlan(NamedTuple):
    """A local plan (M, 3), a view of the whole one, and the index where the next one may begin."""

    poses: Array
    begin: int


class OwnPlan:
    """Cuts local plans out of a global one; pure."""

    def __init__(self, parameters: RegulatedPurePursuitParameters) -> None:
        self._release = RULES[parameters.nav2_release]
        self._is_humble = parameters.nav2_release is Release.HUMBLE
        self._searched_m = parameters.max_robot_pose_search_dist

    def cut(self, plan: Array, begin: int, pose: Array, costmap: Costmap) -> CutPlan:
        """Returns the poses from the closest one on; none where it is itself out of reach.

        plan: (N, 3) the whole plan. begin: index of the first pose left of it. pose: (3,) of the
        robot.
        """
        reach_m = 0.5 * max(costmap.nav2_size_m)
        first, stop = range_in_circle(
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
            return reach_m if self._is_humble else 0.5 * costmap.nav2_size_m[0]
        if self._searched_m < 0.0 and not self._is_humble:
            return math.inf
        return self._searched_m
