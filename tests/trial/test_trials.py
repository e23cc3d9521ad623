"""Whole trials: a real Diagram is built and stepped to its end."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from stub_controller import StubPreset, straight_ahead

from drake_navbench import run_trial
from drake_navbench.analysis.metrics.efficiency import duration_s
from drake_navbench.analysis.reproduction.published import published_metrics
from drake_navbench.controller import Decision, NoValidControl
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.column_controller import make_controller
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.trial.trial_log import failed_log
from drake_navbench.typed_files.typed_yaml import validate

PUBLISHED_RPP = {
    "empty": {"path_length": 7.231, "time_taken": 14.512},
    "static_obstacles": {"path_length": 14.883, "time_taken": 30.107},
    "one_obstacle": {"path_length": 15.612, "time_taken": 31.553},
    "restricted_large": {"path_length": 3.458, "time_taken": 6.905},
}
# RPP keeps to the plan, so its smallest distance is that of the plan; m.
PUBLISHED_RPP_OBSTACLE_DISTANCE = {
    "static_obstacles": 0.636,
    "one_obstacle": 0.916,
    "restricted_small": 0.856,
    "restricted_large": 1.326,
}
REACHED_BY_RPP = ("empty", "static_obstacles", "one_obstacle")


@pytest.fixture(scope="module")
def rpp_logs() -> dict[str, TrialLog]:
    return {name: run_trial(name, "rpp", seed=1) for name in PUBLISHED_SCENARIOS}


@pytest.mark.parametrize("scenario", PUBLISHED_RPP)
def test_rpp_drives_within_three_percent_of_the_published_length_and_time(rpp_logs, scenario):
    metrics = published_metrics(rpp_logs[scenario])
    for name, published in PUBLISHED_RPP[scenario].items():
        assert metrics[name] == pytest.approx(published, rel=0.03)


@pytest.mark.parametrize("scenario", PUBLISHED_RPP_OBSTACLE_DISTANCE)
def test_rpp_passes_obstacles_within_5_cm_of_the_published_distance(rpp_logs, scenario):
    published = PUBLISHED_RPP_OBSTACLE_DISTANCE[scenario]
    distance = published_metrics(rpp_logs[scenario])["min_obstacle_distance"]
    assert distance == pytest.approx(published, abs=0.05)


@pytest.mark.parametrize("scenario", REACHED_BY_RPP)
def test_rpp_ends_inside_the_goal_tolerance(rpp_logs, scenario):
    log = rpp_logs[scenario]
    assert log.outcome is Outcome.SUCCEEDED
    last = log.samples.iloc[-1]
    goal = log.course[-1]
    # 0.25 m, seen through pose noise of 5 mm.
    assert np.hypot(last.x_m - goal[0], last.y_m - goal[1]) < 0.27
    assert abs(last.yaw_rad - goal[2]) < 0.27


@pytest.mark.parametrize("scenario", ["restricted_small", "restricted_large"])
def test_rpp_gives_up_before_a_wall_that_the_plan_goes_through(rpp_logs, scenario):
    log = rpp_logs[scenario]
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] == NoValidControl.code
    assert "collision" in log.info["reason"].lower()
    assert log.samples["clearance_m"].min() > 0.0


@pytest.mark.parametrize("size", ["small", "large"])
def test_a_noisy_restricted_scenario_differs_from_the_other_by_its_noise_alone(size):
    still, noisy = (load_scenario(f"restricted_{size}{ending}") for ending in ("", "_noisy"))
    exact = {"localization": {"xy_std_m": 0.0, "yaw_std_rad": 0.0}}
    assert still.robot_overrides == noisy.robot_overrides | exact
    told_apart = {"name", "description", "robot_overrides"}
    assert still.model_dump(exclude=told_apart) == noisy.model_dump(exclude=told_apart)


def test_the_plan_of_a_restricted_scenario_goes_straight_through_the_wall(rpp_logs):
    plan = rpp_logs["restricted_large"].course
    assert path_length(plan) == pytest.approx(8.8)
    np.testing.assert_allclose(plan[:, 1], 0.0, atol=1e-12)


def test_rpp_slows_down_in_the_sharp_bend_and_nowhere_before(rpp_logs):
    samples = rpp_logs["one_obstacle"].samples
    before_bend = samples[(samples.time_s > 1.0) & (samples.x_m < 5.5)]
    assert before_bend["command_v_mps"].min() == pytest.approx(0.5)
    assert samples[samples.x_m > 6.9]["command_v_mps"].min() < 0.45


def test_the_lidar_sees_the_wall_at_its_true_range(rpp_logs):
    log = rpp_logs["restricted_small"]
    scan = log.scans[0]
    ahead = scan.ranges_m[np.argmin(np.abs(scan.angles_rad))]
    assert ahead == pytest.approx(1.605, abs=1e-3)


def test_clearance_is_the_distance_from_the_footprint_to_the_wall(rpp_logs):
    log = rpp_logs["restricted_small"]
    first = log.samples.iloc[5]
    # The side walls are at 1.225 m, the flank of the chair at 0.30 m; the back wall is nearer:
    # 0.805 m behind the axle, the back of the chair at 0.25 m.
    assert first.clearance_m == pytest.approx(0.805 - 0.25, abs=0.01)


def test_cells_are_measured_to_their_centres_and_to_their_lower_left_corners(rpp_logs):
    log = rpp_logs["restricted_small"]
    # The back wall at -0.805 m lies in the cell from -0.85 to -0.8 m; at 0.22 s all is fresh.
    sample = log.samples.iloc[11]
    assert sample.obstacle_cell_distance_m == pytest.approx(0.825 + sample.x_m, abs=0.03)
    # The lower left corner of a cell behind is its far one.
    farther_m = sample.obstacle_corner_distance_m - sample.obstacle_cell_distance_m
    assert farther_m == pytest.approx(0.025, abs=1e-3)


def test_equal_seeds_give_equal_logs_but_for_compute_times(rpp_logs):
    again = run_trial("empty", "rpp", seed=1)
    first = rpp_logs["empty"]
    varying = list(UNREPEATABLE_COLUMNS)
    pd.testing.assert_frame_equal(
        again.samples.drop(columns=varying), first.samples.drop(columns=varying), check_exact=True
    )
    assert again.info == first.info


def test_another_seed_gives_another_trial(rpp_logs):
    other = run_trial("empty", "rpp", seed=2)
    assert not np.array_equal(
        other.samples["estimated_y_m"], rpp_logs["empty"].samples["estimated_y_m"]
    )


def test_a_log_read_back_is_the_log_that_was_written(rpp_logs, tmp_path: Path):
    log = rpp_logs["restricted_small"]
    path = tmp_path / "trial.parquet"
    log.write(path)
    again = TrialLog.read(path)
    pd.testing.assert_frame_equal(again.samples, log.samples, check_exact=True)
    (plan,) = log.plans
    assert [(p.time_s, p.leg) for p in again.plans] == [(0.0, 0)]
    np.testing.assert_array_equal(again.plans[0].poses, plan.poses)
    assert again.info == log.info
    assert len(again.scans) == len(log.scans)
    np.testing.assert_array_equal(again.scans[-1].ranges_m, log.scans[-1].ranges_m)


def simulate_stub(step, scenario: str | Scenario = "empty", **changes) -> TrialLog:
    """Runs a controller that is one function."""
    if isinstance(scenario, str):
        scenario = load_scenario(scenario)
    scenario = scenario.model_copy(update=changes)
    robot = load_robot("wheelchair", scenario.robot_overrides)
    return simulate(TrialSpec(scenario, robot, StubPreset(step), seed=0))


def test_a_controller_that_ignores_a_wall_collides():
    log = simulate_stub(straight_ahead, "restricted_small")
    assert log.outcome is Outcome.COLLIDED
    # The front is 0.85 m ahead of the axle, the wall at 1.605 m.
    assert log.samples.iloc[-1].x_m == pytest.approx(1.605 - 0.85, abs=2e-5)


def test_a_controller_that_stands_still_fails_to_make_progress_after_ten_seconds():
    log = simulate_stub(lambda o, m: Decision(np.zeros(2), m))
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] == 105
    assert log.end_time_s == pytest.approx(10.0, abs=0.2)


def test_a_trial_that_takes_too_long_is_timed_out():
    log = simulate_stub(lambda o, m: Decision(np.zeros(2), m), timeout_s=1.0)
    assert log.outcome is Outcome.TIMED_OUT
    assert log.end_time_s == pytest.approx(1.0)


def test_a_controller_that_breaks_ends_its_own_trial_with_the_traceback():
    def broken(observation, memory):
        raise ZeroDivisionError("one over nothing")

    log = simulate_stub(broken)
    assert log.outcome is Outcome.ERROR
    assert log.info["reason"] == "ZeroDivisionError: one over nothing"
    assert "broken" in log.info["traceback"]


def test_a_command_that_is_not_a_number_ends_the_trial():
    log = simulate_stub(lambda o, m: Decision(np.array([np.nan, 0.0]), m))
    assert log.outcome is Outcome.ERROR
    assert "expected two finite numbers" in log.info["reason"]


def test_diagnostics_that_no_log_can_hold_end_the_trial_and_the_rest_is_logged(tmp_path):
    def fails_at_third(observation, memory):
        left = {"seen": {1}} if memory == 2 else {"seen": 1}
        return Decision(np.zeros(2), memory + 1, left)

    log = simulate_stub(fails_at_third)
    assert log.outcome is Outcome.ERROR
    assert "got set" in log.info["reason"]
    log.write(tmp_path / "log.parquet")
    assert [left for _, left in log.diagnostics] == [{"seen": 1}] * 2


class UnfitPreset(StubPreset):
    """Stands for a preset whose plugin refuses to be built."""

    source = "unfit.yaml"

    def controller_class(self, parameters, setup):
        raise self._step


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError("speed: got 9"), "unfit.yaml: speed: got 9"),
        (ValueError("no such speed\nat all"), "unfit.yaml: ValueError: no such speed"),
        (KeyError("speed"), "unfit.yaml: KeyError: 'speed'"),
    ],
)
def test_a_controller_that_cannot_be_built_is_wrong_input_in_one_line(error, line):
    with pytest.raises(InputError) as caught:
        make_controller(UnfitPreset(error), load_robot("wheelchair"))
    assert str(caught.value) == line


def test_without_patience_the_first_cycle_without_control_aborts():
    def fails_at_third(observation, memory):
        if memory == 2:
            raise NoValidControl("no way", details={"rejected": 3})
        return straight_ahead(observation, memory)

    log = simulate_stub(fails_at_third)
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] == 106
    assert log.info["details"] == {"rejected": 3}
    assert log.samples["cycle_count"].max() == 3


def test_with_patience_the_server_waits_and_then_gives_up():
    def never(observation, memory):
        raise NoValidControl("no way")

    patient = {"navigation": {"controller_server": {"failure_tolerance": 0.3}}}
    log = simulate_stub(never, robot_overrides=patient)
    assert log.info["error_code"] == 104
    # More than 0.3 s after the start at 0.02 s: the seventh tick of 0.05 s.
    assert log.end_time_s == pytest.approx(0.02 + 0.35, abs=1e-6)
    assert (log.samples["command_v_mps"] == 0.0).all()


@pytest.mark.parametrize(("patience_s", "cycles"), [(0.0, 1), (-2.0, 1), (0.06, 3)])
def test_the_last_cycle_is_in_the_log_where_the_trial_ends_between_two_samples(patience_s, cycles):
    def never(observation, memory):
        raise NoValidControl("no way")

    # The smoother runs 5 ms after the cycle, and there the simulation stops.
    server = {"failure_tolerance": patience_s}
    overrides = {"navigation": {"controller_server": server, "velocity_smoother": {}}}
    log = simulate_stub(never, robot_overrides=overrides)
    assert log.samples.iloc[-1].cycle_count == cycles
    assert [left for _, left in log.diagnostics] == [{"failure": "no way"}] * cycles


def test_patience_ends_with_the_next_valid_command():
    def every_other(observation, memory):
        if round(observation.time_s / 0.05) % 2:
            raise NoValidControl("now and then")
        return straight_ahead(observation, memory)

    patient = {"navigation": {"controller_server": {"failure_tolerance": 0.3}}}
    log = simulate_stub(every_other, robot_overrides=patient)
    assert log.outcome is Outcome.SUCCEEDED


def test_a_goal_that_is_already_reached_ends_at_once_without_motion():
    log = simulate_stub(straight_ahead, goal=(0.1, 0.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.samples["v_mps"].abs().max() == 0.0


def test_a_goal_without_a_way_aborts_with_the_planners_code():
    ring = [
        {"type": "wall", "start": a, "end": b}
        for a, b in [
            ([3.0, -1.0], [5.0, -1.0]),
            ([5.0, -1.0], [5.0, 1.0]),
            ([5.0, 1.0], [3.0, 1.0]),
            ([3.0, 1.0], [3.0, -1.0]),
        ]
    ]
    data = {
        "name": "ring",
        "description": "goal inside a ring of walls",
        "world": {"obstacles": ring},
        "goal": [4.0, 0.0, 0.0],
    }
    log = simulate_stub(straight_ahead, validate(Scenario, data, "ring.yaml"))
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] in (206, 208)
    assert log.plans == ()
    assert duration_s(log) == 0.0


BESIDE_THE_START = {"type": "box", "min": [0.0, 0.35], "max": [0.5, 0.6]}
WALLED_START = {
    "name": "walled",
    "description": "a wall 5 cm beside the robot, which may start in it",
    "world": {"obstacles": [BESIDE_THE_START]},
    "goal": [4.0, 0.0, 0.0],
    "variation": {"start_xy_std_m": 0.2},
}


@pytest.mark.parametrize("mode", ["follow_path", "navigate_to_pose"])
def test_a_trial_that_starts_in_contact_has_collided_before_its_first_cycle(mode):
    scenario = validate(Scenario, WALLED_START | {"navigation_mode": mode}, "walled.yaml")
    # The outline reaches 0.3 m to the side.
    seed = next(s for s in range(100) if scenario.start_pose(s)[1] > 0.1)
    robot = load_robot("wheelchair")
    check_task(scenario, robot)
    log = simulate(TrialSpec(scenario, robot, StubPreset(straight_ahead), seed=seed))
    assert log.outcome is Outcome.COLLIDED
    assert log.info["reason"] == "the footprint touched an obstacle"
    assert log.end_time_s == duration_s(log) == 0.0
    assert log.samples["time_s"].tolist() == [0.0]
    assert log.samples["cycle_count"].tolist() == [0]


def test_a_trial_that_never_ran_has_no_duration():
    spec = TrialSpec(load_scenario("empty"), load_robot("wheelchair"), load_preset("rpp"), seed=0)
    log = failed_log(spec, "the worker died")
    assert log.outcome is Outcome.ERROR
    assert duration_s(log) == 0.0


@pytest.mark.parametrize(("release", "cost"), [("humble", 1e4), ("lyrical", 1e5)])
def test_a_log_tells_the_defaults_that_drove(release, cost):
    scenario = load_scenario("empty")
    preset = load_preset(f"mppi_nav2:nav2_release={release}")
    spec = TrialSpec(scenario, scenario.load_robot("wheelchair"), preset, seed=0)
    told = failed_log(spec, "the worker died").info["parameters"]
    assert told["ObstaclesCritic"]["collision_cost"] == cost


def test_every_controller_meets_the_same_noise():
    """Two that drive apart: the errors of what they are told, and the start, are equal."""
    scenario = load_scenario("one_obstacle").model_copy(update={"timeout_s": 4.0})
    robot = scenario.load_robot("wheelchair")
    noisy = robot.localization.model_copy(update={"xy_std_m": 0.01, "yaw_std_rad": 0.02})
    robot = robot.model_copy(update={"localization": noisy})
    presets = (StubPreset(straight_ahead), load_preset("rpp"), load_preset("dwb"))
    logs = [simulate(TrialSpec(scenario, robot, preset, seed=7)) for preset in presets]
    first = logs[0].samples
    assert len({log.samples["x_m"].iloc[-1] for log in logs}) == len(logs)
    for samples in (log.samples for log in logs[1:]):
        assert samples["x_m"].iloc[0] == first["x_m"].iloc[0]
        for name in ("x_m", "y_m", "yaw_rad"):
            error, other = (s[f"estimated_{name}"] - s[name] for s in (samples, first))
            assert error.iloc[1:].std() > 0.005
            np.testing.assert_allclose(error, other, rtol=0.0, atol=1e-12)


def test_a_viewer_changes_no_byte_of_the_log():
    spec = TrialSpec(
        load_scenario("static_obstacles").model_copy(update={"timeout_s": 2.0}),
        load_robot("wheelchair"),
        load_preset("rpp"),
        seed=3,
    )
    moments = []
    unseen, seen = simulate(spec), simulate(spec, Observers(moments.append))
    pd.testing.assert_frame_equal(
        *(log.samples.drop(columns=list(UNREPEATABLE_COLUMNS)) for log in (unseen, seen)),
        check_exact=True,
    )
    # It sees what the recorder samples; the last one is taken when all is over.
    assert [moment.time_s for moment in moments] == list(seen.samples["time_s"])[: len(moments)]
    assert len(moments) >= len(seen.samples) - 1
    assert moments[-1].plan.shape[1] == 3
    assert seen.info == unseen.info
    np.testing.assert_array_equal(seen.course, unseen.course)
    for one, other in zip(seen.scans, unseen.scans, strict=True):
        np.testing.assert_array_equal(one.ranges_m, other.ranges_m)
