"""Planted faults: does the doctor find one parameter that was spoilt in a sound Nav2 file?

    python studies/planted_faults.py draw     planted_faults.yaml: 60 faults, drawn by a seed
    python studies/planted_faults.py read     the first look at each, nothing driven
    python studies/planted_faults.py read 2027 2028 2029    at 180 others, drawn by these seeds
    python studies/planted_faults_page.py     docs/doctor_planted_faults.md

The files: RPP, DWB, MPPI, TEB and Graceful with the built-in presets' parameters, the same servers
and costmaps, for the TurtleBot 4. The draw knows nothing of the doctor's rules: twelve times a
controller, any number or switch of the file is taken with equal chances, a number times 1/4, 2/5,
5/2 or 4, a switch turned round. What the file's reader refuses is drawn again.

The score's rules, written before anything was read or driven:

- *read, first*: of the findings that the sound file has not, the first one's first cure is the
  spoilt parameter, in the direction back. *named*: any cure of any of them is.
- *no skill*: the parameter that is farthest from the release's default, as a ratio, towards it
  (a switch that differs counts as a factor of 2); and a parameter by chance with a coin for its
  direction, as an expected value.

What is driven, and its score's rules, is in `planted_faults_driven.py`.
"""

from __future__ import annotations

import argparse
import copy
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import findings_of
from drake_navbench.typed_files.dotted_names import flattened

