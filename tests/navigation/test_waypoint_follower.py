"""The order of waypoints, pauses and missed ones."""

import pytest

from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.navigation.waypoint_follower import (
    Progress,
    WaypointFollower,
    WaypointFollowerParameters,
)

GOALS = ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0))
REACHED = TaskStatus(TaskState.SUCCEEDED)
MISSED = TaskStatus(TaskState.ABORTED, 208, "no path")


def follower(goals=GOALS, **parameters) -> WaypointFollower:
    return WaypointFollower(goals, WaypointFollowerParameters(**parameters))


def follow(watch: WaypointFollower, *results: TaskStatus) -> Progress:
    """Returns the progress after legs of 10 s each."""
    progress = Progress()
    for number, result in enumerate(results, start=1):
        progress = watch.end_leg(progress, result, 10.0 * number, recovery_count=0)
    return progress


def test_the_task_succeeds_with_the_last_waypoint():
    watch = follower()
    assert follow(watch, REACHED, REACHED).status.state is TaskState.RUNNING
    done = follow(watch, REACHED, REACHED, REACHED)
    assert done.status.state is TaskState.SUCCEEDED
    assert [(leg.start_time_s, leg.end_time_s) for leg in done.legs] == [
        (0.0, 10.0),
        (10.0, 20.0),
        (20.0, 30.0),
    ]


def test_a_missed_waypoint_stops_the_task_with_nav2s_code():
    progress = follow(follower(), REACHED, MISSED)
    assert progress.status.state is TaskState.ABORTED
    assert progress.status.error_code == 603
    assert progress.status.reason == "waypoint 2 of 3: no path"


def test_without_stop_on_failure_a_missed_waypoint_is_noted_and_the_task_succeeds():
    progress = follow(follower(stop_on_failure=False), REACHED, MISSED, REACHED)
    assert progress.status.state is TaskState.SUCCEEDED
    assert progress.status.details == {"missed_waypoints": [2]}
    assert progress.legs[1].status.error_code == 208


def test_a_single_goal_fails_with_its_own_code():
    progress = follow(follower(GOALS[:1]), MISSED)
    assert (progress.status.state, progress.status.error_code) == (TaskState.ABORTED, 208)


def test_a_pause_in_milliseconds_follows_each_waypoint_that_is_reached():
    watch = follower(wait_at_waypoint={"waypoint_pause_duration": 1500})
    progress = follow(watch, REACHED)
    assert (progress.index, progress.pause_end_s) == (0, 11.5)
    assert watch.end_pause(progress, 11.49) is progress
    on_the_way = watch.end_pause(progress, 11.5)
    assert (on_the_way.index, on_the_way.pause_end_s) == (1, None)
    assert on_the_way.leg_start_s == 11.5


@pytest.mark.parametrize("wait", [{"waypoint_pause_duration": 0}, {"enabled": False}])
def test_without_a_pause_the_next_leg_begins_at_once(wait):
    progress = follow(follower(wait_at_waypoint=wait), REACHED)
    assert (progress.index, progress.pause_end_s) == (1, None)


def test_a_broken_controller_ends_the_task_even_without_stop_on_failure():
    broken = TaskStatus(TaskState.ERROR, 100, "ZeroDivisionError")
    progress = follow(follower(stop_on_failure=False), broken)
    assert progress.status.state is TaskState.ERROR
