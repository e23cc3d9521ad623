"""The plan of a scenario: from the global planner on what it knows, or as the scenario gives it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.layered_costmap import GridGeometry, LayeredCostmap
from drake_navbench.costmaps.map_file import OCCUPIED, OccupancyMap
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import (
    Arc,
    ConstrainedSmoothing,
    ElementsPlan,
    GridPlan,
    PolylinePlan,
    Scenario,
    SimpleSmoothing,
    Straight,
)
from drake_navbench.kernels.grid import FREE, LETHAL, Costmap
from drake_navbench.kernels.path_geometry import path_from_elements, path_from_polyline
from drake_navbench.kernels.rasterize import mark_polygon
from drake_navbench.navigation import constrained_smoother, simple_smoother
from drake_navbench.navigation.planner import PlanningError, plan_path

Array = NDArray[np.float64]


class SmoothingError(PlanningError):
    """The planner found a path, but its smoother failed; `code` is Nav2's SmoothPath error code."""

    code = constrained_smoother.FailedToSmoothPath.code


def make_plan(
    scenario: Scenario,
    robot: Robot,
    start: Array,
    goal: Array | None = None,
    *,
    costmap: Costmap | None = None,
) -> Array:
    """Returns the global plan (N, 3) x m, y m, yaw rad from a start pose (3,).

    A given plan starts at the scenario's start, whatever the robot's deviation from it. goal: (3,),
    the scenario's where not given. costmap: to plan on, what is known beforehand where not given.
    Raises PlanningError where the planner finds nothing or a smoother fails.
    """
    plan = scenario.plan
    if isinstance(plan, ElementsPlan):
        elements = [_as_element(element) for element in plan.elements]
        return path_from_elements(np.array(scenario.start), elements, plan.spacing_m)
    if isinstance(plan, PolylinePlan):
        return path_from_polyline(np.array(plan.points), plan.spacing_m)
    if costmap is None:
        costmap = global_costmap(scenario, robot)
    path = plan_path(
        costmap,
        start,
        np.array(scenario.goal) if goal is None else goal,
        robot.navigation.planner,
        footprint=None if robot.is_circle else robot.padded_outline,
    )
    return _smoothed(path, costmap, plan)


def _smoothed(path: Array, costmap: Costmap, plan: GridPlan) -> Array:
    """Returns the planner's path after the smoother that the scenario names."""
    if isinstance(plan.smoother, SimpleSmoothing):
        return simple_smoother.smooth_path(path, costmap, plan.smoother)
    if isinstance(plan.smoother, ConstrainedSmoothing):
        try:
            return constrained_smoother.smooth_path(path, costmap, plan.smoother)
        except constrained_smoother.FailedToSmoothPath as error:
            raise SmoothingError(str(error)) from error
    return path


def global_costmap(scenario: Scenario, robot: Robot) -> Costmap:
    """Returns the global costmap as it is before anything was seen."""
    layers = global_layers(scenario, robot)
    start = np.array(scenario.start)
    return layers.updated(layers.initial_state(), scan=None, pose=start, time_s=0.0).costmap


def global_layers(scenario: Scenario, robot: Robot) -> LayeredCostmap:
    """Returns the layers of the global costmap, on the grid of the known map."""
    known = known_map(scenario, robot)
    return LayeredCostmap(
        robot.navigation.global_costmap,
        GridGeometry.of_map(known),
        lidar=robot.lidar,
        footprint=robot.padded_outline,
        static_map=known,
        masks=scenario.filter_masks,
    )


def known_map(scenario: Scenario, robot: Robot) -> OccupancyMap:
    """Returns what the robot knows of the world beforehand: the map and the known obstacles.

    Without a map file nothing fixes the lattice, so it is laid such that the scenario's start is a
    cell's centre; all that is not an obstacle is free.
    """
    grid = scenario.map or _empty_map(scenario, robot)
    known = scenario.known_world
    if not known.obstacles:
        return grid
    marked = np.full(grid.occupancy.shape, FREE, dtype=np.uint8)
    for obstacle in known.obstacles:
        mark_polygon(marked, grid.origin_x, grid.origin_y, grid.resolution, obstacle.outline)
    occupancy = np.where(marked == LETHAL, np.int8(OCCUPIED), grid.occupancy)
    return OccupancyMap(occupancy, grid.resolution, grid.origin_x, grid.origin_y)


def _empty_map(scenario: Scenario, robot: Robot) -> OccupancyMap:
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
    occupancy = np.zeros((rows, columns), dtype=np.int8)
    return OccupancyMap(occupancy, resolution, float(origin[0]), float(origin[1]))


def _as_element(element: Straight | Arc) -> Mapping[str, float]:
    if isinstance(element, Straight):
        return {"s": element.straight_m}
    return {"arc": element.arc_deg, "r": element.radius_m}
