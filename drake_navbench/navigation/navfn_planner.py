"""Nav2's NavFn planner: down the slope of a navigation function, by Dijkstra's search or A*.

The function spreads from the start; the path runs down its slope from the goal and is turned round.

Nav2's NavFn takes the lattice point nearest to a pose as the pose's cell; a costmap takes the
square that holds the pose. So paths lie half a cell to the lower left of the costs. In the last
half cell before the map's right or upper edge the lattice point is off the map; Humble refuses it.
Beyond the right edge it is the first cell of the next row since Iron. Beyond the upper edge Nav2
then reads and writes memory that is not the map's; here such a start is refused, and such a goal is
not reached.

Nav2 frees the start's cell in the costmap for good; here the costmap stays as it is.
Source: nav2_navfn_planner (NavfnPlanner), branches humble to lyrical. Before Lyrical
max_cycles_factor is fixed at its default; Humble has no codes for failures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from drake_navbench.kernels import navfn
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    StartOccupied,
    StartOutsideMapBounds,
    as_pose,
    cells_of_request,
    outside_map,
)
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.typed_yaml import FrozenModel

# Within this of the goal, the path's last position becomes the goal's, m^2.
SAME_POSITION_M2 = 1e-6
# If both components of the path's last step are smaller than this, m, it gives no direction.
SAME_COMPONENT_M = 1e-4


class NavfnPlannerParameters(FrozenModel):
    """Parameters of nav2_navfn_planner::NavfnPlanner."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "max_cycles_factor": since(Release.LYRICAL),
    }

    plugin: Literal["nav2_navfn_planner::NavfnPlanner"] = "nav2_navfn_planner::NavfnPlanner"
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: Iron refuses a start on a lethal cell; up to "
        "Iron the goal is appended even where the path ends at its position.",
    )
    tolerance: float = Field(
        0.5,
        ge=0.0,
        description="Distance from the goal at which a path may end where the goal cannot be "
        "reached [m].",
    )
    use_astar: bool = Field(False, description="Search by A* instead of Dijkstra's algorithm.")
    max_cycles_factor: int = Field(
        4, gt=0, description="Largest number of path steps, per edge cell of the map [steps/cell]."
    )
    allow_unknown: bool = Field(True, description="Let paths cross unknown cells.")
    use_final_approach_orientation: bool = Field(
        False, description="End the path with its own direction, not with the goal's heading."
    )


