"""The table of missions.md: `python studies/building_comparison.py FOLDER` drives and prints it.

Draws a building of 10,000 m2 of a seed, as one map and as four that meet at doors, writes both into
FOLDER with missions from one end of it to the other, plans and drives them, each kind in a process
of its own, and prints the tables in Markdown.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image

from drake_navbench import run_trial
from drake_navbench.inputs.robot import Robot, load_robot, overridden
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import Outcome
from drake_navbench.navigation.costmaps.layered_costmap import LayeredCostmap, LayersState
from drake_navbench.navigation.planner import PlanningError
from drake_navbench.trial.planning import global_layers, planner_of

Pixels = NDArray[np.uint8]

SIDE_M, CELL_M, ROOM_M = 100.0, 0.05, 10.0
ROOMS = round(SIDE_M / ROOM_M)
HALF_M = 0.5 * SIDE_M
# Each of the four maps reaches so far beyond the middle of the building.
OVERLAP_M = 2.0
WALL_M, DOOR_M = 0.2, 1.6
# Furniture stands this far from the walls, so that it blocks no door.
CLEAR_M = 2.2
EXTRA_DOORS = 0.15
FREE, OCCUPIED = 254, 0
SMAC = "nav2_smac_planner::SmacPlanner2D"
PLANNERS: dict[str, dict[str, Any]] = {
    "Smac 2D": {"plugin": SMAC},
    "Smac 2D, no limits": {"plugin": SMAC, "max_iterations": -1, "max_planning_time": 60.0},
    "NavFn": {"plugin": "nav2_navfn_planner::NavfnPlanner"},
    "Theta*": {"plugin": "nav2_theta_star_planner::ThetaStarPlanner"},
}
REPEATS = 3
QUARTERS = ("south west", "south east", "north west", "north east")
KINDS = ("one map", "four maps")
DRIVEN = (("Smac 2D", KINDS[0]), ("Smac 2D, no limits", KINDS[0]), ("Smac 2D", KINDS[1]))


class Building(NamedTuple):
    """pixels: (rows, columns) grey, row 0 in the south. doors: of two quarters, x m, y m, yaw."""

    pixels: Pixels
    doors: dict[tuple[str, str], list[float]]


def draw_building(seed: int) -> Building:
    """Returns rooms of 10 m with furniture, joined by doors; one door between two quarters."""
    random = np.random.default_rng(seed)
    count = round(SIDE_M / CELL_M)
    pixels = np.full((count, count), FREE, np.uint8)
    for edge in np.arange(ROOMS + 1) * ROOM_M:
        _block(pixels, edge, SIDE_M / 2, WALL_M, SIDE_M)
        _block(pixels, SIDE_M / 2, edge, SIDE_M, WALL_M)
    for row, column in np.ndindex(ROOMS, ROOMS):
        for _ in range(random.integers(1, 5)):
            low = np.array([column, row]) * ROOM_M + CLEAR_M
            x, y = random.uniform(low, low + ROOM_M - 2 * CLEAR_M)
            _block(pixels, x, y, *random.uniform(0.4, 1.2, 2))
    for first, second in _joined_rooms(random):
        _cut_door(pixels, *_door(first, second, random.uniform(-2.5, 2.5)))
    doors = {}
    near, far = 2, ROOMS - 3
    west, east = ROOMS // 2 - 1, ROOMS // 2
    for names, first, second in (
        (("south west", "south east"), (near, west), (near, east)),
        (("north west", "north east"), (far, west), (far, east)),
        (("south west", "north west"), (west, near), (east, near)),
        (("south east", "north east"), (west, far), (east, far)),
    ):
        x, y, goes_east = _door(first, second, random.uniform(-2.5, 2.5))
        _cut_door(pixels, x, y, goes_east)
        doors[names] = [x, y, 0.0 if goes_east else np.pi / 2]
    return Building(pixels, doors)


def _joined_rooms(random: np.random.Generator) -> list[tuple[Any, Any]]:
    """Returns pairs of rooms with a door: within each quarter a tree over all, and some more."""
    quarter_of = {
        room: (room[0] >= ROOMS // 2, room[1] >= ROOMS // 2) for room in np.ndindex(ROOMS, ROOMS)
    }
    pairs = [
        (room, other)
        for room in quarter_of
        for other in ((room[0] + 1, room[1]), (room[0], room[1] + 1))
        if quarter_of.get(other) == quarter_of[room]
    ]
    group = {room: index for index, room in enumerate(quarter_of)}
    joined = []
    for index in random.permutation(len(pairs)):
        first, second = pairs[index]
        if group[first] != group[second]:
            old, new = group[second], group[first]
            group = {room: new if own == old else own for room, own in group.items()}
            joined.append((first, second))
        elif random.random() < EXTRA_DOORS:
            joined.append((first, second))
    return joined


def _door(first: Any, second: Any, along_m: float) -> tuple[float, float, bool]:
    """Returns x m, y m of a door between two rooms (row, column), and whether it leads east."""
    goes_east = second[1] != first[1]
    y, x = ((np.array(first) + second) / 2 + 0.5) * ROOM_M
    x, y = (x, y + along_m) if goes_east else (x + along_m, y)
    return float(x), float(y), goes_east


def _cut_door(pixels: Pixels, x: float, y: float, goes_east: bool) -> None:
    size = (2 * WALL_M, DOOR_M) if goes_east else (DOOR_M, 2 * WALL_M)
    _block(pixels, x, y, *size, value=FREE)


def _block(
    pixels: Pixels, x: float, y: float, width: float, height: float, value: int = OCCUPIED
) -> None:
    low = np.round((np.array([y - height / 2, x - width / 2])) / CELL_M).astype(int).clip(0)
    high = np.round((np.array([y + height / 2, x + width / 2])) / CELL_M).astype(int)
    pixels[low[0] : high[0], low[1] : high[1]] = value


def write_map(folder: Path, name: str, pixels: Pixels, origin: tuple[float, float]) -> str:
    """Writes a map and returns the name of its file."""
    Image.fromarray(pixels[::-1]).save(folder / f"{name}.png")
    described = {"image": f"{name}.png", "resolution": CELL_M, "origin": [*origin, 0.0]}
    described |= {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(described))
    return f"{name}.yaml"


def write_building(folder: Path, building: Building) -> dict[str, str]:
    """Writes the building as one map and as four; returns the maps by the name of the quarter."""
    write_map(folder, "whole", building.pixels, (0.0, 0.0))
    maps = {}
    for name in QUARTERS:
        north, east = name.split()
        low_y, high_y = _limits(north == "north")
        low_x, high_x = _limits(east == "east")
        rows, columns = (
            slice(round(low / CELL_M), round(high / CELL_M))
            for low, high in ((low_y, high_y), (low_x, high_x))
        )
        part = building.pixels[rows, columns]
        maps[name] = write_map(folder, name.replace(" ", "_"), part, (low_x, low_y))
    return maps


def _limits(is_far: bool) -> tuple[float, float]:
    return (HALF_M - OVERLAP_M, SIDE_M) if is_far else (0.0, HALF_M + OVERLAP_M)


def write_missions(folder: Path, building: Building, seed: int, count: int) -> None:
    """Writes tasks from a room in the south west to one in the north east, for both kinds."""
    random = np.random.default_rng([seed, 1])
    maps = write_building(folder, building)
    for number in range(count):
        # Beside the furniture: it stands CLEAR_M off the walls.
        rooms = random.integers(0, ROOMS // 2, (2, 2))
        rooms[1] = ROOMS - 1 - rooms[1]
        start, goal = ([*(float(v) for v in room * ROOM_M + 1.3), 0.0] for room in rooms)
        common = {
            "start": start,
            "navigation_mode": "navigate_to_pose",
            "timeout_s": 1500.0,
        }
        task = {"description": "In one map", "world": {"map": "whole.yaml"}, "goal": goal}
        _write(folder / f"one_map_{number}.yaml", common | task)
        route = _route(building, start, goal)
        quarters = [QUARTERS[0], *(after for _, after in route)]
        task = {
            "description": "In four maps",
            "floors": [
                {"name": name, "origin": [0.0, 0.0], "world": {"map": maps[name]}}
                for name in QUARTERS
            ],
            "lifts": [
                {"name": " - ".join(ends), "stops": dict.fromkeys(ends, pose)}
                for ends, pose in building.doors.items()
            ],
            "mission": [
                *({"lift": " - ".join(ends), "to": ends[1]} for ends in route),
                {"floor": quarters[-1], "goal": goal},
            ],
        }
        _write(folder / f"four_maps_{number}.yaml", common | task)


def _write(path: Path, data: dict[str, Any]) -> None:
    class NoAliases(yaml.SafeDumper):
        def ignore_aliases(self, data: Any) -> bool:
            return True

    path.write_text(yaml.dump(data, Dumper=NoAliases, sort_keys=False))


def _route(building: Building, start: list[float], goal: list[float]) -> list[tuple[str, str]]:
    """Returns the doors of the shorter way round, by straight lines."""
    ways = [
        [(QUARTERS[0], QUARTERS[1]), (QUARTERS[1], QUARTERS[3])],
        [(QUARTERS[0], QUARTERS[2]), (QUARTERS[2], QUARTERS[3])],
    ]

    def length(way: list[tuple[str, str]]) -> float:
        points = [start, *(building.doors[ends] for ends in way), goal]
        return path_length(np.array(points)[:, :2])

    return min(ways, key=length)


def robot_with(planner: str) -> Robot:
    """Returns the wheelchair with one of the planners."""
    return overridden(
        load_robot("wheelchair"), {"navigation": {"planner": PLANNERS[planner]}}, "planner"
    )


def legs_of(scenario: Scenario) -> list[tuple[Scenario, Any, Any]]:
    """Returns for each leg the map that it is planned on, and where it begins and ends."""
    if not scenario.floors:
        return [(scenario, scenario.start, scenario.goal)]
    places = {floor.name: floor.scenario for floor in scenario.placed_floors}
    here, names = scenario.floors[0].name, []
    for step in scenario.mission:
        names.append(here)
        here = step.to or here
    ends = [scenario.start, *scenario.goals]
    return [(places[name], *pair) for name, pair in zip(names, pairwise(ends), strict=True)]


def plan_all(folder: Path, kind: str, count: int, planner: str) -> dict[str, float]:
    """Returns the time and memory of planning the missions of a kind, in a process of its own.

    Times are the processor's, the least of some repetitions.
    """
    robot, before_mb = robot_with(planner), _peak_mb()
    plan_ms, update_ms, lengths_m, costmap_mb = [], [], [], 0.0
    for number in range(count):
        scenario = load_scenario(str(folder / f"{kind.replace(' ', '_')}_{number}.yaml"))
        length_m = 0.0
        for place, start, goal in legs_of(scenario):
            layers = global_layers(place, robot)
            new_map = partial(_new_map, layers, np.array(start))
            costmap = new_map().costmap
            assert costmap is not None
            plan = partial(planner_of(robot).plan, costmap, np.array(start))
            update_ms.append(_least_ms(new_map))
            costmap_mb = max(costmap_mb, _bytes_of(new_map()) / 1e6)
            try:
                length_m += path_length(plan(np.array(goal))[:, :2])
            except PlanningError:
                length_m = np.nan
                continue
            plan_ms.append(_least_ms(partial(plan, np.array(goal))))
        lengths_m.append(length_m)
    return {
        "missions with a plan": int(np.isfinite(lengths_m).sum()),
        "plan, mean [ms]": float(np.mean(plan_ms)),
        "longest [ms]": float(np.max(plan_ms)),
        "costmap of a new map [ms]": float(np.mean(update_ms)),
        "costmap [MB]": costmap_mb,
        "memory of the process [MB]": _peak_mb() - before_mb,
        "way, mean [m]": float(np.nanmean(lengths_m)),
    }


def _new_map(layers: LayeredCostmap, start: NDArray[np.float64]) -> LayersState:
    """Returns the global costmap with its layers, as a robot has it that comes to a map."""
    return layers.updated(layers.initial_state(), scan=None, pose=start, time_s=0.0)


def _least_ms(function: Callable[[], object]) -> float:
    times_s = []
    for _ in range(REPEATS):
        begin_s = time.process_time()
        function()
        times_s.append(time.process_time() - begin_s)
    return 1e3 * min(times_s)


def _bytes_of(state: Any) -> int:
    """Returns the bytes of all arrays in a costmap's layers."""
    if isinstance(state, np.ndarray):
        return int(state.nbytes)
    if is_dataclass(state):
        return sum(_bytes_of(getattr(state, field.name)) for field in fields(state))
    return 0


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def drive_all(
    folder: Path, kind: str, count: int, planner: str, controller: str
) -> dict[str, float]:
    """Returns the outcomes of the missions of a kind, driven in a process of its own."""
    succeeded, driven_s, way_m, recoveries = 0, [], [], 0
    begin_s = time.process_time()
    for number in range(count):
        path = folder / f"{kind.replace(' ', '_')}_{number}.yaml"
        log = run_trial(str(path), controller, robot=robot_with(planner))
        recoveries += sum(leg["recovery_count"] for leg in log.info["legs"])
        if log.outcome is Outcome.SUCCEEDED:
            succeeded += 1
            driven_s.append(log.end_time_s)
            way_m.append(path_length(log.samples[["x_m", "y_m"]].to_numpy()))
    return {
        "driven": count,
        "succeeded": succeeded,
        "recoveries": recoveries,
        "time, mean [s]": float(np.mean(driven_s)) if driven_s else np.nan,
        "way, mean [m]": float(np.mean(way_m)) if way_m else np.nan,
        "computing a mission [s]": (time.process_time() - begin_s) / count,
        "memory of the process [MB]": _peak_mb(),
    }


