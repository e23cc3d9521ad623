"""When a goal counts as reached: Nav2's goal checkers, as pure functions of an immutable state.

All poses are (3,) x m, y m, yaw rad, in one frame; twists are (3,) v m/s, w rad/s, vy m/s. Lengths,
angles and speeds are compared inclusively unless a class says otherwise. Source: nav2_controller,
branch lyrical.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.plugin_parameters import PluginParameters
from drake_navbench.plugins import PluginKind
from drake_navbench.typed_files.quantities import Angle, AngularSpeed, Count, Length, Speed
from drake_navbench.typed_files.typed_yaml import FrozenModel

Array = NDArray[np.float64]

# Closer than this to the goal there is no direction towards it (AxisGoalChecker).
NEGLIGIBLE_DISTANCE_M = 1e-6


class GoalCheck(NamedTuple):
    """The outcome of one check.

    reached: the task is done. xy_reached: only the heading or standstill may be missing.
    state: handed to the next check.
    """

    reached: bool
    xy_reached: bool
    state: Any


class GoalChecker(Protocol):
    """What the controller server asks once a cycle.

    xy_tolerance_m, yaw_tolerance_rad: what a controller is told of the tolerances.
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


class PositionGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::PositionGoalChecker."""

    plugin: Literal["nav2_controller::PositionGoalChecker"] = "nav2_controller::PositionGoalChecker"
    xy_goal_tolerance: Length = Field(0.25, ge=0.0, description="Distance to the goal [m].")
    path_length_tolerance: Length | None = Field(
        1.0,
        ge=0.0,
        description="Local plans longer than this are never at the goal [m]; null, as up to "
        "Kilted: any may be.",
    )
    stateful: bool = Field(True, description="Once the position is reached it stays reached.")
    xy_goal_tolerance_buffer: Length = Field(
        0.0, ge=0.0, description="Leaving by more than this undoes `stateful` [m]; 0: never."
    )


class SimpleGoalCheckerParameters(PositionGoalCheckerParameters):
    """Parameters of nav2_controller::SimpleGoalChecker."""

    # A derived set of parameters has a tag of its own.
    plugin: Literal["nav2_controller::SimpleGoalChecker"] = "nav2_controller::SimpleGoalChecker"  # type: ignore[assignment]
    yaw_goal_tolerance: Angle = Field(0.25, ge=0.0, description="Heading error [rad].")
    symmetric_yaw_tolerance: bool = Field(False, description="Facing backwards is as good.")


class StoppedGoalCheckerParameters(SimpleGoalCheckerParameters):
    """Parameters of nav2_controller::StoppedGoalChecker."""

    # A derived set of parameters has a tag of its own.
    plugin: Literal["nav2_controller::StoppedGoalChecker"] = "nav2_controller::StoppedGoalChecker"  # type: ignore[assignment]
    trans_stopped_velocity: Speed = Field(0.25, ge=0.0, description="Counts as standing [m/s].")
    rot_stopped_velocity: AngularSpeed = Field(
        0.25, ge=0.0, description="Counts as standing [rad/s]."
    )


class XyLatch(NamedTuple):
    """Whether the position was reached since the path was given."""

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
        distance_squared = _distance_squared(pose, goal)
        if latch.is_set:
            buffer_m = parameters.xy_goal_tolerance_buffer
            leave_at_m = parameters.xy_goal_tolerance + buffer_m
            has_left = buffer_m > 0.0 and distance_squared > leave_at_m**2
            return not has_left, XyLatch(not has_left)
        is_near = distance_squared <= parameters.xy_goal_tolerance**2
        return is_near, XyLatch(is_near and parameters.stateful)

    def _accepts(self, pose: Array, goal: Array, twist: Array) -> bool:
        """Tells whether what a subclass asks for beyond the position holds."""
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
        return _is_heading_reached(
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
        return super()._accepts(pose, goal, twist) and _is_standing(
            twist,
            trans_stopped_velocity=self.parameters.trans_stopped_velocity,
            rot_stopped_velocity=self.parameters.rot_stopped_velocity,
        )


class AxisGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::AxisGoalChecker."""

    plugin: Literal["nav2_controller::AxisGoalChecker"] = "nav2_controller::AxisGoalChecker"
    along_path_tolerance: Length = Field(
        0.25, ge=0.0, description="Error along the end of the path [m]."
    )
    cross_track_tolerance: Length = Field(
        0.25, ge=0.0, description="Error across the end of the path [m]."
    )
    path_length_tolerance: Length = Field(
        1.0, ge=0.0, description="Local plans longer than this are never at the goal [m]."
    )
    is_overshoot_valid: bool = Field(False, description="Any error beyond the goal will do.")


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
        """Heading error that Nav2 reports, rad; the heading is not looked at."""
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


class AdaptiveToleranceGoalCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::AdaptiveToleranceGoalChecker."""

    plugin: Literal["nav2_controller::AdaptiveToleranceGoalChecker"] = (
        "nav2_controller::AdaptiveToleranceGoalChecker"
    )
    fine_xy_goal_tolerance: Length = Field(
        0.10, ge=0.0, description="Distance that is always good enough [m]."
    )
    coarse_xy_goal_tolerance: Length = Field(
        0.25, ge=0.0, description="Distance that will do where it gets no better [m]."
    )
    xy_goal_tolerance_buffer: Length = Field(
        0.0, ge=0.0, description="Leaving by more than this undoes `stateful` [m]; 0: never."
    )
    yaw_goal_tolerance: Angle = Field(0.25, ge=0.0, description="Heading error [rad].")
    path_length_tolerance: Length = Field(
        1.0, ge=0.0, description="Local plans longer than this are never at the goal [m]."
    )
    stateful: bool = Field(True, description="Once the position is reached it stays reached.")
    symmetric_yaw_tolerance: bool = Field(False, description="Facing backwards is as good.")
    trans_stopped_velocity: Speed = Field(0.10, ge=0.0, description="Counts as standing [m/s].")
    rot_stopped_velocity: AngularSpeed = Field(
        0.10, ge=0.0, description="Counts as standing [rad/s]."
    )
    required_stagnation_cycles: Count = Field(
        15, ge=0, description="Cycles without getting nearer, or standing, that are enough."
    )


class AdaptiveState(NamedTuple):
    """What AdaptiveToleranceGoalChecker remembers.

    is_xy_reached: latched. was_fine: by the fine tolerance. entry: (x, y) from robot to goal, m,
    when the robot entered the coarse tolerance, None outside. best_squared: least squared distance
    since, m^2. standing_cycles, stagnant_cycles: cycles in a row.
    """

    is_xy_reached: bool = False
    was_fine: bool = False
    entry: tuple[float, float] | None = None
    best_squared: float = math.inf
    standing_cycles: int = 0
    stagnant_cycles: int = 0


class AdaptiveToleranceGoalChecker:
    """Reached within a fine distance, or within a coarse one where it gets no better.

    It gets no better once the robot has passed the goal, seen from where it entered the coarse
    distance, or has stood still or not come nearer for some cycles. Counts advance once a cycle;
    in Nav2 a controller that asks again in the same cycle advances them again.
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
            xy_reached, state = self._stay(state, _distance_squared(pose, goal))
        else:
            xy_reached, state = self._approach(state, pose, goal, twist)
        reached = xy_reached and _is_heading_reached(
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
        distance_squared = _distance_squared(pose, goal)
        if distance_squared <= parameters.fine_xy_goal_tolerance**2:
            return True, state._replace(is_xy_reached=parameters.stateful, was_fine=True)
        if distance_squared > parameters.coarse_xy_goal_tolerance**2:
            return False, AdaptiveState()
        to_goal = float(goal[0] - pose[0]), float(goal[1] - pose[1])
        entry = state.entry
        if entry is None:
            return False, AdaptiveState(entry=to_goal, best_squared=distance_squared)
        is_standing = _is_standing(
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


def _distance_squared(pose: Array, goal: Array) -> float:
    delta_x, delta_y = float(pose[0] - goal[0]), float(pose[1] - goal[1])
    return delta_x * delta_x + delta_y * delta_y


def _is_heading_reached(
    pose: Array, goal: Array, *, tolerance_rad: float, is_symmetric: bool
) -> bool:
    error_rad = abs(wrap(float(goal[2] - pose[2])))
    if is_symmetric:
        backward_error_rad = abs(wrap(float(goal[2]) + math.pi - float(pose[2])))
        error_rad = min(error_rad, backward_error_rad)
    return error_rad <= tolerance_rad


def _is_standing(
    twist: Array, *, trans_stopped_velocity: float, rot_stopped_velocity: float
) -> bool:
    v, w, vy = twist
    return abs(w) <= rot_stopped_velocity and math.hypot(v, vy) <= trans_stopped_velocity


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
