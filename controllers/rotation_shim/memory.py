"""The memory that the Rotation Shim hands from one cycle to the next."""

from __future__ import annotations

from typing import Any, NamedTuple


class ShimMemory(NamedTuple):
    """The memory of the Rotation Shim.

    primary: the memory of the primary controller. is_turning: turned towards the plan in the last
    cycle. last_w: the last command's, rad/s; 0 at the start of a goal. plan_id: of the last cycle.
    goal: (x m, y m, yaw rad) of the last cycle. looks_at_plan: this plan may still ask for a turn.
    goal_xy_reached: the goal's position was reached on this plan. The last three matter before
    Lyrical only.
    """

    primary: Any = None
    is_turning: bool = False
    last_w: float = 0.0
    plan_id: int | None = None
    goal: tuple[float, ...] | None = None
    looks_at_plan: bool = True
    goal_xy_reached: bool = False
