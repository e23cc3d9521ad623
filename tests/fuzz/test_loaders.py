"""Whatever a file holds, its loader returns a value or one error that names the file.

`make fuzz` runs many more cases of each. What once broke is kept in `corpus/`, one folder a loader.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from bounds import fuzz, only_input_errors
from damage import as_text, damaged, damaged_bytes, damaged_text
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.navigation.costmaps.map_file import load_map
from drake_navbench.trial.task_cost import check_cost
from drake_navbench.typed_files.typed_yaml import read_yaml

CORPUS = Path(__file__).parent / "corpus"


def read_scenario(path: Path) -> None:
    scenario = load_scenario(str(path))
    robot = scenario.load_robot("wheelchair")
    check_task(scenario, robot)
    check_cost(scenario, robot)


def read_map(path: Path) -> None:
    Image.new("L", (20, 10)).save(path.parent / "map.png")
    load_map(path)


def read_manifest(path: Path) -> None:
    ResultsFolder(path.parent).read_manifest()


LOADERS: dict[str, Callable[[Path], Any]] = {
    "scenario.yaml": read_scenario,
    "robot.yaml": lambda path: load_robot(str(path)),
    "preset.yaml": load_parameter_file,
    "nav2.yaml": load_parameter_file,
    "map.yaml": read_map,
    "manifest.json": read_manifest,
    "text.yaml": read_yaml,
    "log.parquet": TrialLog.read,
}

SCENARIO = {
    "description": "one of everything",
    "world": {
        "obstacles": [
            {"type": "box", "min": [2.0, 0.4], "max": [2.5, 2.0], "height_m": 1.0},
            {"type": "cylinder", "centre": [4.0, -0.8], "radius_m": 0.2},
            {"type": "wall", "start": [0.0, -2.0], "end": [8.0, -2.0], "thickness_m": 0.1},
            {"type": "polygon", "vertices": [[5.0, 0.5], [6.0, 0.5], [5.5, 1.5]]},
        ]
    },
    "filters": [
        {"type": "keepout", "areas": [{"polygon": [[3.0, 1.0], [4.0, 1.0], [4.0, 2.0]]}]},
        {
            "type": "speed_percent",
            "base": 100.0,
            "multiplier": -1.0,
            "areas": [{"polygon": [[3.0, -1.0], [6.0, -1.0], [6.0, 0.0]], "value": 60}],
        },
    ],
    "start": [0.0, 0.0, 0.0],
    "goal": [7.0, 0.0, 0.0],
    "waypoints": [[2.0, 0.0, 0.0]],
    "navigation_mode": "navigate_to_pose",
    "plan": {
        "type": "planner",
        "smoother": {"plugin": "nav2_constrained_smoother::ConstrainedSmoother", "w_cost": 0.02},
    },
    "timeout_s": 60.0,
    "variation": {"start_xy_std_m": 0.02, "start_yaw_std_rad": 0.02},
    "robot_overrides": {"navigation": {"controller_server": {"failure_tolerance": 0.3}}},
}
GIVEN_PLANS = [
    {"type": "elements", "elements": [{"straight_m": 2.0}, {"arc_deg": 45.0, "radius_m": 0.5}]},
    {"type": "polyline", "points": [[0.0, 0.0], [2.0, 0.0]], "spacing_m": 0.05},
]
ROBOT = {
    **yaml.safe_load((Path(__file__).parents[2] / "models" / "wheelchair.yaml").read_text()),
    "model": None,
}
ROBOT["navigation"] |= {
    "velocity_smoother": {"max_accel": [0.5, 0.0, 1.0], "max_decel": [-0.8, 0.0, -1.5]},
    "collision_monitor": {
        "polygons": {
            "body": {"type": "polygon", "action_type": "approach"},
            "near": {"type": "circle", "action_type": "slowdown", "radius": 1.5},
        }
    },
    "behavior_tree": {"recovery_actions": ["clear", "wait"], "wrap_around": True},
}
PRESETS = [
    {
        "controller": "dwb",
        "description": "DWB",
        "parameters": {
            "critics": ["ObstacleFootprint", "PathDist"],
            "PathDist": {"scale": 2.0},
            "ObstacleFootprint.scale": 1.0,
            "max_vel_x": 0.5,
            "vx_samples": 20,
            "sim_time": 1.7,
        },
        "path_handler": {"prune_distance": 2.0},
    },
    {
        "controller": "mppi",
        "description": "MPPI",
        "parameters": {
            "motion_model": "car",
            "car": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.6},
            "critics": ["GoalCritic", "PathAlignCritic"],
            "GoalCritic.cost_weight": 5.0,
            "polish": {"enabled": True, "knot_count": 8},
        },
    },
    {"controller": "rpp", "description": "RPP", "parameters": {"desired_linear_vel": 0.4}},
    {
        "controller": "teb",
        "description": "TEB",
        "parameters": {"footprint_model": {"type": "two_circles"}, "max_vel_x": 0.4},
    },
]
NAV2 = {
    "controller_server": {
        "ros__parameters": {
            "controller_frequency": 20.0,
            "controller_plugins": ["FollowPath", "Other"],
            "FollowPath": {
                "plugin": "nav2_mppi_controller::MPPIController",
                "critics": ["GoalCritic"],
                "GoalCritic": {"cost_weight": 5.0},
            },
            "Other": {"plugin": "dwb_core::DWBLocalPlanner", "critics": ["PathDist"]},
        }
    }
}
MAP = {
    "image": "map.png",
    "resolution": 0.05,
    "origin": [-1.5, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.25,
    "mode": "trinary",
}
MANIFEST = {
    "manifest_version": 1,
    "request": {
        "scenarios": ["empty"],
        "controllers": ["rpp"],
        "parameter_files": [],
        "trials": 1,
        "seed": 0,
        "robot": "wheelchair",
        "replay": "none",
    },
    "scenarios": ["empty"],
    "controllers": ["rpp"],
    "inputs": {"controllers/rpp.yaml": "00"},
    "packages": {"numpy": "2.0"},
    "identity": "00",
    "drake_navbench": "0.1.0",
    "wall_clock_s": 1.0,
}


@pytest.mark.parametrize(
    "name", sorted(str(path.relative_to(CORPUS)) for path in CORPUS.rglob("*") if path.is_file())
)
def test_what_once_broke_a_loader_no_longer_does(name, tmp_path):
    loader = LOADERS[name.partition("/")[0]]
    path = tmp_path / name.partition("/")[0]
    path.write_bytes((CORPUS / name).read_bytes())
    with only_input_errors():
        loader(path)


def check(name: str, content: bytes | str, write: Callable[[str, bytes | str], Path]) -> None:
    path = write(name, content)
    with only_input_errors():
        LOADERS[name](path)


DAMAGED: dict[str, st.SearchStrategy[bytes | str]] = {
    "scenario.yaml": damaged(SCENARIO).map(as_text)
    | st.sampled_from(GIVEN_PLANS)
    .flatmap(
        lambda plan: damaged(
            SCENARIO | {"plan": plan, "navigation_mode": "follow_path", "waypoints": []}
        )
    )
    .map(as_text),
    "robot.yaml": damaged(ROBOT).map(as_text),
    "preset.yaml": st.sampled_from(PRESETS).flatmap(damaged).map(as_text),
    "nav2.yaml": damaged(NAV2).map(as_text),
    "map.yaml": damaged(MAP).map(as_text),
    "manifest.json": damaged(MANIFEST).map(json.dumps)
    | damaged_bytes(json.dumps(MANIFEST).encode()),
    "text.yaml": damaged_text(as_text(SCENARIO)) | st.text(max_size=200),
}


@pytest.mark.parametrize("name", DAMAGED)
@fuzz
@given(data=st.data())
def test_damaged_files(name, data, file):
    check(name, data.draw(DAMAGED[name]), file)


@fuzz
@given(content=damaged_bytes(b"P2\n# a comment\n2 2\n255\n0 127\n254 205\n"))
def test_images_of_maps(content, file):
    image = file("image/fuzzed.pgm", content)
    path = file("image/map.yaml", as_text(MAP | {"image": image.name}))
    with only_input_errors():
        load_map(path)


@fuzz
@given(
    text=damaged_text("rpp:lookahead_dist=0.9:use_rotate_to_heading=false") | st.text(max_size=40)
)
def test_variants(text):
    with only_input_errors():
        load_preset(text)


@pytest.fixture(scope="module")
def log_bytes(file) -> bytes:
    """The file of a whole, short log."""
    from drake_navbench import run_trial

    path = file("log.parquet", b"")
    scenario = file("short.yaml", "description: short\ngoal: [1.0, 0.0, 0.0]\ntimeout_s: 0.3\n")
    run_trial(str(scenario), "rpp").write(path)
    return path.read_bytes()


@fuzz
@given(data=st.data())
def test_bytes_of_logs(data, file, log_bytes):
    check("log.parquet", data.draw(damaged_bytes(log_bytes)), file)


@fuzz
@given(data=st.data())
def test_headers_of_logs(data, file, log_bytes):
    import pyarrow.parquet as pq

    from drake_navbench.logs.header import METADATA_KEY

    table = pq.read_table(file("whole.parquet", log_bytes))
    header = json.loads(table.schema.metadata[METADATA_KEY])
    header = data.draw(damaged(header))
    path = file("log.parquet", b"")
    metadata = {METADATA_KEY: json.dumps(header).encode()}
    pq.write_table(table.replace_schema_metadata(metadata), path)
    with only_input_errors():
        TrialLog.read(path)
