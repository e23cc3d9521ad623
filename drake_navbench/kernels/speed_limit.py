"""The controller's own speed under a speed limit."""

from __future__ import annotations

from typing import Protocol

from drake_navbench.kernels.percent import PERCENT

# The value by which Nav2's speed filter lifts a limit (nav2_costmap_2d, NO_SPEED_LIMIT).
NO_SPEED_LIMIT = 0.0


class Limit(Protocol):
    """A limit in m/s, or in percent of the controller's own speed."""

    @property
    def value(self) -> float: ...

    @property
    def is_percentage(self) -> bool: ...


def limited_speed(speed: float, limit: Limit | None) -> float:
    """Returns the speed that holds under a limit, m/s.

    speed: the one in the controller's parameters, m/s. An absolute limit replaces it, even by more,
    as in Nav2's setSpeedLimit; None or NO_SPEED_LIMIT lift the limit.
    """
    if limit is None or limit.value == NO_SPEED_LIMIT:
        return speed
    return speed * limit.value / PERCENT if limit.is_percentage else limit.value


def speed_limit_ratio(speed: float, limit: Limit | None) -> float:
    """Returns the part of `speed` m/s that holds under a limit, for scaling other axes alike.

    A limit in percent is that percentage, whatever the speed, as in Nav2's MPPI.
    """
    if limit is None or limit.value == NO_SPEED_LIMIT:
        return 1.0
    return limit.value / PERCENT if limit.is_percentage else limit.value / speed
