"""A trial among people: they react, are logged where they were, and the same seed is the same."""

import numpy as np
import pyarrow as pa
import pytest
from stub_controller import StubPreset

from drake_navbench.analysis.figures import maps
from drake_navbench.analysis.figures.style import Look
from drake_navbench.analysis.invariants import violations_of
from drake_navbench.analysis.metrics import social
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.replay import write_trial_replay
from drake_navbench.controller import Decision
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.people import read_people
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


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_whom_the_draw_puts_on_the_robot_or_into_a_wall_begins_elsewhere(model):
    near = {"start": [-0.9, 0.0], "reaction": "oblivious"}
    gaps_m = []
    for seed in range(8):
        log = drive(0.0, near, seed=seed, timeout_s=0.1, start_xy_std_m=0.6, model=model)
        assert log.outcome is Outcome.TIMED_OUT
        gaps_m.append(social.min_person_distance_m(log))
    assert min(gaps_m) > 0.0


def test_people_by_orca_go_round_a_chair_at_rest_and_round_each_other():
    other = COMES | {"start": [-4.0, 0.1], "goals": [[9.0, 0.1]], "yaw_rad": 0.0}
    log = drive(0.0, COMES, other, timeout_s=9.0, model="orca")
    assert log.outcome is Outcome.TIMED_OUT
    assert log.people.poses[-1, 0, 0] < -1.0
    assert log.people.poses[-1, 1, 0] > 2.0
    assert violations_of(log) == []
    again = drive(0.0, COMES, other, timeout_s=9.0, model="orca")
    np.testing.assert_array_equal(log.people.poses, again.people.poses)


RECORDED = """\
time_s,person,x_m,y_m
0.0,aside,2.0,-3.0
4.0,aside,6.0,-3.0
1.0,comes,6.0,0.0
5.0,comes,2.0,0.0
"""
HALL = """\
description: a hall
world: {people: {recording: {file: crowd.csv, max_gap_s: 10}}}
plan: {type: polyline, points: [[0.0, 0.0], [9.0, 0.0]]}
goal: [9.0, 0.0, 0.0]
timeout_s: 6.0
"""


def among_recorded(folder, v, recording=RECORDED, seed=0) -> TrialLog:
    (folder / "crowd.csv").write_text(recording, encoding="utf-8")
    (folder / "hall.yaml").write_text(HALL, encoding="utf-8")
    step = StubPreset(lambda observation, memory: Decision(np.array([v, 0.0]), memory))
    scenario = load_scenario(str(folder / "hall.yaml"))
    robot = scenario.load_robot("wheelchair")
    return simulate(TrialSpec(scenario, robot, step, seed=seed))


def test_recorded_people_walk_as_they_did_whatever_the_robot_does(tmp_path):
    logs = [among_recorded(tmp_path, v, seed=seed) for v, seed in ((0.0, 0), (0.2, 1))]
    aside, comes = logs[0].people.poses.swapaxes(0, 1)
    time_s = logs[0].people.time_s
    there = (time_s >= 1.0) & (time_s < 5.0)
    np.testing.assert_allclose(comes[there, 0], 7.0 - time_s[there], atol=1e-4)
    assert np.isnan(comes[~there]).all()
    assert np.isnan(aside[time_s >= 4.0]).all()
    shared = min(len(log.people.time_s) for log in logs)
    np.testing.assert_array_equal(*(log.people.poses[:shared] for log in logs))
    assert logs[0].outcome is Outcome.TIMED_OUT
    assert all(violations_of(log) == [] for log in logs)
    # The last sample of it is at 4.9 s, 2.1 m away.
    nearest_m = social.min_person_distance_m(logs[0])
    assert nearest_m == pytest.approx(2.1 - FRONT_M - BODY_M, abs=1e-3)
    with pytest.raises(Undefined, match="nobody who walked"):
        social.people_slowdown_ratio(logs[0])


def test_a_recorded_person_is_met_at_the_instant_and_named(tmp_path):
    log = among_recorded(tmp_path, 0.5)
    assert log.outcome is Outcome.COLLIDED
    assert log.info["contact"]["name"] == "comes"
    assert log.info["contact"]["other_closing_mps"] == pytest.approx(1.0, abs=1e-3)
    gap_m = (7.0 - log.end_time_s) - 0.3 - (log.samples["x_m"].iloc[-1] + 0.85)
    assert gap_m == pytest.approx(0.0, abs=2e-4)


def test_who_appears_on_the_robot_has_met_it_then(tmp_path):
    appears = RECORDED + "2.5,ghost,0.2,0.0\n3.5,ghost,0.2,1.0\n"
    log = among_recorded(tmp_path, 0.0, appears)
    assert log.outcome is Outcome.COLLIDED
    assert log.info["contact"]["name"] == "ghost"
    assert log.end_time_s == pytest.approx(2.5, abs=0.05)


def test_a_log_of_recorded_people_is_read_as_it_was_written(tmp_path):
    log = among_recorded(tmp_path, 0.0)
    log.write(tmp_path / "log.parquet")
    read = TrialLog.read(tmp_path / "log.parquet")
    np.testing.assert_allclose(read.people.poses, log.people.poses, atol=1e-6)
    assert movers_of(read).names == ["aside", "comes"]
    assert movers_of(read).top_speed_mps == pytest.approx(1.0, abs=1e-3)
    for name in ("mean_closest_person_distance_m", "social_force_on_people_mps2"):
        assert getattr(social, name)(read) == pytest.approx(getattr(social, name)(log), abs=1e-4)


def test_the_replay_of_a_recording_hides_who_is_not_there(tmp_path):
    log = among_recorded(tmp_path, 0.0)
    write_trial_replay(log, tmp_path / "trial.html", model=None)
    assert ">people<" in (tmp_path / "trial.html").read_text(encoding="utf-8")
    figure = maps.paths_figure(maps.paths_map({"stub": [log]}), Look(["stub"]))
    ways = [line.get_xydata() for line in figure.axes[0].lines]
    assert np.nanmax(np.abs(np.vstack(ways))) < 100.0


def test_the_replay_shows_walking_figures(tmp_path):
    log = drive(0.0, COMES, timeout_s=1.0)
    write_trial_replay(log, tmp_path / "trial.html", model=None)
    assert ">people<" in (tmp_path / "trial.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("times_s", [[], [0.0, 0.02]])
def test_a_log_that_ends_before_its_first_look_at_people_has_none(times_s):
    people = pa.array([None] * len(times_s), pa.list_(pa.float32()))
    assert read_people(pa.table({"time_s": times_s, "people": people})) is None
