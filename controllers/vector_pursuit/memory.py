"""The memory that Vector Pursuit hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple


class VectorPursuitMemory(NamedTuple):
    """The memory of the controller.

    last_v m/s, last_w rad/s: the last command, which it takes for the speed at which the robot
    moves. plan_id, plan_begin: up to Kilted, the plan of the last cycle, and the index at which its
    rest begins.
    """

    last_v: float = 0.0
    last_w: float = 0.0
    plan_id: int | None = None
    plan_begin: int = 0
