"""What moved in a trial besides its robot, as its log tells it."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from drake_navbench.inputs.moving import (
    Bodies,
    MovingObstacle,
    MovingObstacles,
    circle,
    with_people,
)
from drake_navbench.inputs.people import NOBODY, People, WalkingPeople
from drake_navbench.kernels.moving_bodies import Tracks
from drake_navbench.kernels.social_force import TOP_SPEED_MPS
from drake_navbench.log import TrialLog
from drake_navbench.logged_people import LoggedPeople

Array = NDArray[np.float64]


class Movers(NamedTuple):
    """All B bodies that moved.

    things: those that move on given ways. people: those who walk. names: of each, things, then
    people. outlines: (K, 2) corners of each in its own frame, m. bodies: the same as edges and
    discs. tracks: their ways. top_speed_mps: what no point of any is faster than.
    """

    things: MovingObstacles
    people: WalkingPeople
    names: list[str]
    outlines: list[Array]
    bodies: Bodies
    tracks: Tracks
    top_speed_mps: float

    @property
    def body_count(self) -> int:
        """How many there are."""
        return self.tracks.count

    @property
    def reaches_m(self) -> Array:
        """(B,) how far each outline reaches from its origin, m."""
        return np.array([np.hypot(*outline.T).max() for outline in self.outlines])

    def poses_at(self, time_s: Array) -> Array:
        """Returns (T, B, 3) x m, y m, yaw rad at times (T,)."""
        poses = [self.tracks.poses_at(time) for time in time_s]
        return np.array(poses).reshape(len(time_s), self.body_count, 3)


# One log is measured at a time, by several metrics in turn; a log does not change.
@lru_cache(maxsize=1)
def movers_of(log: TrialLog) -> Movers:
    """Returns what moved; nothing in logs in which nothing did."""
    described = log.info["scenario"]["world"].get("moving_obstacles", [])
    things = MovingObstacles(tuple(TypeAdapter(list[MovingObstacle]).validate_python(described)))
    people = _people_of(log)
    tracks, top_speed_mps = things.tracks, things.top_speed_mps
    if log.people is not None:
        tracks = tracks.joined(Tracks.of(_rows(log.people)))
        top_speed_mps = max(top_speed_mps, TOP_SPEED_MPS)
    return Movers(
        things,
        people,
        [*things.names, *people.names],
        [*(thing.outline for thing in things.things), *map(circle, people.radii_m)],
        with_people(things.bodies, people.radii_m),
        tracks,
        top_speed_mps,
    )


def _people_of(log: TrialLog) -> WalkingPeople:
    described = log.info["scenario"]["world"].get("people")
    # A trial that broke has no samples, and so nobody's way.
    if described is None or log.people is None:
        return NOBODY
    return WalkingPeople(People.model_validate(described))


def _rows(people: LoggedPeople) -> list[Array]:
    """Returns (T, 4) time s, x m, y m, yaw rad of each person."""
    return [
        np.column_stack([people.time_s, people.poses[:, index]])
        for index in range(people.person_count)
    ]
