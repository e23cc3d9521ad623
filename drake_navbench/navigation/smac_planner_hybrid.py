"""Nav2's planner for cars: Hybrid-A*, with Dubins' or Reeds and Shepp's curves.

Source: nav2_smac_planner (SmacPlannerHybrid), branches humble to lyrical. Humble has no codes for
failures. There are two differences. A time limit is a number of expansions. And where Nav2 reads
beyond its arrays, there is a value: the robot does not fit at the map's upper edge, and at a
heading that rounds to a full turn it has the outline of heading 0.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_navbench.errors import InputError
from drake_navbench.kernels import astar, hybrid_astar
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import INSCRIBED, MAX_NON_OBSTACLE, Costmap
from drake_navbench.kernels.hybrid_astar import SearchRules
from drake_navbench.kernels.hybrid_expansion import ExpansionRules
from drake_navbench.kernels.hybrid_graph import Body
from drake_navbench.kernels.hybrid_heuristics import FreeWays, free_ways, reached_from
from drake_navbench.kernels.hybrid_motion import Motions, cos32, motions, sin32
from drake_navbench.kernels.hybrid_smoothing import smooth_car_path
from drake_navbench.navigation.costmaps.built_in_layers import InflationLayerParameters
from drake_navbench.navigation.planner import (
    GoalOccupied,
    GoalOutsideMapBounds,
    NoValidPathCouldBeFound,
    PlannerTimedOut,
    StartOccupied,
    StartOutsideMapBounds,
    as_pose,
)
from drake_navbench.navigation.smac_planner_2d import PLACE_IN_CELL, downsample, map_coordinates
from drake_navbench.navigation.smac_planner_hybrid_parameters import SmacPlannerHybridParameters
from drake_navbench.plugins.releases import Release

F32 = np.float32
# Each state has a number: 2 GB of addresses. The search touches only those of states it visits.
MAX_STATES = 500_000_000
UNLIMITED = 2**31 - 1
NO_POSSIBLE_COST = -1.0
# The number of cars whose tables of ways are kept; a table takes up to 25 MB.
KEPT_TABLES = 4
_tables: OrderedDict[tuple[Any, ...], FreeWays] = OrderedDict()


class SmacPlannerHybrid:
    """Answers requests by Hybrid-A*; see `Planner.plan`.

    The outline of a robot given by a polygon is checked only at poses where the inflated cost under
    the centre is so high that the outline may touch something. `with_inflation` sets this cost;
    without it the outline is checked at every pose.
    """

    nav2_plugin = "nav2_smac_planner::SmacPlannerHybrid"
    Parameters = SmacPlannerHybridParameters

    def __init__(self, parameters: SmacPlannerHybridParameters, footprint: Array | None) -> None:
        """footprint: (K, 2) padded, base frame, m; None where the robot is given by a radius."""
        self.parameters = parameters
        self._footprint = np.empty((0, 2)) if footprint is None else np.ascontiguousarray(footprint)
        self._possible_cost = NO_POSSIBLE_COST

    def with_inflation(self, inflation: InflationLayerParameters) -> SmacPlannerHybrid:
        """Returns a planner that knows the inflation layer of the costmaps that it will plan on."""
        planner = SmacPlannerHybrid(self.parameters, self._footprint)
        planner._possible_cost = _circumscribed_cost(self._footprint, inflation)
        return planner

    def plan(self, costmap: Costmap, start: ArrayLike, goal: ArrayLike) -> Array:
        """See `Planner.plan`. Raises InputError where there would be too many states."""
        start, goal = as_pose(start, "start"), as_pose(goal, "goal")
        parameters = self.parameters
        grid = costmap
        if parameters.downsample_costmap and parameters.downsampling_factor > 1:
            grid = downsample(costmap, parameters.downsampling_factor, known_cells=False)
        rows, columns = grid.costs.shape
        require_few_states(parameters, rows, columns)
        first = self._state(grid, start, StartOutsideMapBounds, "start")
        last = self._state(grid, goal, GoalOutsideMapBounds, "goal")
        if self._are_one(first, last):
            return np.array([[start[0], start[1], goal[2]]])
        cells, expansions = self._search(costmap, grid, first, last)
        place = PLACE_IN_CELL.get(parameters.nav2_release, 0.0)
        path = np.empty(cells.shape)
        for axis, origin in enumerate((grid.origin_x, grid.origin_y)):
            places = cells[:, axis].astype(float) + place
            path[:, axis] = float(F32(origin)) + places * grid.resolution
        path[:, 2] = [wrap(float(angle)) for angle in cells[:, 2]]
        smoother = parameters.smoother
        if parameters.smooth_path and expansions > 1 and smoother.max_iterations > 0:
            radius_m, release = self._radius_m(costmap.resolution), self._minor_version
            path = smooth_car_path(path, grid.grid, self._footprint, radius_m, smoother, release)
        return path

    @property
    def _minor_version(self) -> int:
        return self.parameters.nav2_release.version[1]

    def _radius_m(self, cell_m: float) -> float:
        """Returns the turning radius, m; cell_m: edge of a cell of the given costmap, m.

        Since Jazzy it is not below a cell of the coarser map, also where downsample_costmap is off.
        Before, the motions of a car that turns within a cell are no numbers in Nav2.
        """
        p = self.parameters
        if p.nav2_release >= Release.JAZZY:
            return max(p.minimum_turning_radius, cell_m * p.downsampling_factor)
        least_m = cell_m * self._factor
        turns = p.minimum_turning_radius >= math.sqrt(0.5) * least_m
        return p.minimum_turning_radius if turns else least_m

    def _are_one(self, first: NDArray[np.float32], last: NDArray[np.float32]) -> bool:
        """Tells whether a path from a state (3,) to another is one pose."""
        release = self.parameters.nav2_release
        count = 2 if release is Release.JAZZY else 3
        are_equal = np.array_equal(np.floor(first[:count]), np.floor(last[:count]))
        return are_equal and release is not Release.IRON

    def _state(
        self, grid: Costmap, pose: Array, error: type[Any], name: str
    ) -> NDArray[np.float32]:
        """Returns (3,) position in cells and heading bin; raises `error` off the map."""
        release = self.parameters.nav2_release
        x, y = map_coordinates(grid, pose, release, error, name)
        bins = self.parameters.angle_quantization_bins
        count = wrap(float(pose[2])) / (2.0 * math.pi / bins)
        if release is Release.IRON:
            heading = float(math.floor(count % bins))
        else:
            # Halves go away from 0.
            heading = math.copysign(math.floor(abs(count) + 0.5), count)
        return np.array([x, y, heading % bins], F32)

    def _search(
        self,
        costmap: Costmap,
        grid: Costmap,
        first: NDArray[np.float32],
        last: NDArray[np.float32],
    ) -> tuple[NDArray[np.float32], int]:
        """Returns (N, 3) the path in cells and rad, and the number of expansions; raises.

        The way round obstacles is that of the cells of the given costmap with the same numbers, as
        in Nav2 since Jazzy, also where the path is searched on the coarser grid.
        """
        parameters, release = self.parameters, self.parameters.nav2_release
        cell_m = costmap.resolution * self._factor
        ways_of_car = motions(
            self._radius_m(costmap.resolution) / cell_m,
            parameters.angle_quantization_bins,
            reverses=parameters.motion_model_for_search == "REEDS_SHEPP",
            interpolates=parameters.allow_primitive_interpolation,
            costs_chords=release < Release.JAZZY,
        )
        reached = reached_from(
            costmap.costs if release >= Release.JAZZY else grid.costs,
            (int(last[0]), int(last[1])),
            (int(first[0]), int(first[1])),
            is_coarse=parameters.downsample_obstacle_heuristic,
            cost_penalty=parameters.cost_penalty,
            is_quadratic=parameters.use_quadratic_cost_penalty,
            release=self._minor_version,
        )
        rules = self._rules(grid)
        status, path, expansions = hybrid_astar.search(
            self._body(grid, ways_of_car),
            ways_of_car,
            rules,
            self._expansion(costmap.resolution, grid.costs.shape[1]),
            (reached, _free_ways(ways_of_car, self._table_width(cell_m))),
            first,
            (last[:2], self._goal_bins(int(last[2]))),
            # Made here, not in the kernel: numpy takes memory that is 0 already, page by page.
            np.zeros(grid.costs.size * ways_of_car.bins, np.int32),
        )
        if status == astar.FOUND and len(path) > 0:
            return path, expansions
        if status == astar.START_OCCUPIED:
            raise StartOccupied("start: the robot does not fit there")
        if status == astar.GOAL_OCCUPIED:
            raise GoalOccupied(
                f"goal: the robot does not fit there, nor within {parameters.tolerance:g} m"
            )
        if expansions == 1 and release >= Release.JAZZY:
            raise StartOccupied("start: every way out of it is blocked")
        if status == astar.ITERATION_LIMIT:
            raise PlannerTimedOut(f"no path within max_iterations = {parameters.max_iterations}")
        limit = parameters.max_planning_time
        is_late = status == astar.EXPANSION_BUDGET_SPENT
        why = f"within max_planning_time = {limit:g} s" if is_late else "for a car that turns so"
        raise NoValidPathCouldBeFound(f"goal: not reachable {why}, after {expansions} expansions")

    def _rules(self, grid: Costmap) -> SearchRules:
        p = self.parameters
        return SearchRules(
            F32(F32(p.tolerance) / F32(grid.resolution)),
            F32(p.non_straight_penalty),
            F32(p.change_penalty),
            F32(p.reverse_penalty),
            F32(p.cost_penalty),
            F32(F32(1.0) - F32(p.retrospective_penalty)),
            p.use_quadratic_cost_penalty,
            p.max_iterations if p.max_iterations > 0 else UNLIMITED,
            p.max_on_approach_iterations if p.max_on_approach_iterations > 0 else UNLIMITED,
            p.terminal_checking_interval,
            math.ceil(p.max_planning_time * p.expansions_per_second),
            p.coarse_step,
            self._minor_version,
        )

    def _expansion(self, cell_m: float, columns: int) -> ExpansionRules:
        """cell_m: edge of a cell of the given costmap, m, whose cells Nav2 takes for the length."""
        p = self.parameters
        return ExpansionRules(
            F32(p.analytic_expansion_ratio),
            F32(p.analytic_expansion_max_length / cell_m),
            F32(p.analytic_expansion_max_cost),
            p.analytic_expansion_max_cost_override,
            F32(p.cost_penalty),
            columns,
            self._minor_version,
        )

    @property
    def _factor(self) -> int:
        p = self.parameters
        return p.downsampling_factor if p.downsample_costmap else 1

    def _table_width(self, cell_m: float) -> int:
        width = int(F32(self.parameters.lookup_table_size) / F32(cell_m))
        return width + 1 if width % 2 == 0 else width

    def _goal_bins(self, heading: int) -> NDArray[np.int64]:
        bins = self.parameters.angle_quantization_bins
        mode = self.parameters.goal_heading_mode
        if mode == "ALL_DIRECTION":
            return np.arange(bins)
        if mode == "BIDIRECTIONAL":
            return np.array([heading, (heading + bins // 2) % bins])
        return np.array([heading])

    def _body(self, grid: Costmap, ways_of_car: Motions) -> Body:
        """Returns the body for collision checks: the outline by heading, rounded as in Nav2."""
        bin_size = F32(2.0 * math.pi / ways_of_car.bins)
        outlines = np.empty((ways_of_car.bins, len(self._footprint), 2))
        for heading in range(ways_of_car.bins):
            angle = F32(bin_size * F32(heading))
            cosine, sine = float(cos32(angle)), float(sin32(angle))
            x, y = self._footprint[:, 0], self._footprint[:, 1]
            outlines[heading, :, 0] = x * cosine - y * sine
            outlines[heading, :, 1] = x * sine + y * cosine
        allow_unknown = self.parameters.allow_unknown
        return Body(grid.grid, outlines, self._possible_cost, allow_unknown, self._minor_version)


def require_few_states(parameters: SmacPlannerHybridParameters, rows: int, columns: int) -> None:
    """Raises InputError where a search on a map would have too many states."""
    bins = parameters.angle_quantization_bins
    states = rows * columns * bins
    if states > MAX_STATES:
        raise InputError(
            f"{parameters.plugin}: {columns} x {rows} cells in angle_quantization_bins {bins} make "
            f"{states:.3g} states, expected at most {MAX_STATES:.3g}; downsample_costmap makes less"
        )


def _circumscribed_cost(footprint: Array, inflation: InflationLayerParameters) -> float:
    """Returns the cost of a centre that is as far from an obstacle as the outline reaches."""
    if len(footprint) == 0:
        return NO_POSSIBLE_COST
    inscribed_m, circumscribed_m = footprint_radii(footprint)
    if inflation.inflation_radius < circumscribed_m:
        return 0.0
    beyond_m = circumscribed_m - inscribed_m
    if beyond_m <= 0.0:
        return float(INSCRIBED)
    return float(int(MAX_NON_OBSTACLE * math.exp(-inflation.cost_scaling_factor * beyond_m)))


def _free_ways(ways_of_car: Motions, width: int) -> FreeWays:
    """Returns the table of a car; ways are added when asked for, and never change."""
    key = (float(ways_of_car.radius), ways_of_car.bins, ways_of_car.reverses, width)
    if key not in _tables:
        while len(_tables) >= KEPT_TABLES:
            _tables.popitem(last=False)
        _tables[key] = free_ways(width, ways_of_car.bins)
    _tables.move_to_end(key)
    return _tables[key]
