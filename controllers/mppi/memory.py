"""The memory that MPPI hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import SpeedLimit


class SamplerState(NamedTuple):
    """The sampler's memory between cycles; arrays are read-only and by axis (vx, vy, wz).

    controls: (3, N) float32, warm start. history: (3, 4) float32, the controls that the filter
    reads for the time before column 0. last_command: (3,) float64. delayed: (3, D) float32
    commands, oldest first. reset_count: number of resets of the optimiser, which names the fixed
    noise.
    """

    controls: NDArray[np.float32]
    history: NDArray[np.float32]
    last_command: NDArray[np.float64]
    delayed: NDArray[np.float32]
    reset_count: int = 0


class PlanState(NamedTuple):
    """The progress along a plan: plan[begin:end] remains before the next cusp."""

    plan_id: int | None = None
    begin: int = 0
    end: int = 0


class MppiMemory(NamedTuple):
    """The memory of one cycle for the next.

    sampler: the optimiser's state. start_speed: (2,) v m/s, w rad/s that the cycle's roll-outs
    started from. polish_fallback_count: number of cycles since the start in which the polish did
    not improve the sampled sequence. plan: up to Kilted, the progress along the plan. driven_at_s:
    in Humble, the time of the last cycle. limit: the speed limit of the last cycle.
    limit_is_lifted: a reset has lifted it, until another one is told.
    """

    sampler: SamplerState
    start_speed: NDArray[np.float64]
    polish_fallback_count: int = 0
    plan: PlanState = PlanState()
    driven_at_s: float | None = None
    limit: SpeedLimit | None = None
    limit_is_lifted: bool = False
