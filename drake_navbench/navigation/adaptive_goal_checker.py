"""Nav2's AdaptiveToleranceGoalChecker. Source: nav2_controller, branch lyrical."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.goal_check import (
    GoalCheck,
    is_heading_reached,
    squared_distance,
    stands_still,
)
from drake_navbench.typed_files.quantities import Angle, AngularSpeed, Count, Length, Speed
from drake_navbench.typed_files.typed_yaml import FrozenModel


class AdaptiveToleranceGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::AdaptiveToleranceGoalChecker."""

    plugin: Literal["nav2_controller::AdaptiveToleranceGoalChecker"] = (
        "nav2_controller::AdaptiveToleranceGoalChecker"
    )
    fine_xy_goal_tolerance: Length = Field(
        0.10, ge=0.0, description="Distance to the goal that always counts as reached [m]."
    )
    coarse_xy_goal_tolerance: Length = Field(
        0.25,
        ge=0.0,
        description="Distance to the goal that counts as reached once the robot gets no "
        "nearer [m].",
    )
    xy_goal_tolerance_buffer: Length = Field(
        0.0,
        ge=0.0,
        description="Distance beyond the tolerance at which `stateful` is undone [m]; 0: never.",
    )
    yaw_goal_tolerance: Angle = Field(0.25, ge=0.0, description="Heading error [rad].")
    path_length_tolerance: Length = Field(
        1.0, ge=0.0, description="Length of the local plan above which the goal is not reached [m]."
    )
    stateful: bool = Field(True, description="Keep the position as reached once it was reached.")
    symmetric_yaw_tolerance: bool = Field(
        False, description="Accept the goal's heading turned by 180 degrees as well."
    )
    trans_stopped_velocity: Speed = Field(
        0.10, ge=0.0, description="Speed below which the robot stands [m/s]."
    )
    rot_stopped_velocity: AngularSpeed = Field(
        0.10, ge=0.0, description="Turn rate below which the robot stands [rad/s]."
    )
    required_stagnation_cycles: Count = Field(
        15,
        ge=0,
        description="Number of cycles in which the robot gets no nearer or stands until the coarse "
        "tolerance counts.",
    )


class AdaptiveState(NamedTuple):
    """The state of AdaptiveToleranceGoalChecker.

    is_xy_reached: latched. was_fine: reached by the fine tolerance. entry: (x, y) from robot to
    goal, m, when the robot entered the coarse tolerance; None outside. best_squared: least squared
    distance to the goal since then, m^2. standing_cycles, stagnant_cycles: cycles in a row.
    """

    is_xy_reached: bool = False
    was_fine: bool = False
    entry: tuple[float, float] | None = None
    best_squared: float = math.inf
    standing_cycles: int = 0
    stagnant_cycles: int = 0


class AdaptiveToleranceGoalChecker:
    """Reached within the fine tolerance; within the coarse one if the robot gets no nearer.

    The robot gets no nearer if it has passed the goal, seen from the place where it entered the
    coarse tolerance, or if for some cycles in a row it stood still or its distance did not fall.
    The counts of cycles advance once a cycle; in Nav2 they advance each time that a controller
    asks.
    """

    nav2_plugin = "nav2_controller::AdaptiveToleranceGoalChecker"
    Parameters = AdaptiveToleranceGoalCheckerParameters

    def __init__(self, parameters: AdaptiveToleranceGoalCheckerParameters) -> None:
        self.parameters = parameters

    @property
    def xy_tolerance_m(self) -> float:
        """The coarse distance, m."""
        return self.parameters.coarse_xy_goal_tolerance

    @property
    def yaw_tolerance_rad(self) -> float:
        """Heading error, rad."""
        return self.parameters.yaw_goal_tolerance

    def initial_state(self) -> AdaptiveState:
        """Returns the state at the start of a path."""
        return AdaptiveState()

    def check(
        self, state: AdaptiveState, *, pose: Array, goal: Array, twist: Array, local_plan: Array
    ) -> GoalCheck:
        """Tells whether `pose` is at `goal`."""
        parameters = self.parameters
        if arc_length(local_plan) > parameters.path_length_tolerance:
            return GoalCheck(False, False, state)
        if state.is_xy_reached:
            xy_reached, state = self._stay(state, squared_distance(pose, goal))
        else:
            xy_reached, state = self._approach(state, pose, goal, twist)
        reached = xy_reached and is_heading_reached(
            pose,
            goal,
            tolerance_rad=parameters.yaw_goal_tolerance,
            is_symmetric=parameters.symmetric_yaw_tolerance,
        )
        return GoalCheck(reached, xy_reached, state)

    def _stay(self, state: AdaptiveState, distance_squared: float) -> tuple[bool, AdaptiveState]:
        parameters = self.parameters
        buffer_m = parameters.xy_goal_tolerance_buffer
        tolerance_m = (
            parameters.fine_xy_goal_tolerance
            if state.was_fine
            else parameters.coarse_xy_goal_tolerance
        )
        if buffer_m > 0.0 and distance_squared > (tolerance_m + buffer_m) ** 2:
            return False, AdaptiveState()
        return True, state

    def _approach(
        self, state: AdaptiveState, pose: Array, goal: Array, twist: Array
    ) -> tuple[bool, AdaptiveState]:
        parameters = self.parameters
        distance_squared = squared_distance(pose, goal)
        if distance_squared <= parameters.fine_xy_goal_tolerance**2:
            return True, state._replace(is_xy_reached=parameters.stateful, was_fine=True)
        if distance_squared > parameters.coarse_xy_goal_tolerance**2:
            return False, AdaptiveState()
        to_goal = float(goal[0] - pose[0]), float(goal[1] - pose[1])
        entry = state.entry
        if entry is None:
            return False, AdaptiveState(entry=to_goal, best_squared=distance_squared)
        is_standing = stands_still(
            twist,
            trans_stopped_velocity=parameters.trans_stopped_velocity,
            rot_stopped_velocity=parameters.rot_stopped_velocity,
        )
        state = state._replace(
            best_squared=min(state.best_squared, distance_squared),
            stagnant_cycles=(
                0 if distance_squared < state.best_squared else state.stagnant_cycles + 1
            ),
            standing_cycles=state.standing_cycles + 1 if is_standing else 0,
        )
        has_passed = to_goal[0] * entry[0] + to_goal[1] * entry[1] <= 0.0
        enough = parameters.required_stagnation_cycles
        if has_passed or max(state.standing_cycles, state.stagnant_cycles) >= enough:
            return True, state._replace(is_xy_reached=parameters.stateful, was_fine=False)
        return False, state
