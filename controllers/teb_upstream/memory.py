"""The memory that the original TEB hands from one cycle to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

from drake_navbench.kernels.arrays import Array


class Trajectory(NamedTuple):
    """One band of the planner.

    number: its name. poses (n, 3), time_steps (n - 1,) s. cost: the cost by which bands are
    compared, inf before the first optimisation. chi_squared: see `optimizer.Optimized`.
    is_optimized: its last optimisation succeeded. preferred_turn: 1 left, -1 right, 0 neither.
    """

    number: int
    poses: Array
    time_steps: Array
    cost: float = math.inf
    chi_squared: float = 0.0
    is_optimized: bool = False
    preferred_turn: float = 0.0

    @property
    def duration_s(self) -> float:
        """Time from the first to the last pose, s."""
        return float(self.time_steps.sum())


class PlannerState(NamedTuple):
    """The planner's bands between cycles.

    best: number of the band driven, or -1. next_number: for the next new band. switched_s: when
    the driven band last changed class. plan_class: signature of the global plan, of the last cycle
    that had room for its band.
    """

    trajectories: tuple[Trajectory, ...] = ()
    best: int = -1
    best_class: Array | None = None
    next_number: int = 0
    switched_s: float = 0.0
    plan_class: Array | None = None


class TebUpstreamMemory(NamedTuple):
    """The state that a cycle hands to the next one.

    last_command: (2,) v m/s, w rad/s, or with cmd_angle_instead_rotvel the steering angle, rad, in
    place of w, as the original has it; zero after a failure. history: (K, 2) past commands over
    their limits, oldest first. oscillated_s: when an oscillation was last seen, at first the time
    of configuration, 0, soon after which no side is preferred either. preferred_turn: 1 left, -1
    right, 0 neither. plan_id: id of the last cycle's plan. plan_begin: index of its first pose that
    is not dropped.
    """

    planner: PlannerState
    last_command: Array
    history: Array
    oscillated_s: float = 0.0
    preferred_turn: float = 0.0
    plan_id: int | None = None
    plan_begin: int = 0
