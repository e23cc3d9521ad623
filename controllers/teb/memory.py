"""The memory that TEB hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.teb.band import Band
from drake_navbench.controllers.teb.obstacle_tracking import Tracking

# Bands that lost or failed are tried again only after this, s: little changes in a cycle.
REVISIT_PERIOD_S = 0.25


class Alternative(NamedTuple):
    """A band of another class than the driven one, or a guess of a class in which there was none.

    stamp_s: when it was optimised. accepted: it obeyed the limits then. is_queued: a guess that
    there was no time for; it is its turn now.
    """

    band: Band
    stamp_s: float
    accepted: bool
    is_queued: bool = False

    def is_recent(self, time_s: float) -> bool:
        """Whether the alternative was optimised less than REVISIT_PERIOD_S before."""
        return not self.is_queued and time_s - self.stamp_s < REVISIT_PERIOD_S


class TebMemory(NamedTuple):
    """The memory of TEB after a cycle.

    band: the last band that was driven, or None. alternatives: bands of other classes. stamp_s:
    when the driven one was planned. switched_s: when the class last changed. command: (2,) v m/s, w
    rad/s of the last cycle, or None after a failure. explored_s: when other classes were last
    searched for. spare_failed_s: when a new guess for the driven band's class last failed.
    tracking: the snapshots and tracks of moving obstacles.
    """

    band: Band | None = None
    alternatives: tuple[Alternative, ...] = ()
    stamp_s: float = 0.0
    switched_s: float = -np.inf
    command: NDArray[np.float64] | None = None
    explored_s: float = -np.inf
    spare_failed_s: float = -np.inf
    tracking: Tracking = Tracking()

    def afresh(self) -> TebMemory:
        """Returns the memory without bands and commands: the next cycle starts from the plan."""
        return TebMemory(tracking=self.tracking)
