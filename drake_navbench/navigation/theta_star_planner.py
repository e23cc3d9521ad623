"""Nav2's Theta* planner: straight lines between the corners of a path that heeds the costs.

Since Jazzy each request is answered as Nav2 answers the first one after its start: it frees the
cell at the lower left corner of the map. (It means to free the robot's cell, but takes that of the
request before.) Nav2 leaves the cell free in the costmap; here the costmap stays as it is.
Source: nav2_theta_star_planner (ThetaStarPlanner), branches humble to lyrical. Humble has no codes
for failures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from drake_navbench.kernels import theta_star
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import FREE, LETHAL, MAX_NON_OBSTACLE, Costmap
from drake_navbench.navigation.planner import (
    GoalOccupied,
    NoValidPathCouldBeFound,
    PlanningError,
    StartOccupied,
    as_pose,
    cells_of_request,
)
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import one_of


class ThetaStarPlannerParameters(FrozenModel):
    """Parameters of nav2_theta_star_planner::ThetaStarPlanner."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "terminal_checking_interval": since(Release.JAZZY),
    }

    plugin: Literal["nav2_theta_star_planner::ThetaStarPlanner"] = (
        "nav2_theta_star_planner::ThetaStarPlanner"
    )
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Kilted lines of sight run between the "
        "cells' corners; Iron refuses a start on a lethal cell and enters no cell of cost 252.",
    )
    how_many_corners: Annotated[Literal[4, 8], one_of((4, 8), 8)] = Field(
        8, description="Number of neighbours of a cell [cells]."
    )
    allow_unknown: bool = Field(True, description="Let paths cross unknown cells.")
    w_euc_cost: float = Field(1.0, ge=0.0, description="Weight of the path's length [1/cell].")
    w_traversal_cost: float = Field(2.0, ge=0.0, description="Weight of the cells' costs.")
    terminal_checking_interval: int = Field(
        5000,
        gt=0,
        description="No effect here: nothing cancels a search.",
    )
    use_final_approach_orientation: bool = Field(
        False, description="End the path with its own direction, not with the goal's heading."
    )


class ThetaStarPlanner:
    """Answers requests by Theta*.

    The path runs from the centre of the start's cell to that of the goal's, a point every cell's
    edge along each straight line; all headings are 0 but the last, as Nav2 leaves them.
    """

    nav2_plugin = "nav2_theta_star_planner::ThetaStarPlanner"
    Parameters = ThetaStarPlannerParameters

    def __init__(self, parameters: ThetaStarPlannerParameters, footprint: Array | None) -> None:
        """footprint: without effect; the search sees the cell under the robot's centre only."""
        self.parameters = parameters

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """See `Planner.plan`. Raises PlanningError itself where start or goal is inscribed."""
        start, goal = as_pose(start, "start"), as_pose(goal, "goal")
        start_cell, goal_cell = cells_of_request(costmap, start, goal)
        release = self.parameters.nav2_release
        if release is Release.IRON and costmap.costs[start_cell[1], start_cell[0]] == LETHAL:
            raise StartOccupied("start: its cell is lethal, and iron plans nothing from there")
        if costmap.costs[goal_cell[1], goal_cell[0]] == LETHAL:
            raise GoalOccupied("goal: its cell is lethal")
        parameters = self.parameters
        if start_cell == goal_cell:
            keeps_start_yaw = parameters.use_final_approach_orientation
            return np.array([[start[0], start[1], start[2] if keeps_start_yaw else goal[2]]])
        path = _points_along(costmap, self._corners(costmap, start_cell, goal_cell))
        path[-1, 2] = goal[2]
        if parameters.use_final_approach_orientation and len(path) > 1:
            path[-1, 2] = math.atan2(path[-1, 1] - path[-2, 1], path[-1, 0] - path[-2, 0])
        return path

    def _corners(
        self, costmap: Costmap, start_cell: tuple[int, int], goal_cell: tuple[int, int]
    ) -> NDArray[np.int64]:
        """Returns (N, 2) [column, row] of the corners of the path; raises a PlanningError."""
        parameters = self.parameters
        release = parameters.nav2_release
        tables = theta_star.cost_tables(
            parameters.w_traversal_cost,
            allow_unknown=parameters.allow_unknown,
            highest=MAX_NON_OBSTACLE - (release is Release.IRON),
        )
        costs = costmap.costs.copy()
        if release >= Release.JAZZY:
            costs[0, 0] = FREE
        for name, (column, row) in (("start", start_cell), ("goal", goal_cell)):
            cost = costs[row, column]
            if not tables.may_enter[cost]:
                raise PlanningError(f"{name}: its cell has cost {cost}, expected a free cell")
        corners = theta_star.search(
            costs,
            start_cell,
            goal_cell,
            tables=tables,
            w_euc_cost=parameters.w_euc_cost,
            how_many_corners=parameters.how_many_corners,
            by_lattice=release < Release.LYRICAL,
        )
        if corners is None:
            raise NoValidPathCouldBeFound("goal: not reachable")
        return corners


def _points_along(costmap: Costmap, corners: NDArray[np.int64]) -> Array:
    """Returns (M, 3) poses with heading 0 through the centres of the corners' cells.

    The gap before a corner is between one and two edges of a cell.
    """
    origin = np.array([costmap.origin_x, costmap.origin_y])
    spacing = costmap.resolution
    centres = origin + (corners + 0.5) * spacing
    points = []
    for here, there in pairwise(centres):
        offset = there - here
        distance = np.hypot(offset[0], offset[1])
        direction = offset / distance
        # Always the corner itself, also where the line is shorter than a cell's edge.
        count = max(int(distance / spacing), 1)
        points.append(here + (np.arange(count) * spacing)[:, None] * direction)
    points.append(centres[-1:])
    path = np.zeros((sum(map(len, points)), 3))
    path[:, :2] = np.concatenate(points)
    return path
