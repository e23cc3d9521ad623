"""The floors of a mission, side by side in the one plane that a trial simulates.

Each floor is a scenario of its own, with its world, map and masks. A placed floor is moved by its
offset, so that no two storeys are within sight of each other and a position tells its floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from drake_navbench.errors import InputError
from drake_navbench.inputs.floor_scenario import FloorScenario
from drake_navbench.inputs.mission import Lift, MissionStep
from drake_navbench.inputs.moving_obstacles import NOTHING_MOVES, MovingObstacles
from drake_navbench.inputs.people import NOBODY, People, WalkingPeople
from drake_navbench.inputs.scenario_world import Floor
from drake_navbench.inputs.world import World
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.map_file import OccupancyMap

Bounds = tuple[float, float, float, float]
Offset = tuple[float, float]
Model = TypeVar("Model", bound=BaseModel)
Pose = tuple[float, float, float]

# The gap between two storeys, m: larger than measured clearances and than people's reach.
STOREY_GAP_M = 10.0
# The fields of shapes, objects and people that hold positions.
POINTS = ("min", "max", "start", "end", "centre", "position")
POINT_LISTS = ("vertices", "goals")
PARTS = ("waypoints", "persons")


def rounded(numbers: Iterable[float]) -> list[float]:
    """Returns lengths, m, and angles, rad, as messages show them: to a thousandth."""
    return [round(float(number), 3) for number in numbers]


@dataclass(frozen=True)
class PlacedFloor:
    """A floor with its place in the world.

    index: its number among the floors of the file. offset: m, a point (x, y) on its map is (x, y) +
    offset in the world. scenario: moved to its place in the world. bounds: its min_x, min_y, max_x,
    max_y in the world, m. storey: a number, equal for the floors of one storey.
    """

    index: int
    name: str
    offset: Offset
    scenario: FloorScenario
    bounds: Bounds
    storey: int

    def placed(self, pose: Sequence[float]) -> Pose:
        """Returns the pose in the world of a pose on the floor's map, x m, y m, yaw rad."""
        x, y, yaw = pose
        return x + self.offset[0], y + self.offset[1], yaw


@dataclass(frozen=True)
class PlacedLeg:
    """A leg of a mission in the world: a goal on a floor, and a ride from there where it has one.

    arrival: the end of the ride, on the floor `to`; both None without a ride.
    """

    goal: Pose
    floor: PlacedFloor
    lift: Lift | None = None
    to: PlacedFloor | None = None
    arrival: Pose | None = None


@dataclass(frozen=True)
class FloorSight:
    """The surroundings that a sensor on a floor may see: the floor's storey.

    world: the standing world of the storey. bounds: min_x, min_y, max_x, max_y m around it, which
    hold all moving bodies there.
    """

    world: World
    bounds: Bounds


def sight_of(floor: PlacedFloor, floors: Sequence[PlacedFloor]) -> FloorSight:
    """Returns the surroundings that a sensor on a floor, one of `floors`, may see."""
    storey = [other for other in floors if other.storey == floor.storey]
    world = joined_world(storey)
    low_x, low_y, high_x, high_y = _joined([other.bounds for other in storey])
    margin_m = 0.5 * STOREY_GAP_M
    bounds = low_x - margin_m, low_y - margin_m, high_x + margin_m, high_y + margin_m
    return FloorSight(replace(world, moving=NOTHING_MOVES, people=NOBODY), bounds)


def mission_legs(
    mission: Sequence[MissionStep], lifts: Sequence[Lift], floors: Sequence[PlacedFloor]
) -> tuple[PlacedLeg, ...]:
    """Returns the legs of a mission, in order."""
    by_name, lift_of = {floor.name: floor for floor in floors}, {lift.name: lift for lift in lifts}
    here, legs = floors[0], []
    for step in mission:
        if step.goal is not None:
            legs.append(PlacedLeg(here.placed(step.goal), here))
            continue
        lift, there = lift_of[str(step.lift)], by_name[str(step.to)]
        stops = here.placed(lift.stops[here.name]), there.placed(lift.stops[there.name])
        legs.append(PlacedLeg(stops[0], here, lift, there, stops[1]))
        here = there
    return tuple(legs)


