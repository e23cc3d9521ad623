"""A world of Gazebo as a scenario: polygons with heights, people, a task."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.descriptions.ros_packages import forget_folders
from drake_navbench.inputs.descriptions.world import Actor, is_world, read_world
from drake_navbench.inputs.descriptions.world_areas import Area, Levels, floor_under, world_areas
from drake_navbench.inputs.people import Person
from drake_navbench.inputs.scenario import TIMEOUT_ON_MAPS_S, Scenario, Suite
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.rasterize import mark_polygon
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import OCCUPIED, UNKNOWN
from drake_navbench.typed_files.quantities import MAX_LENGTH_M, Pose
from drake_navbench.typed_files.typed_yaml import validate

__all__ = ["GazeboWorld", "is_world", "load_gazebo_world", "scenario_in_world"]

# Worlds are cut off at this distance from the task, m: costmaps with cells of 5 cm can hold no
# more.
REACH_M = 100.0
# Corners within this of a straight edge are left out, m.
TOLERANCE_M = 0.003
MIN_AREA_M2 = 1e-4
GRID_M = 1e-4
# A smaller hole in a solid shape is closed, as no robot fits in it, m^2.
MIN_HOLE_M2 = 0.01
MAX_POLYGONS = 5000
# The most shapes in a world; those below the floor and above the robot make no polygon.
MAX_SHAPES = 20_000
HIGHEST_M = 20.0
MAX_REMARKS_SHOWN = 5
# The grid on which goals are drawn: its cell, its border around obstacles and its least reach, m.
# If walls enclose at least this area, m^2, goals lie within it.
CELL_M, BORDER_M, OPEN_M, ROOM_M2 = 0.05, 1.0, 4.0, 4.0
# The walking speeds that scenarios allow, m/s.
SLOWEST_MPS, FASTEST_MPS = 0.05, 2.0


@dataclass(frozen=True)
class GazeboWorld:
    """The obstacles and people of a Gazebo world, as fields of a scenario file.

    remarks: the parts left out, with the reasons. floor_m: height of the floor in the world's file.
    """

    path: Path
    obstacles: tuple[Mapping[str, Any], ...]
    persons: tuple[Mapping[str, Any], ...]
    remarks: tuple[str, ...]
    floor_m: float

    @property
    def summary(self) -> str:
        """One line with the numbers of obstacles, people and remarks."""
        hidden = sum(not obstacle["known_to_planner"] for obstacle in self.obstacles)
        people = f", {len(self.persons)} people" if self.persons else ""
        floor = f", floor at {self.floor_m:.3g} m" if self.floor_m else ""
        count = len(self.remarks)
        left_out = f", {count} {'remark' if count == 1 else 'remarks'}" if count else ""
        return (
            f"{self.path.name}: {len(self.obstacles)} polygons, {hidden} of them hidden from the "
            f"lidar{people}{floor}{left_out}"
        )


def load_gazebo_world(
    path: Path,
    *,
    lidar_m: float,
    top_m: float,
    around: Sequence[Sequence[float]] = (),
    folders: Sequence[Path] = (),
) -> GazeboWorld:
    """Returns a world for a robot whose lidar and top are at heights over the floor, m.

    around: the places of the task, m. folders: searched for models and packages besides the
    repository. Raises InputError where the file is no world.
    """
    places = [(float(place[0]), float(place[1])) for place in around]
    forget_folders()
    found = _loaded(path, Levels(lidar_m, top_m), places, folders)
    for remark in found.remarks[:MAX_REMARKS_SHOWN]:
        warnings.warn(f"{path}: {remark}", InputWarning, stacklevel=2)
    more = len(found.remarks) - MAX_REMARKS_SHOWN
    if more > 0:
        warnings.warn(f"{path}: and {more} remarks more", InputWarning, stacklevel=2)
    return found


def _loaded(
    path: Path, levels: Levels, around: Sequence[tuple[float, float]], folders: Sequence[Path]
) -> GazeboWorld:
    source = read_world(path, folders)
    floor_m = floor_under(source, around[0] if around else (0.0, 0.0))
    count = sum(len(link.collisions) for m in source.models for link in m.links.values())
    if count > MAX_SHAPES:
        raise InputError(f"{path}: {count} shapes stand in it, expected at most {MAX_SHAPES}")
    areas = world_areas(source, levels, floor_m)
    near = _region_around(around)
    remarks = list(source.remarks)
    clipped = [area for area in areas if not near.contains(shapely.box(*area.region.bounds))]
    if clipped:
        wide_m = max(max(a.region.bounds[2:]) - min(a.region.bounds[:2]) for a in clipped)
        remarks.append(
            f"cut off {REACH_M:g} m around the task: {clipped[0].name} and other parts reach "
            f"{wide_m:.4g} m"
        )
    every = (obstacle for area in areas for obstacle in _obstacles(area, near))
    obstacles = tuple(islice(every, MAX_POLYGONS + 1))
    if len(obstacles) > MAX_POLYGONS:
        raise InputError(
            f"{path}: makes more than {MAX_POLYGONS} polygons; expected a smaller world"
        )
    solid = shapely.union_all([area.region for area in areas])
    persons = []
    for person in map(_person, source.actors):
        why = _why_not_walking(person, solid)
        if why:
            remarks.append(f"left out the actor {person['name']}, which {why}")
        else:
            persons.append(person)
    return GazeboWorld(path, obstacles, tuple(persons), tuple(remarks), floor_m)


def _region_around(places: Sequence[Sequence[float]]) -> BaseGeometry:
    task = shapely.MultiPoint([(0.0, 0.0)] if not places else [tuple(p) for p in places])
    return shapely.box(*task.buffer(REACH_M).bounds)


def _obstacles(area: Area, near: BaseGeometry) -> Iterator[dict[str, Any]]:
    """Yields the polygons of an area as fields of obstacles."""
    for part in _polygons(shapely.intersection(area.region, near)):
        for piece in simple_parts(part):
            for polygon in _polygons(piece):
                if polygon.interiors:
                    # The holes that remain come of rounding.
                    polygon = shapely.Polygon(polygon.exterior)
                corners = [[round(x, 4), round(y, 4)] for x, y in polygon.exterior.coords[:-1]]
                fields: dict[str, Any] = {
                    "type": "polygon",
                    "vertices": corners,
                    "known_to_planner": area.is_seen,
                    "height_m": round(min(max(area.top_m, 0.001), HIGHEST_M), 3),
                }
                if area.bottom_m > 0.0:
                    fields["bottom_m"] = round(min(area.bottom_m, HIGHEST_M), 3)
                yield fields


def _polygons(region: BaseGeometry) -> Iterator[shapely.Polygon]:
    """Yields the polygons of a region, valid, with few corners, each on a grid of 0.1 mm.

    Thin spikes, which rounding would turn into edges that cross, are closed first.
    """
    closed = shapely.buffer(region, TOLERANCE_M, join_style="mitre")
    opened = shapely.buffer(closed, -TOLERANCE_M, join_style="mitre")
    few = shapely.simplify(opened, TOLERANCE_M)
    for part in shapely.get_parts(shapely.set_precision(few, GRID_M)):
        if isinstance(part, shapely.Polygon) and part.area >= MIN_AREA_M2:
            yield part


def simple_parts(polygon: shapely.Polygon) -> Iterator[shapely.Polygon]:
    """Yields polygons without holes that cover a polygon: it is cut through its larger holes."""
    holes = [hole for hole in polygon.interiors if shapely.Polygon(hole).area > MIN_HOLE_M2]
    polygon = shapely.Polygon(polygon.exterior, holes)
    if not polygon.interiors:
        yield polygon
        return
    x = float(shapely.Polygon(polygon.interiors[0]).centroid.x)
    low_x, low_y, high_x, high_y = polygon.bounds
    for box in (
        shapely.box(low_x - 1.0, low_y - 1.0, x, high_y + 1.0),
        shapely.box(x, low_y - 1.0, high_x + 1.0, high_y + 1.0),
    ):
        for part in shapely.get_parts(shapely.intersection(polygon, box)):
            if isinstance(part, shapely.Polygon) and part.area > MIN_AREA_M2:
                yield from simple_parts(part)


def occupancy_of(world: GazeboWorld) -> OccupancyMap:
    """Returns the floor of a world as a grid, with obstacles of any height occupied.

    Where walls enclose a room or more, cells outside of them are unknown.
    """
    # SciPy is loaded for those who have goals drawn.
    from scipy import ndimage

    outlines = [np.array(obstacle["vertices"]) for obstacle in world.obstacles]
    corners = np.vstack([*outlines, [[-OPEN_M, -OPEN_M], [OPEN_M, OPEN_M]]])
    low, high = corners.min(axis=0) - BORDER_M, corners.max(axis=0) + BORDER_M
    columns, rows = np.ceil((high - low) / CELL_M).astype(int)
    grid = Grid(np.zeros((rows, columns), dtype=np.uint8), float(low[0]), float(low[1]), CELL_M)
    for outline in outlines:
        mark_polygon(grid, outline)
    occupancy = np.where(grid.costs > 0, OCCUPIED, 0).astype(np.int8)
    regions, _ = ndimage.label(occupancy == 0)
    sides = (regions[0], regions[-1], regions[:, 0], regions[:, -1])
    outside = np.isin(regions, np.unique(np.concatenate(sides)))
    is_enclosed = (occupancy == 0) & ~outside
    if is_enclosed.sum() * CELL_M**2 >= ROOM_M2:
        occupancy[outside & (occupancy == 0)] = UNKNOWN
    return OccupancyMap(occupancy, CELL_M, grid.origin_x, grid.origin_y)


def _person(actor: Actor) -> dict[str, Any]:
    """Returns a person who walks an actor's trajectory and ignores the robot, as in Gazebo."""
    knots = actor.knots
    length_m = sum(math.dist(a[1:], b[1:]) for a, b in pairwise(knots))
    duration_s = knots[-1][0] - knots[0][0]
    speed = length_m / duration_s if duration_s > 0.0 else SLOWEST_MPS
    places = [list(map(float, knot[1:])) for knot in knots]
    goals = [b for a, b in pairwise(places) if math.dist(a, b) > 0.0][:1000]
    return {
        "name": actor.name,
        "start": places[0],
        "goals": goals,
        "repeats": actor.repeats,
        "speed_mps": min(max(speed, SLOWEST_MPS), FASTEST_MPS),
        "reaction": "oblivious",
    }


