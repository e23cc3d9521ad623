"""What Vector Pursuit keeps from one cycle to the next."""

from __future__ import annotations

from typing import NamedTuple


class VectorPursuitMemory(NamedTuple):
    """The last command, which it takes for the speed at which the robot moves: m/s, rad/s."""

    last_v: float = 0.0
    last_w: float = 0.0
