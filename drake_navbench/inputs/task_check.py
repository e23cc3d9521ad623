"""Checks that a robot can stand at a scenario's start, can turn, and has goals that are free."""

from __future__ import annotations

import math
import warnings

import numpy as np
import shapely

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.faults import PARTS, Conditions
from drake_navbench.inputs.floor_check import Place, check_floors, places_of
from drake_navbench.inputs.floor_scenario import FloorScenario
from drake_navbench.inputs.floors import rounded
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.rasterize import MASK_FULL
from drake_navbench.navigation.costmaps.map_image import UNKNOWN
from drake_navbench.navigation.costmaps.observation_layers import SensingParameters
from drake_navbench.typed_files.quantities import Pose


def check_task(scenario: Scenario, robot: Robot) -> None:
    """Raises InputError where the robot cannot stand at the start, or cannot get to the goal.

    On a map the start must not overlap an occupied cell, and the goal must be on the map and known.
    The start is checked without its variation: a trial that begins with a touch ends as collided.
    """
    if scenario.floors:
        check_floors(scenario)
    _check_conditions(scenario, robot)
    for place in places_of(scenario):
        _check_place(scenario.name, place, robot)


def _check_place(name: str, place: Place, robot: Robot) -> None:
    """Raises InputError where something is wrong on one map; name: the scenario's."""
    here = place.scenario
    for field, pose in place.stands.items():
        if here.true_world.intersects(shapely.Polygon(place_outline(robot.outline, pose))):
            raise InputError(
                f"scenario {name}: {field}: the robot's footprint at {list(pose)}{place.named} "
                "overlaps an obstacle; expected free space"
            )
    _check_map_for_amcl(here, robot)
    body = None
    if place.holds_start:
        body = shapely.Polygon(place_outline(robot.outline, here.start))
    _check_moving(here, body)
    _check_people(here, body)
    if body is not None:
        _check_recorded_people(here, body)
    for field, goal in place.goals.items():
        where = _why_no_goal(here, robot, np.array(goal[:2]))
        if where:
            raise InputError(
                f"scenario {name}: {field}: {list(goal[:2])} lies {where}{place.named}; "
                "expected free space"
            )


def why_no_place(scenario: FloorScenario, robot: Robot, pose: Pose) -> str:
    """Returns the reason why a robot cannot both start at a pose and be sent there, or ''."""
    reason = _why_no_goal(scenario, robot, np.array(pose[:2]))
    if reason:
        return reason
    if scenario.true_world.intersects(shapely.Polygon(place_outline(robot.outline, pose))):
        return "where the robot's footprint overlaps an obstacle"
    return ""


def _check_conditions(scenario: Scenario, robot: Robot) -> None:
    """Raises InputError where a fault is wrong, or where a delay or fault is later than the end."""
    conditions = scenario.conditions(robot)
    for part in PARTS:
        for settings in getattr(conditions, part).settings:
            for name, late_s in settings.delays_s.items():
                if late_s >= scenario.timeout_s:
                    raise InputError(
                        f"scenario {scenario.name}: {part}.{name}: got {late_s:g} s, expected less "
                        f"than the trial's timeout_s of {scenario.timeout_s:g} s"
                    )
    _check_actuators(scenario, robot, conditions)
    for index, fault in enumerate(scenario.faults):
        if fault.at_s >= scenario.timeout_s:
            raise InputError(
                f"scenario {scenario.name}: faults[{index}].at_s: got {fault.at_s:g} s, expected "
                f"less than the trial's timeout_s of {scenario.timeout_s:g} s"
            )


def _check_map_for_amcl(scenario: FloorScenario, robot: Robot) -> None:
    """Raises InputError where AMCL's map has no obstacle."""
    if robot.localization.amcl is None or scenario.known_world.obstacles:
        return
    if scenario.map is None or not scenario.map.is_occupied.any():
        raise InputError(
            f"scenario {scenario.name}: localization.amcl: expected a map, or obstacles that are "
            "known_to_planner, as there is nothing else to be localized by"
        )


def _check_actuators(scenario: Scenario, robot: Robot, conditions: Conditions) -> None:
    """Raises InputError where an actuator setting needs a drive that the robot does not have."""
    place = f"scenario {scenario.name}: actuators"
    if robot.localization.wheel_odometry and not isinstance(robot.drive, DifferentialDrive):
        raise InputError(
            f"scenario {scenario.name}: localization.wheel_odometry: expected a differential "
            f"drive, got drive.type {robot.drive.type}"
        )
    for settings in conditions.actuators.settings:
        if settings.touches_wheels and not isinstance(robot.drive, DifferentialDrive):
            raise InputError(
                f"{place}: deadband, steps, radii and slip are those of a differential drive's "
                f"wheels, got drive.type {robot.drive.type}"
            )
        if not settings.limits_force:
            continue
        if not robot.mass_kg:
            raise InputError(f"{place}: force_n, payload_kg and slope_rad need the robot's mass_kg")
        if settings.force_n is None and not math.isfinite(robot.drive.bounds.acceleration_mps2):
            raise InputError(
                f"{place}: force_n: missing; the drive has no limit on acceleration to take it from"
            )


