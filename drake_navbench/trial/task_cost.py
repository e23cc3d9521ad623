"""The least memory and time that a trial needs, by its task and robot alone.

The figures behind each entry were measured on a server of 2024, to within a factor of 2. They
refuse a task that would only break later, hours into a run. A controller's own share is not known
here, so its parameters have bounds of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.scenario_plan import ElementsPlan, PolylinePlan, Straight
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.navigation.smac_planner_hybrid import require_few_states
from drake_navbench.navigation.smac_planner_hybrid_parameters import SmacPlannerHybridParameters
from drake_navbench.trial.planning import global_grid_shape

# A trial that takes this much longer than the time it simulates hangs.
WALL_CLOCK_PER_SIMULATED_SECOND = 5.0
MIN_WALL_CLOCK_S = 120.0
MAX_MEMORY_BYTES = 2e9

BYTES_PER_CELL = 30.0
LOCAL_UPDATE_S_PER_CELL = 2e-8
PLAN_S_PER_CELL = 5e-8
# SceneGraph keeps an entry for every pair of obstacles, and compares each new name with all others.
BYTES_PER_OBSTACLE_PAIR, S_PER_OBSTACLE_PAIR = 170.0, 4e-6
BYTES_PER_WALL, S_PER_WALL_PAIR = 6e3, 5e-8
BYTES_PER_BEAM = 40.0
BYTES_PER_SIMULATED_SECOND = 60e3
CYCLE_S = 2e-4
BYTES_PER_PLAN_POSE = 100.0


class Need(NamedTuple):
    """The resources that a part of a trial needs: bytes at its peak, and s of wall clock."""

    what: str
    memory_bytes: float = 0.0
    time_s: float = 0.0


def wall_clock_limit_s(scenario: Scenario) -> float:
    """Returns the wall-clock time, s, after which a trial counts as hanging."""
    return max(MIN_WALL_CLOCK_S, WALL_CLOCK_PER_SIMULATED_SECOND * scenario.timeout_s)


def check_cost(scenario: Scenario, robot: Robot) -> None:
    """Raises InputError, with the figures, where a trial would need too much memory or time."""
    planner = robot.navigation.planner
    if isinstance(planner, SmacPlannerHybridParameters):
        factor = planner.downsampling_factor if planner.downsample_costmap else 1
        for place in scenario.places:
            rows, columns = (-(-count // factor) for count in global_grid_shape(place, robot))
            require_few_states(planner, rows, columns)
    needs = list(_needs(scenario, robot))
    memory = sum(need.memory_bytes for need in needs)
    if memory > MAX_MEMORY_BYTES:
        largest = max(needs, key=lambda need: need.memory_bytes)
        raise InputError(
            f"scenario {scenario.name}: a trial would need {_gigabytes(memory)}, "
            f"{_gigabytes(largest.memory_bytes)} of it for {largest.what}; "
            f"expected at most {_gigabytes(MAX_MEMORY_BYTES)}"
        )
    time_s, limit_s = sum(need.time_s for need in needs), wall_clock_limit_s(scenario)
    if time_s > limit_s:
        longest = max(needs, key=lambda need: need.time_s)
        raise InputError(
            f"scenario {scenario.name}: a trial would take {time_s:.0f} s and more, "
            f"{longest.time_s:.0f} s of it for {longest.what}; expected at most {limit_s:.0f} s"
        )


def _needs(scenario: Scenario, robot: Robot) -> Iterator[Need]:
    navigation, duration_s = robot.navigation, scenario.timeout_s
    local = navigation.local_costmap
    cells = local.width * local.height / local.resolution**2
    yield Need(
        f"the local costmap of {cells:.3g} cells",
        BYTES_PER_CELL * cells,
        LOCAL_UPDATE_S_PER_CELL * cells * local.update_frequency * duration_s,
    )
    plans = 1.0
    if scenario.navigation_mode != "follow_path":
        plans = max(1.0, navigation.global_costmap.update_frequency * duration_s)
    places = scenario.places
    for place in places:
        rows, columns = global_grid_shape(place, robot)
        yield Need(
            f"the global costmap of {columns} x {rows} cells",
            BYTES_PER_CELL * rows * columns,
            # On each floor of a mission plans are made for its share of the time.
            PLAN_S_PER_CELL * rows * columns * plans / len(places),
        )
    finest = min((place.map.resolution for place in places if place.map is not None), default=None)
    for costmap in (local, navigation.global_costmap):
        radius = costmap.inflation_layer.inflation_radius
        resolution = finest or costmap.resolution
        yield Need(
            f"an inflation_radius of {radius:g} m in cells of {resolution:g} m",
            BYTES_PER_CELL * (radius / resolution) ** 2,
        )
    obstacles = sum(len(place.world.obstacles) for place in places)
    walls = len(scenario.true_world.walls)
    yield Need(
        f"{obstacles} obstacles",
        BYTES_PER_OBSTACLE_PAIR * obstacles**2,
        S_PER_OBSTACLE_PAIR * obstacles**2,
    )
    yield Need(f"{walls} walls of the map", BYTES_PER_WALL * walls, S_PER_WALL_PAIR * walls**2)
    scans = duration_s / robot.lidar.period_s
    beams = robot.lidar.beam_count * (1 + len(robot.lidar.further_poses))
    yield Need(f"{scans:.3g} scans of {beams} beams", BYTES_PER_BEAM * scans * beams)
    frequency = navigation.controller_server.controller_frequency
    yield Need(
        f"{duration_s:g} s of driving",
        BYTES_PER_SIMULATED_SECOND * duration_s,
        CYCLE_S * frequency * duration_s,
    )
    poses = _plan_length_m(scenario) / getattr(scenario.plan, "spacing_m", np.inf)
    yield Need(f"the plan of {poses:.3g} poses", BYTES_PER_PLAN_POSE * poses)


def _plan_length_m(scenario: Scenario) -> float:
    """Returns the length of a plan that the scenario gives, 0 where a planner makes it."""
    plan = scenario.plan
    if isinstance(plan, PolylinePlan):
        return path_length(plan.points)
    if isinstance(plan, ElementsPlan):
        return sum(
            e.straight_m if isinstance(e, Straight) else abs(np.radians(e.arc_deg)) * e.radius_m
            for e in plan.elements
        )
    return 0.0


def _gigabytes(count: float) -> str:
    return f"{count / 1e9:.3g} GB"
