"""Trials of robots whose parts fail: what controllers are told, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.kernels.poses import compose
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import ODOMETRY_COLUMNS
from drake_navbench.logs.moment import Moment
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import run_trial, simulate

SCENE = {
    "description": "Past a pillar",
    "world": {"obstacles": [{"type": "box", "min": [1.6, 0.6], "max": [2.0, 1.0]}]},
    "goal": (4.0, 0.0, 0.0),
    "timeout_s": 20.0,
    "name": "pillar",
}


EXACT = {"xy_std_m": 0.0, "yaw_std_rad": 0.0}


def driven(controller="rpp", *, faults=(), seed=1, scene=(), **overrides):
    robot = load_robot("wheelchair", {"localization": {"xy_std_m": 0.0, "yaw_std_rad": 0.0}})
    robot = load_robot("wheelchair", overrides) if overrides else robot
    scenario = Scenario(**SCENE | dict(scene), faults=faults)
    return run_trial(scenario, controller, seed, robot=robot)


def without_times(log):
    return log.samples.drop(columns=["compute_time_ms", "compute_cpu_time_ms"])


def error_m(log):
    samples = log.samples
    return np.hypot(samples.estimated_x_m - samples.x_m, samples.estimated_y_m - samples.y_m)


@pytest.mark.long
@pytest.mark.parametrize("mode", ["follow_path", "navigate_to_pose"])
def test_a_frame_of_its_own_that_does_not_drift_changes_nothing(mode):
    scene = {"navigation_mode": mode}
    exact = driven(scene=scene, localization={"drift": 0.0})
    framed = driven(scene=scene, localization={"drift": 1e-12})
    assert framed.outcome == exact.outcome == Outcome.SUCCEEDED
    shared = [name for name in without_times(exact).columns]
    np.testing.assert_allclose(framed.samples[shared], exact.samples[shared], atol=1e-6)


def test_a_drifting_robot_believes_in_the_goal_and_stands_beside_it():
    log = driven(localization={"drift": 0.05, "xy_std_m": 0.0, "yaw_std_rad": 0.0})
    last = log.samples.iloc[-1]
    way = np.hypot(np.diff(log.samples.x_m), np.diff(log.samples.y_m)).sum()
    assert error_m(log).iloc[-1] == pytest.approx(0.05 * way, rel=0.05)
    believed = np.hypot(last.estimated_x_m - 4.0, last.estimated_y_m)
    assert believed < 0.25
    assert set(ODOMETRY_COLUMNS) <= set(log.samples.columns)


def test_an_odometry_that_believes_slipping_wheels_arrives_too_early():
    # Wheels that turn 4 m move the robot by 3.6 m.
    localization = EXACT | {"wheel_odometry": True}
    log = driven(localization=localization, actuators={"slip": 0.1})
    samples, last = log.samples, log.samples.iloc[-1]
    way = np.hypot(np.diff(samples.x_m), np.diff(samples.y_m)).sum()
    told = np.hypot(np.diff(samples.odometry_x_m), np.diff(samples.odometry_y_m)).sum()
    assert told == pytest.approx(way / 0.9, rel=2e-3)
    assert last.odometry_x_m > 3.7 > last.x_m
    # The speed that it tells is the one that was commanded.
    under_way = log.samples[log.samples.time_s.between(4.0, 5.0)]
    np.testing.assert_allclose(under_way.v_mps / 0.9, under_way.command_v_mps, rtol=0.02)


def test_an_odometry_that_believes_unequal_wheels_does_not_see_the_robot_turn():
    # A right wheel larger by 2%, 0.5 m from the left one: 0.04 rad to the left a metre, unseen.
    localization = EXACT | {"wheel_odometry": True}
    log = driven(localization=localization, actuators={"radius_difference": -0.02})
    samples, last = log.samples, log.samples.iloc[-1]
    way = np.hypot(np.diff(samples.x_m), np.diff(samples.y_m)).sum()
    assert last.yaw_rad - last.odometry_yaw_rad == pytest.approx(0.04 * way, rel=0.02)


def test_an_odometry_that_does_not_believe_wheels_is_right_whatever_they_do():
    log = driven(localization=EXACT | {"drift": 1e-12}, actuators={"slip": 0.1})
    assert log.samples.odometry_x_m.to_numpy() == pytest.approx(log.samples.x_m.to_numpy())


def test_a_costmap_in_the_odometrys_frame_shows_the_pillar_where_the_odometry_sees_it():
    log = driven(localization={"drift": 0.05, "xy_std_m": 0.0, "yaw_std_rad": 0.0})
    costmap = [c for c in log.costmaps if len(c.lethal_centres)][-1]
    row = log.samples[log.samples.time_s <= costmap.stamp_s].iloc[-1]
    # Translated only, for the heading does not drift: the odometry's pose less the true one.
    shift = np.array([row.odometry_x_m - row.x_m, row.odometry_y_m - row.y_m])
    assert np.hypot(*shift) > 0.05
    centres = costmap.lethal_centres - shift
    corners = np.clip(centres, [1.6, 0.6], [2.0, 1.0])
    assert np.median(np.hypot(*(centres - corners).T)) < 0.03


def test_a_log_with_its_own_columns_reads_back_as_it_was(tmp_path):
    log = driven(localization={"drift": 0.05})
    log.write(tmp_path / "a.parquet")
    back = TrialLog.read(tmp_path / "a.parquet")
    assert back.samples.equals(log.samples)


def test_every_controller_meets_the_same_drift():
    directions = []
    for controller in ("rpp", "dwb"):
        samples = driven(controller, localization={"drift": 0.05}).samples
        error = samples.odometry_x_m - samples.x_m, samples.odometry_y_m - samples.y_m
        row = samples.index[samples.x_m > 1.0][0]
        directions.append(np.arctan2(error[1][row], error[0][row]))
    assert directions[0] == pytest.approx(directions[1], abs=0.05)


def test_what_is_off_stands_in_no_log():
    text = str(driven().info)
    for name in ("drift", "fix_period_s", "jump_m", "faults"):
        assert f"'{name}'" not in text


@pytest.mark.parametrize(
    ("faults", "overrides", "told"),
    [
        ((), {"localization": {"drift": -0.1}}, "localization.drift: "),
        ((), {"localization": {"fix_period_s": 1.0, "fix_lag_s": 20.0}}, "fix_lag_s: got 20 s"),
        ((), {"localization": {"fix_lag_s": 1.0}}, "expected fix_period_s as well"),
        (({"at_s": 1.0},), {}, "expected fields of one of"),
        (({"at_s": 30.0, "lidar": {"range_std_m": 1.0}},), {}, "faults[0].at_s: got 30 s"),
        (({"at_s": 1.0, "lidar": {"beam_count": 9}},), {}, "beam_count: cannot change"),
        (({"at_s": 1.0, "lidar": {"range_sdt_m": 1.0}},), {}, "range_sdt_m: unknown field"),
    ],
)
def test_what_cannot_be_is_one_line(faults, overrides, told):
    with pytest.raises((InputError, ValueError)) as refused:
        driven(faults=faults, **overrides)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        ({"lidar": {"dropout_probability": 1.5}}, "lidar.dropout_probability: "),
        ({"timing": {"scan_latency_s": 25.0}}, "scan_latency_s: got 25 s"),
        ({"timing": {"command_latency_s": 15.0, "command_jitter_s": 10.0}}, "expected less than"),
        ({"timing": {"compute_time": "slow"}}, "timing.compute_time"),
        ({"timing": {"compute_time": -1.0}}, "expected measured, scaled or 0"),
        ({"actuators": {"slip": 2.0}}, "actuators.slip: "),
        ({"actuators": {"payload_kg": 10.0}, "mass_kg": None}, "need the robot's mass_kg"),
        (
            {
                "actuators": {"slope_rad": 0.1},
                "drive": {"max_linear_acceleration_mps2": None},
            },
            "force_n: missing",
        ),
    ],
)
def test_a_part_that_cannot_be_is_one_line(overrides, told):
    with pytest.raises(InputError) as refused:
        driven(**overrides)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_only_a_base_with_wheels_on_either_side_is_misled_by_them():
    robot = load_robot("omni_robot", {"localization": {"wheel_odometry": True}})
    with pytest.raises(InputError, match="wheel_odometry: expected a differential drive, got"):
        run_trial(Scenario(**SCENE), "dwb_omni", 1, robot=robot)


def test_a_late_command_comes_that_late():
    exact, late = (
        driven(localization=EXACT, timing={"command_latency_s": latency_s})
        for latency_s in (0.0, 0.3)
    )
    moves = [log.samples.time_s[log.samples.v_mps > 0.01].iloc[0] for log in (exact, late)]
    assert moves[1] - moves[0] == pytest.approx(0.3, abs=0.021)


def test_a_slow_cycle_misses_its_period_and_the_next_begins_after_it():
    # Cycles of 120 ms at 20 Hz: one every 0.125 s, on quarters of 0.05 s.
    log = driven(timing={"compute_time": 120.0})
    cycles = log.samples.drop_duplicates("cycle_count")
    cycles = cycles[cycles.cycle_count > 0]
    assert np.diff(cycles.time_s).mean() == pytest.approx(0.125, abs=0.001)
    first = log.samples.time_s[log.samples.command_v_mps > 0.0].iloc[0]
    assert first == pytest.approx(0.14, abs=0.021)


def test_a_given_compute_time_gives_the_same_trial_twice():
    logs = [driven(timing={"compute_time": 70.0}) for _ in range(2)]
    assert without_times(logs[0]).equals(without_times(logs[1]))


@pytest.mark.usefixtures("rehearsals")
def test_measured_compute_times_are_replayed_to_the_same_bytes(tmp_path):
    robot = load_robot(
        "wheelchair", {"timing": {"compute_time": "scaled", "compute_time_scale": 100.0}}
    )
    scenario = Scenario(**SCENE)
    first = run_trial(scenario, "rpp", 1, robot=robot)
    again = run_trial(scenario, "rpp", 1, robot=robot, compute_times_of=first)
    for name, log in {"first": first, "again": again}.items():
        log.write(tmp_path / name)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "again").read_bytes()
    # They matter: with cycles of 100 ms the trial takes longer than with such of 1 ms. Those that
    # were measured tell nothing here, as a busy machine's may be longer than either.
    given = load_robot("wheelchair", {"timing": {"compute_time": 1.0}})
    quick = run_trial(scenario, "rpp", 1, robot=given)
    slow = replace(quick, samples=quick.samples.assign(compute_time_ms=1.0))
    slowed = run_trial(scenario, "rpp", 1, robot=robot, compute_times_of=slow)
    assert slowed.end_time_s > quick.end_time_s + 0.05
    shorter = replace(first, samples=first.samples.iloc[:100])
    with pytest.raises(InputError, match="compute times"):
        run_trial(scenario, "rpp", 1, robot=robot, compute_times_of=shorter)


def test_a_fault_of_the_wheels_stops_the_robot_for_its_time():
    fault = {"at_s": 3.0, "duration_s": 2.0, "actuators": {"deadband_mps": 10.0}}
    samples = driven(faults=(fault,)).samples
    during = samples[(samples.time_s > 3.8) & (samples.time_s < 4.98)]
    assert during.v_mps.abs().max() < 0.01
    assert samples[samples.time_s > 6.0].v_mps.max() > 0.3


@pytest.mark.parametrize(
    "mode", [pytest.param("follow_path", marks=pytest.mark.long), "navigate_to_pose"]
)
def test_everything_at_once_is_a_function_of_the_seed(mode):
    everything = {
        "localization": {"drift": 0.03, "fix_period_s": 0.5, "fix_lag_s": 0.1},
        "lidar": {"dropout_probability": 0.1, "dropout_burst_beams": 5, "range_bias_m": 0.02},
        "actuators": {"slip": 0.1, "slip_std": 0.05, "payload_kg": 20.0},
        "timing": {"scan_latency_s": 0.1, "command_jitter_s": 0.1, "odometry_latency_s": 0.05},
    }
    logs = [driven(scene={"navigation_mode": mode}, **everything) for _ in range(2)]
    assert without_times(logs[0]).equals(without_times(logs[1]))
    assert logs[0].outcome == Outcome.SUCCEEDED


def test_the_everyday_world_is_the_clean_one_with_faults_and_not_of_the_default_ones():
    everyday, clean = (load_scenario(name) for name in ("everyday", "static_obstacles"))
    assert everyday.clean_scenario == clean.name
    assert everyday.plan == clean.plan
    for one, other in zip(everyday.world.obstacles, clean.world.obstacles, strict=True):
        assert (one.min, one.max) == (other.min, other.max)
    assert "everyday" not in PUBLISHED_SCENARIOS
    conditions = everyday.conditions(everyday.load_robot("wheelchair"))
    for part in ("lidar", "localization", "actuators", "timing"):
        assert len(getattr(conditions, part).settings) > 1


def test_an_unknown_clean_scenario_is_one_line(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("description: mine\ngoal: [1.0, 0.0, 0.0]\nclean_scenario: emtpy\n")
    with pytest.raises(InputError, match=r"clean_scenario: unknown scenario 'emtpy'.*empty"):
        load_scenario(str(file))


def test_who_watches_is_told_where_the_odometry_lies():
    robot = load_robot("wheelchair", {"localization": {"drift": 0.5, "yaw_drift": 0.5}})
    scenario = Scenario(**SCENE | {"timeout_s": 2.0})
    moments: list[Moment] = []
    spec = TrialSpec(scenario, robot, load_preset("rpp"), seed=3)
    log = simulate(spec, Observers(moments.append))
    told = [compose(moment.odometry_from_world, moment.state[:3]) for moment in moments]
    logged = log.samples[list(ODOMETRY_COLUMNS)].to_numpy()[: len(moments)]
    np.testing.assert_allclose(told, logged, atol=1e-9)
    assert (
        np.abs(logged - log.samples[["x_m", "y_m", "yaw_rad"]].to_numpy()[: len(moments)]).max()
        > 0.1
    )
