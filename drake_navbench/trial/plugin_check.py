"""Whether the plugins that a scenario and a robot name can be made, before anything is driven."""

from __future__ import annotations

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.foreign_code import has_foreign_plugins
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.scenario_plan import GridPlan
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
)
from drake_navbench.navigation.behavior_tree.navigators import navigator_tree
from drake_navbench.navigation.behaviors import make_behaviors
from drake_navbench.navigation.checker_settings import make_goal_checker, make_progress_checker
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.navigation.smoother_settings import make_smoother
from drake_navbench.trial.planning import global_layers, planner_of


def check_running_stack(scenario: Scenario, preset: Preset) -> None:
    """Raises InputError where a column is a running stack that cannot be given the task."""
    if not preset.is_running_stack:
        return
    its = f"scenario {scenario.name}: {preset.name} is a running stack, which"
    if scenario.floors:
        raise InputError(f"{its} drives on one floor; expected a scenario without floors")
    if scenario.navigation_mode == NAVIGATE_THROUGH_POSES:
        raise InputError(
            f"{its} is sent one goal after another; navigation_mode: expected navigate_to_pose, "
            "got navigate_through_poses"
        )


def check_plugins(scenario: Scenario, robot: Robot) -> None:
    """Makes each third-party plugin once; raises InputError where that fails."""
    if not has_foreign_plugins(scenario, robot):
        return
    navigation = robot.navigation
    planner_of(robot)
    make_goal_checker(navigation.goal_checker)
    make_progress_checker(navigation.progress_checker)
    local_layers(navigation.local_costmap, lidar=robot.lidar, footprint=robot.padded_outline)
    global_layers(scenario, robot)
    if isinstance(scenario.plan, GridPlan) and scenario.plan.smoother is not None:
        make_smoother(scenario.plan.smoother)
    make_behaviors(navigation.behavior_server)
    nobody = Board(
        lambda start, goal, costmap: np.array([start]),
        lambda path, costmap: True,
        lambda path, costmap: path,
        lambda pose, costmap, uses_outline: None,
    )
    mode = scenario.navigation_mode
    navigator_tree(
        nobody, navigation.behavior_tree, NAVIGATE_TO_POSE if mode == "follow_path" else mode
    )
