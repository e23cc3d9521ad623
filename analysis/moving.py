"""What moved in a trial besides its robot, as its log tells it."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from drake_navbench.inputs.moving import Bodies, MovingObstacle, MovingObstacles
from drake_navbench.kernels.moving_bodies import Tracks
from drake_navbench.log import TrialLog

Array = NDArray[np.float64]


class Movers(NamedTuple):
    """All B bodies that moved.

    things: those that move on given ways. names: of each. outlines: (K, 2) corners of each in its
    own frame, m. bodies: the same as edges and discs. tracks: their ways. top_speed_mps: what no
    point of any is faster than.
    """

    things: MovingObstacles
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
    return Movers(
        things,
        things.names,
        [thing.outline for thing in things.things],
        things.bodies,
        things.tracks,
        things.top_speed_mps,
    )
