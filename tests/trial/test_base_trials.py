"""Whole trials of robots with other bases than the wheelchair's."""

import numpy as np
import pytest
from stub_controller import StubPreset, straight_ahead

from drake_navbench import run_trial
from drake_navbench.analysis.metrics.efficiency import mechanical_energy_j
from drake_navbench.controller import Decision
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import LATERAL_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

SMOOTHER = {
    "max_velocity": [0.5, 0.3, 2.0],
    "min_velocity": [-0.5, -0.3, -2.0],
    "max_accel": [2.5, 1.0, 3.2],
    "max_decel": [-2.5, -1.0, -3.2],
}


def drive(step, robot, *, timeout_s=2.0, obstacles=(), overrides=None) -> TrialLog:
    """Returns the log of a controller that is one function, told to go 3 m ahead."""
    task = {
        "name": "test",
        "description": "made by a test",
        "goal": [3.0, 0.0, 0.0],
        "timeout_s": timeout_s,
        "world": {"obstacles": list(obstacles)},
    }
    scenario = validate(Scenario, task, "test.yaml")
    return simulate(TrialSpec(scenario, load_robot(robot, overrides), StubPreset(step), seed=0))


def to_the_left(observation, memory):
    return Decision(np.array([0.1, 0.0, 0.4]), observation.vy_mps)


def test_the_log_of_an_omnidirectional_robot_has_its_sideways_velocity(tmp_path):
    log = drive(to_the_left, "omni_robot")
    log.write(tmp_path / "trial.parquet")
    samples = TrialLog.read(tmp_path / "trial.parquet").samples
    assert set(LATERAL_COLUMNS) <= set(samples.columns)
    last = samples.iloc[-1]
    assert last.command_vy_mps == 0.4
    assert last.vy_mps == pytest.approx(0.4, abs=1e-3)
    # The controller starts after 0.02 s; the response costs 0.04 m, the ramp of 3 m/s^2 no more.
    assert last.y_m == pytest.approx(0.4 * (2.0 - 0.02) - 0.045, abs=0.01)
    assert last.y_m == pytest.approx(4.0 * last.x_m, rel=0.03)
    assert mechanical_energy_j(log) > 0.0


def test_the_log_of_a_wheelchair_has_none():
    log = drive(straight_ahead, "wheelchair", timeout_s=0.5)
    assert not set(LATERAL_COLUMNS) & set(log.samples.columns)


def test_a_sideways_command_for_a_base_that_cannot_is_an_error_of_the_controller():
    log = drive(to_the_left, "wheelchair")
    assert log.outcome is Outcome.ERROR
    assert "commanded vy = 0.4 m/s" in log.info["reason"]


def test_a_controller_may_leave_the_sideways_velocity_out():
    log = drive(straight_ahead, "omni_robot", timeout_s=0.5)
    assert (log.samples["command_vy_mps"] == 0.0).all()
    assert log.samples["command_v_mps"].iloc[-1] == 0.5


def test_sideways_velocities_pass_the_smoother_and_the_monitor_and_come_back_to_the_controller():
    seen = []

    def remember(observation, memory):
        seen.append(observation.vy_mps)
        return Decision(np.array([0.0, 0.0, 1.0]), None)

    # The zone begins 0.3 m to the left of the outline.
    zone = {"type": "polygon", "action_type": "stop", "min_points": 1}
    zone["points"] = [[0.3, 0.5], [0.3, 0.0], [-0.3, 0.0], [-0.3, 0.5]]
    navigation = {"velocity_smoother": SMOOTHER, "collision_monitor": {"polygons": {"zone": zone}}}
    wall = {"type": "box", "min": [-1.0, 1.0], "max": [1.0, 1.2]}
    log = drive(
        remember,
        "omni_robot",
        timeout_s=4.0,
        obstacles=[wall],
        overrides={"navigation": navigation},
    )
    commands = log.samples["command_vy_mps"]
    # 1 m/s^2 at 20 Hz: 0.05 m/s more each time, up to 0.3 m/s, until the wall is in the zone.
    assert set(np.round(commands, 12)) == {0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3}
    assert commands.iloc[-1] == 0.0
    assert max(seen) == pytest.approx(0.3, abs=1e-3)
    assert log.samples["y_m"].iloc[-1] == pytest.approx(0.5, abs=0.06)


def test_an_omnidirectional_robot_touches_a_wall_with_its_side():
    wall = {"type": "box", "min": [-1.0, 0.6], "max": [1.0, 0.8], "known_to_planner": False}
    log = drive(to_the_left, "omni_robot", obstacles=[wall])
    assert log.outcome is Outcome.COLLIDED
    # Half the width is 0.2 m.
    last = log.samples.iloc[-1]
    assert last.y_m == pytest.approx(0.4, abs=2e-5)
    assert last.vy_mps > 0.3


def test_a_car_that_collides_is_put_back_to_the_contact():
    def turning(observation, memory):
        return Decision(np.array([0.5, 0.4]), None)

    wall = {"type": "box", "min": [-1.0, 0.9], "max": [3.0, 1.1], "known_to_planner": False}
    log = drive(turning, "ackermann_robot", obstacles=[wall], timeout_s=5.0)
    assert log.outcome is Outcome.COLLIDED
    last, before = log.samples.iloc[-1], log.samples.iloc[-2]
    assert last.clearance_m == 0.0
    assert last.w_radps == pytest.approx(before.w_radps, abs=1e-3)
    # The curvature is the commanded 0.8 1/m.
    assert last.w_radps / last.v_mps == pytest.approx(0.8, rel=0.01)


@pytest.mark.parametrize(
    ("robot", "preset"),
    [("omni_robot", "rpp"), ("omni_robot", "dwb_omni"),
     ("ackermann_robot", "mppi_nav2_ackermann")],
)  # fmt: skip
def test_a_robot_gets_through_a_door_with_a_controller_for_its_base(robot, preset):
    log = run_trial("doorway", preset, robot=robot)
    assert log.outcome is Outcome.SUCCEEDED
    if robot == "ackermann_robot":
        sharpest = 1.0 / 0.6
        assert (log.samples.w_radps.abs() <= sharpest * log.samples.v_mps.abs() + 1e-9).all()


# Controllers that are made for a base, or leave it its choice.
OF_BASES = [
    ("omni_robot", "mppi_nav2_omni"),
    ("omni_robot", "dwb_omni"),
    ("ackermann_robot", "mppi_nav2_ackermann"),
    ("ackermann_robot", "vector_pursuit"),
]


@pytest.mark.long
@pytest.mark.parametrize(("robot", "controller"), OF_BASES)
def test_each_base_drives_in_the_published_scenarios(robot, controller):
    outcomes = {
        scenario: run_trial(scenario, controller, seed=0, robot=robot).outcome
        for scenario in PUBLISHED_SCENARIOS
    }
    # Two of them have no way out: there it gives up, and touches nothing.
    assert outcomes == {
        "empty": Outcome.SUCCEEDED,
        "static_obstacles": Outcome.SUCCEEDED,
        "one_obstacle": Outcome.SUCCEEDED,
        "restricted_small": Outcome.ABORTED,
        "restricted_large": Outcome.ABORTED,
    }
