"""How far a model is from a recording, and what is found of a drive: planted answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from robot_bags import drive as turtlebot_drive
from robot_bags import reached, turtlebot, without, write_ros2

from drake_navbench.commands.main import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.robot import Robot
from drake_navbench.ros2.recordings.drive_data import DriveData
from drake_navbench.ros2.recordings.drive_fit import as_yaml, fit_drive
from drake_navbench.ros2.recordings.simulation_gap import simulation_gap
from drake_navbench.trial.open_loop import drive_open_loop

DRIVE = DifferentialDrive(
    max_linear_velocity_mps=1.0,
    response_time_constant_s=0.1,
    max_linear_acceleration_mps2=None,
    max_angular_acceleration_radps2=None,
)
ROBOT = Robot(description="round", robot_radius=0.2, drive=DRIVE)
LENGTH_S = 30.0


def driven(robot: Robot, command_time_s, commands, *, length_s: float = LENGTH_S) -> DriveData:
    """Returns what a robot with this drive does, sampled at 50 Hz."""
    time_s = 0.02 * np.arange(round(length_s / 0.02) + 1)
    command_time_s, commands = np.array(command_time_s), np.array(commands, dtype=float)
    commands = np.column_stack([commands, np.zeros(len(commands))])
    states = drive_open_loop(robot, np.zeros(6), time_s, command_time_s, commands)
    return DriveData(time_s, states[:, :3], states[:, 3:], command_time_s, commands)


def steps(seed: int, length_s: float = LENGTH_S) -> tuple[np.ndarray, np.ndarray]:
    """Returns commands that change every second, at times between the samples."""
    generator = np.random.default_rng(seed)
    times = np.arange(0.013, length_s, 1.0)
    return times, generator.uniform([-0.3, -1.0], [0.6, 1.0], (len(times), 2))


def test_the_model_of_the_robot_itself_is_off_by_nothing():
    gap = simulation_gap(ROBOT, driven(ROBOT, *steps(1)))
    assert [pose.horizon_s for pose in gap.poses] == [1.0, 2.0, 5.0, 10.0]
    assert gap.v_rms_mps < 1e-9
    assert max(pose.position_p95_m for pose in gap.poses) < 1e-4


def test_a_robot_with_more_lag_is_off_by_the_way_that_it_lags_behind():
    # A step to 0.5 m/s: behind by v tau in the end, so the two differ by 0.5 (0.3 - 0.1) m.
    lagging = DRIVE.model_copy(update={"response_time_constant_s": 0.3})
    slow = ROBOT.model_copy(update={"drive": lagging})
    gap = simulation_gap(ROBOT, driven(slow, [0.0], [[0.5, 0.0]], length_s=5.05))
    by_horizon = {pose.horizon_s: pose for pose in gap.poses}
    assert by_horizon[5.0].position_median_m == pytest.approx(0.1, abs=1e-4)
    assert by_horizon[5.0].heading_median_deg == pytest.approx(0.0, abs=1e-9)
    assert 10.0 not in by_horizon
    # The integral of 0.25 (exp(-t/0.3) - exp(-t/0.1))^2 is 0.25 (0.15 + 0.05 - 2 * 0.075) m^2/s.
    expected = math.sqrt(0.25 * (0.15 + 0.05 - 0.15) / 5.05)
    assert gap.v_rms_mps == pytest.approx(expected, rel=0.03)


def test_a_robot_that_slips_in_turns_is_off_in_its_heading():
    data = driven(ROBOT, [0.0], [[0.0, 1.0]], length_s=2.05)
    slipping = DriveData(
        data.time_s, 0.9 * data.pose, 0.9 * data.twist, data.command_time_s, data.commands
    )
    (_, after_two) = simulation_gap(ROBOT, slipping).poses
    assert after_two.heading_median_deg == pytest.approx(math.degrees(0.1 * 1.9), rel=1e-3)


def plant(*, lag_s, dead_s, rates, deadbands, noise=0.004, length_s=60.0) -> DriveData:
    """Returns a recording of a drive with these parameters, simulated every millisecond."""
    generator = np.random.default_rng(4)
    time_s = 0.001 * np.arange(round(length_s / 0.001))
    command_time_s = np.arange(0.0, length_s, 0.05)
    # Every other command is a small one, on both sides of the deadband.
    sizes = np.where(np.arange(60)[:, None] % 2, [0.5, 1.2], 1.6 * np.array(deadbands))
    signs = generator.choice([-1.0, 1.0], (60, 2))
    chosen = sizes * signs * generator.uniform(0.3, 1.0, (60, 2))
    commands = np.repeat(chosen, -(-len(command_time_s) // 60), axis=0)[: len(command_time_s)]
    last = np.searchsorted(command_time_s, time_s - dead_s + 1e-9, side="right") - 1
    held = np.where(last[:, None] >= 0, commands[np.maximum(last, 0)], 0.0)
    held = np.where(np.abs(held) < deadbands, 0.0, held)
    velocity = np.zeros((len(time_s), 2))
    for k in range(1, len(time_s)):
        change = np.clip((held[k - 1] - velocity[k - 1]) / lag_s, -np.array(rates), rates)
        velocity[k] = velocity[k - 1] + 0.001 * change
    seen = velocity[::20] + noise * generator.standard_normal((len(velocity[::20]), 2))
    return DriveData(time_s[::20], np.zeros((len(seen), 3)), seen, command_time_s, commands)


def test_planted_parameters_of_a_drive_are_found_within_a_tenth():
    fit = fit_drive(plant(lag_s=0.18, dead_s=0.12, rates=(0.6, 1.5), deadbands=(0.06, 0.2)))
    found = {
        "lag": (fit.response_time_constant_s, 0.18),
        "dead time": (fit.dead_time_s, 0.12),
        "acceleration": (fit.linear.acceleration, 0.6),
        "angular acceleration": (fit.angular.acceleration, 1.5),
        "deadband": (fit.linear.deadband, 0.06),
        "angular deadband": (fit.angular.deadband, 0.2),
    }
    for name, (value, planted) in found.items():
        assert value == pytest.approx(planted, rel=0.1), name
    told = yaml.safe_load(as_yaml(fit, "lab"))["drive"]
    assert DifferentialDrive(**told).response_time_constant_s == pytest.approx(0.18, rel=0.1)


def test_what_a_recording_does_not_show_is_not_invented():
    gentle = plant(lag_s=0.3, dead_s=0.0, rates=(50.0, 50.0), deadbands=(0.0, 0.0), length_s=30.0)
    fit = fit_drive(gentle)
    assert fit.response_time_constant_s == pytest.approx(0.3, rel=0.1)
    assert (fit.linear.acceleration, fit.linear.deadband) == (None, None)
    text = as_yaml(fit, "lab")
    assert "max_linear_acceleration_mps2: no limit was reached" in text
    assert "no deadband seen" in text


def test_a_robot_that_was_never_commanded_cannot_be_fitted():
    data = driven(ROBOT, [0.0], [[0.0, 0.0]])
    with pytest.raises(InputError, match="reach 0 m/s and 0 rad/s"):
        fit_drive(data)


def test_the_page_tells_how_far_the_model_is_and_the_report_leads_there(
    make, robot_file, tmp_path, capsys
):
    bag = write_ros2(tmp_path / "lab", turtlebot(make))
    out = tmp_path / "out"
    command = ["import-bag", str(bag), "--robot", str(robot_file), "--out", str(out)]
    assert main([*command, "--no-report"]) == 0
    # The recorded robot has no lag: 0.2 m/s at once; the model is 0.2 x 0.1 m behind.
    assert "the model is off by 0.0" in capsys.readouterr().out
    page = (out / "simulation_gap.html").read_text()
    assert "recording, trial 0" in page
    assert "transforms, map to base_footprint" in page
    assert (out / "trials" / "lab" / "recording" / "trial_000_gap.svg").is_file()
    assert main(["report", str(out), "--jobs", "1", "--figures", "none"]) == 0
    assert '<a href="simulation_gap.html">' in (out / "report.html").read_text()


def test_without_commands_there_is_no_page_and_no_fit(make, robot_file, tmp_path, capsys):
    bag = write_ros2(
        tmp_path / "lab", without([*turtlebot_drive(make), *reached(make)], "/cmd_vel")
    )
    out = tmp_path / "out"
    command = ["import-bag", str(bag), "--robot", str(robot_file), "--out", str(out)]
    assert main([*command, "--no-report"]) == 0
    assert not (out / "simulation_gap.html").exists()
    command[-1] = str(tmp_path / "fitted")
    assert main([*command, "--no-report", "--fit-drive"]) == 2
    assert "the recording has no commands" in capsys.readouterr().err
    assert not (tmp_path / "fitted").exists()
