"""Nav2's SmacPlanner2D as a pure function of map, start and goal.

`plan_path` searches with A*, turns cells into poses, smooths them and sets the last pose. Where
Nav2 has a flaw that every plan would show, a parameter of ours switches between mending it (the
default) and Nav2's behaviour; `SmacPlanner2DParameters.nav2_classic()` switches all to Nav2's.
Where Humble reads memory that it never set, there is an error: for a start or goal off the map.
Source: nav2_smac_planner (SmacPlanner2D, CostmapDownsampler), branches humble to lyrical. Humble
has no codes for failures.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.kernels import astar
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION, Costmap, cost_at
from drake_navbench.kernels.path_smoothing import (
    MIN_SPAN_OF_GRID_PATH,
    smooth_grid_path,
    smooth_segment,
    with_headings,
)
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    PlannerTimedOut,
    PlanningError,
    StartOccupied,
    StartOutsideMapBounds,
    as_pose,
    outside_map,
)
from drake_navbench.navigation.smac_planner_2d_parameters import SmacPlanner2DParameters
from drake_navbench.plugins.releases import Release

# The place of a pose in its cell, in cells from the lower left corner; 0 in other releases.
PLACE_IN_CELL = {Release.HUMBLE: 0.5, Release.IRON: -0.5}


class SmacPlanner2D:
    """Answers requests by the 2D A* search of Nav2's Smac planners."""

    nav2_plugin = "nav2_smac_planner::SmacPlanner2D"
    Parameters = SmacPlanner2DParameters

    def __init__(self, parameters: SmacPlanner2DParameters, footprint: Array | None) -> None:
        self.parameters = parameters
        self._footprint = footprint

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """See `Planner.plan`."""
        return plan_path(costmap, start, goal, self.parameters, footprint=self._footprint)


