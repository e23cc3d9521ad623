"""The part of the plan that a cycle follows: how far, and where it is blocked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import NO_PLAN
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.distance_field import DistanceField, path_clearance
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# A plan is trapped if it makes less than this share of the wanted progress.
TRAPPED_RATIO = 0.2
# Room is looked for in this many poses of a plan behind the obstacle.
MOST_POSES_BEHIND = 100
# A way's direction is that to its point LOOK_BACK_M ahead, m; the turn to this direction is checked
# at TURN_POSES poses.
LOOK_BACK_M, TURN_POSES = 0.5, 13
# A way that needs a larger turn than the first leads back, rad; a robot that backs up already goes
# on until its turn is less than the second: with one limit it would turn to and fro between both.
LEADS_BACK_RAD, STILL_BACK_RAD = 0.5 * np.pi, 0.25 * np.pi
# A plan that ends within this of the goal ends in it, m. A path ends in the goal's heading if its
# last LOOK_BACK_M do within this, rad.
SAME_PLACE_M, SAME_HEADING_RAD = 1e-6, 0.1


class Way(NamedTuple):
    """The part of the path that a cycle follows.

    path: (P, 3). target: (3,) the point aimed at. nears_goal: the target is the goal. length_m:
    along the path to it. blocked_m: along the path to its first pose at which the robot has no
    room, inf where there is none. behind: (2,) m, the path's first point behind that, its last one
    where the robot has no room up to there, or None. stop_m: along the path to where plans come to
    rest, inf where they need not. backs_up: it is driven backwards. is_detour: it begins with one.
    has_room: the robot has room at the target. hurries: a smooth start counts less.
    """

    path: Array
    target: Array
    nears_goal: bool
    length_m: float
    blocked_m: float
    behind: Array | None = None
    stop_m: float = np.inf
    backs_up: bool = False
    is_detour: bool = False
    has_room: bool = True
    hurries: bool = False


def way_along(
    plan: Array,
    goal: Array,
    reach_m: float,
    field: DistanceField,
    discs: Array,
    global_plan: Array = NO_PLAN,
) -> Way:
    """Returns the way along a local plan (M, 3), as far as a horizon's reach.

    field, discs (D, 2): of the obstacles and the robot, to find the poses without room.
    global_plan: (N, 3), continues the local plan behind its end.
    """
    path = read_only(plan)
    driven = along_itself(path)
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
    stations = np.concatenate([[0.0], np.cumsum(steps)])
    index = int(np.searchsorted(stations, reach_m, side="left"))
    is_end = index >= len(path)
    target = path[-1 if is_end else index]
    nears_goal = is_end and bool(np.hypot(*(target[:2] - goal[:2])) < SAME_PLACE_M)
    has_room = path_clearance(field, discs, driven) >= 0.0
    blocked = np.flatnonzero(~has_room)
    behind = None
    if len(blocked):
        rest = np.flatnonzero(has_room[blocked[0] :])
        if len(rest):
            behind = path[blocked[0] + rest[0], :2]
        else:
            behind = _first_room(global_plan, path[-1], field, discs)
    return Way(
        path,
        np.array(goal if nears_goal else target),
        nears_goal,
        float(stations[min(index, len(path) - 1)]),
        float(stations[blocked[0]]) if len(blocked) else np.inf,
        behind,
        float(stations[-1]) if nears_goal else np.inf,
        has_room=bool(has_room[min(index, len(path) - 1)]),
    )


def along_itself(path: Array) -> Array:
    """Returns the poses of a path (P, 3) as they are driven: each turned to the next.

    Planners of points, as NavFn, leave all headings but the last at 0.
    """
    steps = np.diff(path[:, :2], axis=0)
    driven = path.copy()
    moves = np.flatnonzero((steps != 0.0).any(axis=1))
    if len(moves):
        # A pose on the one behind it goes where that one goes; the last one where it came from.
        towards = moves[np.minimum(np.searchsorted(moves, np.arange(len(path))), len(moves) - 1)]
        driven[:, 2] = np.arctan2(steps[towards, 1], steps[towards, 0])
    return read_only(driven)


def _first_room(plan: Array, last: Array, field: DistanceField, discs: Array) -> Array:
    """Returns (2,) a plan's first point with room behind a pose (3,), else the pose's point."""
    if len(plan) == 0:
        return last[:2]
    nearest = int(np.argmin(np.hypot(*(plan[:, :2] - last[:2]).T)))
    ahead = read_only(plan[nearest : nearest + MOST_POSES_BEHIND])
    room = np.flatnonzero(path_clearance(field, discs, along_itself(ahead)) >= 0.0)
    return ahead[room[0], :2] if len(room) else last[:2]


def around(way: Way) -> Way:
    """Returns the way with its target behind the obstacle if the target lies inside it.

    A target inside an obstacle is as near from in front of it as from beside it, so it would not
    draw plans past the obstacle. A target behind the obstacle stays: a nearer one would only slow
    the robot, for example in front of a door.
    """
    if way.behind is None or way.nears_goal or way.blocked_m > way.length_m or way.has_room:
        return way
    # As writable as the targets of other ways, so that kernels are compiled once for all of them.
    return way._replace(target=np.array([*way.behind, way.target[2]]))


def up_to_blocked(way: Way, distance_m: float) -> Way:
    """Returns the way with a target `distance_m` before the obstacle on it, if that is in reach.

    So the robot is slow already when it gives up.
    """
    stop_m = max(way.blocked_m - distance_m, 0.0)
    if stop_m >= way.length_m:
        return way
    steps = np.hypot(*np.diff(way.path[:, :2], axis=0).T)
    index = int(np.searchsorted(np.cumsum(steps), stop_m))
    return way._replace(target=np.array(way.path[index]), nears_goal=False, stop_m=stop_m)


def driving_on(way: Way, distance_m: float) -> Way:
    """Returns the way with a target `distance_m` behind the goal if it ends in the goal's heading.

    So the robot is quick when it arrives. Where it must turn to this heading, that would need room.
    """
    if not way.nears_goal or len(way.path) < 2:
        return way
    behind = way.target[:2] - way.path[:, :2]
    far = np.flatnonzero(np.hypot(*behind.T) >= LOOK_BACK_M)
    x, y = behind[far[-1] if len(far) else 0]
    yaw = way.target[2]
    if abs(wrap(float(np.arctan2(y, x) - yaw))) > SAME_HEADING_RAD:
        return way
    target = way.target + distance_m * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    return way._replace(target=target, stop_m=way.stop_m + distance_m)


def turn_towards(way: Way, start: Array) -> float:
    """Returns the turn, rad, from the heading of a start (9,) of plans to where the way leads."""
    stations = np.cumsum(np.hypot(*np.diff(way.path[:, :2], axis=0).T))
    ahead = way.path[min(int(np.searchsorted(stations, LOOK_BACK_M)) + 1, len(way.path) - 1)]
    heading = np.arctan2(ahead[1] - start[1], ahead[0] - start[0])
    return wrap(float(heading - start[2]))


def must_back_up(
    way: Way,
    start: Array,
    field: DistanceField,
    discs: Array,
    clearance: float,
    backs_up: bool = False,
) -> bool:
    """Returns whether the way leads back and the robot has no room here to turn towards it.

    start: (9,) of plans. discs: (D, 2) m, which must keep `clearance` m. backs_up: it does already.
    """
    turn = turn_towards(way, start)
    if abs(turn) < (STILL_BACK_RAD if backs_up else LEADS_BACK_RAD):
        return False
    yaws = start[2] + np.linspace(0.0, turn, TURN_POSES)
    poses = np.column_stack([np.full((TURN_POSES, 2), start[:2]), yaws])
    return bool(path_clearance(field, discs, poses).min() < clearance)


def turn_at(start: Array, goal: Array) -> Way:
    """Returns the way of a robot that has reached the goal's position: a turn to its heading, here.

    start: (9,) first stage of plans. goal: (3,).
    """
    pose = np.array([start[0], start[1], goal[2]])
    return Way(read_only(pose[None]), pose, True, 0.0, np.inf, stop_m=0.0)


def straight(start: Array, distance_m: float) -> Way:
    """Returns the way straight on from the start (9,) of plans, backwards for less than 0 m."""
    pose = np.array(start[:3])
    end = pose + distance_m * np.array([np.cos(pose[2]), np.sin(pose[2]), 0.0])
    return Way(read_only(pose[None]), end, False, 0.0, np.inf, backs_up=distance_m < 0.0)


def progress_on(way: Way, position: Array) -> float:
    """Returns the arc length along the path to its point nearest to a position (2,), m."""
    nearest = int(np.argmin(np.hypot(*(way.path[:, :2] - position).T)))
    return path_length(way.path[: nearest + 1]) if nearest else 0.0


def is_trapped(way: Way, plan: Array, start: Array, tolerance_m: float) -> bool:
    """Returns whether a plan gets nowhere: its end is hardly farther along the path than its start.

    Its progress is compared with the wanted distance, as in the test of DRPA-MPPI (arXiv
    2503.20134). Near a goal that is farther than the tolerance, the distance to the goal counts.
    """
    if way.nears_goal:
        left = float(np.hypot(*(way.target[:2] - start[:2])))
        progress = left - float(np.hypot(*(way.target[:2] - plan[-1, :2])))
        return left > tolerance_m and progress < TRAPPED_RATIO * left
    progress = progress_on(way, plan[-1, :2]) - progress_on(way, start[:2])
    return progress < TRAPPED_RATIO * way.length_m
