"""Whole trials with each planner, and with a voxel layer in place of the obstacle layer."""

import numpy as np
import pytest
from stub_controller import StubPreset, straight_ahead

from drake_navbench import run_trial
from drake_navbench.controller import Decision
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.outcome import Outcome
from drake_navbench.navigation.planner_settings import PLANNERS
from drake_navbench.navigation.smac_planner_2d import SmacPlanner2D
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

NAVFN = "nav2_navfn_planner::NavfnPlanner"
BOX = {"type": "box", "min": [2.0, -1.0], "max": [2.5, 0.3]}
WALL = {"type": "box", "min": [2.51, -2.03], "max": [2.7, 2.03], "known_to_planner": False}
# The straight line goes through whatever stands there.
SEARCHING = sorted({*PLANNERS.names} - {"nav2_straightline_planner::StraightLine"})
every_planner = pytest.mark.parametrize("plugin", SEARCHING)


def scenario(*obstacles, goal=(5.0, 0.0, 0.0), **navigation):
    data = {
        "name": "task",
        "description": "a task",
        "world": {"obstacles": list(obstacles)},
        "goal": list(goal),
        "timeout_s": 30.0,
        "robot_overrides": {"navigation": navigation},
    }
    return validate(Scenario, data, "task.yaml")


# Planners


@every_planner
def test_each_planner_leads_the_robot_past_an_obstacle(plugin):
    log = run_trial(scenario(BOX, planner={"plugin": plugin}), "rpp", seed=2)
    assert log.outcome is Outcome.SUCCEEDED
    assert log.samples["clearance_m"].min() > 0.1
    # Past the box by the inflation's 0.9 m or so, and on.
    assert 5.0 < path_length(log.course) < 6.5
    assert log.course[-1, 2] == 0.0


@pytest.mark.parametrize(
    "plugin",
    [SEARCHING[0], *(pytest.param(name, marks=pytest.mark.long) for name in SEARCHING[1:])],
)
def test_each_planner_serves_a_behaviour_tree(plugin):
    task = load_scenario("dead_end")
    navigation = {**task.robot_overrides["navigation"], "planner": {"plugin": plugin}}
    log = run_trial(
        task.model_copy(update={"robot_overrides": {"navigation": navigation}}), "rpp", seed=1
    )
    assert log.outcome is Outcome.SUCCEEDED


@every_planner
def test_a_goal_that_cannot_be_reached_ends_the_trial_with_nav2s_code(plugin):
    walls = [
        {"type": "wall", "start": start, "end": end, "thickness_m": 0.1}
        for start, end in (
            ([-2.0, -2.0], [-2.0, 2.0]),
            ([2.0, -2.0], [2.0, 2.0]),
            ([-2.0, -2.0], [2.0, -2.0]),
            ([-2.0, 2.0], [2.0, 2.0]),
        )
    ]
    log = run_trial(scenario(*walls, planner={"plugin": plugin}), "rpp", seed=2)
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] == 208


def test_the_planner_of_a_robot_file_without_a_name_is_smac_2d():
    logs = [
        run_trial(scenario(BOX, planner=planner), "rpp", seed=2)
        for planner in ({}, {"plugin": SmacPlanner2D.nav2_plugin})
    ]
    np.testing.assert_array_equal(logs[0].course, logs[1].course)


# The voxel layer


def voxels(**layer):
    source = {
        "clearing": True,
        "max_obstacle_height": 2.0,
        "obstacle_max_range": 2.95,
        "raytrace_max_range": 3.0,
    }
    return {
        "local_costmap": {
            "plugins": ["voxel_layer", "keepout_filter", "inflation_layer"],
            "voxel_layer": {"observation_sources": {"scan": source}, **layer},
        }
    }


def simulate_stub(step, task, robot_overrides=None):
    robot = load_robot("wheelchair", {**task.robot_overrides, **(robot_overrides or {})})
    return simulate(TrialSpec(task, robot, StubPreset(step), seed=1))


def local_costs(task, robot_overrides=None, *, step):
    """Returns the local costmaps that a controller saw, one each cycle."""
    seen = []

    def watch(observation, memory):
        if seen and observation.time_s < seen[-1].time_s:
            # What came before was a rehearsal.
            seen.clear()
        seen.append(observation)
        return step(observation, memory)

    simulate_stub(watch, task, robot_overrides)
    return [observation.costmap.costs for observation in seen]


def stand(observation, memory):
    return Decision(np.zeros(2), memory)


def test_before_a_wall_a_voxel_layer_gives_the_trial_of_the_obstacle_layer():
    logs = [run_trial(scenario(WALL, **navigation), "rpp", seed=2) for navigation in ({}, voxels())]
    assert logs[0].outcome is Outcome.ABORTED
    assert logs[0].samples["clearance_m"].min() < 0.5
    columns = [c for c in logs[0].samples if "compute" not in c]
    np.testing.assert_array_equal(logs[1].samples[columns], logs[0].samples[columns])


def test_a_robot_that_stands_sees_the_same_costs_with_either_layer():
    pillar = {"type": "cylinder", "centre": [1.0, 1.5], "radius_m": 0.3}
    task = scenario(WALL, pillar).model_copy(update={"timeout_s": 1.5})
    pairs = zip(
        local_costs(task, step=stand),
        local_costs(task, {"navigation": voxels()}, step=stand),
        strict=True,
    )
    compared = 0
    for flat, columns in pairs:
        assert (flat == 254).sum() > 40
        np.testing.assert_array_equal(columns, flat)
        compared += 1
    assert compared > 20


def test_a_robot_that_drives_along_a_wall_leaves_marks_with_a_voxel_layer():
    # Rays that graze the wall clear it cell by cell, but end two cells early.
    wall = {"type": "box", "min": [-3.0, 1.02], "max": [6.0, 1.3]}
    task = scenario(wall).model_copy(update={"timeout_s": 3.0})
    flat = local_costs(task, step=straight_ahead)[-1] == 254
    columns = local_costs(task, {"navigation": voxels()}, step=straight_ahead)[-1] == 254
    assert (columns & ~flat).sum() > 10
    assert (flat & ~columns).sum() == 0


def test_with_its_lidar_above_the_grid_a_robot_drives_into_a_wall():
    # Sixteen levels of 5 cm, as in Nav2's bringup, end at 0.8 m.
    low = voxels(z_voxels=16, z_resolution=0.05)
    outcomes = [
        run_trial(
            scenario(WALL, **low).model_copy(
                update={"robot_overrides": {"navigation": low, "lidar": {"height_m": height_m}}}
            ),
            "rpp",
            seed=2,
        ).outcome
        for height_m in (0.75, 0.85)
    ]
    assert outcomes == [Outcome.ABORTED, Outcome.COLLIDED]


def test_a_mark_threshold_above_0_hides_a_planar_scan():
    task = scenario(WALL, **voxels(mark_threshold=1))
    assert simulate_stub(straight_ahead, task).outcome is Outcome.COLLIDED
    assert not any((costs == 254).any() for costs in local_costs(task, step=straight_ahead))
