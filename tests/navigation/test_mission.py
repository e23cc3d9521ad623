"""A mission goes from leg to leg and changes floor when a ride is over, never before."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.navigation.lift_ride import Ride
from drake_navbench.navigation.mission import (
    LIFT_FAILED,
    FloorSwitch,
    MissionFollower,
    MissionLeg,
    RideLeg,
)
from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.navigation.waypoint_follower import WaypointFollowerParameters

REACHED = TaskStatus(TaskState.SUCCEEDED, reason="goal reached")
MISSED = TaskStatus(TaskState.ABORTED, 105, "failed to make progress")
TEN_SECONDS = Ride(((0.0, "requested"), (0.0, "came"), (10.0, "arrived")), 10.0)


def follower(ride: Ride = TEN_SECONDS, *, stop_on_failure: bool = True) -> MissionFollower:
    """Returns one with a leg to a lift at (4, 0), which goes to (24, 1), and a goal there."""
    then = RideLeg("main", 1, (24.0, 1.0, 0.0), ride)
    legs = (
        MissionLeg((4.0, 0.0, 0.0), 0, "ground", then),
        MissionLeg((26.0, 1.0, 0.0), 1, "upper"),
    )
    parameters = WaypointFollowerParameters(stop_on_failure=stop_on_failure)
    return MissionFollower(legs, parameters, tick_s=0.05, lead_s=0.004)


def test_the_floor_changes_just_before_the_first_tick_after_the_ride():
    mission = follower()
    progress = mission.end_leg(mission.first_progress(), REACHED, 7.03, 0)
    assert progress.switch is not None
    assert (progress.switch.floor, progress.switch.time_s) == (1, 17.026)
    assert mission.end_pause(progress, 16.98) is progress
    after = mission.end_pause(progress, 17.03)
    assert (after.index, after.leg_start_s) == (1, 17.03)


def test_a_ride_without_duration_takes_a_tick():
    mission = follower(Ride(((0.0, "requested"), (0.0, "came"), (0.0, "arrived")), 0.0))
    progress = mission.end_leg(mission.first_progress(), REACHED, 7.03, 0)
    assert progress.switch.time_s == pytest.approx(7.076)


def test_a_lift_that_fails_ends_the_mission_when_the_robot_gives_up():
    mission = follower(Ride(((0.0, "requested"), (3.0, "gave up")), 3.0, "was refused"))
    progress = mission.end_leg(mission.first_progress(), REACHED, 7.03, 0)
    assert progress.switch is None
    after = mission.end_pause(progress, 10.03)
    assert after.status.state is TaskState.ABORTED
    assert after.status.error_code == LIFT_FAILED
    assert after.status.reason == "leg 1 of 2: lift main was refused"


@pytest.mark.parametrize("stop_on_failure", [True, False])
def test_who_does_not_get_to_the_lift_does_not_get_upstairs(stop_on_failure):
    mission = follower(stop_on_failure=stop_on_failure)
    progress = mission.end_leg(mission.first_progress(), MISSED, 7.03, 0)
    assert progress.status.state is TaskState.ABORTED
    assert progress.switch is None


def test_the_legs_tell_floors_lifts_and_when_what_happened():
    mission = follower()
    progress = mission.end_leg(mission.first_progress(), REACHED, 7.0, 2)
    told = progress.legs[0].as_plain()
    assert (told["floor"], told["lift"], told["recovery_count"]) == ("ground", "main", 2)
    assert told["lift_events"][-1] == {"time_s": 17.0, "event": "arrived"}
    assert told["ride_end_s"] == 17.0


def test_a_lift_keeps_what_stands_in_it_where_it_stands():
    # It stops at (4, 0) heading along x, and then at (20, 5) heading along y.
    switch = FloorSwitch(1, 1, 0.0, (4.0, 0.0, 0.0), (20.0, 5.0, np.pi / 2))
    # 0.2 m behind and 0.1 m to the left of the stop, turned by 0.3 rad.
    np.testing.assert_allclose(switch.carried((3.8, 0.1, 0.3)), [19.9, 4.8, np.pi / 2 + 0.3])
