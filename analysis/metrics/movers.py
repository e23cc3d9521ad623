"""The moving obstacles and people of a trial, read from its log."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from drake_navbench.inputs.moving_obstacles import (
    Bodies,
    MovingObstacle,
    MovingObstacles,
    circle,
    with_people,
)
from drake_navbench.inputs.people import NOBODY, People, WalkingPeople
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import FAR_AWAY_M, Tracks
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.people import LoggedPeople

# Much shorter than the time between two samples of people.
MOMENT_S = 1e-3


class Movers(NamedTuple):
    """The B moving bodies of a trial: first the moving obstacles, then the people.

    things: the obstacles that move on given ways. people: the walking people. names: (B,).
    outlines: the corners (K, 2) of each body in its own frame, m. bodies: the same shapes as edges
    and discs. tracks: the poses of each body over time; a body that is not in the world is at
    FAR_AWAY_M. top_speed_mps: an upper bound on the speed of every point of every body.
    """

    things: MovingObstacles
    people: WalkingPeople | RecordedPeople
    names: list[str]
    outlines: list[Array]
    bodies: Bodies
    tracks: Tracks
    top_speed_mps: float

    @property
    def body_count(self) -> int:
        """The number of moving obstacles and people."""
        return self.tracks.count

    @property
    def reaches_m(self) -> Array:
        """(B,) the largest distance of each outline from the origin of its frame, m."""
        return np.array([np.hypot(*outline.T).max() for outline in self.outlines])

    def poses_at(self, time_s: Array) -> Array:
        """Returns (T, B, 3) x m, y m, yaw rad at times (T,)."""
        poses = [self.tracks.poses_at(time) for time in time_s]
        return np.array(poses).reshape(len(time_s), self.body_count, 3)

    def rates_between(self, poses: Array, later: Array, duration_s: float) -> Array:
        """Returns the mean rates (T, B, 3) between poses (T, B, 3); 0 for a body that is absent."""
        rates = (later - poses) / duration_s
        rates[~(is_there(poses) & is_there(later))] = 0.0
        return rates


def is_there(poses: Array) -> NDArray[np.bool_]:
    """Returns (...,) whether bodies at poses (..., 3) are in the world."""
    return np.abs(poses[..., 0]) < 0.5 * FAR_AWAY_M


# Several metrics measure one log in turn, and a log does not change: the last result is kept.
@lru_cache(maxsize=1)
def movers_of(log: TrialLog) -> Movers:
    """Returns the moving obstacles and people of a trial; an empty `Movers` if there were none."""
    described = log.info["scenario"]["world"].get("moving_obstacles", [])
    things = MovingObstacles(tuple(TypeAdapter(list[MovingObstacle]).validate_python(described)))
    people = _people_of(log)
    tracks, top_speed_mps = things.tracks, things.top_speed_mps
    if log.people is not None:
        tracks = tracks.joined(Tracks.of(_rows(log.people)))
        top_speed_mps = max(top_speed_mps, _top_speed_mps(people, log.people))
    return Movers(
        things,
        people,
        [*things.names, *people.names],
        [*(thing.outline for thing in things.things), *map(circle, people.radii_m)],
        with_people(things.bodies, people.radii_m),
        tracks,
        top_speed_mps,
    )


def _people_of(log: TrialLog) -> WalkingPeople | RecordedPeople:
    described = log.info["scenario"]["world"].get("people")
    # A trial that broke off has no samples, and so no paths of people.
    if described is None or log.people is None:
        return NOBODY
    people = People.model_validate(described)
    if people.recording is None:
        return WalkingPeople(people)
    who = log.info["people"]
    return RecordedPeople.known_by(who["names"], who["groups"], people.recording.radius_m)


def _top_speed_mps(people: WalkingPeople | RecordedPeople, logged: LoggedPeople) -> float:
    """Returns an upper bound on the people's speed, m/s; for a recording its largest speed."""
    if isinstance(people, WalkingPeople):
        return people.top_speed_mps
    steps_m = np.hypot(*np.moveaxis(np.diff(logged.poses[..., :2], axis=0), -1, 0))
    speeds_mps = steps_m / np.diff(logged.time_s)[:, None]
    return float(np.nanmax(speeds_mps, initial=0.0))


def _rows(people: LoggedPeople) -> list[Array]:
    """Returns the track of each person, (T, 4): time s, x m, y m, yaw rad.

    A person who is not in the world stands at FAR_AWAY_M. The jump between there and the first or
    last pose takes MOMENT_S.
    """
    tracks = []
    for index in range(people.person_count):
        rows = np.column_stack([people.time_s, people.poses[:, index]])
        away = np.isnan(rows[:, 1])
        rows[away, 1:] = FAR_AWAY_M, FAR_AWAY_M, 0.0
        pieces = [rows[:1]]
        for row in range(1, len(rows)):
            if away[row] != away[row - 1]:
                here = row - 1 if away[row] else row
                time_s = rows[here, 0] + (MOMENT_S if away[row] else -MOMENT_S)
                turn = rows[[row - 1, row]].copy()
                turn[:, 0] = time_s
                pieces.append(turn)
            pieces.append(rows[row : row + 1])
        tracks.append(np.vstack(pieces))
    return tracks
