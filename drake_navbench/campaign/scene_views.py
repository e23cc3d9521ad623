"""The scene that `show` draws of a scenario: world, task, plan, costmap, ways of moving bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_navbench.analysis.figures.course import Course
from drake_navbench.analysis.figures.views import SceneView, Task
from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.inputs.floor_scenario import FloorScenario
from drake_navbench.inputs.moving_obstacles import circle
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.inputs.world import World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.poses import place_outline
from drake_navbench.trial.planning import global_costmap, make_plan

# The number of times at which the way of a moving body is drawn.
LOOKS = 200
UNKNOWN_TO_PLANNER = "obstacle that is on no map"
MASKS = {
    "keepout": "keepout area",
    "speed_percent": "area of limited speed",
    "speed_absolute": "area of limited speed",
    "binary": "area of a binary state",
}
BELOW, ABOVE, GLASS = "below the lidar's plane", "above the lidar's plane", "glass"


def scene_view(scenarios: Sequence[Scenario], robot: Robot) -> tuple[SceneView, list[str]]:
    """Returns the scene of scenarios that share one world, and a line for each missing plan.

    Raises InputError where a robot cannot stand at a start, or get to a goal, as `run` does.
    """
    first = scenarios[0]
    told: list[str] = []
    tasks: list[Task] = []
    costs, known = [], []
    masks: dict[str, list[Grid]] = {}
    for scenario in scenarios:
        check_task(scenario, robot)
        tasks += _tasks(scenario, robot, told)
    for place in first.places:
        costmap = global_costmap(place, robot)
        costs.append(costmap.grid)
        known += _known(place)
        for mask in place.filter_masks:
            grid = Grid(np.asarray(mask.grid.occupancy), *mask.grid.frame)
            masks.setdefault(MASKS.get(mask.type, mask.type), []).append(grid)
    seen, others = _obstacles(first.true_world, robot)
    ways, movers = _movers(first.true_world)
    plans = [task.plan[:, :2] for task in tasks if task.plan is not None]
    goals = [np.array(goal[:2]) for goal in first.goals]
    course = Course(
        seen,
        plans,
        False,
        np.array(goals[:-1]).reshape(-1, 2) if len(scenarios) == 1 else np.empty((0, 2)),
        goals[-1],
        ways,
        movers,
        [(f.name, np.array([f.bounds[0], f.bounds[3]])) for f in first.placed_floors],
    )
    name = first.suite.name if len(scenarios) > 1 and first.suite else first.name
    count = f", {len(scenarios)} tasks" if len(scenarios) > 1 else ""
    view = SceneView(f"{name}{count}", course, others, costs, known, masks, tasks, robot.outline)
    return view, told


def scenes_of(scenarios: Sequence[Scenario]) -> list[list[Scenario]]:
    """Returns scenarios grouped by world: tasks on one map or in one world share a picture."""
    groups: dict[object, list[Scenario]] = {}
    for scenario in scenarios:
        suite = None if scenario.suite is None else scenario.suite.name
        is_shared = suite is not None and scenario.suite is not None
        world = scenario.world.model_dump_json() if is_shared else scenario.name
        groups.setdefault((suite, world, scenario.directory), []).append(scenario)
    return list(groups.values())


def _known(scenario: FloorScenario) -> list[Array]:
    """Returns min_x, min_y, max_x, max_y m of the map's known part; nothing without a map."""
    grid = scenario.map
    if grid is None:
        return []
    rows, columns = np.nonzero(np.asarray(grid.occupancy) >= 0)
    if not len(rows):
        return [np.array(grid.bounds)]
    x, y, edge = grid.frame
    low, high = (np.array([f(columns), f(rows)]) for f in (np.min, np.max))
    return [np.concatenate([[x, y] + edge * low, [x, y] + edge * (high + 1)])]


def _tasks(scenario: Scenario, robot: Robot, told: list[str]) -> list[Task]:
    """Returns the legs of a scenario with their plans; adds a line for each without."""
    legs = []
    start = np.array(scenario.start)
    if scenario.floors:
        start = np.array(scenario.placed_floors[0].scenario.start)
        for leg in scenario.legs:
            legs.append((leg.floor.scenario, start, np.array(leg.goal)))
            start = np.array(leg.goal if leg.arrival is None else leg.arrival)
    else:
        for goal in scenario.goals:
            legs.append((scenario, start, np.array(goal)))
            start = np.array(goal)
    return [
        Task(begin, goal, _plan(place, robot, begin, goal, told)) for place, begin, goal in legs
    ]


def _plan(
    scenario: FloorScenario, robot: Robot, start: Array, goal: Array, told: list[str]
) -> Array | None:
    try:
        return make_plan(scenario, robot, start, goal)
    except InputError:
        raise
    except NavbenchError as error:
        told.append(f"{scenario.name}: no plan: {error}")
        return None


def _obstacles(world: World, robot: Robot) -> tuple[list[Array], dict[str, list[Array]]]:
    """Returns the outlines of obstacles that maps show, and of others by their kind."""
    height_m = robot.lidar.height_m
    seen: list[Array] = []
    others: dict[str, list[Array]] = {}
    for one in world.obstacles:
        kind = ""
        if one.material != "solid":
            kind = GLASS
        elif one.height_m < height_m:
            kind = f"{BELOW} ({height_m:g} m)"
        elif one.bottom_m > height_m:
            kind = f"{ABOVE} ({height_m:g} m)"
        elif not one.known_to_planner:
            kind = UNKNOWN_TO_PLANNER
        (others.setdefault(kind, []) if kind else seen).append(one.outline)
    return seen, others


def _movers(world: World) -> tuple[list[Array], list[Array]]:
    """Returns the ways (N, 2) of all moving bodies, and their outlines (K, 2) at the start, m."""
    ways, movers = [], []
    for thing in world.moving.things:
        last_s = float(thing.knots[-1, 0])
        poses = np.array([thing.pose_at(time_s) for time_s in np.linspace(0.0, last_s, LOOKS)])
        ways.append(poses[:, :2])
        movers.append(place_outline(thing.outline, poses[0]))
    people = world.people
    if isinstance(people, RecordedPeople):
        walked: dict[int, list[Array]] = {}
        for person, _, ends in people.ways():
            walked.setdefault(person, [ends[0]]).append(ends[1])
        for steps in walked.values():
            ways.append(np.array(steps))
            movers.append(steps[0] + circle(float(np.max(people.radius_m))))
        return ways, movers
    for walker in people.persons:
        ways.append(np.array([walker.start, *(end for _, end in walker.ways)], dtype=float))
        movers.append(ways[-1][0] + circle(walker.radius_m))
    return ways, movers
