"""What harmony keeps from one cycle to the next."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class HarmonyMemory(NamedTuple):
    """What one cycle leaves to the next; arrays are read-only.

    plan: (N + 1, 9) the committed plan, or None where the last command was not a plan's.
    time_s: when it was committed. sent: (H, 2) the last commands v m/s, w rad/s, the oldest first,
    and sent_s: (H,) when each was sent. refused_since_s: since when no plan has been accepted, None
    while they are. is_trapped: the last plan got nowhere. rpp: memory of Regulated Pure Pursuit.
    """

    plan: Array | None = None
    time_s: float = 0.0
    sent: Array | None = None
    sent_s: Array | None = None
    refused_since_s: float | None = None
    is_trapped: bool = False
    rpp: Any = None
