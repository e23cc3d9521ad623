"""Several goals one after another: Nav2's waypoint follower, as a pure function of its state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated

from pydantic import Field

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.task import Leg, TaskState, TaskStatus
from drake_navbench.typed_files.quantities import Count
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative

STOP_ON_MISSED_WAYPOINT = 603
MILLISECONDS_PER_SECOND = 1e3
NANOSECOND_DIGITS = 9

Pose = tuple[float, float, float]


class WaitAtWaypointParameters(FrozenModel):
    """Parameters of nav2_waypoint_follower::WaitAtWaypoint."""

    enabled: bool = Field(True, description="Wait at each waypoint.")
    waypoint_pause_duration: Annotated[Count, not_negative("as 0")] = Field(
        0, description="Duration of the wait at each waypoint [ms]."
    )


class WaypointFollowerParameters(FrozenModel):
    """Parameters of nav2_waypoint_follower."""

    stop_on_failure: bool = Field(True, description="Abort at the first waypoint that is missed.")
    wait_at_waypoint: WaitAtWaypointParameters = Field(default_factory=WaitAtWaypointParameters)

    @property
    def pause_s(self) -> float:
        """The pause at each waypoint, s."""
        wait = self.wait_at_waypoint
        pause_ms = max(0, wait.waypoint_pause_duration) if wait.enabled else 0
        return pause_ms / MILLISECONDS_PER_SECOND


@dataclass(frozen=True)
class Progress(Immutable):
    """The progress of the waypoint follower.

    index: index of the present waypoint. leg_start_s: when its leg began. pause_end_s: None while
    driving. legs: the legs that are over. status: status of the whole task.
    """

    index: int = 0
    leg_start_s: float = 0.0
    pause_end_s: float | None = None
    legs: tuple[Leg, ...] = ()
    status: TaskStatus = field(default_factory=lambda: TaskStatus(TaskState.RUNNING))


class WaypointFollower:
    """Goes to one waypoint after another and pauses at each that is reached.

    A waypoint that is missed ends the task (code 603) or, without stop_on_failure, is only noted;
    Nav2 then still reports success. A single waypoint is a plain NavigateToPose: its own error code
    is the task's.
    """

    noun = "waypoint"

    def __init__(self, waypoints: tuple[Pose, ...], parameters: WaypointFollowerParameters) -> None:
        self.waypoints = waypoints
        self._parameters = parameters

    def first_progress(self) -> Progress:
        """Returns the progress at the start."""
        return Progress()

    def end_leg(
        self, progress: Progress, status: TaskStatus, time_s: float, recovery_count: int
    ) -> Progress:
        """Returns the progress after the present leg ended with `status`."""
        leg = Leg(
            self.waypoints[progress.index], status, progress.leg_start_s, time_s, recovery_count
        )
        progress = replace(progress, legs=(*progress.legs, leg))
        if status.state is TaskState.SUCCEEDED:
            # The pause is a task of the waypoint follower; a plain goal has none.
            pause_s = self._parameters.pause_s if len(self.waypoints) > 1 else 0.0
            if pause_s > 0.0:
                pause_end_s = round(time_s + pause_s, NANOSECOND_DIGITS)
                return replace(progress, pause_end_s=pause_end_s)
        elif len(self.waypoints) == 1:
            return replace(progress, status=replace(status, time_s=time_s))
        elif self._parameters.stop_on_failure or status.state is TaskState.ERROR:
            return replace(progress, status=self._failure(progress, status, time_s))
        return self._next(progress, time_s)

    def end_pause(self, progress: Progress, time_s: float) -> Progress:
        """Returns the progress, with the next waypoint where the pause is over."""
        if progress.pause_end_s is None or round(time_s, NANOSECOND_DIGITS) < progress.pause_end_s:
            return progress
        return self._next(replace(progress, pause_end_s=None), time_s)

    def _next(self, progress: Progress, time_s: float) -> Progress:
        index = progress.index + 1
        if index < len(self.waypoints):
            return replace(progress, index=index, leg_start_s=time_s)
        missed = [
            number
            for number, leg in enumerate(progress.legs, start=1)
            if leg.status.state is not TaskState.SUCCEEDED
        ]
        reason = f"missed waypoints {missed}" if missed else "goal reached"
        details = {"missed_waypoints": missed} if missed else {}
        done = TaskStatus(TaskState.SUCCEEDED, reason=reason, details=details, time_s=time_s)
        return replace(progress, status=done)

    def _failure(self, progress: Progress, status: TaskStatus, time_s: float) -> TaskStatus:
        where = f"{self.noun} {progress.index + 1} of {len(self.waypoints)}"
        code = status.error_code if status.state is TaskState.ERROR else STOP_ON_MISSED_WAYPOINT
        return replace(status, error_code=code, reason=f"{where}: {status.reason}", time_s=time_s)
