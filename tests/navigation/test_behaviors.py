"""The behaviours' commands and ends, by hand-computed numbers; frequency 10 Hz throughout."""

import math

import numpy as np
import pytest

from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, Costmap
from drake_navbench.navigation.behavior import BehaviorServerParameters, DriveLimits, Surroundings
from drake_navbench.navigation.behaviors import BackUp, DriveOnHeading, Spin, Wait

PARAMETERS = BehaviorServerParameters()
# A robot of 1.0 m x 0.4 m about its reference point.
FOOTPRINT = np.array([[0.5, 0.2], [0.5, -0.2], [-0.5, -0.2], [-0.5, 0.2]])


def surroundings(*cells: tuple[float, float], cost: int = LETHAL) -> Surroundings:
    """Returns a map of 6 m x 6 m about the origin, free but for the cells at some points."""
    costs = np.zeros((120, 120), dtype=np.uint8)
    for x, y in cells:
        costs[int((y + 3.0) / 0.05), int((x + 3.0) / 0.05)] = cost
    return Surroundings(Costmap(costs, -3.0, -3.0, 0.05), FOOTPRINT)


def pose(x=0.0, y=0.0, yaw=0.0):
    return np.array([x, y, yaw])


def start_spin(target_yaw=1.57, time_allowance=10.0):
    spin = Spin(PARAMETERS)
    arguments = {"target_yaw": target_yaw, "time_allowance": time_allowance}
    return spin, spin.start(arguments, pose(), 0.0)


def test_spin_is_as_fast_as_allowed_until_it_must_brake():
    spin, state = start_spin()
    first = spin.step(state, pose(), 0.0, surroundings())
    assert first.command == (0.0, 1.0)
    # 0.05 rad are left: sqrt(2 * 3.2 * 0.05) = 0.566.
    near = spin.step(state, pose(yaw=1.52), 1.0, surroundings())
    assert near.command[1] == pytest.approx(math.sqrt(2 * 3.2 * 0.05))
    # 0.01 rad would give 0.253, less than the least.
    nearer = spin.step(state, pose(yaw=1.56), 1.0, surroundings())
    assert nearer.command[1] == pytest.approx(0.4)


def test_spin_to_the_right_is_negative():
    spin, state = start_spin(target_yaw=-1.57)
    assert spin.step(state, pose(), 0.0, surroundings()).command == (0.0, -1.0)


def test_spin_is_done_when_it_has_turned_far_enough():
    spin, state = start_spin()
    step = spin.step(state, pose(yaw=1.57), 1.0, surroundings())
    assert step.is_done
    assert step.command == (0.0, 0.0)


def test_spin_counts_on_over_the_wrap_of_the_yaw():
    spin = Spin(PARAMETERS)
    state = spin.start({"target_yaw": 1.0}, pose(yaw=3.0), 0.0)
    # From 3.0 to -3.0 it is 2 pi - 6 = 0.283 rad to the left.
    step = spin.step(state, pose(yaw=-3.0), 0.1, surroundings())
    assert step.state.turned == pytest.approx(2.0 * math.pi - 6.0)


def test_spin_runs_out_of_time_after_its_allowance_and_not_at_it():
    spin, state = start_spin(time_allowance=10.0)
    assert not spin.step(state, pose(yaw=0.1), 10.0, surroundings()).is_final
    late = spin.step(state, pose(yaw=0.1), 10.1, surroundings())
    assert late.error_code == Spin.TIMEOUT


def test_spin_without_an_allowance_has_all_the_time():
    spin, state = start_spin(time_allowance=0.0)
    assert not spin.step(state, pose(yaw=0.1), 1e4, surroundings()).is_final


# The front left corner, at 21.8 deg and 0.539 m, is turned to 21.8 + 11.5 deg by 0.2 rad.
BESIDE_THE_CORNER = (0.539 * math.cos(0.381 + 0.2), 0.539 * math.sin(0.381 + 0.2))


def test_spin_looks_no_farther_ahead_than_it_has_turned():
    blocked = surroundings(BESIDE_THE_CORNER)
    spin, state = start_spin()
    assert not spin.step(state, pose(), 0.0, blocked).is_final
    # After 0.15 rad it looks at 0.15 and at 0.25 rad only, after 0.05 rad at no turn beyond it.
    assert not spin.step(state, pose(yaw=0.05), 0.1, blocked).is_final
    step = spin.step(state._replace(turned=0.11, previous_yaw=0.11), pose(yaw=0.11), 0.1, blocked)
    assert step.error_code == Spin.COLLISION_AHEAD
    assert step.command == (0.0, 0.0)


def test_unknown_space_counts_as_an_obstacle():
    unknown = surroundings((0.5, 0.0), cost=NO_INFORMATION)
    assert not unknown.is_free(0.0, 0.0, 0.0)


def test_without_a_costmap_or_off_it_nothing_is_free():
    assert not Surroundings(None, FOOTPRINT).is_free(0.0, 0.0, 0.0)
    assert not surroundings().is_free(4.0, 0.0, 0.0)


def start_backup(distance=0.3, speed=0.15, time_allowance=10.0):
    backup = BackUp(PARAMETERS)
    arguments = {"target_x": distance, "speed": speed, "time_allowance": time_allowance}
    return backup, backup.start(arguments, pose(), 0.0)


