"""Nav2's AxisGoalChecker. Source: nav2_controller, branch lyrical."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.goal_check import (
    GoalCheck,
)
from drake_navbench.typed_files.quantities import Length
from drake_navbench.typed_files.typed_yaml import FrozenModel

Array = NDArray[np.float64]

# Closer to the goal than this, the direction towards it counts as undefined (AxisGoalChecker).
NEGLIGIBLE_DISTANCE_M = 1e-6


class AxisGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::AxisGoalChecker."""

    plugin: Literal["nav2_controller::AxisGoalChecker"] = "nav2_controller::AxisGoalChecker"
    along_path_tolerance: Length = Field(
        0.25, ge=0.0, description="Tolerance along the end direction of the path [m]."
    )
    cross_track_tolerance: Length = Field(
        0.25, ge=0.0, description="Tolerance across the end direction of the path [m]."
    )
    path_length_tolerance: Length = Field(
        1.0, ge=0.0, description="Length of the local plan above which the goal is not reached [m]."
    )
    is_overshoot_valid: bool = Field(False, description="Accept any distance beyond the goal.")


class AxisGoalChecker:
    """Reached within an error along and one across the end of the path; both bounds exclusive.

    The end of the path points from its last pose that is not the goal to the goal. Where there is
    none, the distance to the goal must be less than the diagonal of the two tolerances.
    """

    nav2_plugin = "nav2_controller::AxisGoalChecker"
    Parameters = AxisGoalCheckerParameters

    def __init__(self, parameters: AxisGoalCheckerParameters) -> None:
        self.parameters = parameters

    @property
    def xy_tolerance_m(self) -> float:
        """The smaller of the two tolerances, m."""
        return min(self.parameters.along_path_tolerance, self.parameters.cross_track_tolerance)

    @property
    def yaw_tolerance_rad(self) -> float:
        """Heading error that Nav2 reports, rad; the heading does not count."""
        return 0.5 * math.pi

    def initial_state(self) -> None:
        """Returns None: there is nothing to remember."""

    def check(
        self, state: None, *, pose: Array, goal: Array, twist: Array, local_plan: Array
    ) -> GoalCheck:
        """Tells whether `pose` is at `goal`."""
        reached = self._is_reached(pose, goal, local_plan)
        return GoalCheck(reached, reached, state)

    def _is_reached(self, pose: Array, goal: Array, local_plan: Array) -> bool:
        parameters = self.parameters
        if arc_length(local_plan) > parameters.path_length_tolerance:
            return False
        to_goal_x, to_goal_y = goal[0] - pose[0], goal[1] - pose[1]
        distance_m = math.hypot(to_goal_x, to_goal_y)
        direction = _end_direction(local_plan, goal)
        if direction is None:
            diagonal_m = math.hypot(
                parameters.along_path_tolerance, parameters.cross_track_tolerance
            )
            return distance_m < diagonal_m
        if distance_m < NEGLIGIBLE_DISTANCE_M:
            return True
        angle = direction - math.atan2(to_goal_y, to_goal_x)
        along_m, across_m = distance_m * math.cos(angle), distance_m * math.sin(angle)
        if not parameters.is_overshoot_valid:
            along_m = abs(along_m)
        return (
            along_m < parameters.along_path_tolerance
            and abs(across_m) < parameters.cross_track_tolerance
        )


def _end_direction(local_plan: Array, goal: Array) -> float | None:
    """Returns the heading from the last pose that is not the goal to the goal, rad."""
    for candidate in local_plan[-2::-1]:
        delta_x, delta_y = goal[0] - candidate[0], goal[1] - candidate[1]
        if math.hypot(delta_x, delta_y) >= NEGLIGIBLE_DISTANCE_M:
            return math.atan2(delta_y, delta_x)
    return None