def placed_floors(floors: Sequence[Floor], own: Sequence[FloorScenario]) -> tuple[PlacedFloor, ...]:
    """Returns the floors at their places in the world; the first one's frame is the world's.

    own: each floor in the frame of its map. Floors with an origin in a storey lie at that origin;
    every other floor is a storey of its own. Each storey lies to the right of those before.
    """
    if not floors:
        return ()
    limits = [_bounds_of(floor) for floor in own]
    origins = [floor.origin or (0.0, 0.0) for floor in floors]
    storeys = _storeys(floors)
    right_m = -math.inf
    shifts_m: dict[int, float] = {}
    for storey in dict.fromkeys(storeys):
        low_x, _, high_x, _ = _joined(
            [_moved(limits[i], origins[i]) for i, its in enumerate(storeys) if its == storey]
        )
        # The offset is whole metres, so that cells lie as on the floor's own map, but for rounding.
        shift_m = 0.0
        if shifts_m:
            shift_m = float(math.ceil(right_m + STOREY_GAP_M - low_x))
        shifts_m[storey], right_m = shift_m, high_x + shift_m
    placed = []
    for index, (floor, one) in enumerate(zip(floors, own, strict=True)):
        x = origins[index][0] + shifts_m[storeys[index]] - origins[0][0]
        offset = x, origins[index][1] - origins[0][1]
        bounds = _moved(limits[index], offset)
        place = _placed_scenario(one, offset)
        placed.append(PlacedFloor(index, floor.name, offset, place, bounds, storeys[index]))
    return tuple(placed)


def _storeys(floors: Sequence[Floor]) -> list[int]:
    """Returns for each floor the index of the first floor of its storey."""
    named: dict[str, int] = {}
    return [
        index if floor.origin is None else named.setdefault(floor.storey, index)
        for index, floor in enumerate(floors)
    ]


def joined_world(floors: Sequence[PlacedFloor]) -> World:
    """Returns the worlds of all floors as one."""
    worlds = [floor.scenario.true_world for floor in floors]
    return World(
        tuple(one for world in worlds for one in world.obstacles),
        tuple(one for world in worlds for one in world.walls),
        MovingObstacles(tuple(thing for world in worlds for thing in world.moving.things)),
        WalkingPeople(_joined_people([floor.scenario.world.people for floor in floors])),
    )


def shifted(model: Model, offset: Offset) -> Model:
    """Returns a shape, a moving thing or people, with all positions moved by an offset, m."""
    changes: dict[str, Any] = {}
    for name in type(model).model_fields:
        value = getattr(model, name)
        if name in POINTS:
            changes[name] = _moved_point(value, offset)
        elif name in POINT_LISTS:
            changes[name] = [_moved_point(point, offset) for point in value]
        elif name in PARTS:
            changes[name] = [shifted(part, offset) for part in value]
    return model.model_copy(update=changes)


def floor_scenarios(
    whole: FloorScenario,
    start: Pose,
    floors: Sequence[Floor],
    lifts: Sequence[Lift],
    mission: Sequence[MissionStep],
) -> tuple[FloorScenario, ...]:
    """Returns each floor of a mission as a place of its own, in the frame of its map.

    whole: the mission's scenario, which starts at `start` on the first floor. The targets on a
    floor are its goals and the stops of lifts. Raises InputError for a floor without any.
    """
    own = []
    for index, floor in enumerate(floors):
        poses = [step.goal for step in mission if step.floor == floor.name and step.goal]
        poses += [lift.stops[floor.name] for lift in lifts if floor.name in lift.stops]
        if index == 0:
            poses.insert(0, start)
        if not poses:
            raise InputError(
                f"scenario {whole.name}: floors[{index}]: the mission never gets to {floor.name}, "
                "and no lift stops there"
            )
        own.append(
            FloorScenario.model_construct(
                description=whole.description,
                world=floor.world,
                filters=floor.filters,
                start=poses[0],
                waypoints=poses[:-1],
                goal=poses[-1],
                plan=whole.plan,
                navigation_mode=whole.navigation_mode,
                timeout_s=whole.timeout_s,
                name=f"{whole.name}: floors[{index}]",
                directory=whole.directory,
            )
        )
    return tuple(own)


