"""Sound Nav2 files, in which the studies of planted faults spoil a parameter.

Those of `sound_file` are for the TurtleBot 4; the faults that are only read are in these. Those of
`good_file` are for a round base of 0.2 m whose costmaps take it for 0.22 m; the faults that are
driven are in these, as they show no touch and no near miss in any probe.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from drake_navbench.inputs.presets import load_preset
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.typed_files.dotted_names import flattened

HERE = Path(__file__).parent
TURTLEBOT, BASE = "turtlebot4", str(HERE / "planted_base.yaml")
RELEASE, PLUGIN = "lyrical", "FollowPath"
TYPES = {
    "rpp": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
    "dwb": "dwb_core::DWBLocalPlanner",
    "mppi": "nav2_mppi_controller::MPPIController",
    "teb": "teb_local_planner::TebLocalPlannerROS",
    "graceful": "nav2_graceful_controller::GracefulController",
    "shim": "nav2_rotation_shim_controller::RotationShimController",
    "vector_pursuit": "vector_pursuit_controller::VectorPursuitController",
}
PRESETS = {
    "rpp": "rpp_bringup",
    "dwb": "dwb_bringup",
    "mppi": "mppi_bringup",
    "teb": "teb_upstream",
    "graceful": "graceful",
    "vector_pursuit": "vector_pursuit",
}
# Changes that make the presets, which are for another robot, sound for this one.
SPEEDS: Mapping[str, Mapping[str, Any]] = {
    "rpp": {
        "max_linear_vel": 0.3,
        "lookahead_dist": 0.5,
        "inflation_cost_scaling_factor": 4.0,
        "cost_scaling_dist": 0.4,
    },
    "dwb": {"max_vel_x": 0.3, "max_speed_xy": 0.3, "sim_time": 1.7, "vx_samples": 20},
    "mppi": {"vx_max": 0.3, "vx_min": -0.3, "prune_distance": 1.7},
    "teb": {
        "max_vel_x": 0.3,
        "max_vel_x_backwards": 0.15,
        "min_obstacle_dist": 0.2,
        "weight_kinematics_forward_drive": 1000.0,
    },
    "graceful": {"v_linear_max": 0.3, "slowdown_radius": 1.0, "v_angular_max": 1.0},
}
# Of the presets' parameters, those that this release does not read.
NOT_READ = (
    "stateful", "use_interpolation", "PathAngleCritic.forward_preference", "motion_target_dist",
    "initial_rotation_min_angle", "final_rotation",
)  # fmt: skip
# Changes that make the files good for the rectangular base.
OF_SHIM: Mapping[str, Any] = {
    "angular_dist_threshold": 0.785, "forward_sampling_distance": 0.5,
    "rotate_to_heading_angular_vel": 1.0, "max_angular_accel": 3.2, "simulate_ahead_time": 1.0,
    "rotate_to_goal_heading": True,
}  # fmt: skip
OF_DWB: Mapping[str, Any] = {
    "max_vel_x": 0.7, "max_speed_xy": 0.7, "sim_time": 1.7, "vx_samples": 20,
    "ObstacleFootprint.scale": 0.02,
}  # fmt: skip
OF_RPP: Mapping[str, Any] = {
    "max_linear_vel": 0.7, "lookahead_dist": 0.8, "approach_velocity_scaling_dist": 0.9,
}  # fmt: skip
GOOD: Mapping[str, Mapping[str, Any]] = {
    "rpp": OF_RPP,
    "dwb": OF_DWB,
    "graceful": {},
    "mppi": {"batch_size": 1000, "CostCritic.consider_footprint": True},
    "shim": OF_RPP | OF_SHIM | {"use_rotate_to_heading": False},
    "shim_dwb": OF_DWB | OF_SHIM,
    "vector_pursuit": {
        "desired_linear_vel": 0.7, "rotate_to_heading_angular_vel": 1.0,
        "min_approach_linear_velocity": 0.05,
    },
}  # fmt: skip
# The controller behind a shim.
BEHIND = {"shim": "rpp", "shim_dwb": "dwb"}
OUTLINE = "[[0.3, 0.225], [-0.3, 0.225], [-0.3, -0.225], [0.3, -0.225]]"
# Nothing that a drive depends on, or no parameter of a drive.
LEFT_OUT = ("visualize", "publish", "debug", "transform_tolerance", "seed", "enabled", "rolling")


def sound_file(controller: str) -> dict[str, dict[str, Any]]:
    """Returns a sound Nav2 file of a controller, by the nodes' names."""
    preset = load_preset(PRESETS[controller])
    block = {**dict(flattened(preset.parameters.as_read().model_dump(mode="json")))}
    known = {k: v for k, v in block.items() if _is_plain(v) and k not in NOT_READ}
    inflation = {
        "plugin": "nav2_costmap_2d::InflationLayer",
        "inflation_radius": 0.45,
        "cost_scaling_factor": 4.0,
    }
    scan = {
        "topic": "/scan", "data_type": "LaserScan", "max_obstacle_height": 2.0,
        "obstacle_max_range": 2.5, "raytrace_max_range": 2.5,
    }  # fmt: skip
    obstacles = {
        "plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "scan", "scan": scan,
    }  # fmt: skip
    costmap = {"robot_radius": 0.175, "resolution": 0.05, "inflation_layer": inflation}
    return {
        "controller_server": {
            "controller_frequency": 20.0,
            "failure_tolerance": 0.3,
            "progress_checker_plugins": ["progress_checker"],
            "goal_checker_plugins": ["goal_checker"],
            "controller_plugins": [PLUGIN],
            "progress_checker": {
                "plugin": "nav2_controller::SimpleProgressChecker",
                "required_movement_radius": 0.3, "movement_time_allowance": 15.0,
            },
            "goal_checker": {
                "plugin": "nav2_controller::SimpleGoalChecker",
                "xy_goal_tolerance": 0.25, "yaw_goal_tolerance": 0.25, "stateful": True,
            },
            PLUGIN: {"plugin": TYPES[controller]} | _nested(known | SPEEDS[controller]),
        },
        "local_costmap/local_costmap": costmap | {
            "rolling_window": True, "width": 4, "height": 4, "update_frequency": 5.0,
            "plugins": ["obstacle_layer", "inflation_layer"], "obstacle_layer": obstacles,
        },
        "global_costmap/global_costmap": costmap | {
            "plugins": ["static_layer", "obstacle_layer", "inflation_layer"],
            "static_layer": {"plugin": "nav2_costmap_2d::StaticLayer"},
            "obstacle_layer": obstacles,
        },
        "velocity_smoother": {
            "smoothing_frequency": 20.0, "feedback": "OPEN_LOOP", "velocity_timeout": 1.0,
            "max_velocity": [0.31, 0.0, 1.9], "min_velocity": [-0.31, 0.0, -1.9],
            "max_accel": [2.5, 0.0, 3.2], "max_decel": [-2.5, 0.0, -3.2],
        },
    }  # fmt: skip


