"""The scenario file: a world, a task, the planner's knowledge, the variation between trials."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import (
    Field,
    model_validator,
)

from drake_navbench.errors import InputError, InputWarning, nearest_name_hint
from drake_navbench.inputs.faults import Conditions, Fault, conditions_of
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES, FloorScenario
from drake_navbench.inputs.floors import (
    PlacedFloor,
    PlacedLeg,
    floor_scenarios,
    joined_world,
    mission_legs,
    placed_floors,
    rounded,
)
from drake_navbench.inputs.mission import Lift, MissionStep, check_mission, end_of
from drake_navbench.inputs.robot import Robot, load_robot, overridden
from drake_navbench.inputs.scenario_world import Floor
from drake_navbench.inputs.world import World
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.typed_files.file_kinds import SCENARIO, require_kind
from drake_navbench.typed_files.quantities import (
    Angle,
    Length,
    Pose,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel, parse_yaml, read_text, validate

# The order of the publication; other built-in scenarios run only when named.
PUBLISHED_SCENARIOS = (
    "empty",
    "static_obstacles",
    "one_obstacle",
    "restricted_small",
    "restricted_large",
)
# Fields that a file may not contain.
SET_BY_LOADING = ("name", "directory")
# The fields that a mission's floors have in place of the scenario.
ON_FLOORS = ("world", "filters", "waypoints")
# With more floors, lifts or legs it is no building and no mission.
MAX_FLOORS, MAX_LEGS = 100, 1000
# The timeout of a task that is given by a map, a start and a goal alone.
TIMEOUT_ON_MAPS_S = 600.0


class Suite(FrozenModel):
    """Many worlds that belong together: reports tell their totals, by density as well."""

    name: str = Field(min_length=1, description="Name of the suite of worlds.")
    density: str = Field("", description="Crowding of this world, in the suite's own words.")
    reference_length_m: Length | None = Field(
        None, gt=0.0, description="Length of the reference path of BARN's score [m]."
    )
    arrival_radius_m: Length | None = Field(
        None, gt=0.0, description="Distance to the goal that is enough for BARN's score [m]."
    )


class Variation(FrozenModel):
    """The random differences between the trials of a scenario; the same for every controller."""

    start_xy_std_m: Length = Field(
        0.0, ge=0.0, description="Standard deviation of the start position on x and y [m]."
    )
    start_yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Standard deviation of the start heading [rad]."
    )


class Scenario(FloorScenario):
    """One task in one world, or a mission over several floors."""

    quiet: ClassVar = frozenset({"faults", "clean_scenario", "floors", "lifts", "mission"})

    floors: tuple[Floor, ...] = Field(
        (),
        max_length=MAX_FLOORS,
        description="Floors of a mission; the robot starts on the first one.",
    )
    lifts: tuple[Lift, ...] = Field(
        (), max_length=MAX_FLOORS, description="Lifts between the floors."
    )
    mission: tuple[MissionStep, ...] = Field(
        (),
        max_length=MAX_LEGS,
        description="Goals and lift rides in order, in place of world, filters, waypoints and "
        "goal.",
    )
    expected_outcome: Literal["succeeded", "aborted"] = Field(
        "succeeded",
        description="Outcome that is right. aborted: the task is impossible on purpose, and "
        "giving up is right; reports say so, trials do not depend on it.",
    )
    variation: Variation = Field(default_factory=Variation)
    suite: Suite | None = Field(None, description="Suite of worlds that the scenario belongs to.")
    robot_overrides: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot file that this scenario replaces."
    )
    faults: tuple[Fault, ...] = Field((), description="Faults of the robot, each from its time on.")
    clean_scenario: str | None = Field(
        None,
        description="Name of the easier scenario of which this is a harsher form; where both "
        "are driven, the verdict tells how each controller's rank changes.",
    )

    @model_validator(mode="after")
    def _check_task(self) -> Scenario:
        if not (self.floors or self.lifts or self.mission):
            if "goal" not in self.model_fields_set:
                raise ValueError("goal: missing, but required")
            return self
        check_mission([floor.name for floor in self.floors], self.lifts, self.mission)
        for name in ON_FLOORS:
            usual = Scenario.model_fields[name].get_default(call_default_factory=True)
            if getattr(self, name) != usual:
                raise ValueError(
                    f"{name}: has no meaning with a mission, whose floors have their own"
                )
        end = end_of(self.mission, self.lifts)
        if "goal" in self.model_fields_set and self.goal != end:
            raise ValueError(
                f"goal: has no meaning with a mission, which ends at {list(end)}, got "
                f"{list(self.goal)}"
            )
        # The end of the task, on its floor's map.
        self.__dict__["goal"] = end
        return self

    @model_validator(mode="after")
    def _check_mode(self) -> Scenario:
        if self.floors and self.navigation_mode != "navigate_to_pose":
            raise ValueError(
                "navigation_mode: expected navigate_to_pose for a mission, got "
                f"{self.navigation_mode}"
            )
        if self.navigation_mode == "follow_path" and self.waypoints:
            raise ValueError(
                "waypoints: expected navigation_mode navigate_to_pose or navigate_through_poses, "
                "got follow_path"
            )
        if self.navigation_mode != "follow_path" and self.plan.type != "planner":
            raise ValueError(
                f"navigation_mode: {self.navigation_mode} plans again and again, so plan must be "
                f"of type planner, got {self.plan.type}"
            )
        return self

    @property
    def goals(self) -> tuple[Pose, ...]:
        """The goals in the world: waypoints and then the goal, or the goals of a mission's legs."""
        if self.floors:
            return tuple(leg.goal for leg in self.legs)
        return super().goals

    @property
    def places(self) -> tuple[FloorScenario, ...]:
        """The scenario itself, or its floors in the world, the floor of the start first."""
        return tuple(floor.scenario for floor in self.placed_floors) or (self,)

    @cached_property
    def floor_scenarios(self) -> tuple[FloorScenario, ...]:
        """Each floor of a mission as a place of its own, in the frame of its map."""
        if not self.floors:
            return ()
        return floor_scenarios(self, self.start, self.floors, self.lifts, self.mission)

    @cached_property
    def placed_floors(self) -> tuple[PlacedFloor, ...]:
        """The floors of a mission at their places in the world."""
        return placed_floors(self.floors, self.floor_scenarios)

    @property
    def legs(self) -> tuple[PlacedLeg, ...]:
        """The legs of a mission, in order."""
        return mission_legs(self.mission, self.lifts, self.placed_floors)

    @property
    def is_impossible(self) -> bool:
        """Whether the task is meant to be given up."""
        return self.expected_outcome == "aborted"

    @property
    def files(self) -> list[Path]:
        """The scenario's map and mask files, with their images, and the recording."""
        if self.floors:
            return [path for floor in self.floor_scenarios for path in floor.files]
        return super().files

    @cached_property
    def true_world(self) -> World:
        """Everything that is in the world, on all floors."""
        if self.floors:
            return joined_world(self.placed_floors)
        return super().true_world

    def load_robot(self, robot: str | Robot) -> Robot:
        """Returns a robot, also by name or from a file, with the overrides; raises InputError."""
        source = f"scenario {self.name}: robot_overrides"
        if isinstance(robot, Robot):
            return overridden(robot, self.robot_overrides, source)
        return load_robot(robot, self.robot_overrides, overrides_source=source)

    def conditions(self, robot: Robot) -> Conditions:
        """Returns the conditions of a robot at each time; raises InputError for a wrong fault."""
        conditions = conditions_of(robot, self.faults, f"scenario {self.name}: faults")
        return replace(conditions, relocalizes=any(lift.errs for lift in self.lifts))

    def start_pose(self, seed: int) -> np.ndarray:
        """Returns (3,) the start pose of the trial with this seed, the same for all controllers."""
        deviation = NoiseKey(seed, NoiseStream.START_POSE, 0).generator().standard_normal(3)
        spread = self.variation
        return np.array(self.start) + deviation * np.array(
            [spread.start_xy_std_m, spread.start_xy_std_m, spread.start_yaw_std_rad]
        )


