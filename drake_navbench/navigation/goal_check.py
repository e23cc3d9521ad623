"""The interface of goal checkers: their inputs and answers, and checks that several share.

All poses are (3,) x m, y m, yaw rad, in one frame; twists are (3,) v m/s, w rad/s, vy m/s.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array


class GoalCheck(NamedTuple):
    """The outcome of one check.

    reached: the task is done. xy_reached: only the heading or standstill may be missing.
    state: handed to the next check.
    """

    reached: bool
    xy_reached: bool
    state: Any


class GoalChecker(Protocol):
    """A goal checker, which the controller server calls once a cycle.

    xy_tolerance_m, yaw_tolerance_rad: the tolerances that the controllers see.
    """

    @property
    def xy_tolerance_m(self) -> float: ...

    @property
    def yaw_tolerance_rad(self) -> float: ...

    def initial_state(self) -> Any:
        """Returns the state at the start of a path."""
        ...

    def check(
        self, state: Any, *, pose: Array, goal: Array, twist: Array, local_plan: Array
    ) -> GoalCheck:
        """Tells whether `pose` is at `goal`; local_plan: (M, 3) of this cycle."""
        ...


def squared_distance(pose: Array, goal: Array) -> float:
    """Returns the squared distance between two poses, m^2."""
    delta_x, delta_y = float(pose[0] - goal[0]), float(pose[1] - goal[1])
    return delta_x * delta_x + delta_y * delta_y


def is_heading_reached(
    pose: Array, goal: Array, *, tolerance_rad: float, is_symmetric: bool
) -> bool:
    """Tells whether a heading is near the goal's, or its opposite where that is as good."""
    error_rad = abs(wrap(float(goal[2] - pose[2])))
    if is_symmetric:
        backward_error_rad = abs(wrap(float(goal[2]) + math.pi - float(pose[2])))
        error_rad = min(error_rad, backward_error_rad)
    return error_rad <= tolerance_rad


def stands_still(
    twist: Array, *, trans_stopped_velocity: float, rot_stopped_velocity: float
) -> bool:
    """Tells whether a robot stands still."""
    v, w, vy = twist
    return abs(w) <= rot_stopped_velocity and math.hypot(v, vy) <= trans_stopped_velocity