def test_backup_goes_back_whatever_the_signs():
    for distance, speed in [(0.3, 0.15), (-0.3, 0.15), (0.3, -0.15), (-0.3, -0.15)]:
        backup, state = start_backup(distance, speed)
        assert backup.step(state, pose(), 0.0, surroundings()).command == (-0.15, 0.0)


def test_drive_speeds_up_by_its_acceleration_limit():
    drive = DriveOnHeading(PARAMETERS)
    state = drive.start({"target_x": 3.0, "speed": 0.6}, pose(), 0.0)
    speeds = []
    for _ in range(4):
        step = drive.step(state, pose(), 0.0, surroundings())
        state = step.state
        speeds.append(step.command[0])
    # 2.5 m/s^2 for 0.1 s: 0.25 m/s a cycle.
    assert speeds == pytest.approx([0.25, 0.5, 0.6, 0.6])


def test_drive_slows_down_before_its_end_to_its_least_speed():
    drive = DriveOnHeading(PARAMETERS)
    state = drive.start({"target_x": 1.0, "speed": 0.6}, pose(), 0.0)._replace(last_speed=0.6)
    # 0.02 m are left: sqrt(2 * 2.5 * 0.02) = 0.316 m/s, within reach of 0.6 - 0.25 = 0.35 only
    # as Nav2 puts the stop above the ramp.
    step = drive.step(state, pose(x=0.98), 0.0, surroundings())
    assert step.command[0] == pytest.approx(math.sqrt(2 * 2.5 * 0.02))
    step = drive.step(state, pose(x=0.9999), 0.0, surroundings())
    assert step.command[0] == pytest.approx(0.10)


@pytest.mark.parametrize("missing", ["acceleration_limit", "deceleration_limit"])
def test_drive_without_a_limit_is_as_fast_as_asked_from_its_start_to_its_end(missing):
    limits = DriveLimits(**{missing: None})
    drive = DriveOnHeading(BehaviorServerParameters(drive_on_heading=limits))
    state = drive.start({"target_x": 1.0, "speed": 0.6}, pose(), 0.0)
    for x in (0.0, 0.5, 0.9999):
        assert drive.step(state, pose(x=x), 0.0, surroundings()).command == (0.6, 0.0)


@pytest.mark.parametrize("limit", [None, 2.5])
@pytest.mark.parametrize(("least", "speed"), [(0.1, 0.1), (0.02, 0.05)])
def test_backup_is_never_slower_than_its_least_speed(limit, least, speed):
    """0.05 m/s is what the trees of Humble and Iron ask for."""
    limits = DriveLimits(acceleration_limit=limit, minimum_speed=least)
    backup = BackUp(BehaviorServerParameters(backup=limits))
    state = backup.start({"target_x": 0.3, "speed": 0.05}, pose(), 0.0)
    assert backup.step(state, pose(), 0.0, surroundings()).command == (-speed, 0.0)


@pytest.mark.parametrize(("limits", "speed"), [((0.0, -2.5), 0.1), ((2.5, 0.0), 0.1)])
def test_drive_with_a_limit_of_zero_creeps_as_in_nav2(limits, speed):
    acceleration, deceleration = limits
    drive = DriveOnHeading(
        BehaviorServerParameters(
            drive_on_heading=DriveLimits(
                acceleration_limit=acceleration, deceleration_limit=deceleration
            )
        )
    )
    state = drive.start({"target_x": 1.0, "speed": 0.6}, pose(), 0.0)
    assert drive.step(state, pose(), 0.0, surroundings()).command == (speed, 0.0)


def test_drive_with_signs_that_differ_is_refused():
    with pytest.raises(ValueError, match="differ in sign"):
        DriveOnHeading(PARAMETERS).start({"target_x": 1.0, "speed": -0.1}, pose(), 0.0)


def test_backup_is_done_after_its_distance_in_a_straight_line():
    backup, state = start_backup()
    assert not backup.step(state, pose(x=-0.29), 1.0, surroundings()).is_final
    assert backup.step(state, pose(x=-0.3), 1.0, surroundings()).is_done


def test_backup_stops_before_what_stands_in_its_way_and_ignores_what_lies_beyond():
    backup, state = start_backup()
    # The rear is at -0.5 m; on its way it comes to less than -0.8 m.
    behind = surroundings((-0.72, 0.0))
    assert backup.step(state, pose(), 0.0, behind).error_code == BackUp.COLLISION_AHEAD
    beyond = surroundings((-0.88, 0.0))
    assert not backup.step(state, pose(), 0.0, beyond).is_final


def test_backup_runs_out_of_time():
    backup, state = start_backup(time_allowance=3.0)
    assert backup.step(state, pose(x=-0.1), 3.1, surroundings()).error_code == BackUp.TIMEOUT


def test_wait_ends_after_its_time_whatever_its_sign_and_commands_nothing():
    wait = Wait(PARAMETERS)
    for time in (5.0, -5.0):
        state = wait.start({"time": time}, pose(), 1.02)
        step = wait.step(state, pose(), 6.01, surroundings())
        assert not step.is_final
        assert step.command is None
        assert wait.step(state, pose(), 6.02, surroundings()).is_done


def test_a_speed_of_zero_drives_backwards_as_in_nav2():
    drive = DriveOnHeading(PARAMETERS)
    state = drive.start({"target_x": -0.3, "speed": 0.0}, pose(), 0.0)
    assert drive.step(state, pose(), 0.0, surroundings()).command == (-0.1, 0.0)
