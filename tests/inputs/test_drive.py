"""The base in a robot file: told apart by its type, and logs of differential ones as ever."""

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.drive import (
    LEAST_LAG_S,
    AckermannDrive,
    DifferentialDrive,
    OmnidirectionalDrive,
)
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.trial.timing import MAX_STEP_S


def test_the_shortest_lag_is_the_step_of_the_integration():
    assert LEAST_LAG_S == MAX_STEP_S


def test_a_robot_file_without_a_type_has_a_differential_base_and_its_log_does_not_name_it():
    drive = load_robot("wheelchair").drive
    assert isinstance(drive, DifferentialDrive)
    assert "type" not in drive.model_dump(mode="json")
    assert (drive.lateral_speed_mps, drive.turning_radius_m) == (0.0, 0.0)


def test_the_built_in_robots_have_their_bases():
    assert isinstance(load_robot("omni_robot").drive, OmnidirectionalDrive)
    car = load_robot("ackermann_robot").drive
    assert isinstance(car, AckermannDrive)
    assert car.max_angular_velocity_radps == pytest.approx(0.5 / 0.6)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ({"type": "ackerman"}, "unknown type 'ackerman'; did you mean 'ackermann'"),
        ({"type": "ackermann", "wheelbase_m": 0.5}, "min_turning_radius_m: missing"),
        (
            {"type": "ackermann", "wheelbase_m": 0.5, "min_turning_radius_m": 0.0},
            "min_turning_radius_m: .*greater than 0",
        ),
        ({"response_time_constant_s": 0.01}, "response_time_constant_s: .*0.02"),
        ({"max_lateral_velocity_mps": 0.3}, "max_lateral_velocity_mps: unknown field"),
    ],
)
def test_a_base_that_makes_no_sense_is_refused_in_one_line(drive, message, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(f"description: a robot\nrobot_radius: 0.2\ndrive: {drive}\n")
    with pytest.raises(InputError, match=message) as caught:
        load_robot(str(path))
    assert "\n" not in str(caught.value)


def test_a_scenario_takes_a_limit_away_only_from_bases_that_have_it():
    # It gives the drive no limit on either acceleration.
    scenario = load_scenario("restricted_small")
    assert scenario.load_robot("wheelchair").drive.max_angular_acceleration_radps2 is None
    car = scenario.load_robot("ackermann_robot").drive
    assert car.max_linear_acceleration_mps2 is None
    assert car.wheelbase_m == 0.45


def test_an_override_that_no_base_has_is_still_refused():
    with pytest.raises(InputError, match="unknown field"):
        load_robot("ackermann_robot", {"drive": {"wheel_base_m": 0.3}})