def _placed_scenario(own: FloorScenario, offset: Offset) -> FloorScenario:
    world = own.world
    moved = FloorScenario.model_construct(
        **{name: getattr(own, name) for name in FloorScenario.model_fields}
        | {
            "world": world.model_copy(
                update={
                    "obstacles": [shifted(one, offset) for one in world.obstacles],
                    "moving_obstacles": [shifted(one, offset) for one in world.moving_obstacles],
                    "people": world.people and shifted(world.people, offset),
                }
            ),
            "start": _moved_pose(own.start, offset),
            "waypoints": [_moved_pose(pose, offset) for pose in own.waypoints],
            "goal": _moved_pose(own.goal, offset),
        }
    )
    masks = tuple(_moved_mask(mask, offset) for mask in own.filter_masks)
    return moved.with_maps(own.map and _moved_map(own.map, offset), masks)


def _bounds_of(own: FloorScenario) -> Bounds:
    """Returns min_x, min_y, max_x, max_y of a floor's map, poses and moving bodies, m."""
    points = [pose[:2] for pose in (own.start, *own.goals)]
    if own.map is not None:
        points += [own.map.bounds[:2], own.map.bounds[2:]]
    for thing in own.true_world.moving.things:
        points += [*(thing.knots[:, 1:3] - thing.reach_m), *(thing.knots[:, 1:3] + thing.reach_m)]
    for person in own.true_world.people.persons:
        points += [person.start, *person.goals]
    low_x, low_y, high_x, high_y = map(float, own.true_world.bounds(points, 0.0))
    return low_x, low_y, high_x, high_y


def _joined_people(everybody: Sequence[People | None]) -> People | None:
    """Returns the people of all floors as one crowd, in which no group is on two floors."""
    crowds = [(index, people) for index, people in enumerate(everybody) if people is not None]
    if not crowds:
        return None
    (_, first), *_ = crowds
    persons = []
    for index, people in crowds:
        # The groups of a file are below 1000.
        for person in people.persons:
            group = person.group if person.group is None else person.group + 1001 * index
            persons.append(person.model_copy(update={"group": group}))
    return first.model_copy(update={"persons": persons})


def _moved_map(grid: OccupancyMap, offset: Offset) -> OccupancyMap:
    return replace(grid, origin_x=grid.origin_x + offset[0], origin_y=grid.origin_y + offset[1])


def _moved_mask(mask: FilterMask, offset: Offset) -> FilterMask:
    return replace(mask, grid=_moved_map(mask.grid, offset))


def _moved_point(point: Sequence[float], offset: Offset) -> Offset:
    return point[0] + offset[0], point[1] + offset[1]


def _moved_pose(pose: Pose, offset: Offset) -> Pose:
    return pose[0] + offset[0], pose[1] + offset[1], pose[2]


def _moved(bounds: Bounds, offset: Offset) -> Bounds:
    x, y = offset
    return bounds[0] + x, bounds[1] + y, bounds[2] + x, bounds[3] + y


def _joined(all_bounds: Sequence[Bounds]) -> Bounds:
    low_x, low_y, high_x, high_y = np.array(all_bounds).T
    return float(low_x.min()), float(low_y.min()), float(high_x.max()), float(high_y.max())
