"""The memory that DWB hands from one cycle to the next."""

from __future__ import annotations

from typing import Any, NamedTuple

from drake_navbench.controllers.dwb.kinematics import Kinematics


class DwbMemory(NamedTuple):
    """The memory of DWB after a cycle.

    plan_id: id of the last cycle's plan. kinematics: limits under the last speed limit.
    critics: the memories of the critics, in their order. plan_begin: index of the first pose of the
    plan that is still to be driven, in releases in which DWB cuts the plan itself.
    """

    plan_id: int | None
    kinematics: Kinematics
    critics: tuple[Any, ...]
    plan_begin: int = 0