def apart(function: Any, *arguments: Any) -> dict[str, float]:
    """Calls a function in a fresh process, whose memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        result: dict[str, float] = pool.submit(function, *arguments).result()
        return result


def table(rows: dict[tuple[str, str], dict[str, float]]) -> str:
    """Returns a table in Markdown, a row for each planner and kind."""
    lines = [["planner", "", *next(iter(rows.values()))]]
    lines.append(["---"] * len(lines[0]))
    lines += [[*of, *(f"{value:.4g}" for value in row.values())] for of, row in rows.items()]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Writes the building, plans and drives, prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--missions", type=int, default=10, help="to plan")
    parser.add_argument("--driven", type=int, default=3, help="of these")
    parser.add_argument("--controller", default="rpp")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    building = draw_building(options.seed)
    write_missions(options.folder, building, options.seed, options.missions)
    planned, driven = {}, {}
    for planner in PLANNERS:
        for kind in KINDS:
            # First one alone, which compiles kernels into the cache.
            for count in (1, options.missions):
                found = apart(plan_all, options.folder, kind, count, planner)
            planned[planner, kind] = found
    print(table(planned), flush=True)
    for planner, kind in DRIVEN if options.driven else ():
        driven[planner, kind] = apart(
            drive_all, options.folder, kind, options.driven, planner, options.controller
        )
    if driven:
        print("", table(driven), sep="\n")


if __name__ == "__main__":
    main()
