"""The local plan of the releases up to Kilted, in which MPPI cuts the global plan itself.

Source: nav2_mppi_controller (PathHandler), tags 1.1.20 to 1.4.2.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from drake_navbench.controller import Observation
from drake_navbench.controllers.mppi.memory import PlanState
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.releases import RULES
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_pruning import (
    closest_pose,
    first_closest_pose,
    first_pose_beyond,
    first_pose_off_grid,
    is_within_tolerances,
)

# With fewer poses a plan has no cusp.
LEAST_POSES_WITH_CUSP = 3


class OwnPlan:
    """Cuts local plans out of a global one; pure."""

    def __init__(self, parameters: MppiParameters) -> None:
        self._parameters = parameters
        self._takes_first = RULES[parameters.nav2_release].takes_first_of_equals

    def cut(self, observation: Observation, state: PlanState) -> tuple[Array, PlanState]:
        """Returns the local plan (M, 3), a view, and the state for the next cycle.

        The local plan is empty where nothing is left of the plan on the costmap.
        """
        p, costmap, pose = self._parameters, observation.costmap, observation.pose
        whole = observation.whole_plan
        if observation.plan_id != state.plan_id:
            state = PlanState(observation.plan_id, 0, self._end(whole, 0))
        x, y, yaw = pose.tolist()
        searched_m = p.max_robot_pose_search_dist
        if searched_m is None:
            searched_m = 0.5 * max(costmap.costs.shape) * costmap.resolution
        first, stop = own_plan_range(
            whole,
            state.begin,
            state.end,
            (x, y),
            searched_m,
            p.prune_distance,
            costmap.grid,
            self._takes_first,
        )
        state = state._replace(begin=first)
        if state.end < len(whole) and is_within_tolerances(
            whole, state.end - 1, x, y, yaw, p.inversion_xy_tolerance, p.inversion_yaw_tolerance
        ):
            state = state._replace(begin=state.end, end=self._end(whole, state.end))
        return whole[first:stop], state

    def _end(self, plan: Array, begin: int) -> int:
        if not self._parameters.enforce_path_inversion:
            return len(plan)
        return first_cusp_end(plan, begin)


@njit(cache=True)
def own_plan_range(plan, begin, end, position, searched, ahead, grid, takes_first):
    """Returns (first, stop): the poses plan[first:stop] that make the local plan.

    The first is the closest to the robot's position (x, y), m, within the arc length `searched` m
    from `begin` on; takes_first: of equals the first. It ends at the arc length `ahead` m, at
    `end`, or before the first pose off the `Grid`.
    """
    x, y = position
    searched_end = first_pose_beyond(plan, begin, end, searched)
    if takes_first:
        first = first_closest_pose(plan, begin, searched_end, x, y)
    else:
        first = closest_pose(plan, begin, searched_end, x, y)
    stop = first_pose_beyond(plan, first, end, ahead)
    return first, first_pose_off_grid(plan, first, stop, grid)


@njit(cache=True)
def first_cusp_end(plan, begin):
    """Returns the index after the first pose from `begin` on where a plan turns back, else N.

    It turns back where two segments that follow each other have a negative product, in float32.
    """
    count = plan.shape[0]
    if count - begin < LEAST_POSES_WITH_CUSP:
        return count
    for i in range(begin + 1, count - 1):
        to_x = np.float32(plan[i, 0] - plan[i - 1, 0])
        to_y = np.float32(plan[i, 1] - plan[i - 1, 1])
        on_x = np.float32(plan[i + 1, 0] - plan[i, 0])
        on_y = np.float32(plan[i + 1, 1] - plan[i, 1])
        if to_x * on_x + to_y * on_y < 0.0:
            return i + 1
    return count
