"""What TEB keeps from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.teb.band import Band


class Alternative(NamedTuple):
    """A band of another class than the driven one, perhaps not yet converged.

    stamp_s: when it was optimised. accepted: it obeyed the limits then.
    """

    band: Band
    stamp_s: float
    accepted: bool


class TebMemory(NamedTuple):
    """What one cycle leaves to the next.

    band: the last band that was driven, or None. alternatives: bands of other classes. stamp_s:
    when the driven one was planned. switched_s: when the class last changed. command: (2,) v m/s,
    w rad/s of the last cycle, or None after a failure. explored_s: when other classes were last
    looked for.
    """

    band: Band | None = None
    alternatives: tuple[Alternative, ...] = ()
    stamp_s: float = 0.0
    switched_s: float = -np.inf
    command: NDArray[np.float64] | None = None
    explored_s: float = -np.inf
