"""The memory that harmony hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.learning import Learnt
from drake_navbench.controllers.harmony.prediction import Sent
from drake_navbench.controllers.harmony.tracking import Tracks

Array = NDArray[np.float64]


class HarmonyMemory(NamedTuple):
    """The memory of harmony after a cycle; arrays are read-only.

    plan: (N + 1, 9) the committed plan, or None where the last command was not a plan's.
    time_s: when it was committed. sent: the last commands. refused_since_s: since when no new plan
    has been accepted; None if the last one was. is_trapped: the last plan got nowhere. detour:
    (M, 3) the way out of a trap, or None. backs_up: the last way was driven backwards. learnt: the
    errors of the base's candidates. tracks: of the things in the costmap. met_s: when one of
    them surely moved last. hurries: the robot has stopped for such a thing.
    """

    plan: Array | None = None
    time_s: float = 0.0
    sent: Sent | None = None
    refused_since_s: float | None = None
    is_trapped: bool = False
    detour: Array | None = None
    backs_up: bool = False
    learnt: Learnt | None = None
    tracks: Tracks | None = None
    met_s: float = -np.inf
    hurries: bool = False
