"""Makes tasks of the places in a user's file: from place to place, or along a graph's edges."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.gazebo_world import GazeboWorld, scenario_in_world
from drake_navbench.inputs.goal_file import GoalFile
from drake_navbench.inputs.goal_graph import Place
from drake_navbench.inputs.goal_poses import FoundPose
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, Suite, scenario_on_map
from drake_navbench.inputs.task_check import why_no_place
from drake_navbench.inputs.task_time import with_time
from drake_navbench.navigation.costmaps.map_file import load_map
from drake_navbench.typed_files.quantities import Pose

MAX_TASKS = 1000
# Places nearer than this, and within this turn, are one: m and rad.
SAME_M, SAME_RAD = 0.01, 0.02
# Nav2's default goal tolerance: on a shorter way the robot has arrived before it drives, m.
ARRIVED_M = 0.25
MOST_NAMED = 5
# The headings that are tried for a place without one, rad.
HEADINGS = tuple(math.radians(degrees) for degrees in range(0, 360, 15))


class _Leg(NamedTuple):
    """A way between two places, with their names."""

    begin: str
    end: str
    start: Pose
    goal: Pose

    @property
    def is_a_way(self) -> bool:
        """Whether the two are different poses."""
        turn = math.remainder(self.goal[2] - self.start[2], 2.0 * math.pi)
        return self.length_m >= SAME_M or abs(turn) >= SAME_RAD

    @property
    def length_m(self) -> float:
        """The straight distance."""
        return math.dist(self.start[:2], self.goal[:2])


class _Floor(NamedTuple):
    """The ground of all tasks, as that of one, and the robots that drive there."""

    scenario: Scenario
    robots: Sequence[Robot]

    def why_no_place(self, pose: FoundPose) -> str:
        """Returns the reason why a robot cannot start at a place or be sent there, or ''."""
        headings = HEADINGS if pose.yaw is None else (pose.yaw,)
        reasons = [self._why(pose.x, pose.y, heading) for heading in headings]
        return "" if "" in reasons else reasons[0]

    def leg(self, begin: Place, end: Place, arrived: float | None) -> _Leg:
        """Returns a way; a place without a heading is reached facing the way from the one before.

        arrived: the heading in which the robot came to `begin`, rad, which it keeps if it has room.
        """
        here, there = begin.pose, end.pose
        straight = math.atan2(there.y - here.y, there.x - here.x)
        if here.yaw is not None:
            departs = here.yaw
        else:
            wanted = [straight if arrived is None else arrived, straight, *HEADINGS]
            fitting = (one for one in wanted if not self._why(here.x, here.y, one))
            departs = next(fitting, straight)
        arrives = straight if there.yaw is None else there.yaw
        start, goal = (here.x, here.y, departs), (there.x, there.y, arrives)
        return _Leg(begin.name, end.name, start, goal)

    def _why(self, x: float, y: float, yaw: float) -> str:
        reasons = (why_no_place(self.scenario, robot, (x, y, yaw)) for robot in self.robots)
        return next(filter(None, reasons), "")


def given_tasks(
    goals: GoalFile, map_file: Path, robots: Sequence[Robot], *, start: Pose | None = None
) -> list[Scenario]:
    """Returns the tasks of a file of places on a map, in the file's order.

    robots: all that drive them. start: where the first leg begins; by default the file's own start,
    else its first place. Warns of places where a robot cannot stand, and leaves them out. Raises
    InputError where no leg is left.
    """
    grid, suite = load_map(map_file), Suite(name=map_file.stem)

    def made(begin: Pose, end: Pose, name: str) -> Scenario:
        return scenario_on_map(map_file, begin, end, name=name, suite=suite, grid=grid)

    return _tasks(goals, map_file, robots, start, made)


def given_world_tasks(
    goals: GoalFile,
    world: GazeboWorld,
    robots: Sequence[Robot],
    *,
    start: Pose | None = None,
    map_file: Path | None = None,
) -> list[Scenario]:
    """Returns the tasks of a file of places in a world of Gazebo, as `given_tasks` does.

    map_file: the robot's map of the world.
    """
    suite = Suite(name=world.path.name.partition(".")[0])

    def made(begin: Pose, end: Pose, name: str) -> Scenario:
        return scenario_in_world(world, begin, end, name=name, suite=suite, map_file=map_file)

    return _tasks(goals, world.path, robots, start, made)


def _tasks(
    goals: GoalFile,
    ground: Path,
    robots: Sequence[Robot],
    start: Pose | None,
    made: Callable[[Pose, Pose, str], Scenario],
) -> list[Scenario]:
    """Returns a task for each leg; ground: the map or world, whose name they have."""
    goals = goals.on_ground()
    for line in goals.told:
        warnings.warn(line, InputWarning, stacklevel=4)
    _require_few(goals)
    stem = ground.name.partition(".")[0]
    origin: Pose = (goals.places[0].pose.x, goals.places[0].pose.y, 0.0)
    floor = _Floor(made(origin, origin, stem), robots)
    every = [*(_edge_legs if goals.edges is not None else _list_legs)(goals, floor, start)]
    # A patrol comes along the same way again: driven twice, one task would count as two.
    first: dict[tuple[Pose, Pose], _Leg] = {}
    for leg in every:
        first.setdefault((leg.start, leg.goal), leg)
    legs = list(first.values())
    if len(legs) < len(every):
        warnings.warn(
            f"{goals.path}: {len(every) - len(legs)} of {len(every)} ways repeat an earlier one; "
            "each is driven once",
            InputWarning,
            stacklevel=4,
        )
    if not legs:
        raise InputError(
            f"{goals.path}: no way between two of its {len(goals.places)} places; expected two "
            "that differ, or one and --start X Y YAW"
        )
    _warn_of_path(goals.path, legs)
    digits = len(str(len(legs)))
    tasks = (
        made(leg.start, leg.goal, f"{stem}_{number:0{digits}}").model_copy(
            update={"description": f"{ground.name}: from {leg.begin} to {leg.end}"}
        )
        for number, leg in enumerate(legs, start=1)
    )
    return [with_time(task, robots) for task in tasks]


def _require_few(goals: GoalFile) -> None:
    for kind, found in (("places", goals.places), ("edges", goals.edges or ())):
        if len(found) > MAX_TASKS:
            raise InputError(
                f"{goals.path}: {len(found)} {kind}; expected at most {MAX_TASKS}, goals and not "
                "the points of a path"
            )


def _warn_of_path(path: Path, legs: Sequence[_Leg]) -> None:
    """Warns where most ways are so short that the robot arrives without a drive."""
    short = sum(leg.length_m < ARRIVED_M for leg in legs)
    if 2 * short > len(legs):
        warnings.warn(
            f"{path}: {short} of {len(legs)} ways are shorter than {ARRIVED_M:g} m, Nav2's goal "
            "tolerance: the robot arrives without a drive; expected goals, not a path",
            InputWarning,
            stacklevel=5,
        )


def _free_places(goals: GoalFile, floor: _Floor, places: Sequence[Place]) -> list[Place | None]:
    """Returns places, None for one where a robot cannot stand; warns of these.

    Raises InputError where none is left.
    """
    reasons = [floor.why_no_place(place.pose) for place in places]
    faults = [
        f"{place.name} ({place.pose.x:.3f}, {place.pose.y:.3f}) lies {reason}"
        for place, reason in zip(places, reasons, strict=True)
        if reason
    ]
    if faults:
        more = f"; and {len(faults) - MOST_NAMED} more" if len(faults) > MOST_NAMED else ""
        line = f"{goals.path}: left out: {'; '.join(faults[:MOST_NAMED])}{more}"
        if len(faults) == len(places):
            raise InputError(f"{line}; expected places on the map")
        warnings.warn(line, InputWarning, stacklevel=5)
    return [None if why else place for place, why in zip(places, reasons, strict=True)]


def _edge_legs(goals: GoalFile, floor: _Floor, start: Pose | None) -> Iterator[_Leg]:
    """Yields the edges of a graph between free places."""
    if start is not None:
        raise InputError(
            f"--start: each edge of {goals.path} has its own start; expected no --start"
        )
    free = _free_places(goals, floor, goals.places)
    for a, b in goals.edges or ():
        begin, end = free[a], free[b]
        if begin is not None and end is not None:
            leg = floor.leg(begin, end, None)
            if leg.is_a_way:
                yield leg


def _list_legs(goals: GoalFile, floor: _Floor, start: Pose | None) -> Iterator[_Leg]:
    """Yields the ways from each free place to the next that differs from it."""
    places = [*goals.places]
    if start is None and goals.start is not None:
        places.insert(0, Place("its start", goals.start))
    free = [place for place in _free_places(goals, floor, places) if place is not None]
    if start is not None:
        free.insert(0, Place("--start", FoundPose(*start)))
    here, heading = free[0], None
    for end in free[1:]:
        leg = floor.leg(here, end, heading)
        if leg.is_a_way:
            yield leg
            here, heading = end, leg.goal[2]
