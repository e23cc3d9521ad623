"""The task of an episode: the start, the goal, and the obstacles."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import shapely
from pydantic import Field

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.world import Cylinder, Polygon, World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.typed_files.quantities import Length, Size, Within
from drake_navbench.typed_files.typed_yaml import FrozenModel

# After this many failed draws, there is no room.
MAX_DRAWS = 1000
# Margin around the scenario's start, goal and obstacles, where they extend beyond the given area.
AREA_MARGIN_M = 1.0


class EpisodeTask(NamedTuple):
    """One episode: start and goal (3,) x m, y m, yaw rad, and the obstacles.

    seed: for the noise of lidar and localization.
    """

    start: Array
    goal: Array
    world: World
    seed: int


class RandomTasks(FrozenModel):
    """The ranges from which random tasks are drawn, in and around a scenario."""

    area_m: Size = Field(8.0, description="Side of the square that holds start and goal [m].")
    max_obstacles: Annotated[int, Within(0, 100)] = Field(
        6, description="Largest number of pillars and boxes added to the scenario's obstacles."
    )
    min_radius_m: Size = Field(0.1, description="Least radius of a pillar, or about a box [m].")
    max_radius_m: Size = Field(0.5, description="Largest radius of a pillar, or about a box [m].")
    passage_m: Length = Field(
        1.4, ge=0.0, description="Least gap between two obstacles, so that there is a way [m]."
    )
    start_clearance_m: Length = Field(
        0.3, ge=0.0, description="Least clearance of the outline at the start [m]."
    )
    min_distance_m: Length = Field(2.0, ge=0.0, description="Least distance to the goal [m].")
    max_distance_m: Length = Field(6.0, ge=0.0, description="Largest distance to the goal [m].")


def scenario_task(scenario: Scenario, seed: int) -> EpisodeTask:
    """Returns the task of the trial with this seed: its start and its goal."""
    return EpisodeTask(
        scenario.start_pose(seed), np.array(scenario.goal), scenario.true_world, seed
    )


def random_task(scenario: Scenario, robot: Robot, settings: RandomTasks, seed: int) -> EpisodeTask:
    """Returns a task as a function of the seed.

    Obstacles leave a passage between each other, the start some clearance to the robot's outline,
    the goal room to turn on the spot. Raises InputError where there is no room for that.
    """
    generator = np.random.default_rng(seed)
    low, high = _area(scenario, settings)
    world = _with_obstacles(scenario.true_world, settings, generator, low, high)
    start = _draw_start(world, robot, settings, generator, low, high)
    _, radius_m = robot.radii
    for _ in range(MAX_DRAWS):
        goal = np.array([*generator.uniform(low, high), generator.uniform(-math.pi, math.pi)])
        distance_m = math.dist(goal[:2], start[:2])
        if (
            settings.min_distance_m <= distance_m <= settings.max_distance_m
            and _gap_m(world, shapely.Point(goal[:2])) >= radius_m
        ):
            return EpisodeTask(start, goal, world, seed)
    raise InputError(f"scenario {scenario.name}: no free goal found; expected more room")


def _area(scenario: Scenario, settings: RandomTasks) -> tuple[Array, Array]:
    """Returns the corners (2,) of the area in which everything is drawn, m."""
    poses = [scenario.start, scenario.goal]
    centre = np.mean(poses, axis=0)[:2]
    x0, y0, x1, y1 = scenario.true_world.bounds(poses, AREA_MARGIN_M)
    half_m = 0.5 * settings.area_m
    if not scenario.true_world.shapes:
        return centre - half_m, centre + half_m
    return np.minimum([x0, y0], centre - half_m), np.maximum([x1, y1], centre + half_m)


def _with_obstacles(
    world: World,
    settings: RandomTasks,
    generator: np.random.Generator,
    low: Array,
    high: Array,
) -> World:
    """Returns a world with more obstacles; one for which there is no room is left out."""
    added: list[Cylinder | Polygon] = []
    placed = np.empty((0, 3))
    for _ in range(generator.integers(settings.max_obstacles, endpoint=True)):
        radius_m = generator.uniform(settings.min_radius_m, settings.max_radius_m)
        centre, angle = generator.uniform(low, high), generator.uniform(0.0, 0.5 * math.pi)
        is_box = generator.random() < 0.5
        gaps_m = np.hypot(*(placed[:, :2] - centre).T) - placed[:, 2]
        apart_m = min(gaps_m.min(initial=math.inf), _gap_m(world, shapely.Point(centre)))
        if apart_m - radius_m < settings.passage_m:
            continue
        placed = np.vstack([placed, [*centre, radius_m]])
        added.append(_box(centre, radius_m, angle) if is_box else _pillar(centre, radius_m))
    return World((*world.obstacles, *added), world.walls)


def _draw_start(
    world: World,
    robot: Robot,
    settings: RandomTasks,
    generator: np.random.Generator,
    low: Array,
    high: Array,
) -> Array:
    outline = robot.outline
    for _ in range(MAX_DRAWS):
        start = np.array([*generator.uniform(low, high), generator.uniform(-math.pi, math.pi)])
        body = shapely.Polygon(place_outline(outline, start))
        if _gap_m(world, body) >= settings.start_clearance_m:
            return start
    raise InputError("no free start found; expected more room")


def _gap_m(world: World, geometry: shapely.Geometry) -> float:
    """Returns the distance from a geometry to the obstacles, m; 0 inside one, inf without any."""
    return float(shapely.distance(world.regions, geometry).min(initial=math.inf))


def _pillar(centre: Array, radius_m: float) -> Cylinder:
    x, y = centre.tolist()
    return Cylinder(type="cylinder", centre=(x, y), radius_m=radius_m)


def _box(centre: Array, radius_m: float, angle: float) -> Polygon:
    corners = angle + np.arange(4) * 0.5 * math.pi
    points = centre + radius_m * np.column_stack([np.cos(corners), np.sin(corners)])
    return Polygon(type="polygon", vertices=[(x, y) for x, y in points.tolist()])
