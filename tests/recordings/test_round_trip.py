"""A trial, exported as a bag and imported again, is the same trial."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from recorded_trials import short_trial

from drake_navbench.analysis.metrics.registry import measure_all
from drake_navbench.commands.main import main
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.scenario_plan import PolylinePlan
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import LATERAL_COLUMNS
from drake_navbench.logs.plans import Plan
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.trial.trial import run_trial

pytestmark = pytest.mark.usefixtures("without_curves")

PRECISION = 1e-9
# The beams' angles are sent as float32.
OF_SCANS = {"min_scan_clearance_m"}


def round_trip(folder: Path, log: TrialLog) -> TrialLog:
    log.write(folder / "trial.parquet")
    assert main(["export", str(folder / "trial.parquet"), "--mcap"]) == 0
    out = str(folder / "results")
    assert main(["import-bag", str(folder / "trial"), "--out", out, "--no-report"]) == 0
    info = log.info
    column = f"{info['controller']}-recording"
    path = ResultsFolder(folder / "results").log_path(info["scenario"]["name"], column, 0)
    return TrialLog.read(path)


# RPP reaches a goal round a bend, between the first obstacles; DWB gives up before a wall.
NEAR = load_scenario("static_obstacles").model_copy(
    update={
        "plan": PolylinePlan(type="polyline", points=[(0.0, 0.0), (1.0, 0.0), (1.8, 0.4)]),
        "goal": (1.8, 0.4, 0.4636),
    }
)


@pytest.mark.parametrize(
    ("scenario", "controller"),
    [(NEAR, "rpp"), pytest.param("restricted_small", "dwb", marks=pytest.mark.long)],
    ids=["to a goal", "before a wall"],
)
def test_metrics_of_a_trial_come_back_from_its_bag(scenario, controller, tmp_path):
    log = run_trial(scenario, controller, seed=5)
    back = round_trip(tmp_path, log)
    before, after = measure_all(log), measure_all(back)
    for name, measured in before.items():
        tolerance = 1e-5 if name in OF_SCANS else PRECISION
        assert after[name].value == pytest.approx(
            measured.value, rel=tolerance, abs=tolerance, nan_ok=True
        ), name
        assert after[name].reason == measured.reason
    assert sum(math.isfinite(value.value) for value in before.values()) > 40
    assert back.missing == {}
    assert (back.outcome, back.info["reason"]) == (log.outcome, log.info["reason"])
    for name in ("robot", "obstacles", "seed", "start_time_s"):
        assert back.info[name] == log.info[name]
    for name in log.samples:
        ours, theirs = log.samples[name].to_numpy(float), back.samples[name].to_numpy(float)
        np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-12, err_msg=name)
    assert [scan.time_s for scan in back.scans] == pytest.approx(
        [scan.time_s for scan in log.scans], abs=PRECISION
    )
    assert len(back.costmaps) == len(log.costmaps)
    for ours, theirs in zip(log.costmaps, back.costmaps, strict=True):
        np.testing.assert_allclose(theirs.lethal_centres, ours.lethal_centres, atol=1e-9)


def test_a_robot_that_moves_sideways_comes_back_with_its_sideways_velocities(tmp_path):
    scenario = load_scenario("restricted_small").model_copy(update={"timeout_s": 1.0})
    log = run_trial(scenario, "dwb_omni", robot="omni_robot", seed=2)
    assert set(LATERAL_COLUMNS) <= set(log.samples.columns)
    # To the side it is pushed by nobody here; a number of its own tells the columns apart.
    samples = log.samples.assign(vy_mps=0.1, measured_vy_mps=0.2, command_vy_mps=0.3)
    back = round_trip(tmp_path, dataclasses.replace(log, samples=samples))
    assert set(LATERAL_COLUMNS) <= set(back.samples.columns)
    for name, value in (("vy_mps", 0.1), ("measured_vy_mps", 0.2), ("command_vy_mps", 0.3)):
        assert set(back.samples[name]) == {value}


def test_legs_and_what_the_navigator_did_come_back(tmp_path):
    log = short_trial()
    first = log.plans[0]
    legs = (first, Plan(0.2, first.poses + 0.5, 1), Plan(0.4, first.poses + 0.6, 1))
    events = ((0.1, {"node": "FollowPath", "status": "running"}),)
    back = round_trip(tmp_path, dataclasses.replace(log, plans=legs, events=events))
    assert [(plan.time_s, plan.leg) for plan in back.plans] == [(0.0, 0), (0.2, 1), (0.4, 1)]
    np.testing.assert_allclose(back.plans[2].poses, legs[2].poses, atol=1e-4)
    assert back.events == events


def test_a_folder_is_exported_trial_by_trial_and_imported_beside_the_trials(tmp_path):
    folder = ResultsFolder(tmp_path / "results")
    for trial in range(2):
        info = dict(short_trial().info) | {"trial": trial}
        folder.write_log(dataclasses.replace(short_trial(), info=info))
    folder.write_manifest({"scenarios": ["restricted_small"], "controllers": ["rpp"]})
    assert main(["export", str(folder.path), "--mcap", "--csv", "--jobs", "2"]) == 0
    bags = folder.path / "export" / "restricted_small" / "rpp"
    assert sorted(path.name for path in bags.iterdir()) == [
        "trial_000",
        "trial_000.csv",
        "trial_001",
        "trial_001.csv",
    ]
    assert (folder.path / "export" / "foxglove_layout.json").is_file()
    paths = [str(bags / f"trial_{trial:03d}") for trial in range(2)]
    assert main(["import-bag", *paths, "--out", str(folder.path), "--no-report"]) == 0
    column = folder.path / "trials" / "restricted_small" / "rpp-recording"
    assert sorted(path.name for path in column.glob("*.parquet")) == [
        "trial_000.parquet",
        "trial_001.parquet",
    ]


def test_a_local_costmap_in_a_drifting_odometry_comes_back_around_the_robot(tmp_path):
    robot = load_robot("wheelchair", {"localization": {"drift": 2.0, "y_bias_m": 0.2}})
    log = run_trial("restricted_small", "rpp", seed=3, robot=robot)
    back = round_trip(tmp_path, log)
    compared = 0
    for costmap in back.costmaps:
        row = (back.samples["time_s"] - costmap.stamp_s).abs().argmin() + 2
        seen_m = back.samples["obstacle_cell_distance_m"].iloc[min(row, len(back.samples) - 1)]
        rows, columns = np.nonzero(costmap.costs == LETHAL)
        if not len(rows) or not math.isfinite(seen_m):
            continue
        x = costmap.origin_x + (columns + 0.5) * costmap.resolution
        y = costmap.origin_y + (rows + 0.5) * costmap.resolution
        sample = back.samples.iloc[row - 2]
        nearest_m = np.hypot(x - sample.x_m, y - sample.y_m).min()
        assert nearest_m == pytest.approx(seen_m, abs=0.08)
        compared += 1
    assert compared > 0
