"""Draws tasks on a map: a start and a goal where the robot fits, and a way between them.

A cell is passable where the robot's centre is farther from occupied or unknown cells than its
inscribed radius, as costmaps inflate; starts and goals keep the circumscribed radius of outline and
body, so that any heading is free. Both of a pair lie in one connected region of passable cells.
Cells that the map's saver left unknown are unknown here, whatever the map's thresholds make of
them, where it has others that are free.
"""

from __future__ import annotations

import math
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.gazebo_world import GazeboWorld, occupancy_of, scenario_in_world
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, Suite, scenario_on_map
from drake_navbench.inputs.task_time import with_time
from drake_navbench.inputs.world_on_map import free_on_both
from drake_navbench.navigation.costmaps.map_file import (
    NEARLY_FREE,
    SAVED_FREE_THRESH,
    OccupancyMap,
    load_map,
)
from drake_navbench.navigation.costmaps.map_image import UNKNOWN
from drake_navbench.typed_files.quantities import Pose

# The least distance from start to goal: a goal next to the start needs no navigation.
MIN_DISTANCE_M = 2.0
# The limit is high because most draws fail on a map with hardly any two places so far apart.
MAX_DRAWS_PER_TASK = 1000
EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=int)
# From this share of unknown cells on the error on a map without room tells it.
MOSTLY = 0.5
# Files with thresholds: a world has none.
MAP_SUFFIXES = (".yaml", ".yml")
# Positions are rounded to mm.
DECIMALS = 3


class _Places(NamedTuple):
    """The places where a robot may be.

    regions: (rows, columns), 0 where its centre cannot be, else the number of a connected region.
    roomy: (N,) flat indices of the cells where it may stand in any heading.
    """

    grid: OccupancyMap
    regions: NDArray[np.int32]
    roomy: NDArray[np.int64]

    def centre(self, cell: int) -> tuple[float, float]:
        """Returns the centre of a cell by its flat index, m."""
        row, column = divmod(int(cell), self.regions.shape[1])
        grid = self.grid
        x = grid.origin_x + (column + 0.5) * grid.resolution
        return x, grid.origin_y + (row + 0.5) * grid.resolution


def sample_tasks(
    map_file: Path,
    robot: Robot,
    count: int,
    *,
    seed: int,
    start: Pose | None = None,
    beside: Sequence[Robot] = (),
) -> list[Scenario]:
    """Returns tasks on a map, the same for the same map, outlines, count and seed.

    start: start of all tasks; drawn for each where not given. beside: robots that drive the same
    tasks, with outlines of their own. Raises InputError where the map has no room for so many.
    """
    grid, suite = load_map(map_file), Suite(name=map_file.stem)
    known = _known_floor(map_file)
    pairs = _drawn_pairs(known, [robot, *beside], count, map_file, seed=seed, start=start)
    tasks = (
        scenario_on_map(map_file, *pair, name=name, suite=suite, grid=grid)
        for name, pair in zip(_numbered(map_file.stem, count), pairs, strict=True)
    )
    return [with_time(task, [robot, *beside]) for task in tasks]


def sample_world_tasks(
    world: GazeboWorld,
    robot: Robot,
    count: int,
    *,
    seed: int,
    start: Pose | None = None,
    beside: Sequence[Robot] = (),
    map_file: Path | None = None,
) -> list[Scenario]:
    """Returns tasks in a world of Gazebo, the same for the same world, outline, count and seed.

    Where walls enclose an area, the tasks are within it. start, beside: as for `sample_tasks`.
    map_file: the robot's map of the world, on which starts and goals are free as well. Raises
    InputError where the world has no room for so many.
    """
    stem = world.path.name.partition(".")[0]
    suite = Suite(name=stem)
    floor = occupancy_of(world)
    if map_file is not None:
        floor = free_on_both(floor, _known_floor(map_file))
    pairs = _drawn_pairs(floor, [robot, *beside], count, world.path, seed=seed, start=start)
    tasks = (
        scenario_in_world(world, *pair, name=name, suite=suite, map_file=map_file)
        for name, pair in zip(_numbered(stem, count), pairs, strict=True)
    )
    return [with_time(task, [robot, *beside]) for task in tasks]


def _known_floor(map_file: Path) -> OccupancyMap:
    """Returns a map as its saver knew it; its warnings are those of the map itself.

    A map without a white cell is drawn, not saved: there the grey that its thresholds free is the
    floor.
    """
    with warnings.catch_warnings(action="ignore", category=InputWarning):
        saved = load_map(map_file, as_saved=True)
        return saved if _is_free(saved).any() else load_map(map_file)


