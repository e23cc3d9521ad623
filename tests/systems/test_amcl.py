"""AMCL in whole trials: what it finds, and what it is told."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench import run_trial
from drake_navbench.errors import InputError
from drake_navbench.inputs.amcl import AmclSettings
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.particle_filter import hit_points, weigh
from drake_navbench.kernels.poses import carrier_pose
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.trial.planning import known_map
from drake_navbench.trial.systems.amcl import likelihood_field

ROOM = {
    "name": "room",
    "description": "A room with a pillar",
    "world": {
        "obstacles": [
            {"type": "box", "min": [-2.2, -2.2], "max": [6.2, -2.0]},
            {"type": "box", "min": [-2.2, 3.0], "max": [6.2, 3.2]},
            {"type": "box", "min": [-2.2, -2.0], "max": [-2.0, 3.0]},
            {"type": "box", "min": [6.0, -2.0], "max": [6.2, 3.0]},
            {"type": "box", "min": [2.0, 1.2], "max": [2.8, 1.8]},
        ]
    },
    "goal": [4.0, 0.0, 0.0],
    "timeout_s": 30.0,
}
DRIFTING = {"drift": 0.05, "random_drift": 0.02, "random_yaw_drift": 0.02}


def driven(seed: int = 0, scenario=ROOM, **localization) -> TrialLog:
    robot = load_robot("wheelchair", {"localization": {"amcl": {}, **DRIFTING, **localization}})
    return run_trial(Scenario(**scenario), "rpp", seed, robot=robot)


def errors_m(log: TrialLog) -> np.ndarray:
    samples = log.samples
    return np.hypot(samples.estimated_x_m - samples.x_m, samples.estimated_y_m - samples.y_m)


def test_it_holds_the_robot_on_the_map_where_the_odometry_does_not():
    log = driven(drift=0.1)
    assert log.outcome is Outcome.SUCCEEDED
    samples = log.samples
    drifted = np.hypot(samples.odometry_x_m - samples.x_m, samples.odometry_y_m - samples.y_m)
    assert drifted.iloc[-1] > 0.3
    assert errors_m(log).max() < 0.25


def best_fits(log: TrialLog, every: int) -> list[np.ndarray]:
    """Returns for every n-th scan the pose on a grid about the truth that fits it best."""
    robot = load_robot("wheelchair")
    grid = known_map(Scenario(**ROOM), robot)
    field, off_map = likelihood_field(AmclSettings(), grid, robot.lidar.range_max_m)
    offsets = np.arange(-0.3, 0.31, 0.05)
    turns = np.radians(np.arange(-6.0, 6.1, 2.0))
    around = np.array([(x, y, yaw) for x in offsets for y in offsets for yaw in turns])
    found = []
    for scan in log.scans[::every]:
        points = hit_points(
            scan.ranges_m,
            scan.angles_rad,
            np.array(robot.lidar.pose),
            max_beams=60,
            range_min=robot.lidar.range_min_m,
            range_max=robot.lidar.range_max_m,
        )
        poses = around + carrier_pose(scan.sensor_pose, robot.lidar.pose)
        weights = np.ones(len(poses))
        weigh(poses, weights, points, field, off_map, *grid.frame)
        found.append(poses[np.argmax(weights)])
    return found


def test_it_is_nearly_as_near_as_the_pose_that_fits_each_scan_best():
    log = driven()
    samples = log.samples.set_index("time_s")
    fits = best_fits(log, every=8)
    rows = [samples.iloc[samples.index.searchsorted(scan.time_s)] for scan in log.scans[::8]]
    searched = [
        np.hypot(fit[0] - row.x_m, fit[1] - row.y_m) for fit, row in zip(fits, rows, strict=True)
    ]
    # Both are off by half a cell, as the original counts cells from their corners.
    assert 0.02 < np.median(searched) < 0.1
    assert errors_m(log).median() < np.median(searched) + 0.1


def test_the_same_seed_gives_the_same_trial_and_another_one_another():
    first, again, other = driven(3), driven(3), driven(4)
    poses = ["x_m", "y_m", "yaw_rad", "estimated_x_m", "estimated_y_m"]
    assert first.samples[poses].equals(again.samples[poses])
    assert not first.samples[poses].equals(other.samples[poses])


@pytest.mark.long
def test_who_is_carried_away_is_found_again_only_with_random_poses():
    kidnapped = load_scenario("kidnapped")
    log = run_trial(kidnapped, "rpp", 0)
    late = errors_m(log)[log.samples.time_s > 35.0]
    assert errors_m(log).max() > 1.4
    assert late.median() < 0.15


def test_a_jump_displaces_what_it_believes_by_its_size():
    log = driven(jump_time_s=3.0, jump_m=0.5, random_drift=0.0, random_yaw_drift=0.0, drift=0.0)
    at_jump = np.flatnonzero(log.samples.time_s >= 2.99)[0]
    around = errors_m(log).iloc[at_jump - 2 : at_jump + 6]
    assert around.max() - around.min() == pytest.approx(0.5, abs=0.15)


def test_what_a_hit_adds_is_the_cube_of_its_likelihood():
    # z_hit 0.5, z_rand 0.5 over 10 m, sigma 0.2 m: on the wall 0.55^3, far off 0.05^3.
    occupancy = np.zeros((1, 5), dtype=np.int8)
    occupancy[0, 0] = 100
    field, off_map = likelihood_field(
        AmclSettings(laser_likelihood_max_dist=2.0), OccupancyMap(occupancy, 0.5, 0.0, 0.0), 10.0
    )
    near = 0.5 * np.exp(-(0.5**2) / (2.0 * 0.2**2)) + 0.05
    assert field[0, :2] == pytest.approx([0.55**3, near**3])
    assert field[0, 4] == pytest.approx(off_map) == pytest.approx(0.05**3)


@pytest.mark.parametrize(
    ("localization", "said"),
    [
        (
            {"amcl": {"min_particles": 900, "max_particles": 800}},
            "got 900, expected at most max_particles 800",
        ),
        ({"amcl": {"max_beams": 1}}, "amcl.max_beams"),
        ({"amcl": {"laser_model_type": "beam"}}, "amcl.laser_model_type"),
        ({"amcl": {}, "fix_period_s": 1.0}, "fix_period_s: AMCL finds the pose by itself"),
        ({"amcl": {}, "x_bias_m": 0.1}, "x_bias_m: AMCL finds the pose by itself"),
    ],
)
def test_settings_that_cannot_be_meant_are_one_line(localization, said):
    with pytest.raises(InputError, match=said) as raised:
        load_robot("wheelchair", {"localization": localization})
    assert "\n" not in str(raised.value)


def test_without_anything_on_the_map_there_is_nothing_to_be_localized_by():
    robot = load_robot("wheelchair", {"localization": {"amcl": {}}})
    with pytest.raises(InputError, match="expected a map, or obstacles that are known_to_planner"):
        run_trial("empty", "rpp", robot=robot)
