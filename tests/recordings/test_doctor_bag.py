"""The doctor on a recording of the robot: its symptoms, its base, and what it lacks."""

from __future__ import annotations

import pytest
from robot_bags import turtlebot, without, write_ros2

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.bag import Heard, heard_in
from drake_navbench.studies.doctor.symptoms import Symptom

STATUS = "/navigate_to_pose/_action/status"


@pytest.fixture
def hear(make, tmp_path, robot_file):
    def of(*missing):
        bag = write_ros2(tmp_path / "drive", without(turtlebot(make), *missing))
        return heard_in(bag, str(robot_file), {})

    return of


def shown(heard):
    return {symptom for symptom, severity in heard.severity.items() if severity > 1.0}


def test_the_weightiest_symptom_of_a_recording_is_treated():
    severity = {Symptom.TOO_SLOW: 3.0, Symptom.SPINS: 1.2, Symptom.COLLISION: 0.0}
    assert Heard(severity, [], {}, ()).weightiest is Symptom.SPINS


def test_a_sound_drive_shows_no_symptom_and_its_base(hear):
    # It follows its commands at once.
    heard = hear()
    assert shown(heard) == set()
    assert heard.weightiest is None
    assert heard.overrides["drive"]["response_time_constant_s"] < 0.05
    assert heard.remarks[0].startswith("The base is fitted to drive: lag 0.0")


def test_a_recording_without_a_goal_shows_nothing_that_only_a_goal_could_tell(hear):
    # It rests for a second, drives for ten and rests again; nobody says where it should go.
    heard = hear(STATUS, "/plan")
    assert shown(heard) == set()
    assert Symptom.GOAL_NOT_REACHED in heard.severity


def test_without_commands_the_base_is_the_robots_and_that_is_told(hear):
    heard = hear("/cmd_vel")
    assert heard.overrides == {}
    assert heard.remarks == ("drive has no commands: the base's lag is the robot file's.",)


def test_a_cars_base_is_not_fitted(make, tmp_path):
    bag = write_ros2(tmp_path / "drive", turtlebot(make))
    heard = heard_in(bag, "ackermann_robot", {})
    assert heard.overrides == {}
    assert "does not fit a car's base" in heard.remarks[0]


def test_a_recording_without_odometry_is_one_line(hear):
    with pytest.raises(InputError, match=r"drive: no odometry on /odom .* --topics odom=TOPIC"):
        hear("/odom")
