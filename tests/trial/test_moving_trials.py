"""A trial in which things move: met at the instant of contact, logged with who met whom."""

import numpy as np
import pytest
from stub_controller import StubPreset

from drake_navbench.analysis.invariants import violations_of
from drake_navbench.analysis.metrics import moving as metrics
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.controller import Decision
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

# The chair's front is 0.85 m ahead of its reference point.
FRONT_M = 0.85


def drive(v, *waypoints, size=None, **fields) -> TrialLog:
    """Runs a trial under one command among one thing that moves along (time, x, y)."""
    points = [{"time_s": t, "position": [x, y]} for t, x, y in waypoints]
    shape = {"type": "cylinder", "radius_m": 0.3}
    if size is not None:
        shape = {"type": "box", "size_m": size}
    data = {
        "name": "meeting",
        "description": "something comes",
        "world": {"moving_obstacles": [shape | {"name": "trolley", "waypoints": points}]},
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        "goal": [9.0, 0.0, 0.0],
        "timeout_s": 4.0,
    }
    scenario = validate(Scenario, data | fields, "meeting.yaml")
    step = StubPreset(lambda observation, memory: Decision(np.array([v, 0.0]), memory))
    robot = scenario.load_robot("wheelchair")
    return simulate(TrialSpec(scenario, robot, step, seed=0))


def test_a_robot_at_rest_is_run_into_when_the_gap_is_closed():
    # From 3.15 m at 1 m/s, the gap is 2 m.
    log = drive(0.0, (0.0, FRONT_M + 0.3 + 2.0, 0.0), (4.0, FRONT_M + 0.3 - 2.0, 0.0))
    assert log.outcome is Outcome.COLLIDED
    assert log.info["reason"] == "the footprint touched trolley"
    assert log.end_time_s == pytest.approx(2.0, abs=1e-4)
    assert log.samples["clearance_m"].iloc[-1] == 0.0
    contact = log.info["contact"]
    assert contact["other_closing_mps"] == pytest.approx(1.0, abs=1e-3)
    assert contact["robot_closing_mps"] == pytest.approx(0.0, abs=1e-3)
    assert metrics.was_run_into_count(log) == 1.0
    assert metrics.ran_into_moving_count(log) == 0.0
    assert violations_of(log) == []


def test_a_robot_that_drives_into_something_slow_did_it():
    log = drive(0.5, (0.0, 1.7, 0.0), (4.0, 1.8, 0.0))
    assert log.outcome is Outcome.COLLIDED
    assert log.info["contact"]["robot_closing_mps"] > 0.4
    # It goes away from the robot.
    assert log.info["contact"]["other_closing_mps"] == pytest.approx(-0.025, abs=1e-3)
    assert metrics.ran_into_moving_count(log) == 1.0
    assert metrics.standing_collision_count(log) == 0.0
    assert metrics.min_moving_clearance_m(log) == 0.0


@pytest.mark.parametrize("phase", range(6))
def test_something_fast_and_thin_does_not_slip_through_between_two_looks(phase):
    start_s = 1.0 + phase * 0.007
    log = drive(
        0.0, (start_s, 0.3, -3.0), (start_s + 0.3, 0.3, 3.0), size=[0.02, 0.02], timeout_s=2.0
    )
    assert log.outcome is Outcome.COLLIDED
    # At 20 m/s, from 3 m to the chair's side at 0.3 m.
    assert log.end_time_s == pytest.approx(start_s + (2.7 - 0.01) / 20.0, abs=1e-4)


def test_what_passes_beside_is_no_contact_and_is_measured():
    # Past the chair's side, 0.5 m from it.
    log = drive(0.0, (0.0, 4.0, 1.1), (4.0, -4.0, 1.1))
    assert log.outcome is Outcome.TIMED_OUT
    assert metrics.min_moving_clearance_m(log) == pytest.approx(0.5, abs=1e-6)
    assert log.samples["clearance_m"].min() == pytest.approx(0.5, abs=1e-3)
    with pytest.raises(Undefined, match="no course met a moving obstacle"):
        metrics.moving_time_to_collision_min_s(log)
    assert violations_of(log) == []


def test_the_time_to_collision_is_that_of_both_courses():
    # It comes at 0.5 m/s until 1.15 m are left, at 1.6 s, and stops: 1.15 m / 0.5 m/s = 2.3 s.
    log = drive(0.0, (0.0, FRONT_M + 0.3 + 1.95, 0.0), (1.6, FRONT_M + 0.3 + 1.15, 0.0))
    # The last look at which it moved was 0.1 s, and so 0.05 m, before.
    assert metrics.moving_time_to_collision_min_s(log) == pytest.approx(2.4, abs=5e-3)


def test_a_world_that_stands_still_has_no_such_metrics():
    data = {
        "name": "empty",
        "description": "nothing",
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        "goal": [9.0, 0.0, 0.0],
        "timeout_s": 0.2,
    }
    scenario = validate(Scenario, data, "empty.yaml")
    step = StubPreset(lambda observation, memory: Decision(np.zeros(2), memory))
    log = simulate(TrialSpec(scenario, scenario.load_robot("wheelchair"), step, seed=0))
    assert "contact" not in log.info
    with pytest.raises(Undefined, match="nothing moved but the robot"):
        metrics.min_moving_clearance_m(log)


def test_the_log_tells_where_everything_was(tmp_path):
    log = drive(0.0, (0.0, 4.0, 2.0), (4.0, -4.0, 2.0))
    log.write(tmp_path / "log.parquet")
    movers = movers_of(TrialLog.read(tmp_path / "log.parquet"))
    assert movers.names == ["trolley"]
    np.testing.assert_allclose(movers.poses_at(np.array([1.0]))[0, 0], [2.0, 2.0, 0.0])