HERE = Path(__file__).parent
DRAWN = HERE / "planted_faults.yaml"
ROBOT, RELEASE, PLUGIN = "turtlebot4", "lyrical", "FollowPath"
SEED, FAULTS_EACH = 2026, 12
FACTORS = (0.25, 0.4, 2.5, 4.0)
TYPES = {
    "rpp": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
    "dwb": "dwb_core::DWBLocalPlanner",
    "mppi": "nav2_mppi_controller::MPPIController",
    "teb": "teb_local_planner::TebLocalPlannerROS",
    "graceful": "nav2_graceful_controller::GracefulController",
}
PRESETS = {
    "rpp": "rpp_bringup",
    "dwb": "dwb_bringup",
    "mppi": "mppi_bringup",
    "teb": "teb_upstream",
    "graceful": "graceful",
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
# Nothing that a drive depends on, or no parameter of a drive.
LEFT_OUT = ("visualize", "publish", "debug", "transform_tolerance", "seed", "enabled", "rolling")


class Fault(NamedTuple):
    """A planted fault. place: node and parameter, 'controller_server: FollowPath.wz_std'."""

    controller: str
    place: str
    sound: Any
    spoilt: Any

    @property
    def name(self) -> str:
        """A name for files: 'mppi_controller_server_FollowPath_wz_std'."""
        node, _, parameter = self.place.partition(": ")
        return f"{self.controller}_{node.partition('/')[0]}_{parameter.replace('.', '_')}"

    @property
    def back(self) -> Direction:
        """The direction of the cure."""
        if isinstance(self.sound, bool):
            return Direction.SET
        return Direction.DOWN if self.spoilt > self.sound else Direction.UP


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


def spoilt_file(fault: Fault) -> dict[str, dict[str, Any]]:
    """Returns the file of a fault."""
    # Both costmaps have the same layers; only one of them is spoilt.
    sound = sound_file(fault.controller)
    file = {node: copy.deepcopy(block) for node, block in sound.items()}
    node, _, name = fault.place.partition(": ")
    *blocks, last = name.split(".")
    inner = file[node]
    for block in blocks:
        inner = inner[block]
    inner[last] = fault.spoilt
    return file


def patient_of(file: Mapping[str, Mapping[str, Any]], folder: Path) -> Patient:
    """Returns the doctor's patient of a file, which is written to a folder."""
    path = folder / "nav2_params.yaml"
    path.write_text(text_of(file), encoding="utf-8")
    return Patient((path,), ROBOT, {}, RELEASE)


def candidates(controller: str) -> list[tuple[str, Any]]:
    """Returns the places of a sound file that may be spoilt, with their values."""
    found = []
    for node, parameters in sound_file(controller).items():
        for name, value in flattened(parameters):
            is_left_out = any(word in name for word in LEFT_OUT)
            is_number = isinstance(value, int | float) and value != 0
            if (is_number or isinstance(value, bool)) and not is_left_out:
                found.append((f"{node}: {name}", value))
    return found


def draw(seed: int = SEED) -> list[Fault]:
    """Returns the faults, by the seed."""
    generator = np.random.default_rng(seed)
    found: list[Fault] = []
    for controller in TYPES:
        choices = candidates(controller)
        order = [int(i) for i in generator.permutation(len(choices))]
        own: list[Fault] = []
        for index in order:
            if len(own) == FAULTS_EACH:
                break
            place, value = choices[index]
            factor = float(generator.choice(FACTORS))
            fault = Fault(controller, place, value, spoilt_value(value, factor))
            if fault.spoilt != value and is_read(fault):
                own.append(fault)
        found += own
    return found


def spoilt_value(value: Any, factor: float) -> Any:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return max(round(value * factor), 1)
    return float(f"{value * factor:.4g}")


def is_read(fault: Fault) -> bool:
    with tempfile.TemporaryDirectory() as folder:
        try:
            patient_of(spoilt_file(fault), Path(folder)).facts()
        except InputError:
            return False
    return True


def read_score(faults: list[Fault]) -> list[dict[str, Any]]:
    """Returns the answer of the first look to each fault, beside those of methods without skill."""
    rows = []
    for fault in faults:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            sound = {
                f.rule.name
                for f in findings_of(patient_of(sound_file(fault.controller), folder).facts())
            }
            facts = patient_of(spoilt_file(fault), folder).facts()
            new = [f for f in findings_of(facts) if f.rule.name not in sound]
        firsts = [f.cures[0] for f in new[:1]]
        rows.append({
            "name": fault.name,
            "first": any(_is_back(c.place, c.direction, fault, facts) for c in firsts),
            "named": any(
                _is_back(c.place, c.direction, fault, facts) for f in new for c in f.cures
            ),
            "findings": len(new),
            "farthest": _farthest(facts, fault),
            "chance": 0.5 / len(candidates(fault.controller)),
        })  # fmt: skip
    return rows


def _is_back(place: str, direction: Direction, fault: Fault, facts: Facts) -> bool:
    """Tells whether a cure is of the spoilt parameter and leads back."""
    own = _place_of(fault)
    return own in facts.matching(place) and direction is fault.back


def _place_of(fault: Fault) -> str:
    """Returns the doctor's name for the spoilt parameter."""
    node, _, name = fault.place.partition(": ")
    node = node.partition("/")[0]
    if node == "controller_server" and name.startswith(f"{PLUGIN}."):
        return f"controller.{name.removeprefix(f'{PLUGIN}.')}"
    if node == "controller_server" and name.startswith(("goal_checker.", "progress_checker.")):
        return name
    return f"{node}.{name.rpartition('.')[2]}"


def _farthest(facts: Facts, fault: Fault) -> bool:
    """Tells whether the spoilt parameter is the one farthest from its default, if one knows it.

    Of the controller's parameters, whose defaults Nav2 declares.
    """
    ratios: dict[str, float] = {}
    for place, default in facts.defaults.items():
        value = facts[place]
        if isinstance(default, bool) or isinstance(value, bool):
            ratios[place] = math.log(2.0) if value != default else 0.0
        elif isinstance(default, int | float) and isinstance(value, int | float):
            both = value * default > 0.0
            ratios[place] = abs(math.log(value / default)) if both else 0.0
    return bool(ratios) and max(ratios, key=lambda place: ratios[place]) == _place_of(fault)


def drawn() -> list[Fault]:
    """Returns the faults of the file of the draw."""
    return [Fault(**entry) for entry in yaml.safe_load(DRAWN.read_text(encoding="utf-8"))]


def main() -> None:
    """Runs a step of the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    steps.add_parser("draw", help=f"draw the faults into {DRAWN.name}")
    read = steps.add_parser(
        "read", help="print the doctor's first look at each fault; drives nothing"
    )
    read.add_argument("seeds", type=int, nargs="*", help=f"of other draws than {DRAWN.name}")
    arguments = parser.parse_args()
    if arguments.step == "draw":
        entries = [fault._asdict() for fault in draw()]
        DRAWN.write_text(yaml.safe_dump(entries, sort_keys=False), encoding="utf-8")
    else:
        faults = [fault for seed in arguments.seeds for fault in draw(seed)] or drawn()
        rows = read_score(faults)
        for row in rows:
            print(row)
        for name in ("first", "named", "farthest", "chance"):
            print(f"{name}: {sum(row[name] for row in rows):g} of {len(rows)}")


if __name__ == "__main__":
    main()
