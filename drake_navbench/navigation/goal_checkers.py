"""Nav2's goal checkers, as pure functions of an immutable state.

All poses are (3,) x m, y m, yaw rad, in one frame; twists are (3,) v m/s, w rad/s, vy m/s. Lengths,
angles and speeds are compared inclusively unless a class says otherwise. Source: nav2_controller,
branch lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.adaptive_goal_checker import AdaptiveToleranceGoalChecker
from drake_navbench.navigation.goal_check import (
    GoalCheck,
    is_heading_reached,
    squared_distance,
    stands_still,
)
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginParameters
from drake_navbench.plugins.releases import ReadBy, Release, before, since
from drake_navbench.typed_files.quantities import Angle, AngularSpeed, Length, Speed
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative

# Closer to the goal than this, the direction towards it counts as undefined (AxisGoalChecker).
NEGLIGIBLE_DISTANCE_M = 1e-6


class PositionGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::PositionGoalChecker."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "path_length_tolerance": since(Release.LYRICAL, before(Release.LYRICAL, None)),
        "xy_goal_tolerance_buffer": since(Release.LYRICAL),
    }

    plugin: Literal["nav2_controller::PositionGoalChecker"] = "nav2_controller::PositionGoalChecker"
    xy_goal_tolerance: Annotated[
        Length, not_negative("the checker takes its size, the controllers the negative number")
    ] = Field(0.25, description="Distance to the goal that counts as reached [m].")
    path_length_tolerance: Annotated[Length | None, not_negative("the robot never arrives")] = (
        Field(
            1.0,
            description="Length of the local plan above which the goal is not reached [m]; null, "
            "as up to Kilted: no such limit.",
        )
    )
    stateful: bool = Field(True, description="Keep the position as reached once it was reached.")
    xy_goal_tolerance_buffer: Annotated[Length, not_negative("as 0")] = Field(
        0.0,
        description="Distance beyond the tolerance at which `stateful` is undone [m]; 0: never.",
    )


class SimpleGoalCheckerParameters(PositionGoalCheckerParameters):
    """Parameters of nav2_controller::SimpleGoalChecker."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "symmetric_yaw_tolerance": ReadBy(frozenset(Release) - {Release.IRON}),
    }

    # A derived set of parameters has a tag of its own.
    plugin: Literal["nav2_controller::SimpleGoalChecker"] = "nav2_controller::SimpleGoalChecker"  # type: ignore[assignment]
    yaw_goal_tolerance: Annotated[Angle, not_negative("the robot never arrives")] = Field(
        0.25, description="Heading error that counts as reached [rad]."
    )
    symmetric_yaw_tolerance: bool = Field(
        False, description="Accept the goal's heading turned by 180 degrees as well."
    )


class StoppedGoalCheckerParameters(SimpleGoalCheckerParameters):
    """Parameters of nav2_controller::StoppedGoalChecker."""

    # A derived set of parameters has a tag of its own.
    plugin: Literal["nav2_controller::StoppedGoalChecker"] = "nav2_controller::StoppedGoalChecker"  # type: ignore[assignment]
    trans_stopped_velocity: Annotated[
        Speed, not_negative("the robot never stands, and so never arrives")
    ] = Field(0.25, description="Speed below which the robot stands [m/s].")
    rot_stopped_velocity: Annotated[
        AngularSpeed, not_negative("the robot never stands, and so never arrives")
    ] = Field(0.25, description="Turn rate below which the robot stands [rad/s].")


class XyLatch(NamedTuple):
    """The memory of a goal checker: whether the position was reached since the path was given."""

    is_set: bool = False


