"""A trial among people: they react, are logged where they were, and the same seed is the same."""

import numpy as np
import pytest
from stub_controller import StubPreset

from drake_navbench.analysis.invariants import violations_of
from drake_navbench.analysis.metrics import social
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.moving import movers_of
from drake_navbench.analysis.replay import write_trial_replay
from drake_navbench.controller import Decision
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.log import Outcome, TrialLog
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

FRONT_M, BODY_M = 0.85, 0.3


def drive(v, *persons, seed=0, timeout_s=3.0, lidar=None, **people) -> TrialLog:
    """Runs a trial under one command among people."""
    data = {
        "name": "hall",
        "description": "somebody comes",
        "world": {"people": {"persons": list(persons)} | people},
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        "goal": [9.0, 0.0, 0.0],
        "timeout_s": timeout_s,
        "robot_overrides": {"lidar": lidar or {}},
    }
    scenario = validate(Scenario, data, "hall.yaml")
    step = StubPreset(lambda observation, memory: Decision(np.array([v, 0.0]), memory))
    robot = scenario.load_robot("wheelchair")
    return simulate(TrialSpec(scenario, robot, step, seed=seed))


def columns(log: TrialLog) -> np.ndarray:
    return log.samples.drop(columns=["compute_time_ms", "compute_cpu_time_ms"]).to_numpy()


COMES = {"start": [5.0, 0.1], "goals": [[-9.0, 0.1]], "yaw_rad": 3.1416, "name": "visitor"}
STANDS = {"start": [3.0, 0.0], "yaw_rad": 3.1416}


def test_somebody_who_comes_goes_round_a_chair_at_rest():
    log = drive(0.0, COMES, timeout_s=9.0)
    assert log.outcome is Outcome.TIMED_OUT
    assert log.people.poses[-1, 0, 0] < -1.0
    assert social.min_person_distance_m(log) > 0.05
    assert log.samples["clearance_m"].min() == pytest.approx(
        social.min_person_distance_m(log), abs=0.05
    )
    assert violations_of(log) == []


def test_the_log_says_where_everybody_was(tmp_path):
    log = drive(0.0, COMES | {"reaction": "impassive", "start": [5.0, 2.0], "goals": [[0.0, 2.0]]})
    log.write(tmp_path / "log.parquet")
    read = TrialLog.read(tmp_path / "log.parquet")
    np.testing.assert_allclose(np.diff(log.people.time_s), 0.1, atol=1e-9)
    # At 1 m/s after what the lag of 1/4 s costs.
    x = movers_of(read).poses_at(np.array([2.0]))[0, 0, 0]
    assert x == pytest.approx(5.0 - 2.0 + 0.25, abs=0.03)
    np.testing.assert_allclose(read.people.poses, log.people.poses, atol=1e-6)
    read.write(tmp_path / "again.parquet")
    assert (tmp_path / "log.parquet").read_bytes() == (tmp_path / "again.parquet").read_bytes()


def test_the_lidar_sees_legs_at_its_height_and_a_trunk_higher_up():
    nearest = {}
    for height_m in (0.2, 1.2):
        log = drive(0.0, STANDS, timeout_s=0.15, lidar={"height_m": height_m})
        nearest[height_m] = np.hypot(*(log.scans[0].hits - [3.0, 0.0]).T)
    # On the circle of a leg, 0.06 m about a point 0.11 m to the side; on that of the trunk.
    assert nearest[0.2].min() > 0.04
    assert nearest[0.2].max() < 0.171
    np.testing.assert_allclose(nearest[1.2], 0.18, atol=1e-6)


def test_the_robot_that_drives_at_somebody_who_stands_ran_into_a_person():
    held = STANDS | {"start": [1.6, 0.0], "reaction": "surprised"}
    log = drive(0.5, held)
    assert log.outcome is Outcome.COLLIDED
    assert log.info["contact"]["kind"] == "person"
    assert log.info["reason"] == "the footprint touched persons[0]"
    # It is the body that is touched, 0.3 m about the person's place.
    assert log.samples["x_m"].iloc[-1] + FRONT_M + BODY_M == pytest.approx(1.6, abs=1e-3)
    assert social.ran_into_person_count(log) == 1.0
    assert social.person_ran_into_robot_count(log) == 0.0
    assert social.min_person_distance_m(log) == 0.0
    assert violations_of(log) == []


def test_zones_and_compliance_are_shares_of_the_time():
    # Beside the chair, whose side is at 0.3 m: a gap of 1.0 m, then of 0.4 m, nobody moves.
    for y, personal, intimate in ((1.6, 1.0, 0.0), (1.0, 0.0, 1.0)):
        log = drive(0.0, {"start": [0.3, y], "reaction": "surprised", "yaw_rad": -1.57})
        assert social.personal_space_ratio(log) == pytest.approx(personal)
        assert social.intimate_space_ratio(log) == pytest.approx(intimate)
        assert social.personal_space_compliance_ratio(log) == pytest.approx(personal)
        assert social.min_person_distance_m(log) == pytest.approx(y - 0.6, abs=1e-3)
        with pytest.raises(Undefined, match="nobody who walked"):
            social.people_slowdown_ratio(log)


def test_equal_seeds_are_equal_trials_and_others_are_not():
    spread = {"start_xy_std_m": 0.2, "speed_std_mps": 0.1}
    first, again, other = (drive(0.5, COMES, seed=seed, **spread) for seed in (1, 1, 2))
    np.testing.assert_array_equal(columns(first), columns(again))
    np.testing.assert_array_equal(first.people.poses, again.people.poses)
    assert not np.array_equal(first.people.poses[0], other.people.poses[0])


def test_the_replay_shows_walking_figures(tmp_path):
    log = drive(0.0, COMES, timeout_s=1.0)
    write_trial_replay(log, tmp_path / "trial.html", model=None)
    assert ">people<" in (tmp_path / "trial.html").read_text(encoding="utf-8")