def good_file(controller: str) -> dict[str, dict[str, Any]]:
    """Returns a Nav2 file of a controller that shows no touch and no near miss in any probe."""
    kind = BEHIND.get(controller, controller)
    preset = load_preset(PRESETS[kind])
    block = dict(flattened(preset.parameters.as_read().model_dump(mode="json")))
    block = {k: v for k, v in block.items() if _is_plain(v) and k not in NOT_READ}
    if kind == "dwb":
        # BaseObstacle looks at the robot's centre alone.
        block = {k: v for k, v in block.items() if not k.startswith("BaseObstacle.")}
        block["critics"] = [
            c.replace("BaseObstacle", "ObstacleFootprint") for c in block["critics"]
        ]
    own = {"plugin": TYPES[kind]} | _nested(block | GOOD[controller])
    if kind != controller:
        own |= {"primary_controller": own["plugin"], "plugin": TYPES["shim"]}
    file = sound_file("rpp")
    server = file["controller_server"]
    server["progress_checker"]["movement_time_allowance"] = 10.0
    server[PLUGIN] = own
    for costmap in (file["local_costmap/local_costmap"], file["global_costmap/global_costmap"]):
        layer = costmap["obstacle_layer"]
        costmap["obstacle_layer"] = layer | {"scan": layer["scan"] | {"clearing": True}}
        costmap["inflation_layer"] = costmap["inflation_layer"] | {
            "inflation_radius": 0.7, "cost_scaling_factor": 3.0,
        }  # fmt: skip
        del costmap["robot_radius"]
        costmap["footprint"] = OUTLINE
    file["velocity_smoother"] |= {
        "max_velocity": [0.7, 0.0, 1.9],
        "min_velocity": [-0.7, 0.0, -1.9],
    }
    return file


def _is_plain(value: Any) -> bool:
    is_list = isinstance(value, list) and all(isinstance(v, str) for v in value) and bool(value)
    return is_list or isinstance(value, bool | int | float | str)


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in flat.items():
        *blocks, last = name.split(".")
        inner = found
        for block in blocks:
            inner = inner.setdefault(block, {})
        inner[last] = value
    return found


def text_of(file: Mapping[str, Mapping[str, Any]]) -> str:
    """Returns a file's text."""
    content: dict[str, Any] = {}
    for node, parameters in file.items():
        inner: dict[str, Any] = {"ros__parameters": dict(parameters)}
        for part in reversed(node.split("/")):
            inner = {part: inner}
        content |= inner
    return yaml.safe_dump(content, sort_keys=False)


def candidates(file: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, Any]]:
    """Returns the places of a file that may be spoilt, with their values."""
    found = []
    for node, parameters in file.items():
        for name, value in flattened(parameters):
            is_left_out = any(word in name for word in LEFT_OUT)
            is_number = isinstance(value, int | float) and value != 0
            if (is_number or isinstance(value, bool)) and not is_left_out:
                found.append((f"{node}: {name}", value))
    return found


def patient_of(
    file: Mapping[str, Mapping[str, Any]], folder: Path, robot: str = TURTLEBOT
) -> Patient:
    """Returns the doctor's patient of a file, which is written to a folder."""
    path = folder / "nav2_params.yaml"
    path.write_text(text_of(file), encoding="utf-8")
    return Patient((path,), robot, {}, RELEASE)