class NavfnPlanner:
    """Answers requests by NavFn.

    Points are half a cell apart, all headings are 0 but the last, as Nav2 leaves them.
    """

    nav2_plugin = "nav2_navfn_planner::NavfnPlanner"
    Parameters = NavfnPlannerParameters

    def __init__(self, parameters: NavfnPlannerParameters, footprint: Array | None) -> None:
        """footprint: without effect; the search sees the cell under the robot's centre only."""
        self.parameters = parameters

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """See `Planner.plan`. Raises GoalOccupied only where the tolerance is 0."""
        start, goal = as_pose(start, "start"), as_pose(goal, "goal")
        start_cell, (column, row) = cells_of_request(costmap, start, goal)
        parameters = self.parameters
        self._check_start(costmap, start_cell, is_at_goal=np.array_equal(start[:2], goal[:2]))
        is_checked = parameters.tolerance == 0.0 and parameters.nav2_release > Release.HUMBLE
        if is_checked and costmap.costs[row, column] == LETHAL:
            raise GoalOccupied("goal: its cell is lethal, and tolerance is 0")
        if np.array_equal(start[:2], goal[:2]):
            keeps_start_yaw = parameters.use_final_approach_orientation
            return np.array([[start[0], start[1], start[2] if keeps_start_yaw else goal[2]]])
        path = self._path(costmap, start, goal)
        if parameters.use_final_approach_orientation:
            path[-1, 2] = _final_direction(path)
        return path

    def _check_start(
        self, costmap: Costmap, start_cell: tuple[int, int], *, is_at_goal: bool
    ) -> None:
        """Raises StartOccupied where the release plans nothing from a lethal cell (column, row)."""
        release = self.parameters.nav2_release
        is_refused = release is Release.IRON or (release is Release.HUMBLE and is_at_goal)
        if is_refused and costmap.costs[start_cell[1], start_cell[0]] == LETHAL:
            raise StartOccupied(
                f"start: its cell is lethal, and {release} plans nothing from there"
            )

    def _path(self, costmap: Costmap, start: Array, goal: Array) -> Array:
        """Returns the path (N, 3), N at least 2, to the goal or near it; raises a PlanningError."""
        parameters = self.parameters
        rows, columns = costmap.costs.shape
        frame = (costmap.origin_x, costmap.origin_y, costmap.resolution)
        seed_x, seed_y, is_on_map = navfn.nearest_cell(start[0], start[1], *frame, columns, rows)
        is_humble = parameters.nav2_release is Release.HUMBLE
        if seed_y * columns + seed_x >= costmap.costs.size or (is_humble and not is_on_map):
            raise outside_map(costmap, start, StartOutsideMapBounds, "start")
        goal_x, goal_y, is_on_map = navfn.nearest_cell(goal[0], goal[1], *frame, columns, rows)
        if is_humble and not is_on_map:
            raise outside_map(costmap, goal, GoalOutsideMapBounds, "goal")
        potential = navfn.spread_potential(
            navfn.traversal_costs(costmap.costs, allow_unknown=parameters.allow_unknown),
            seed_x,
            seed_y,
            goal_x,
            goal_y,
            parameters.use_astar,
        )
        end_x, end_y, found = navfn.reached_point_near(
            potential, *frame, goal[0], goal[1], parameters.tolerance
        )
        if not found:
            raise NoValidPathCouldBeFound(
                f"goal: not reachable within a tolerance of {parameters.tolerance:g} m"
            )
        first_x, first_y, *_ = navfn.nearest_cell(end_x, end_y, *frame, columns, rows)
        steps = navfn.path_down(
            potential,
            first_x,
            first_y,
            seed_x,
            seed_y,
            max(columns, rows) * parameters.max_cycles_factor,
        )
        if len(steps) == 0:
            raise NoValidPathCouldBeFound("goal: reached, but no path leads back from it")
        end = np.array([end_x, end_y, goal[2]])
        repeats_end = parameters.nav2_release <= Release.IRON
        return _with_end(_as_poses(costmap, steps), end, repeats_end=repeats_end)


def _as_poses(costmap: Costmap, steps: NDArray[np.float32]) -> Array:
    """Returns (N, 3) poses, heading 0, from start to goal; steps (N, 2) in cells start there."""
    path = np.zeros((len(steps), 3))
    origin = np.array([costmap.origin_x, costmap.origin_y])
    path[:, :2] = origin + steps[::-1].astype(np.float64) * costmap.resolution
    return path


def _with_end(path: Array, end: Array, *, repeats_end: bool) -> Array:
    """Returns the path with a pose as its end: in place of the last one, or after it.

    repeats_end: after it also where the last one is at the same position.
    (NavfnPlanner::smoothApproachToGoal)
    """

    def squared_distance(first: Array, second: Array) -> float:
        offset_x, offset_y = first[0] - second[0], first[1] - second[1]
        return offset_x * offset_x + offset_y * offset_y

    if len(path) >= 2:
        passes_end = squared_distance(path[-1], path[-2]) > squared_distance(end, path[-2])
        is_there = squared_distance(path[-1], end) < SAME_POSITION_M2 and not repeats_end
        if passes_end or is_there:
            path[-1] = end
            return path
    return np.concatenate([path, end[None]])


def _final_direction(path: Array) -> float:
    """Returns the direction in which a path (N, 3), N at least 2, ends, rad."""
    before = path[-2]
    if len(path) > 2 and np.all(np.abs(path[-1, :2] - before[:2]) < SAME_COMPONENT_M):
        before = path[-3]
    return math.atan2(path[-1, 1] - before[1], path[-1, 0] - before[0])
