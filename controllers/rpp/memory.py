"""The memory that Regulated Pure Pursuit hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple


class RppMemory(NamedTuple):
    """The memory of the controller: the last command, and the progress of cancelling.

    last_v m/s, last_w rad/s: the command of the last cycle that had one; the dynamic window starts
    there. is_cancelling: asked to stop, with `use_cancel_deceleration`. has_stopped: came to rest.
    plan_id, plan_begin, was_near_end: up to Kilted, the plan of the last cycle, the index at which
    its rest begins, and whether the robot was near its end.
    """

    last_v: float = 0.0
    last_w: float = 0.0
    is_cancelling: bool = False
    has_stopped: bool = False
    plan_id: int | None = None
    plan_begin: int = 0
    was_near_end: bool = False
