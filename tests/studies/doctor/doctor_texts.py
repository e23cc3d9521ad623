"""Small whole Nav2 files for the doctor's tests."""

from __future__ import annotations

from typing import Any

import yaml


def nav2_text(controller: dict[str, Any], *, plugin: str = "", **nodes: dict[str, Any]) -> str:
    """Returns a Nav2 file: a controller, a local costmap with a footprint, and further nodes.

    nodes: parameters by name of the node, laid over those of the file.
    """
    server = {
        "controller_frequency": 20.0,
        "progress_checker_plugins": ["progress_checker"],
        "goal_checker_plugins": ["goal_checker"],
        "controller_plugins": ["FollowPath"],
        "progress_checker": {
            "plugin": "nav2_controller::SimpleProgressChecker",
            "required_movement_radius": 0.3,
            "movement_time_allowance": 20.0,
        },
        "goal_checker": {
            "plugin": "nav2_controller::SimpleGoalChecker",
            "xy_goal_tolerance": 0.25,
            "yaw_goal_tolerance": 0.25,
            "stateful": True,
        },
        "FollowPath": {"plugin": plugin, **controller},
    }
    local = {
        "rolling_window": True,
        "width": 5,
        "height": 5,
        "resolution": 0.05,
        "footprint": "[[0.4, 0.2], [0.4, -0.2], [-0.4, -0.2], [-0.4, 0.2]]",
        "plugins": ["obstacle_layer", "inflation_layer"],
        "obstacle_layer": {
            "plugin": "nav2_costmap_2d::ObstacleLayer",
            "observation_sources": "scan",
            "scan": {
                "topic": "/scan",
                "obstacle_max_range": 3.0,
                "raytrace_max_range": 3.0,
                "max_obstacle_height": 2.0,
                "marking": True,
                "clearing": True,
                "data_type": "LaserScan",
            },
        },
        "inflation_layer": {
            "plugin": "nav2_costmap_2d::InflationLayer",
            "inflation_radius": 0.7,
            "cost_scaling_factor": 3.0,
        },
    }
    content: dict[str, Any] = {
        "controller_server": {"ros__parameters": server | nodes.pop("controller_server", {})},
        "local_costmap": {
            "local_costmap": {"ros__parameters": local | nodes.pop("local_costmap", {})}
        },
    }
    for name, parameters in nodes.items():
        content[name] = {"ros__parameters": parameters}
    return yaml.safe_dump(content, sort_keys=False)


RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
MPPI = "nav2_mppi_controller::MPPIController"
DWB = "dwb_core::DWBLocalPlanner"
SHIM = "nav2_rotation_shim_controller::RotationShimController"

RPP_BLOCK: dict[str, Any] = {"desired_linear_vel": 0.5, "lookahead_dist": 0.6}
MPPI_BLOCK: dict[str, Any] = {
    "time_steps": 56,
    "model_dt": 0.05,
    "batch_size": 1000,
    "vx_max": 0.5,
    "vx_std": 0.2,
    "wz_std": 0.4,
    "prune_distance": 2.0,
    "critics": ["CostCritic", "GoalCritic", "PathAlignCritic", "PathFollowCritic"],
    "CostCritic": {"consider_footprint": False},
}
DWB_BLOCK: dict[str, Any] = {
    "max_vel_x": 0.5,
    "max_vel_theta": 1.0,
    "acc_lim_x": 2.5,
    "acc_lim_theta": 3.2,
    "decel_lim_x": -2.5,
    "decel_lim_theta": -3.2,
    "linear_granularity": 0.05,
    "critics": ["RotateToGoal", "Oscillation", "BaseObstacle", "PathDist", "GoalDist"],
}


def cures_of(finding: Any) -> str:
    """Returns the cures of a finding as instructions, without steps, the best first."""
    return finding.rule.advice or "; or ".join(cause.told for cause in finding.cures)
