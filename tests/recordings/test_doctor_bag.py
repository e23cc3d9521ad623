"""The doctor on a recording of the robot: its symptoms, its base, and what it lacks."""

from __future__ import annotations

import numpy as np
import pytest
from robot_bags import turtlebot, without, write_ros2

from drake_navbench.errors import InputError
from drake_navbench.ros2.recordings.drive_data import DriveData
from drake_navbench.ros2.recordings.drive_fit import fit_drive
from drake_navbench.studies.doctor.bag import BagReport, report_on
from drake_navbench.studies.doctor.symptoms import Symptom

STATUS = "/navigate_to_pose/_action/status"


@pytest.fixture
def report_of(make, tmp_path, robot_file):
    def of(*missing):
        bag = write_ros2(tmp_path / "drive", without(turtlebot(make), *missing))
        return report_on(bag, str(robot_file), {})

    return of


def shown(report):
    return {symptom for symptom, severity in report.severity.items() if severity > 1.0}


def test_the_weightiest_symptom_of_a_recording_is_treated():
    severity = {Symptom.TOO_SLOW: 3.0, Symptom.SPINS: 1.2, Symptom.COLLISION: 0.0}
    assert BagReport(severity, [], {}, ()).weightiest is Symptom.SPINS


def test_a_sound_drive_shows_no_symptom_and_its_base(report_of):
    # It follows its commands at once.
    report = report_of()
    assert shown(report) == set()
    assert report.weightiest is None
    assert report.overrides["drive"]["response_time_constant_s"] < 0.05
    assert report.remarks[0].startswith("The base is fitted to drive: lag 0.0")


def test_a_recording_without_a_goal_shows_nothing_that_only_a_goal_could_tell(report_of):
    # It rests for a second, drives for ten and rests again; nobody says where it should go.
    report = report_of(STATUS, "/plan")
    assert shown(report) == set()
    assert Symptom.GOAL_NOT_REACHED in report.severity
    assert report.remarks[0].startswith("drive has no goal: whether Nav2 or a person drove")


def test_without_commands_the_base_is_the_robots_and_that_is_told(report_of):
    report = report_of("/cmd_vel")
    assert report.overrides == {}
    assert report.remarks == ("drive has no commands: the base's lag is the robot file's.",)


def test_commands_that_do_not_explain_the_motion_give_no_base():
    # Commands of a square wave, and a motion that has nothing to do with them.
    time_s = 0.02 * np.arange(1500)
    commands = np.column_stack([0.3 * (time_s % 4.0 < 2.0), *np.zeros((2, 1500))])
    motion = np.column_stack([0.3 * np.sin(7.0 * time_s), *np.zeros((2, 1500))])
    fit = fit_drive(DriveData(time_s, motion, motion, time_s, commands))
    assert fit.linear.explained < 0.1
    # Motion that does what the commands say is explained, and rises at no rate that is a limit.
    fit = fit_drive(DriveData(time_s, commands, commands, time_s, commands))
    assert fit.linear.explained > 0.9
    assert fit.linear.acceleration is None


def test_a_cars_base_is_not_fitted(make, tmp_path):
    bag = write_ros2(tmp_path / "drive", turtlebot(make))
    report = report_on(bag, "ackermann_robot", {})
    assert report.overrides == {}
    assert "does not fit a car's base" in report.remarks[0]


def test_a_recording_without_odometry_is_one_line(report_of):
    with pytest.raises(InputError, match=r"drive: no odometry on /odom .* --topics odom=TOPIC"):
        report_of("/odom")
