"""Parity of a planner's port and the original in a build, over random maps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.external.client_process import ClientProcess
from drake_navbench.controllers.external.messages import configure_message
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Costmap
from drake_navbench.kernels.inflation import inflate
from drake_navbench.native.builds import Build
from drake_navbench.navigation.navfn_planner import NavfnPlanner
from drake_navbench.navigation.planner import Planner, PlanningError
from drake_navbench.navigation.planner_settings import PLANNERS, make_planner
from drake_navbench.navigation.smac_planner_2d import SmacPlanner2D
from drake_navbench.navigation.smac_planner_2d_parameters import SmacPlanner2DParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, RELEASE_FIELD
from drake_navbench.studies.side_by_side.likeness import Likeness, likeness_of
from drake_navbench.trial.column_controller import controller_setup
from drake_navbench.trial.trial import DEFAULT_ROBOT

# Planner -> the sets of parameters, besides its defaults, with which both are compared.
VARIANTS: Mapping[str, tuple[Mapping[str, Any], ...]] = {
    NavfnPlanner.nav2_plugin: ({}, {"use_astar": True}, {"allow_unknown": False}),
    SmacPlanner2D.nav2_plugin: (
        {},
        {"cost_travel_multiplier": 2.5, "allow_unknown": False},
        {"downsample_costmap": True, "downsampling_factor": 2},
    ),
}
# The exception that a release without error codes throws, whatever the reason.
WITHOUT_CODE = "PlannerException"
PATIENCE_S = 60.0
RESOLUTION_M = 0.05
SIDE_CELLS = (50, 140)
MAX_OBSTACLES = 14


class PlanRequest(NamedTuple):
    """A map, a start and a goal, each (3,) x m, y m, yaw rad."""

    costmap: Costmap
    start: Array
    goal: Array


class PlanResult(NamedTuple):
    """Both planners' answers to one request.

    difference: the largest one of |dx| m, |dy| m and |dyaw| rad over all poses; NaN where one finds
    no plan, or the plans have different numbers of poses. told: both answers in words, where they
    differ. has_plan: whether both found a plan.
    """

    likeness: Likeness
    difference: float
    told: str
    has_plan: bool


class PlannerParity(NamedTuple):
    """A planner's port and its original with some parameters, the others at their defaults."""

    plugin: str
    values: Mapping[str, Any]
    results: tuple[PlanResult, ...]


def compare_planners(
    build: Build,
    *,
    maps: int,
    tell: Callable[[str], None] = lambda line: None,
) -> list[PlannerParity]:
    """Returns the differences between a build's planners and our ports, one entry a variant."""
    robot = load_robot(DEFAULT_ROBOT)
    parities = []
    for plugin in build.planners:
        for values in VARIANTS.get(plugin, ()):
            tell(f"{plugin} {dict(values) or ''}: {maps} maps")
            parities.append(_compare(build, plugin, values, robot, maps))
    return parities


def random_requests(robot: Robot, count: int, *, seed: int = 0) -> Iterator[PlanRequest]:
    """Yields maps with walls and an unknown patch, inflated for a robot.

    Start and goal are anywhere on free cells, not at their centres; most are connected.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        costmap = _costmap(random, robot)
        free = np.argwhere(costmap.costs < INSCRIBED)
        yield PlanRequest(costmap, *(_pose(random, costmap, free) for _ in range(2)))


def compare_plans(port: Array | str, original: Array | str) -> PlanResult:
    """Returns the comparison of two plans; each is (N, 3), or the name of the error without one."""
    if isinstance(port, str) or isinstance(original, str):
        both_failed = isinstance(port, str) and isinstance(original, str)
        same = both_failed and original in (port, WITHOUT_CODE)
        told = "" if same else f"port: {_plan_text(port)}; original: {_plan_text(original)}"
        return PlanResult(Likeness.EQUAL if same else Likeness.DIFFERENT, np.nan, told, False)
    told = f"port: {_plan_text(port)}; original: {_plan_text(original)}"
    if port.shape != original.shape:
        return PlanResult(Likeness.DIFFERENT, np.nan, told, True)
    offsets = port - original
    # A heading of half a turn is both pi and -pi.
    offsets[:, 2] = np.arctan2(np.sin(offsets[:, 2]), np.cos(offsets[:, 2]))
    offsets[port == original] = 0.0
    difference = float(np.abs(offsets).max())
    likeness = likeness_of(difference)
    return PlanResult(likeness, difference, told if likeness is Likeness.DIFFERENT else "", True)


def port_of(
    plugin: str, values: Mapping[str, Any], robot: Robot, release: str = NEWEST_RELEASE
) -> Planner:
    """Returns the port of a planner by a release's rules; our switches are set as Nav2 behaves."""
    model = PLANNERS.load(plugin).Parameters
    if RELEASE_FIELD in model.model_fields:
        values = {**values, RELEASE_FIELD: release}
    if plugin == SmacPlanner2D.nav2_plugin:
        # More expansions than any search on such maps takes, so that time is no limit.
        settings: Any = SmacPlanner2DParameters.nav2_classic(**values, expansions_per_second=1e9)
    else:
        settings = model(**values)
    footprint = None if robot.is_circle else np.ascontiguousarray(robot.padded_outline)
    inflation = robot.navigation.global_costmap.inflation_layer
    return make_planner(settings, footprint=footprint, inflation=inflation)