def _why_not_walking(person: Mapping[str, Any], solid: BaseGeometry) -> str:
    """Returns why somebody cannot walk among obstacles as an actor does, through them; or ''."""
    farthest_m = max(abs(x) for place in (person["start"], *person["goals"]) for x in place)
    if farthest_m > MAX_LENGTH_M:
        return f"goes {farthest_m:g} m from the world's origin, farther than {MAX_LENGTH_M:g} m"
    walker = Person(**person)
    if solid.intersects(shapely.Point(walker.start).buffer(walker.radius_m)):
        return f"starts inside an obstacle, at {list(walker.start)}"
    for start, end in walker.ways:
        if solid.intersects(shapely.LineString([start, end])):
            return f"walks through an obstacle, from {list(start)} to {list(end)}"
    return ""


def scenario_in_world(
    world: GazeboWorld,
    start: Pose,
    goal: Pose,
    *,
    name: str | None = None,
    suite: Suite | None = None,
    map_file: Path | None = None,
) -> Scenario:
    """Returns the task to navigate from a start to a goal in a world; raises InputError.

    map_file: the map that the robot has of the world; with None its planner knows every obstacle.
    """
    described: dict[str, Any] = {"obstacles": [dict(o) for o in world.obstacles]}
    if map_file is not None:
        unknown = [{**o, "known_to_planner": False} for o in world.obstacles]
        described = {"map": map_file.name, "map_stands": False, "obstacles": unknown}
    if world.persons:
        described["people"] = {"persons": [dict(p) for p in world.persons]}
    data = {
        "description": f"{world.path.name}: from {list(start)} to {list(goal)}",
        "world": described,
        "start": start,
        "goal": goal,
        "navigation_mode": "navigate_to_pose",
        "timeout_s": TIMEOUT_ON_MAPS_S,
        "name": name or world.path.name.partition(".")[0],
        "suite": suite and suite.model_dump(),
    }
    scenario = validate(Scenario, data, str(world.path))
    if map_file is None:
        return scenario
    return scenario.model_copy(update={"directory": str(map_file.absolute().parent)})