def warn_of_degrees(poses: Mapping[str, Pose | None]) -> None:
    """Warns of headings of more than a turn. poses: by what names them to the user."""
    for name, pose in poses.items():
        if pose is not None and abs(pose[2]) > 2.0 * math.pi:
            warning = f"{name}: a heading of {pose[2]:g} rad; headings are not in degrees"
            warnings.warn(warning, InputWarning, stacklevel=3)


def scenario_on_map(
    map_file: Path,
    start: Pose,
    goal: Pose,
    *,
    name: str | None = None,
    suite: Suite | None = None,
    grid: OccupancyMap | None = None,
) -> Scenario:
    """Returns the task to navigate from a start to a goal on a map; raises InputError.

    name: by default that of the file. grid: the map, if it was read already.
    """
    data = {
        "description": f"{map_file.name}: from {rounded(start)} to {rounded(goal)}",
        "world": {"map": map_file.name},
        "start": start,
        "goal": goal,
        "navigation_mode": "navigate_to_pose",
        "timeout_s": TIMEOUT_ON_MAPS_S,
        "name": name or map_file.stem,
        "suite": suite and suite.model_dump(),
    }
    scenario = validate(Scenario, data, f"--map {map_file}")
    scenario = scenario.model_copy(update={"directory": str(map_file.absolute().parent)})
    if grid is not None:
        scenario = scenario.with_maps(grid)
    _ = scenario.map
    return scenario


def load_scenario(name_or_path: str) -> Scenario:
    """Returns a built-in scenario by name, or one from a file.

    Raises InputError where the name is unknown or the file is wrong.
    """
    path = SCENARIO_FILES.find(name_or_path)
    text = read_text(path)
    return scenario_in_file(parse_yaml(text, str(path)), path, text)


def scenario_in_file(data: dict[str, Any], path: Path, text: str | None = None) -> Scenario:
    """Returns the scenario of a file's content, which need not be in the file yet.

    path: the file, whose name is the scenario's; other files are searched beside it. text: the
    file's, by which errors name lines. Raises InputError where the content is wrong.
    """
    require_kind(data, SCENARIO, path)
    for field in SET_BY_LOADING:
        if field in data:
            raise InputError(f"{path}: {field}: unknown field; the file's place gives it")
    scenario = validate(Scenario, data | {"name": path.stem}, str(path), text)
    scenario = scenario.model_copy(update={"directory": str(path.resolve().parent)})
    if scenario.clean_scenario is not None and scenario.clean_scenario not in SCENARIO_FILES.names:
        hint = nearest_name_hint(scenario.clean_scenario, SCENARIO_FILES.names)
        raise InputError(
            f"{path}: clean_scenario: unknown scenario {scenario.clean_scenario!r}{hint}"
        )
    warn_of_degrees({f"{path}: start": scenario.start, f"{path}: goal": scenario.goal})
    # Maps and masks are read now, so that a wrong one is found before any trial.
    for one in (scenario, *scenario.floor_scenarios):
        _ = one.map, one.filter_masks
    return scenario