def _numbered(stem: str, count: int) -> list[str]:
    digits = len(str(count))
    return [f"{stem}_{number:0{digits}}" for number in range(1, count + 1)]


def _drawn_pairs(
    grid: OccupancyMap,
    robots: Sequence[Robot],
    count: int,
    file: Path,
    *,
    seed: int,
    start: Pose | None,
) -> list[tuple[Pose, Pose]]:
    """Returns starts and goals on a grid.

    file: the map or world, which seeds the draws and is named in errors.
    """
    places = _places(grid, robots)
    entropy = [seed, zlib.crc32(file.name.encode())]
    generator = np.random.default_rng(np.random.SeedSequence(entropy))
    pairs = []
    for _ in range(count):
        pair = _drawn_pair(places, generator, start)
        if pair is None:
            raise InputError(
                f"--goals {count}: {file}: no two places with "
                f"{2.0 * max(map(_reach, robots)):.2g} m of free floor for the robot "
                f"that are {MIN_DISTANCE_M:g} m apart and connected"
                f"{'' if start is None else f', one of them --start {list(start)}'}; "
                f"{_remedy(grid, file, start)}"
            )
        pairs.append(pair)
    return pairs


def _remedy(grid: OccupancyMap, file: Path, start: Pose | None) -> str:
    """Returns the end of the error on a map without room: a way to have tasks nevertheless."""
    other = "" if start is None else "another --start, "
    ways = f"expected {other}a map with room for it, or --goals FILE with places of yours"
    unknown = float((grid.occupancy == UNKNOWN).mean())
    if unknown < MOSTLY or file.suffix not in MAP_SUFFIXES:
        return ways
    return (
        f"{unknown:.0%} of the map is unknown: {ways}, or other thresholds, by which more of its "
        f"grey is free (mode trinary, free_thresh {SAVED_FREE_THRESH:g})"
    )


def _places(grid: OccupancyMap, robots: Sequence[Robot]) -> _Places:
    inscribed, circumscribed = max(r.radii[0] for r in robots), max(map(_reach, robots))
    # The floor beyond the map is not known: its border counts as blocked.
    blocked = np.pad(~_is_free(grid), 1, constant_values=True)
    clearance = ndimage.distance_transform_edt(~blocked)[1:-1, 1:-1] * grid.resolution
    regions, _ = ndimage.label(clearance > inscribed, structure=EIGHT_NEIGHBOURS)
    return _Places(grid, regions, np.flatnonzero(clearance > circumscribed + grid.resolution))


def _is_free(grid: OccupancyMap) -> NDArray[np.bool_]:
    """Returns the cells that are as good as free: mode scale gives white 1 with a free_thresh of 0.

    Source: nav2_costmap_2d (StaticLayer), to which all that is not lethal or unknown is free.
    """
    return (grid.occupancy >= 0) & (grid.occupancy <= 100.0 * NEARLY_FREE)


def _reach(robot: Robot) -> float:
    """Returns the largest distance of outline and body from the base frame's origin, m."""
    return max(robot.radii[1], float(np.linalg.norm(robot.outline, axis=1).max()))


def _drawn_pair(
    places: _Places, generator: np.random.Generator, start: Pose | None
) -> tuple[Pose, Pose] | None:
    """Returns a start and a goal, None where no draw succeeded."""
    if not len(places.roomy):
        return None
    regions = places.regions.ravel()
    given = None if start is None else _region_of(places, start)
    for _ in range(MAX_DRAWS_PER_TASK):
        first, second = generator.choice(places.roomy, 2)
        yaws = generator.uniform(-math.pi, math.pi, 2)
        begin = start or _pose(places.centre(first), yaws[0])
        goal = _pose(places.centre(second), yaws[1])
        region = regions[first] if given is None else given
        if regions[second] == region and math.dist(begin[:2], goal[:2]) >= MIN_DISTANCE_M:
            return begin, goal
    return None


def _region_of(places: _Places, start: Pose) -> int:
    """Returns the region that holds a position; -1 for a position off the map or blocked."""
    grid = places.grid
    column = math.floor((start[0] - grid.origin_x) / grid.resolution)
    row = math.floor((start[1] - grid.origin_y) / grid.resolution)
    rows, columns = places.regions.shape
    if not (0 <= row < rows and 0 <= column < columns):
        return -1
    return int(places.regions[row, column]) or -1


def _pose(position: tuple[float, float], yaw: float) -> Pose:
    x, y = position
    return round(x, DECIMALS), round(y, DECIMALS), round(float(yaw), DECIMALS)
