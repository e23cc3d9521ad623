"""The plan of a scenario: from the global planner on what it knows, or as the scenario gives it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.grid import FREE, Costmap
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.path_geometry import path_from_elements, path_from_polyline
from drake_navbench.kernels.rasterize import mark_polygon
from drake_navbench.planner import plan_path
from drake_navbench.robot import Robot
from drake_navbench.scenario import Arc, ElementsPlan, PolylinePlan, Scenario, Straight


def make_plan(scenario: Scenario, robot: Robot, start: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the global plan (N, 3) x m, y m, yaw rad from a start pose (3,).

    A given plan starts at the scenario's start, whatever the robot's deviation from it. Raises
    PlanningError where the planner finds nothing.
    """
    plan = scenario.plan
    if isinstance(plan, ElementsPlan):
        elements = [_as_element(element) for element in plan.elements]
        return path_from_elements(np.array(scenario.start), elements, plan.spacing_m)
    if isinstance(plan, PolylinePlan):
        return path_from_polyline(np.array(plan.points), plan.spacing_m)
    return plan_path(
        global_costmap(scenario, robot),
        start,
        np.array(scenario.goal),
        robot.navigation.planner,
        footprint=robot.padded_outline,
    )


def global_costmap(scenario: Scenario, robot: Robot) -> Costmap:
    """Returns the inflated map of what the planner knows.

    No map file fixes the lattice, so it is laid such that the scenario's start is a cell's centre.
    """
    settings = robot.navigation.global_costmap
    known = scenario.known_obstacles
    resolution = settings.resolution
    min_x, min_y, max_x, max_y = known.bounds([scenario.start, scenario.goal], settings.margin_m)
    origin = [
        start - (np.ceil((start - low) / resolution) + 0.5) * resolution
        for start, low in zip(scenario.start[:2], (min_x, min_y), strict=True)
    ]
    columns = int(np.ceil((max_x - origin[0]) / resolution))
    rows = int(np.ceil((max_y - origin[1]) / resolution))
    costs = np.full((rows, columns), FREE, dtype=np.uint8)
    for outline in [o.outline for o in known.obstacles] + scenario.world.keepout:
        mark_polygon(costs, origin[0], origin[1], resolution, np.array(outline, dtype=float))
    inflated = inflate(
        costs,
        resolution=resolution,
        inscribed_radius=robot.radii[0],
        inflation_radius=settings.inflation_layer.inflation_radius,
        cost_scaling_factor=settings.inflation_layer.cost_scaling_factor,
    )
    return Costmap(inflated, origin[0], origin[1], resolution)


def _as_element(element: Straight | Arc) -> Mapping[str, float]:
    if isinstance(element, Straight):
        return {"s": element.straight_m}
    return {"arc": element.arc_deg, "r": element.radius_m}
