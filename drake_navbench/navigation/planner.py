"""The contract of a global planner: its inputs, its plan, and its errors where there is no path.

A planner is a class with the attributes `nav2_plugin`, the plugin type by which Nav2 knows it, and
`Parameters`, the model of its parameters; it is made from its parameters and the robot's footprint.
`planner_settings` names the planners that a robot file may choose.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import (
    FREE,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    Costmap,
    cell_at,
    cost_at,
)


class PlanningError(NavbenchError):
    """The base of a planner's errors; `code` is Nav2's ComputePathToPose error code."""

    code: ClassVar[int] = 200


class UnknownFrame(PlanningError):
    """A pose is in no frame, since nothing has written it: Nav2's PlannerTFError."""

    code = 202


class StartOutsideMapBounds(PlanningError):
    """The start does not lie on the map."""

    code = 203


class GoalOutsideMapBounds(PlanningError):
    """The goal does not lie on the map."""

    code = 204


class StartOccupied(PlanningError):
    """The robot cannot leave its start."""

    code = 205


class GoalOccupied(PlanningError):
    """The goal is blocked, and nothing near enough to it is free."""

    code = 206


class PlannerTimedOut(PlanningError):
    """The search ran into a limit before it came within the tolerance of the goal."""

    code = 207


class NoValidPathCouldBeFound(PlanningError):
    """The goal cannot be reached."""

    code = 208


class NoViapointsGiven(PlanningError):
    """There is no pose to plan through; 309 in ComputePathThroughPoses, which alone knows it."""

    code = 209


class Planner(Protocol):
    """Answers requests for paths; pure: the same request gives the same path, bit for bit."""

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """Returns a path (N, 3) x m, y m, yaw rad, N at least 1, from start to goal.

        start, goal: (3,) x m, y m, yaw rad in the costmap's frame.
        Raises a PlanningError, or InputError where start or goal is no finite pose.
        """
        ...


def as_pose(pose: ArrayLike, name: str) -> Array:
    """Returns a (3,) float64 pose; raises InputError where it is none."""
    array = np.asarray(pose, dtype=np.float64)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise InputError(f"{name}: got {pose!r}, expected three finite numbers x, y, yaw")
    return array


def outside_map(
    costmap: Costmap, pose: Array, error: type[PlanningError], name: str
) -> PlanningError:
    """Returns the error for a start or goal outside the global costmap, with its bounds."""
    return error(
        f"{name}: found ({pose[0]:g}, {pose[1]:g}) m, expected a point in the global costmap: "
        f"x from {costmap.origin_x:g} to {costmap.origin_x + costmap.size_x_m:g} m, y from "
        f"{costmap.origin_y:g} to {costmap.origin_y + costmap.size_y_m:g} m"
    )


def cells_of_request(
    costmap: Costmap, start: Array, goal: Array
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Returns the cells (column, row) that hold start and goal.

    Raises StartOutsideMapBounds or GoalOutsideMapBounds.
    """
    cells = []
    for pose, error, name in (
        (start, StartOutsideMapBounds, "start"),
        (goal, GoalOutsideMapBounds, "goal"),
    ):
        cell = cell_at(costmap.grid, pose[0], pose[1])
        if cell[0] < 0:
            raise outside_map(costmap, pose, error, name)
        cells.append(cell)
    return cells[0], cells[1]


def is_path_valid(
    path: NDArray[np.float64],
    costmap: Costmap,
    *,
    footprint: NDArray[np.float64],
    is_circle: bool,
    max_cost: int = LETHAL,
    consider_unknown_as_obstacle: bool = False,
) -> bool:
    """Tells whether the robot could stand at every pose of a path (N, 3) x m, y m, yaw rad.

    footprint: (K, 2) padded, m; is_circle: look at the cell under the centre instead, which is
    blocked from INSCRIBED on. Costs from max_cost on block as well; 0 blocks everything. Unknown
    cells are free unless consider_unknown_as_obstacle; poses off the map are blocked. An empty path
    is not valid.
    """
    if len(path) == 0:
        return False
    blocked_from = min(max_cost, INSCRIBED if is_circle else LETHAL)
    for x, y, yaw in path:
        if is_circle:
            cost = cost_at(costmap.grid, x, y, LETHAL)
        else:
            cost = footprint_cost(costmap.grid, footprint, x, y, yaw, True)
        if cost == NO_INFORMATION:
            cost = LETHAL if consider_unknown_as_obstacle else FREE
        if cost >= blocked_from:
            return False
    return True


def cost_of_pose(
    pose: NDArray[np.float64],
    costmap: Costmap,
    uses_outline: bool,
    *,
    footprint: NDArray[np.float64],
) -> int | None:
    """Returns the cost at a pose (3,) x m, y m, yaw rad, as Nav2's service get_cost does.

    footprint: (K, 2) padded, m. uses_outline: take the largest cost under it, LETHAL off the map;
    otherwise the cost of the cell under the centre, None off the map.
    """
    x, y, yaw = pose
    if uses_outline:
        return int(footprint_cost(costmap.grid, footprint, x, y, yaw, True))
    if cell_at(costmap.grid, x, y)[0] < 0:
        return None
    return int(cost_at(costmap.grid, x, y, LETHAL))
