"""The time of a task on a map or in a world: a slow robot has more of it on a long way."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario

# A way around obstacles, with its turns, takes at most about so many times the straight way's time.
SHARE = 2.0
# Scenarios have a day and some more at most.
MAX_TIMEOUT_S = 1e5


def with_time(task: Scenario, robots: Sequence[Robot]) -> Scenario:
    """Returns a task with a longer `timeout_s` if the slowest robot needs it.

    The robot needs it if twice the straight way at its largest speed takes longer than the task's
    own time.
    """
    slowest_mps = min(map(_speed_mps, robots))
    needed_s = SHARE * math.dist(task.start[:2], task.goal[:2]) / slowest_mps
    if needed_s <= task.timeout_s:
        return task
    return task.model_copy(update={"timeout_s": min(math.ceil(needed_s), MAX_TIMEOUT_S)})


def _speed_mps(robot: Robot) -> float:
    """Returns the largest speed ahead that base and velocity smoother leave a robot."""
    smoother = robot.navigation.velocity_smoother
    largest_mps = robot.drive.max_linear_velocity_mps
    limit_mps = math.inf if smoother is None else smoother.max_velocity[0]
    return min(largest_mps, limit_mps) if limit_mps > 0.0 else largest_mps