def downsample(costmap: Costmap, factor: int, *, known_cells: bool = True) -> Costmap:
    """Returns the costmap with factor x factor cells merged into their largest cost, same origin.

    known_cells: unknown cells count only where a block has no other; else (as in Nav2) unknown is
    the largest cost of all, and the edge of a cell is rounded to float32. Blocks at the upper and
    right edge may be cut off by it.
    """
    rows, columns = costmap.costs.shape
    resolution = costmap.resolution * factor
    coarse_rows, coarse_columns = -(-rows // factor), -(-columns // factor)
    padding = ((0, coarse_rows * factor - rows), (0, coarse_columns * factor - columns))
    blocks = (coarse_rows, factor, coarse_columns, factor)
    # Shifted by one (modulo 256), unknown is the smallest value in place of the largest.
    shift = np.uint8(1 if known_cells else 0)
    ranked = np.pad(costmap.costs + shift, padding).reshape(blocks)
    return Costmap(
        ranked.max(axis=(1, 3)) - shift,
        costmap.origin_x,
        costmap.origin_y,
        resolution if known_cells else float(np.float32(resolution)),
        tracks_unknown=costmap.tracks_unknown,
        stamp_s=costmap.stamp_s,
    )


def plan_path(
    costmap: Costmap,
    start: ArrayLike,
    goal: ArrayLike,
    parameters: SmacPlanner2DParameters,
    *,
    footprint: Array | None = None,
) -> Array:
    """Plans a path from start to goal. Pure: the same arguments give the same path, bit for bit.

    start, goal: (3,) x m, y m, yaw rad in the costmap's frame.
    footprint: (K, 2) m in the base frame, for the smoother's collision test (and the check of the
        final path); None where the robot is given by a radius: the cell under its centre then tells
        of a collision by its inflated cost. The search only ever looks at that cell.
    Returns (N, 3) x m, y m, yaw rad: one pose (the goal's) where start and goal share a cell.
    Raises a PlanningError, or InputError where start or goal is no finite pose.
    """
    start, goal = as_pose(start, "start"), as_pose(goal, "goal")
    grid = costmap
    if parameters.downsample_costmap and parameters.downsampling_factor > 1:
        grid = downsample(
            costmap, parameters.downsampling_factor, known_cells=parameters.downsample_known_cells
        )
    release = parameters.nav2_release
    start_in_grid = map_coordinates(grid, start, release, StartOutsideMapBounds, "start")
    goal_in_grid = map_coordinates(grid, goal, release, GoalOutsideMapBounds, "goal")
    start_cell, goal_cell = start_in_grid.astype(np.int64), goal_in_grid.astype(np.int64)
    ends_at_goal = parameters.use_exact_end_points or release >= Release.LYRICAL
    if np.array_equal(start_cell, goal_cell):
        if release < Release.JAZZY and grid.costs[start_cell[1], start_cell[0]] == LETHAL:
            raise StartOccupied("start: its cell, which is the goal's, too, is lethal")
        x, y = goal[:2] if ends_at_goal else start[:2]
        keeps_start_yaw = parameters.use_final_approach_orientation
        return np.array([[x, y, start[2] if keeps_start_yaw else goal[2]]])
    cells = _search_cells(grid, start_cell, goal_in_grid, parameters)
    reaches_goal = np.array_equal(cells[-1], goal_cell)
    path = _poses_of_cells(grid, cells, parameters)
    if parameters.use_exact_end_points:
        _blend_end_points(path, start, goal if reaches_goal else None)
    path = _smoothed(path, grid, footprint, parameters)
    if reaches_goal and ends_at_goal:
        path[-1, :2] = goal[:2]
    path[-1, 2] = goal[2]
    if parameters.use_final_approach_orientation and len(path) > 1:
        path[-1, 2] = math.atan2(path[-1, 1] - path[-2, 1], path[-1, 0] - path[-2, 0])
    if parameters.check_footprint:
        _require_free_robot(costmap, path, footprint, parameters.allow_unknown)
    return path


def map_coordinates(
    grid: Costmap, pose: Array, release: Release, error: type[PlanningError], name: str
) -> NDArray[np.float32]:
    """Returns (2,) map coordinates in cells, float32 as in Nav2; raises `error` off the map.

    Before Jazzy they are those of the cell's lower left corner.
    """
    rows, columns = grid.costs.shape
    offset = pose[:2] - (grid.origin_x, grid.origin_y)
    exact = offset / grid.resolution
    coordinates = (exact if release >= Release.JAZZY else np.floor(exact)).astype(np.float32)
    if np.any(offset < 0.0) or np.any(coordinates >= np.array([columns, rows])):
        raise outside_map(grid, pose, error, name)
    return coordinates


def _search_cells(
    grid: Costmap,
    start_cell: NDArray[np.int64],
    goal_in_grid: NDArray[np.float32],
    parameters: SmacPlanner2DParameters,
) -> NDArray[np.int64]:
    """Returns (N, 2) the cells of the path, [column, row]; raises a PlanningError."""
    budget = math.ceil(parameters.max_planning_time * parameters.expansions_per_second)
    # A cell's index is its lower left corner in map coordinates; its centre is half a cell further.
    offset = np.float32(0.5 if parameters.use_cell_centres else 0.0)
    status, cells, expansions = astar.search(
        grid.costs,
        (int(start_cell[0]), int(start_cell[1])),
        (int(goal_in_grid[0]), int(goal_in_grid[1])),
        (goal_in_grid[0] - offset, goal_in_grid[1] - offset),
        astar.SearchRules(
            tolerance=float(np.float32(parameters.tolerance) / np.float32(grid.resolution)),
            cost_travel_multiplier=parameters.cost_travel_multiplier,
            allow_unknown=parameters.allow_unknown,
            corner_cutting=parameters.allow_corner_cutting,
            max_iterations=parameters.max_iterations,
            max_on_approach_iterations=parameters.max_on_approach_iterations,
            terminal_checking_interval=parameters.terminal_checking_interval,
            expansion_budget=budget,
            takes_blocked_goal=parameters.nav2_release < Release.LYRICAL,
            fails_when_late=parameters.nav2_release < Release.LYRICAL,
            refuses_blocked_start=parameters.nav2_release < Release.JAZZY,
        ),
    )
    if status == astar.FOUND:
        return cells
    if status == astar.GOAL_OCCUPIED:
        raise GoalOccupied(
            f"goal: its cell is blocked, and no free cell lies within {parameters.tolerance:g} m"
        )
    if status == astar.START_OCCUPIED:
        raise StartOccupied("start: its cell is blocked")
    is_since_jazzy = parameters.nav2_release >= Release.JAZZY
    if status == astar.ITERATION_LIMIT:
        limit = f"no path within max_iterations = {parameters.max_iterations}"
        if expansions == 1 and is_since_jazzy:
            raise StartOccupied(f"start: {limit}, which Nav2 takes for a blocked start")
        raise PlannerTimedOut(limit)
    if status == astar.EXPANSION_BUDGET_SPENT:
        limit = f"no path within max_planning_time = {parameters.max_planning_time:g} s"
        if parameters.report_time_limit_as_timeout:
            raise PlannerTimedOut(limit)
        raise NoValidPathCouldBeFound(limit)
    if expansions == 1 and is_since_jazzy:
        raise StartOccupied("start: every neighbour of its cell is blocked")
    raise NoValidPathCouldBeFound(f"goal: not reachable, after {expansions} expansions")


def _poses_of_cells(
    grid: Costmap, cells: NDArray[np.int64], parameters: SmacPlanner2DParameters
) -> Array:
    """Returns (N, 3) poses of cells with heading 0."""
    path = np.zeros((len(cells), 3))
    if parameters.use_cell_centres:
        path[:, 0] = grid.origin_x + (cells[:, 0] + 0.5) * grid.resolution
        path[:, 1] = grid.origin_y + (cells[:, 1] + 0.5) * grid.resolution
    else:
        place = PLACE_IN_CELL.get(parameters.nav2_release, 0.0)
        # Nav2 rounds the origin to float32 here.
        path[:, 0] = float(np.float32(grid.origin_x)) + (cells[:, 0] + place) * grid.resolution
        path[:, 1] = float(np.float32(grid.origin_y)) + (cells[:, 1] + place) * grid.resolution
    return path


def _blend_end_points(path: Array, start: Array, goal: Array | None) -> None:
    """Moves the first position of `path` to the start and the last to the goal (if it is given).

    The positions between get a share of both offsets, falling linearly along the path. Offsets
    from a cell's centre stay within the cell, and so do their mixtures: each pose stays in its
    cell, and a path along a row of cells stays straight.
    """
    end = path[-1, :2].copy() if goal is None else goal[:2]
    steps = path[:, :2] - path[0, :2]
    missing = end - (start[:2] + steps[-1])
    path[:, :2] = start[:2] + steps + np.linspace(0.0, 1.0, len(path))[:, None] * missing
    path[-1, :2] = end


def _smoothed(
    path: Array, grid: Costmap, footprint: Array | None, parameters: SmacPlanner2DParameters
) -> Array:
    """Returns the path after the planner's own smoother, with headings where they are wanted."""
    smoother = parameters.smoother
    refinement_num = smoother.refinement_num if smoother.do_refinement else 0
    rules = (smoother.tolerance, smoother.max_iterations, smoother.w_data, smoother.w_smooth)
    if smoother.max_iterations > 0 and parameters.nav2_release >= Release.LYRICAL:
        outline = np.empty((0, 2)) if footprint is None else np.ascontiguousarray(footprint)
        path = smooth_grid_path(path, grid.grid, outline, *rules, refinement_num)
    elif smoother.max_iterations > 0 and len(path) - 1 > MIN_SPAN_OF_GRID_PATH:
        # Iron's positions may lie half a cell off the map; then it reads the last cell once more,
        # which was free.
        path = with_headings(smooth_segment(path, grid.grid, *rules, refinement_num, FREE)[0], True)
    return with_headings(path, True) if parameters.always_assign_headings else path


def _require_free_robot(
    costmap: Costmap, path: Array, footprint: Array | None, allow_unknown: bool
) -> None:
    """Raises NoValidPathCouldBeFound where the robot meets an obstacle after the first pose."""
    outline = None if footprint is None else np.ascontiguousarray(footprint, dtype=np.float64)
    part, blocked_from = ("centre", INSCRIBED) if outline is None else ("footprint", LETHAL)
    for index in range(1, len(path)):
        x, y, yaw = path[index]
        if outline is None:
            cost = cost_at(costmap.grid, x, y, LETHAL)
        else:
            cost = footprint_cost(costmap.grid, outline, x, y, yaw, True)
        if cost >= blocked_from and not (cost == NO_INFORMATION and allow_unknown):
            raise NoValidPathCouldBeFound(
                f"check_footprint: the {part} meets a cell of cost {cost} at pose {index} of "
                f"the path, ({x:.3f}, {y:.3f}) m, expected a free {part}"
            )