def _check_moving(scenario: FloorScenario, body: shapely.Polygon | None) -> None:
    """Raises InputError where a moving obstacle meets a standing one, or begins on the robot."""
    world = scenario.true_world
    for index, thing in enumerate(world.moving.things):
        place = f"scenario {scenario.name}: world.moving_obstacles[{index}]"
        for waypoint, floor in thing.swept_floor():
            if world.intersects(floor):
                raise InputError(
                    f"{place}.waypoints[{waypoint}]: the way there leads through an obstacle; "
                    "expected free space"
                )
        first = shapely.Polygon(place_outline(thing.outline, thing.pose_at(0.0)))
        if body is not None and first.intersects(body):
            raise InputError(
                f"{place}: begins where the robot's footprint is, at {list(scenario.start)}; "
                "expected free space"
            )


def _check_people(scenario: FloorScenario, body: shapely.Polygon | None) -> None:
    """Raises InputError where a person starts, or has a goal, in an obstacle or on the robot."""
    world = scenario.true_world
    for index, person in enumerate(world.people.persons):
        place = f"scenario {scenario.name}: world.people.persons[{index}]"
        here = shapely.Point(person.start).buffer(person.radius_m)
        if body is not None and here.intersects(body):
            raise InputError(
                f"{place}.start: {list(person.start)} is where the robot's footprint is, at "
                f"{list(scenario.start)}; expected free space"
            )
        if world.intersects(here):
            raise InputError(
                f"{place}.start: {list(person.start)} is inside an obstacle; expected free space"
            )
        for start, end in person.ways:
            if world.intersects(shapely.LineString([start, end])):
                raise InputError(
                    f"{place}.goals: the straight way from {list(start)} to {list(end)} leads "
                    "through an obstacle; expected goals that can be walked to straight ahead"
                )


def _check_recorded_people(scenario: FloorScenario, body: shapely.Polygon) -> None:
    """Raises InputError where a recorded person starts on the robot, or walks through walls.

    A body may brush an obstacle, as tracks are not that exact.
    """
    world = scenario.true_world
    people = world.people
    if not isinstance(people, RecordedPeople):
        return
    path = scenario.files[-1]
    if not len(people):
        raise InputError(
            f"{path}: no person appears in the {scenario.timeout_s:g} s of a trial of scenario "
            f"{scenario.name}, counted from recording.start_time_s"
        )
    places = shapely.points(people.people_at(0.0)[:, :2])
    gaps_m = shapely.distance(places, body) - people.radius_m
    for person in np.flatnonzero(gaps_m <= 0.0)[:1]:
        raise InputError(
            f"{path}, line {people.line_at(person, 0.0)}: person {people.names[person]} stands "
            f"where scenario {scenario.name} has the robot's footprint, at {list(scenario.start)}; "
            "expected free space"
        )
    for person, line, ends in people.ways():
        if world.intersects(shapely.LineString(ends)):
            raise InputError(
                f"{path}, line {line}: person {people.names[person]} walks through an obstacle of "
                f"scenario {scenario.name}, from {rounded(ends[0])} to {rounded(ends[1])}; "
                "expected free space"
            )


def warn_of_column(preset: Preset, robot: Robot) -> None:
    """Warns where a column's controller asks for what the robot does not have."""
    _warn_of_rotation(preset, robot)
    _warn_of_kept_cells(preset, robot)


def _warn_of_kept_cells(preset: Preset, robot: Robot) -> None:
    """Warns where a controller looks for motion in a local costmap that may keep what has left.

    With Nav2's default only beams that end at a wall clear cells.
    """
    if not preset.parameters.looks_for_motion():
        return
    costmap = robot.navigation.local_costmap
    layers = {name: costmap.block(name) for name in costmap.plugins if costmap.is_active(name)}
    for layer, block in layers.items():
        if not isinstance(block, SensingParameters):
            continue
        for name, source in block.observation_sources.items():
            clears = source.clearing and source.inf_is_valid
            if source.data_type == "LaserScan" and not clears:
                warnings.warn(
                    f"controller {preset.name}: sees what moves only between walls within the "
                    "lidar's range, as beams without a hit clear no cells; for open spaces set "
                    f"{layer}.{name}.inf_is_valid and clearing to true in both costmaps",
                    InputWarning,
                    stacklevel=3,
                )


def _warn_of_rotation(preset: Preset, robot: Robot) -> None:
    """Warns where a column's controller may turn in place and the robot's base cannot."""
    radius_m = robot.drive.turning_radius_m
    if radius_m > 0.0 and preset.parameters.turns_in_place():
        warnings.warn(
            f"controller {preset.name}: may command rotations in place, at which a base that turns "
            f"on {radius_m:g} m stands still",
            InputWarning,
            stacklevel=3,
        )


def _why_no_goal(scenario: FloorScenario, robot: Robot, position: np.ndarray) -> str:
    """Returns the reason why a goal (2,) m cannot be one, such as 'off the map', or ''."""
    if scenario.true_world.intersects(shapely.Point(position)):
        return "inside an obstacle"
    if scenario.map is not None:
        value = scenario.map.value_at(position)
        if value is None:
            return "off the map"
        if value == UNKNOWN:
            return "in unknown space"
    if robot.navigation.global_costmap.is_active("keepout_filter"):
        keepouts = [mask for mask in scenario.filter_masks if mask.type == "keepout"]
        if any(mask.value_at(position) == MASK_FULL for mask in keepouts):
            return "in a keepout"
    return ""
