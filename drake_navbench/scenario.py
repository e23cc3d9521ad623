"""The scenario file: a world, a task, what the planner knows, what varies between trials."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import Field, model_validator

from drake_navbench.errors import InputError
from drake_navbench.named_files import NamedFiles
from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.robot import Robot
from drake_navbench.typed_yaml import FrozenModel, read_yaml, validate
from drake_navbench.world import Obstacle, Point, World, place_footprint

SCENARIO_FILES = NamedFiles(kind="scenario", package="drake_navbench.scenarios")
# The order of the publication; other built-in scenarios run only when named.
PUBLISHED_SCENARIOS = (
    "empty",
    "static_obstacles",
    "one_obstacle",
    "restricted_small",
    "restricted_large",
)

Pose = tuple[float, float, float]


class Straight(FrozenModel):
    """A straight piece of a given plan."""

    straight_m: float = Field(gt=0.0, description="Length [m].")


class Arc(FrozenModel):
    """A circular piece of a given plan."""

    arc_deg: float = Field(ge=-360.0, le=360.0, description="Turn, positive to the left [deg].")
    radius_m: float = Field(gt=0.0, description="Radius [m].")


class GridPlan(FrozenModel):
    """The plan comes from the global planner."""

    type: Literal["planner"]


class ElementsPlan(FrozenModel):
    """The plan is given as straights and arcs from the start pose."""

    type: Literal["elements"]
    elements: list[Straight | Arc] = Field(min_length=1, description="Pieces in order.")
    spacing_m: float = Field(0.05, gt=0.0, description="Distance between plan poses [m].")


class PolylinePlan(FrozenModel):
    """The plan is given as corner points; the first should be the start."""

    type: Literal["polyline"]
    points: list[Point] = Field(min_length=2, description="Corners [m].")
    spacing_m: float = Field(0.05, gt=0.0, description="Distance between plan poses [m].")


Plan = Annotated[GridPlan | ElementsPlan | PolylinePlan, Field(discriminator="type")]


class WorldDescription(FrozenModel):
    """The obstacles."""

    obstacles: list[Obstacle] = Field(default_factory=list, description="Shapes in the world.")
    keepout: list[list[Point]] = Field(
        default_factory=list, description="Polygons that the planner must avoid [m]."
    )


class Variation(FrozenModel):
    """What differs between the trials of a scenario; the same for every controller."""

    start_xy_std_m: float = Field(0.0, ge=0.0, description="Spread of the start position [m].")
    start_yaw_std_rad: float = Field(0.0, ge=0.0, description="Spread of the start heading [rad].")


class Scenario(FrozenModel):
    """One task in one world."""

    description: str = Field(min_length=1, description="One line for --list.")
    world: WorldDescription = Field(default_factory=WorldDescription)
    start: Pose = Field((0.0, 0.0, 0.0), description="x [m], y [m], yaw [rad].")
    goal: Pose = Field(description="x [m], y [m], yaw [rad].")
    plan: Plan = Field(default_factory=lambda: GridPlan(type="planner"))
    navigation_mode: Literal["follow_path"] = Field(
        "follow_path", description="follow_path: plan once, abort when the controller fails."
    )
    timeout_s: float = Field(120.0, gt=0.0, description="The trial ends as timed_out after this.")
    variation: Variation = Field(default_factory=Variation)
    robot_overrides: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot file that this scenario replaces."
    )
    name: str = Field("", description="Set from the file's name.")

    @model_validator(mode="after")
    def _check(self) -> Scenario:
        for polygon in self.world.keepout:
            if len(polygon) < 3 or not shapely.Polygon(polygon).is_valid:
                raise ValueError(
                    f"world.keepout: expected simple polygons of 3 points or more, got {polygon}"
                )
        return self

    @cached_property
    def obstacles(self) -> World:
        """Everything that stands in the world."""
        return World(tuple(self.world.obstacles))

    @cached_property
    def known_obstacles(self) -> World:
        """What the planner's map shows."""
        return World(tuple(o for o in self.world.obstacles if o.known_to_planner))

    def start_pose(self, seed: int) -> np.ndarray:
        """Returns (3,) the start pose of the trial with this seed, the same for all controllers."""
        deviation = NoiseKey(seed, NoiseStream.START_POSE, 0).generator().standard_normal(3)
        spread = self.variation
        return np.array(self.start) + deviation * np.array(
            [spread.start_xy_std_m, spread.start_xy_std_m, spread.start_yaw_std_rad]
        )


def load_scenario(name_or_path: str) -> Scenario:
    """Returns a built-in scenario by name, or one from a file.

    Raises InputError where the name is unknown or the file is wrong.
    """
    path = SCENARIO_FILES.find(name_or_path)
    data = read_yaml(path)
    if "name" in data:
        raise InputError(f"{path}: name: unknown field; a scenario is named by its file")
    return validate(Scenario, data | {"name": path.stem}, str(path))


def check_task(scenario: Scenario, robot: Robot) -> None:
    """Raises InputError where the robot cannot stand at the start, or the goal is occupied."""
    region = scenario.obstacles.region
    body = shapely.Polygon(place_footprint(robot.outline, scenario.start))
    if body.intersects(region):
        raise InputError(
            f"scenario {scenario.name}: start: the robot's footprint at {list(scenario.start)} "
            "overlaps an obstacle; expected free space"
        )
    if region.intersects(shapely.Point(scenario.goal[:2])):
        raise InputError(
            f"scenario {scenario.name}: goal: {list(scenario.goal[:2])} lies inside an obstacle; "
            "expected free space"
        )


def builtin_scenarios() -> list[Path]:
    """Returns the built-in scenario files: the published ones first, then the others by name."""
    others = [name for name in SCENARIO_FILES.names if name not in PUBLISHED_SCENARIOS]
    return [SCENARIO_FILES.find(name) for name in (*PUBLISHED_SCENARIOS, *others)]
