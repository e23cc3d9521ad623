"""The plan of a scenario: by the global planner on its own map, or given by the scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_navbench.inputs.floor_scenario import FloorScenario
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario_plan import Arc, ElementsPlan, PolylinePlan, Straight
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import FREE, LETHAL, Costmap, Grid
from drake_navbench.kernels.path_geometry import path_from_elements, path_from_polyline
from drake_navbench.kernels.rasterize import mark_polygon
from drake_navbench.navigation.behavior_tree.board import SmoothPath
from drake_navbench.navigation.costmaps.grid_size import require_grid_size
from drake_navbench.navigation.costmaps.layered_costmap import (
    FIRST_ORIGIN,
    GridGeometry,
    LayeredCostmap,
)
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import OCCUPIED
from drake_navbench.navigation.planner import Planner
from drake_navbench.navigation.planner_settings import make_planner
from drake_navbench.navigation.smoother_settings import make_smoother


def make_plan(
    scenario: FloorScenario,
    robot: Robot,
    start: Array,
    goal: Array | None = None,
    *,
    costmap: Costmap | None = None,
) -> Array:
    """Returns the global plan (N, 3) x m, y m, yaw rad from a start pose (3,).

    A given plan starts at the scenario's start, whatever the robot's deviation from it. goal: (3,),
    the scenario's where not given. costmap: the costmap to plan on; by default that of the known
    map. Raises PlanningError where the planner finds nothing or a smoother fails.
    """
    plan = scenario.plan
    if isinstance(plan, ElementsPlan):
        elements = [_as_element(element) for element in plan.elements]
        return path_from_elements(np.array(scenario.start), elements, plan.spacing_m)
    if isinstance(plan, PolylinePlan):
        return path_from_polyline(np.array(plan.points), plan.spacing_m)
    if costmap is None:
        costmap = global_costmap(scenario, robot)
    path = planner_of(robot).plan(costmap, start, np.array(scenario.goal) if goal is None else goal)
    _require_path("planner", robot.navigation.planner.plugin, path)
    if plan.smoother is None:
        return path
    smoothed = make_smoother(plan.smoother).smooth(path, costmap)
    _require_path("smoother", plan.smoother.plugin, smoothed)
    return smoothed


def path_smoother_of(robot: Robot) -> SmoothPath:
    """Returns the smoother that a behaviour tree may ask to smooth paths.

    Raises InputError where the smoother cannot be made; the smoother itself raises PlanningError.
    """
    settings = robot.navigation.smoother
    smoother = make_smoother(settings)

    def smooth(path: Array, costmap: Costmap) -> Array:
        smoothed = smoother.smooth(path, costmap)
        _require_path("smoother", settings.plugin, smoothed)
        return smoothed

    return smooth


def planner_of(robot: Robot) -> Planner:
    """Returns the planner of a robot; raises InputError where it cannot be made."""
    outline = None if robot.is_circle else robot.padded_outline
    inflation = robot.navigation.global_costmap.inflation_layer
    return make_planner(robot.navigation.planner, footprint=outline, inflation=inflation)


def _require_path(noun: str, name: str, path: Any) -> None:
    """Raises ValueError where a plugin returned something else than a path."""
    is_array = isinstance(path, np.ndarray) and path.dtype == np.float64
    if not is_array or path.ndim != 2 or path.shape[1] != 3 or not len(path):
        found = f"{path.dtype} {path.shape}" if isinstance(path, np.ndarray) else type(path)
        raise ValueError(f"{noun} {name}: got {found}, expected an array (N, 3) of float64")
    if not np.all(np.isfinite(path)):
        raise ValueError(f"{noun} {name}: got poses that are not finite, expected finite ones")


def global_costmap(scenario: FloorScenario, robot: Robot) -> Costmap:
    """Returns the global costmap before any sensor has seen anything."""
    layers = global_layers(scenario, robot)
    start = np.array(scenario.start)
    costmap = layers.updated(layers.initial_state(), scan=None, pose=start, time_s=0.0).costmap
    assert costmap is not None  # After an update there is one.
    return costmap


def global_layers(scenario: FloorScenario, robot: Robot) -> LayeredCostmap:
    """Returns the layers of the global costmap, on the grid of the known map."""
    known = known_map(scenario, robot)
    return LayeredCostmap(
        robot.navigation.global_costmap,
        _global_geometry(robot, known),
        lidar=robot.lidar,
        footprint=robot.padded_outline,
        static_map=known,
        masks=scenario.filter_masks,
    )


def _global_geometry(robot: Robot, known: OccupancyMap) -> GridGeometry:
    """Returns the geometry of the global costmap: the map's own, or a window that rolls."""
    settings = robot.navigation.global_costmap
    if not settings.rolling_window:
        return GridGeometry.of_map(known)
    return GridGeometry(
        int(settings.height / settings.resolution),
        int(settings.width / settings.resolution),
        *FIRST_ORIGIN,
        settings.resolution,
        rolling_window=True,
    )


def known_map(scenario: FloorScenario, robot: Robot) -> OccupancyMap:
    """Returns the world as the robot knows it beforehand: the map and the known obstacles.

    Without a map file nothing fixes the lattice; the scenario's start is then a cell's centre, and
    all cells without obstacles are free.
    """
    grid = scenario.map or _empty_map(scenario, robot)
    known = scenario.known_world
    if not known.obstacles:
        return grid
    marked = np.full(grid.occupancy.shape, FREE, dtype=np.uint8)
    for obstacle in known.obstacles:
        mark_polygon(Grid(marked, *grid.frame), obstacle.outline)
    occupancy = np.where(marked == LETHAL, np.int8(OCCUPIED), grid.occupancy)
    return OccupancyMap(occupancy, grid.resolution, grid.origin_x, grid.origin_y)


def global_grid_shape(scenario: FloorScenario, robot: Robot) -> tuple[int, int]:
    """Returns rows and columns of the global costmap; raises InputError if there are too many."""
    if scenario.map is not None:
        rows, columns = scenario.map.occupancy.shape
        return rows, columns
    rows, columns, *_ = _lattice_without_map(scenario, robot)
    require_grid_size(f"scenario {scenario.name}: global costmap", columns, rows)
    return rows, columns


def _empty_map(scenario: FloorScenario, robot: Robot) -> OccupancyMap:
    rows, columns, origin_x, origin_y = _lattice_without_map(scenario, robot)
    occupancy = np.zeros((rows, columns), dtype=np.int8)
    resolution = robot.navigation.global_costmap.resolution
    return OccupancyMap(occupancy, resolution, origin_x, origin_y)


def _lattice_without_map(scenario: FloorScenario, robot: Robot) -> tuple[int, int, float, float]:
    """Returns rows, columns and origin x, y m of a grid around everything that is known."""
    settings = robot.navigation.global_costmap
    resolution = settings.resolution
    min_x, min_y, max_x, max_y = scenario.known_world.bounds(
        [scenario.start, *scenario.goals], settings.margin_m
    )
    origin = [
        start - (np.ceil((start - low) / resolution) + 0.5) * resolution
        for start, low in zip(scenario.start[:2], (min_x, min_y), strict=True)
    ]
    columns = int(np.ceil((max_x - origin[0]) / resolution))
    rows = int(np.ceil((max_y - origin[1]) / resolution))
    return rows, columns, float(origin[0]), float(origin[1])


def _as_element(element: Straight | Arc) -> Mapping[str, float]:
    if isinstance(element, Straight):
        return {"s": element.straight_m}
    return {"arc": element.arc_deg, "r": element.radius_m}
