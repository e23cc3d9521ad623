"""The memory that the Graceful Controller hands from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple


class GracefulMemory(NamedTuple):
    """The memory of the Graceful Controller; it begins anew with each plan.

    plan_id: of the last cycle. may_turn_first: the robot has not faced a target of this plan yet.
    safe_angle: the heading, in the base frame, at which it last arrived without coming near an
    obstacle, rad; None where it did not have to look for one. plan_begin, near_goal: up to Kilted,
    the index at which the rest of the plan begins, and whether the robot was near its end.
    """

    plan_id: int | None = None
    may_turn_first: bool = True
    safe_angle: float | None = None
    plan_begin: int = 0
    near_goal: bool = False
