"""The check of a mission's floors against one another, and of the robot's targets on each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely

from drake_navbench.errors import InputError
from drake_navbench.inputs.floor_scenario import FloorScenario
from drake_navbench.inputs.floors import Pose, rounded
from drake_navbench.inputs.scenario import Scenario

# The share of the smaller map by which two maps of one storey may overlap.
MOST_SHARED = 0.5


class Place(NamedTuple):
    """One map with the poses to be checked on it, in the map's frame.

    stands: poses at which the robot will stand, by their name in the file. goals: poses to which it
    is sent, by name. holds_start: whether the trial begins here. named: the map's name in errors.
    """

    scenario: FloorScenario
    stands: dict[str, Pose]
    goals: dict[str, Pose]
    holds_start: bool = True
    named: str = ""


def places_of(scenario: Scenario) -> Iterator[Place]:
    """Yields the maps of a task: one, or that of each floor."""
    if not scenario.floors:
        names = [f"waypoints[{index}]" for index in range(len(scenario.waypoints))]
        goals = dict(zip([*names, "goal"], scenario.goals, strict=True))
        yield Place(scenario, {"start": scenario.start}, goals)
        return
    for index, (floor, own) in enumerate(
        zip(scenario.floors, scenario.floor_scenarios, strict=True)
    ):
        stops = {
            f"lifts[{number}].stops.{floor.name}": lift.stops[floor.name]
            for number, lift in enumerate(scenario.lifts)
            if floor.name in lift.stops
        }
        goals = {
            f"mission[{number}].goal": step.goal
            for number, step in enumerate(scenario.mission)
            if step.goal is not None and step.floor == floor.name
        }
        stands = {"start": scenario.start, **stops} if index == 0 else stops
        yield Place(own, stands, stops | goals, index == 0, f" on floor {floor.name}")


def check_floors(scenario: Scenario) -> None:
    """Raises InputError where the floors cannot be those of one building."""
    _check_people(scenario)
    _check_masks(scenario)
    _check_storey(scenario)


def _check_people(scenario: Scenario) -> None:
    """Raises InputError for recorded people, or where floors' people have different settings."""
    crowds = [
        (index, floor.world.people)
        for index, floor in enumerate(scenario.floors)
        if floor.world.people is not None
    ]
    for index, people in crowds:
        if people.recording is not None:
            raise InputError(
                f"scenario {scenario.name}: floors[{index}].world.people.recording: got "
                f"{people.recording.file!r}, expected people who walk by a model: floors of a "
                "mission have no recorded ones"
            )
    for index, people in crowds[1:]:
        (first, others), *_ = crowds
        for name in type(people).model_fields:
            own, expected = getattr(people, name), getattr(others, name)
            if name != "persons" and own != expected:
                raise InputError(
                    f"scenario {scenario.name}: floors[{index}].world.people.{name}: expected "
                    f"{expected}, as on floors[{first}], got {own}"
                )


def _check_masks(scenario: Scenario) -> None:
    """Raises InputError where a mask's bounds are not those of its floor's map."""
    for index, own in enumerate(scenario.floor_scenarios):
        for number, (entry, mask) in enumerate(zip(own.filters, own.filter_masks, strict=True)):
            if entry.mask is None or own.map is None:
                continue
            off_m = np.abs(np.subtract(mask.grid.bounds, own.map.bounds)).max()
            if off_m > max(mask.grid.resolution, own.map.resolution):
                raise InputError(
                    f"scenario {scenario.name}: floors[{index}].filters[{number}].mask: "
                    f"{entry.mask} covers {rounded(mask.grid.bounds)}, the floor's map "
                    f"{rounded(own.map.bounds)}; expected the same; is it another floor's?"
                )


def _check_storey(scenario: Scenario) -> None:
    """Raises InputError where two floors would lie in the same place."""
    floors = [f for f in scenario.placed_floors if scenario.floors[f.index].origin is not None]
    for number, floor in enumerate(floors):
        for other in floors[:number]:
            if floor.storey != other.storey:
                continue
            own, others = shapely.box(*floor.bounds), shapely.box(*other.bounds)
            smaller_m2 = min(own.area, others.area)
            if own.intersection(others).area > MOST_SHARED * smaller_m2:
                raise InputError(
                    f"scenario {scenario.name}: floors[{floor.index}].origin: {floor.name} would "
                    f"lie on top of {other.name}; expected maps of one storey, side by side, or no "
                    "origin"
                )
