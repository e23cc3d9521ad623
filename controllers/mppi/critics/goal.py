"""Critics that pull toward the end of the local plan: Goal, GoalAngle."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numba import njit
from numba.extending import register_jitable
from pydantic import Field

from drake_navbench.controllers.mppi.critics.base import (
    CriticParameters,
    PointwiseCritic,
    TermParameters,
    Trajectories,
)
from drake_navbench.controllers.mppi.critics.batch import Scene
from drake_navbench.controllers.mppi.float32_math import F32, PI, wrap32
from drake_navbench.controllers.mppi.lanes import LANES, Lanes
from drake_navbench.typed_files.quantities import Length, Number


class GoalParameters(TermParameters):
    """Parameters of GoalCritic."""

    cost_weight: Number = Field(
        5.0, description="Weight of a sample's mean distance to the goal [1/m]."
    )
    threshold_to_consider: Length = Field(
        1.4, ge=0, description="Length of the remaining plan above which the critic is idle [m]."
    )


class GoalCritic(PointwiseCritic):
    """Mean distance to the goal, the last point of the local plan, where that is near."""

    Parameters: ClassVar[type[CriticParameters]] = GoalParameters
    is_mean = True

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...] | None:
        if scene.way_left > F32(self.parameters.threshold_to_consider):
            return None
        return scene.goal[0], scene.goal[1]

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        goal_x, goal_y = cycle
        add_distances(chunk.x, chunk.y, goal_x, goal_y, sums)


@njit(cache=True)
def add_distances(x, y, goal_x, goal_y, sums):
    """Adds the distances of all columns from the goal point."""
    for block in range(x.shape[0]):
        for t in range(x.shape[1]):
            _distance_row(x[block, t], y[block, t], goal_x, goal_y, sums[block])


@register_jitable
def _distance_row(x, y, goal_x, goal_y, sums):
    for lane in range(LANES):
        dx, dy = x[lane] - goal_x, y[lane] - goal_y
        sums[lane] += np.sqrt(dx * dx + dy * dy)


class GoalAngleParameters(TermParameters):
    """Parameters of GoalAngleCritic."""

    cost_weight: Number = Field(
        3.0, description="Weight of a sample's mean yaw error to the goal [1/rad]."
    )
    threshold_to_consider: Length = Field(
        0.5, ge=0, description="Length of the remaining plan above which the critic is idle [m]."
    )
    symmetric_yaw_tolerance: bool = Field(
        False, description="Accept the goal's yaw turned by 180 degrees as well."
    )


class GoalAngleCritic(PointwiseCritic):
    """Mean yaw error against the last point of the local plan, where that is near.

    With `symmetric_yaw_tolerance` the reversed yaw is as good.
    """

    Parameters: ClassVar[type[CriticParameters]] = GoalAngleParameters
    is_mean = True

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...] | None:
        if scene.way_left > F32(self.parameters.threshold_to_consider):
            return None
        return (scene.goal[2],)

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        (goal_yaw,) = cycle
        add_yaw_errors(chunk.yaw, goal_yaw, self.parameters.symmetric_yaw_tolerance, sums)


@njit(cache=True)
def add_yaw_errors(yaw, goal_yaw, symmetric, sums):
    """Adds |wrap(goal yaw - yaw)| of all columns, or the smaller of it and that of the reverse."""
    for block in range(yaw.shape[0]):
        for t in range(yaw.shape[1]):
            if symmetric:
                _two_sided_row(yaw[block, t], goal_yaw, sums[block])
            else:
                _one_sided_row(yaw[block, t], goal_yaw, sums[block])


@register_jitable
def _one_sided_row(yaw, goal_yaw, sums):
    for lane in range(LANES):
        sums[lane] += np.abs(wrap32(goal_yaw - yaw[lane]))


@register_jitable
def _two_sided_row(yaw, goal_yaw, sums):
    for lane in range(LANES):
        ahead = np.abs(wrap32(goal_yaw - yaw[lane]))
        behind = np.abs(wrap32(goal_yaw + PI - yaw[lane]))
        sums[lane] += min(ahead, behind)
