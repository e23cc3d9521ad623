"""Trials of robots whose parts fail: what controllers are told, and what is refused."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.log import ODOMETRY_COLUMNS, Outcome, TrialLog
from drake_navbench.trial.trial import run_trial

SCENE = {
    "description": "Past a pillar",
    "world": {"obstacles": [{"type": "box", "min": [1.6, 0.6], "max": [2.0, 1.0]}]},
    "goal": (4.0, 0.0, 0.0),
    "timeout_s": 20.0,
    "name": "pillar",
}


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
