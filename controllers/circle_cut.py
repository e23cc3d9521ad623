"""The local plan of pursuit controllers up to Kilted, which cut the global plan themselves.

Unlike the path handler's since then, it reaches to the circle of half the local costmap's side
about the robot, however long the way there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from drake_navbench.controller import Observation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_pruning import range_in_circle
from drake_navbench.kernels.read_only import read_only


@dataclass(frozen=True)
class CircleCut:
    """The rules by which a controller cuts the global plan.

    searched_m: arc length that is searched for the pose closest to the robot; None: half the local
    costmap's side along x, or with `defaults_to_longer` half its longer side. With `may_search_all`
    a negative length means the whole plan. takes_first: whether it takes the first of equally close
    poses; else the last one. keeps_two: the local plan never begins with the last pose in reach.
    """

    searched_m: float | None
    takes_first: bool
    keeps_two: bool = False
    defaults_to_longer: bool = False
    may_search_all: bool = True

    def cut(self, observation: Observation, begin: int) -> tuple[Array, int]:
        """Returns the local plan (M, 3), a view, and the index at which the next one may begin.

        begin: index of the first pose that is left of the whole plan. The local plan has no poses
        where the closest one is itself out of reach.
        """
        whole = observation.whole_plan
        if len(whole) == 0:
            return whole, begin
        size_m = observation.costmap.nav2_size_m
        reach_m = 0.5 * max(size_m)
        searched_m = self.searched_m
        if searched_m is None:
            searched_m = reach_m if self.defaults_to_longer else 0.5 * size_m[0]
        elif searched_m < 0.0 and self.may_search_all:
            searched_m = math.inf
        first, stop = range_in_circle(
            read_only(whole),
            begin,
            float(observation.pose[0]),
            float(observation.pose[1]),
            searched_m,
            reach_m,
            self.takes_first,
            self.keeps_two,
        )
        return whole[first:stop], first