class PositionGoalChecker:
    """Reached within a distance of the goal, whatever the heading."""

    nav2_plugin = "nav2_controller::PositionGoalChecker"
    Parameters: type[PositionGoalCheckerParameters] = PositionGoalCheckerParameters

    def __init__(self, parameters: PositionGoalCheckerParameters) -> None:
        self.parameters = parameters

    @property
    def xy_tolerance_m(self) -> float:
        """Distance to the goal, m."""
        return self.parameters.xy_goal_tolerance

    @property
    def yaw_tolerance_rad(self) -> float:
        """Heading error, rad; any heading will do."""
        return math.pi

    def initial_state(self) -> XyLatch:
        """Returns the state at the start of a path."""
        return XyLatch()

    def check(
        self, state: XyLatch, *, pose: Array, goal: Array, twist: Array, local_plan: Array
    ) -> GoalCheck:
        """Tells whether `pose` is at `goal`."""
        xy_reached, state = self._check_xy(state, pose, goal, local_plan)
        return GoalCheck(xy_reached and self._accepts(pose, goal, twist), xy_reached, state)

    def _check_xy(
        self, latch: XyLatch, pose: Array, goal: Array, local_plan: Array
    ) -> tuple[bool, XyLatch]:
        parameters = self.parameters
        longest_m = parameters.path_length_tolerance
        if longest_m is not None and arc_length(local_plan) > longest_m:
            return False, latch
        distance_squared = squared_distance(pose, goal)
        if latch.is_set:
            buffer_m = parameters.xy_goal_tolerance_buffer
            leave_at_m = parameters.xy_goal_tolerance + buffer_m
            has_left = buffer_m > 0.0 and distance_squared > leave_at_m**2
            return not has_left, XyLatch(not has_left)
        is_near = distance_squared <= parameters.xy_goal_tolerance**2
        return is_near, XyLatch(is_near and parameters.stateful)

    def _accepts(self, pose: Array, goal: Array, twist: Array) -> bool:
        """Tells whether a subclass's conditions beyond the position hold."""
        return True


class SimpleGoalChecker(PositionGoalChecker):
    """Reached within a distance of the goal and a heading error."""

    nav2_plugin = "nav2_controller::SimpleGoalChecker"
    Parameters = SimpleGoalCheckerParameters
    parameters: SimpleGoalCheckerParameters

    @property
    def yaw_tolerance_rad(self) -> float:
        """Heading error, rad."""
        return self.parameters.yaw_goal_tolerance

    def _accepts(self, pose: Array, goal: Array, twist: Array) -> bool:
        parameters = self.parameters
        return is_heading_reached(
            pose,
            goal,
            tolerance_rad=parameters.yaw_goal_tolerance,
            is_symmetric=parameters.symmetric_yaw_tolerance,
        )


class StoppedGoalChecker(SimpleGoalChecker):
    """As SimpleGoalChecker, and the robot stands still."""

    nav2_plugin = "nav2_controller::StoppedGoalChecker"
    Parameters = StoppedGoalCheckerParameters
    parameters: StoppedGoalCheckerParameters

    def _accepts(self, pose: Array, goal: Array, twist: Array) -> bool:
        return super()._accepts(pose, goal, twist) and stands_still(
            twist,
            trans_stopped_velocity=self.parameters.trans_stopped_velocity,
            rot_stopped_velocity=self.parameters.rot_stopped_velocity,
        )


class AxisGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::AxisGoalChecker."""

    plugin: Literal["nav2_controller::AxisGoalChecker"] = "nav2_controller::AxisGoalChecker"
    along_path_tolerance: Annotated[
        Length, not_negative("the robot arrives, if at all, only beyond or on the goal")
    ] = Field(0.25, description="Tolerance along the end direction of the path [m].")
    cross_track_tolerance: Annotated[
        Length, not_negative("the robot arrives, if at all, only beyond or on the goal")
    ] = Field(0.25, description="Tolerance across the end direction of the path [m].")
    path_length_tolerance: Annotated[Length, not_negative("the robot never arrives")] = Field(
        1.0, description="Length of the local plan above which the goal is not reached [m]."
    )
    is_overshoot_valid: bool = Field(False, description="Accept any distance beyond the goal.")


class AxisGoalChecker:
    """Reached if the errors along and across the end of the path are both below their tolerances.

    The end of the path points from its last pose that is not the goal to the goal. If every pose is
    the goal, the distance to the goal must be below the diagonal of the two tolerances.
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


GOAL_CHECKERS = PluginKind(
    noun="goal checker",
    group="drake_navbench.goal_checkers",
    members=("Parameters", "xy_tolerance_m", "yaw_tolerance_rad", "initial_state", "check"),
    guide="docs/plugins.md",
    parameters=PluginParameters,
    built_in={
        checker.nav2_plugin: checker
        for checker in (
            SimpleGoalChecker,
            StoppedGoalChecker,
            PositionGoalChecker,
            AxisGoalChecker,
            AdaptiveToleranceGoalChecker,
        )
    },
)
"""The goal checkers by Nav2's plugin type."""
