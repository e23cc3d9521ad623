"""What MPPI keeps from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class SamplerState(NamedTuple):
    """What survives a cycle; arrays are read-only and by axis (vx, vy, wz).

    controls: (3, N) float32, warm start. history: (3, 4) float32, what the filter sees before
    column 0. last_command: (3,) float64. delayed: (3, D) float32 commands, oldest first.
    reset_count: how often the optimiser was reset, which names the fixed noise.
    """

    controls: NDArray[np.float32]
    history: NDArray[np.float32]
    last_command: NDArray[np.float64]
    delayed: NDArray[np.float32]
    reset_count: int = 0


class PlanState(NamedTuple):
    """How far a plan has been followed: plan[begin:end] is left before the next cusp."""

    plan_id: int | None = None
    begin: int = 0
    end: int = 0


class MppiMemory(NamedTuple):
    """What a cycle hands to the next one.

    sampler: the optimiser's state. start_speed: (2,) v m/s, w rad/s that the cycle's roll-outs
    started from. polish_fallback_count: cycles since the start in which the sampled sequence was
    used because the polish did not improve it. plan: up to Kilted, how far the plan was followed.
    """

    sampler: SamplerState
    start_speed: NDArray[np.float64]
    polish_fallback_count: int = 0
    plan: PlanState = PlanState()
