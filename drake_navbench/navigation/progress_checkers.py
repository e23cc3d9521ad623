"""Nav2's progress checkers, as pure functions of immutable state.

Source: nav2_controller, branch lyrical.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple, Protocol

from pydantic import Field

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginParameters
from drake_navbench.typed_files.quantities import Angle, Duration, Length
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative

# Times are compared in whole nanoseconds, as Nav2 does, so that 10.05 s - 0.05 s is 10 s. A
# parameter is cut to them: 2.05 s is 2,049,999,999 ns.
NANOSECONDS_PER_SECOND = 1e9


class Baseline(NamedTuple):
    """The pose and time of the last sufficient motion: x m, y m, yaw rad, time s."""

    x: float
    y: float
    yaw: float
    time_s: float


class ProgressCheck(NamedTuple):
    """The outcome of one check; `state` is handed to the next one."""

    made_progress: bool
    state: Any


class ProgressChecker(Protocol):
    """A progress checker, which the controller server calls once a cycle after the goal checker."""

    def initial_state(self) -> Any:
        """Returns the state at the start of a task."""
        ...

    def check(self, state: Any, *, pose: Array, time_s: float) -> ProgressCheck:
        """Tells whether the robot makes progress; pose: (3,) m, m, rad."""
        ...


class SimpleProgressCheckerParameters(FrozenModel):
    """Parameters of nav2_controller::SimpleProgressChecker."""

    plugin: Literal["nav2_controller::SimpleProgressChecker"] = (
        "nav2_controller::SimpleProgressChecker"
    )
    required_movement_radius: Annotated[
        Length, not_negative("every position counts as progress")
    ] = Field(0.5, description="Distance that counts as progress [m].")
    movement_time_allowance: Annotated[
        Duration, not_negative("the task fails at the first cycle without progress")
    ] = Field(10.0, description="Time within which the robot must make progress [s].")


class PoseProgressCheckerParameters(SimpleProgressCheckerParameters):
    """Parameters of nav2_controller::PoseProgressChecker."""

    # A derived set of parameters has a tag of its own.
    plugin: Literal["nav2_controller::PoseProgressChecker"] = "nav2_controller::PoseProgressChecker"  # type: ignore[assignment]
    required_movement_angle: Annotated[Angle, not_negative("every heading counts as progress")] = (
        Field(0.5, description="Turn that counts as progress [rad].")
    )


class SimpleProgressChecker:
    """The robot must leave a baseline position in time; each success renews the baseline."""

    nav2_plugin = "nav2_controller::SimpleProgressChecker"
    Parameters: type[SimpleProgressCheckerParameters] = SimpleProgressCheckerParameters

    def __init__(self, parameters: SimpleProgressCheckerParameters) -> None:
        self.parameters = parameters

    def initial_state(self) -> Baseline | None:
        """Returns None: there is no baseline before the first check."""
        return None

    def check(self, state: Baseline | None, *, pose: Array, time_s: float) -> ProgressCheck:
        """Tells whether the robot moved enough, or has time left; pose: (3,) m, m, rad."""
        x, y, yaw = pose.tolist()
        if state is None or self._moved_enough(state, x, y, yaw):
            return ProgressCheck(True, Baseline(x, y, yaw, time_s))
        spent_ns = round((time_s - state.time_s) * NANOSECONDS_PER_SECOND)
        allowed_ns = int(self.parameters.movement_time_allowance * NANOSECONDS_PER_SECOND)
        return ProgressCheck(spent_ns <= allowed_ns, state)

    def _moved_enough(self, baseline: Baseline, x: float, y: float, yaw: float) -> bool:
        distance_m = math.hypot(x - baseline.x, y - baseline.y)
        return distance_m > self.parameters.required_movement_radius


class PoseProgressChecker(SimpleProgressChecker):
    """As SimpleProgressChecker, but turning counts as well."""

    nav2_plugin = "nav2_controller::PoseProgressChecker"
    Parameters = PoseProgressCheckerParameters
    parameters: PoseProgressCheckerParameters

    def _moved_enough(self, baseline: Baseline, x: float, y: float, yaw: float) -> bool:
        turn_rad = abs(wrap(yaw - baseline.yaw))
        return (
            super()._moved_enough(baseline, x, y, yaw)
            or turn_rad > self.parameters.required_movement_angle
        )


PROGRESS_CHECKERS = PluginKind(
    noun="progress checker",
    group="drake_navbench.progress_checkers",
    members=("Parameters", "initial_state", "check"),
    guide="docs/plugins.md",
    parameters=PluginParameters,
    built_in={
        checker.nav2_plugin: checker for checker in (SimpleProgressChecker, PoseProgressChecker)
    },
)
"""The progress checkers by Nav2's plugin type."""