def request_message(
    plugin: str, values: Mapping[str, Any], robot: Robot, request: PlanRequest
) -> dict[str, Any]:
    """Returns the message that asks the host for a plan."""
    costmap = request.costmap
    about_robot = configure_message(controller_setup(robot), {})
    inflation = robot.navigation.global_costmap.inflation_layer
    return about_robot | {
        "call": "make_plan",
        "plugin": plugin,
        "parameters": dict(values),
        "inflation_radius_m": inflation.inflation_radius,
        "inflation_cost_scaling_factor": inflation.cost_scaling_factor,
        "tracks_unknown_space": True,
        "costmap": {
            "shape": costmap.costs.shape,
            "data": costmap.costs.tobytes(),
            "origin": [costmap.origin_x, costmap.origin_y],
            "resolution": costmap.resolution,
        },
        "start": request.start.tolist(),
        "goal": request.goal.tolist(),
    }


def _compare(
    build: Build, plugin: str, values: Mapping[str, Any], robot: Robot, maps: int
) -> PlannerParity:
    port = port_of(plugin, values, robot, build.release)
    process = ClientProcess([str(build.host)])
    results = []
    try:
        for request in random_requests(robot, maps):
            message = request_message(plugin, values, robot, request)
            answer = process.ask(message, deadline_s=PATIENCE_S)
            if "error" in answer:
                raise InputError(f"{plugin}@{build.name}: {answer['error']}")
            original = np.array(answer["plan"]) if "plan" in answer else str(answer["failure"])
            results.append(compare_plans(_planned(port, request), original))
    finally:
        process.stop()
    return PlannerParity(plugin, values, tuple(results))


def _planned(port: Planner, request: PlanRequest) -> Array | str:
    try:
        return port.plan(request.costmap, request.start, request.goal)
    except PlanningError as error:
        return type(error).__name__


def _costmap(random: np.random.Generator, robot: Robot) -> Costmap:
    rows, columns = random.integers(*SIDE_CELLS, 2)
    costs = np.zeros((rows, columns), np.uint8)
    for _ in range(random.integers(0, MAX_OBSTACLES + 1)):
        row, column = random.integers(0, rows), random.integers(0, columns)
        # The obstacles: walls, and blocks.
        height, width = random.choice([2, 12]), random.choice([2, 12, 40])
        costs[row : row + height, column : column + width] = LETHAL
    inflation = robot.navigation.global_costmap.inflation_layer
    costs = inflate(
        costs,
        resolution=RESOLUTION_M,
        inscribed_radius=robot.radii[0],
        inflation_radius=inflation.inflation_radius,
        cost_scaling_factor=inflation.cost_scaling_factor,
    )
    row, column = random.integers(0, rows), random.integers(0, columns)
    patch = costs[row : row + 15, column : column + 15]
    patch[patch == 0] = NO_INFORMATION
    origin = random.uniform(-3.0, 3.0, 2)
    return Costmap(costs, float(origin[0]), float(origin[1]), RESOLUTION_M, tracks_unknown=True)


def _pose(random: np.random.Generator, costmap: Costmap, free: NDArray[np.int64]) -> Array:
    rows, columns = costmap.costs.shape
    row, column = free[random.integers(len(free))] if len(free) else (rows // 2, columns // 2)
    x, y = np.array([column, row]) + random.uniform(0.05, 0.95, 2)
    return np.array(
        [
            costmap.origin_x + x * costmap.resolution,
            costmap.origin_y + y * costmap.resolution,
            random.uniform(-np.pi, np.pi),
        ]
    )


def _plan_text(plan: Array | str) -> str:
    if isinstance(plan, str):
        return plan
    length_m = float(np.hypot(*np.diff(plan[:, :2], axis=0).T).sum())
    return f"{len(plan)} poses, {length_m:.4f} m"
