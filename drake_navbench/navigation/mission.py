"""A mission over several floors: Nav2's waypoint follower, with rides by lift between goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.poses import compose, inverse
from drake_navbench.navigation.lift_ride import Ride
from drake_navbench.navigation.task import Leg, TaskState, TaskStatus
from drake_navbench.navigation.waypoint_follower import (
    NANOSECOND_DIGITS,
    STOP_ON_MISSED_WAYPOINT,
    Pose,
    Progress,
    WaypointFollower,
    WaypointFollowerParameters,
)

# In the range of the waypoint follower's error codes, beyond those that Nav2 uses.
LIFT_FAILED = 690


@dataclass(frozen=True)
class FloorSwitch(Immutable):
    """The instant at which a robot is on another floor.

    number: number of the switch in the trial, from 1. floor: the new one's index. time_s: when.
    from_pose, to_pose: the lift's stops on the floor before and on the new one, in the world.
    error: m, m, rad, of the pose at which the robot is localized then.
    """

    number: int
    floor: int
    time_s: float
    from_pose: Pose
    to_pose: Pose
    error: Pose = (0.0, 0.0, 0.0)

    def carried(self, pose: Sequence[float] | Array) -> Array:
        """Returns (3,) the pose in the world to which a lift takes a robot at a pose (3,).

        The pose relative to the lift's stop stays: X_WR' = X_WT X_FW X_WR, with F the stop at which
        the lift leaves, and T that at which it arrives.
        """
        return compose(self.to_pose, compose(inverse(self.from_pose), pose))


@dataclass(frozen=True)
class RideLeg(Immutable):
    """The ride from the end of a leg at a lift's stop to another floor.

    lift: its name. floor: index of the floor of arrival. arrival: the lift's stop there, in the
    world.
    """

    lift: str
    floor: int
    arrival: Pose
    ride: Ride


@dataclass(frozen=True)
class MissionLeg(Immutable):
    """One leg of a mission.

    goal: x m, y m, yaw rad in the world. floor, floor_name: index and name of the goal's floor.
    then: the lift ride from the goal; None without one.
    """

    goal: Pose
    floor: int
    floor_name: str
    then: RideLeg | None = None


@dataclass(frozen=True)
class FloorLeg(Leg):
    """A leg on one floor, and the ride after it.

    lift: its name, '' without a ride. lift_events: (s, event). ride_end_s: the time at which the
    robot stood on the other floor or gave up.
    """

    floor: str = ""
    lift: str = ""
    lift_events: tuple[tuple[float, str], ...] = ()
    ride_end_s: float | None = None

    def as_plain(self) -> dict[str, Any]:
        """Returns the leg as JSON values, for the log."""
        own: dict[str, Any] = {"floor": self.floor}
        if self.lift:
            events = [{"time_s": time_s, "event": name} for time_s, name in self.lift_events]
            own |= {"lift": self.lift, "lift_events": events, "ride_end_s": self.ride_end_s}
        return super().as_plain() | own


@dataclass(frozen=True)
class MissionProgress(Progress):
    """The progress of a mission.

    switches: all changes of floor so far; the time of the last one may be yet to come.
    """

    switches: tuple[FloorSwitch, ...] = ()

    @property
    def switch(self) -> FloorSwitch | None:
        """The newest change of floor, None before the first."""
        return self.switches[-1] if self.switches else None


class MissionFollower(WaypointFollower):
    """Goes from goal to goal, and by lift from floor to floor.

    A leg to a lift that ends at its stop is followed by the ride: a pause that lasts as long, up to
    the navigator's next tick, one tick at least. The floor changes `lead_s` before that tick, which
    then finds the world of the new floor. The mission ends if a lift does not come or a leg does
    not reach its lift, even without stop_on_failure.

    tick_s: between two ticks of the navigator.
    """

    noun = "leg"

    def __init__(
        self,
        legs: tuple[MissionLeg, ...],
        parameters: WaypointFollowerParameters,
        *,
        tick_s: float,
        lead_s: float,
    ) -> None:
        super().__init__(tuple(leg.goal for leg in legs), parameters)
        self._legs = legs
        self._tick_s = tick_s
        self._lead_s = lead_s

    def first_progress(self) -> MissionProgress:
        """Returns the progress at the start."""
        return MissionProgress()

    def end_leg(
        self, progress: Progress, status: TaskStatus, time_s: float, recovery_count: int
    ) -> Progress:
        """Returns the progress after the present leg ended with `status`."""
        assert isinstance(progress, MissionProgress)
        own, index = self._legs[progress.index], progress.index
        if own.then is None or status.state is not TaskState.SUCCEEDED:
            ended = super().end_leg(progress, status, time_s, recovery_count)
            ended = replace(ended, legs=(*progress.legs, self._on_floor(ended.legs[-1], own)))
            if own.then is not None and ended.status.state is TaskState.RUNNING:
                # Nav2 would go on after a missed goal; but from here no way leads to the other
                # floor.
                failure = self._mission_failure(index, status.reason, STOP_ON_MISSED_WAYPOINT)
                return replace(ended, status=replace(failure, time_s=time_s))
            return ended
        return self._begin_ride(progress, own, own.then, status, time_s, recovery_count)

    def end_pause(self, progress: Progress, time_s: float) -> Progress:
        """Returns the progress, with the next leg where the pause or the ride is over."""
        assert isinstance(progress, MissionProgress)
        ride_leg = self._legs[progress.index].then
        is_over = super().end_pause(progress, time_s) is not progress
        if is_over and ride_leg is not None and ride_leg.ride.failure:
            reason = f"lift {ride_leg.lift} {ride_leg.ride.failure}"
            failure = self._mission_failure(progress.index, reason, LIFT_FAILED)
            return replace(progress, pause_end_s=None, status=replace(failure, time_s=time_s))
        return super().end_pause(progress, time_s)

    def _begin_ride(
        self,
        progress: MissionProgress,
        own: MissionLeg,
        then: RideLeg,
        status: TaskStatus,
        time_s: float,
        recovery_count: int,
    ) -> MissionProgress:
        ride = then.ride
        ticks = max(1, math.ceil(round(ride.duration_s / self._tick_s, NANOSECOND_DIGITS)))
        pause_end_s = round(time_s + ticks * self._tick_s, NANOSECOND_DIGITS)
        switch_s = round(pause_end_s - self._lead_s, NANOSECOND_DIGITS)
        events = tuple(
            (round(time_s + after_s, NANOSECOND_DIGITS), n) for after_s, n in ride.events
        )
        leg = FloorLeg(
            own.goal,
            status,
            progress.leg_start_s,
            time_s,
            recovery_count,
            own.floor_name,
            then.lift,
            events,
            pause_end_s,
        )
        switches = progress.switches
        if not ride.failure:
            number = len(switches) + 1
            poses = (own.goal, then.arrival, ride.error)
            switches = (*switches, FloorSwitch(number, then.floor, switch_s, *poses))
        return replace(
            progress, legs=(*progress.legs, leg), pause_end_s=pause_end_s, switches=switches
        )

    @staticmethod
    def _on_floor(leg: Leg, own: MissionLeg) -> FloorLeg:
        return FloorLeg(
            leg.goal,
            leg.status,
            leg.start_time_s,
            leg.end_time_s,
            leg.recovery_count,
            own.floor_name,
            own.then.lift if own.then else "",
        )

    def _mission_failure(self, index: int, reason: str, code: int) -> TaskStatus:
        where = f"{self.noun} {index + 1} of {len(self._legs)}"
        return TaskStatus(TaskState.ABORTED, code, f"{where}: {reason}")
