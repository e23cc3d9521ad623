"""A file of another kind than expected is named as what it is, in one line."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.navigation.costmaps.map_file import load_map

SCENARIO_PATH = SCENARIO_FILES.find("one_obstacle")
ROBOT_PATH = ROBOT_FILES.find("wheelchair")
PRESET_PATH = preset_files()["rpp"]
PRESET = "a preset file or a Nav2 parameter file"


def refusal(load: Callable[..., object], given: object) -> str:
    with pytest.raises(InputError) as refused:
        load(given)
    return str(refused.value)


def test_a_scenario_given_as_parameters_is_called_one():
    told = refusal(load_parameter_file, SCENARIO_PATH)
    assert told == f"{SCENARIO_PATH}: is a scenario file; expected {PRESET}"


def test_a_robot_given_as_parameters_is_called_one():
    told = refusal(load_parameter_file, ROBOT_PATH)
    assert told == f"{ROBOT_PATH}: is a robot file; expected {PRESET}"


def test_other_files_given_as_a_scenario_are_called_what_they_are(tmp_path):
    told = refusal(load_scenario, str(PRESET_PATH))
    assert told == f"{PRESET_PATH}: is a preset file; expected a scenario file"
    nav2 = tmp_path / "nav2_params.yaml"
    nav2.write_text("local_costmap: {local_costmap: {ros__parameters: {width: 3}}}")
    told = refusal(load_scenario, str(nav2))
    hint = ", or --nav2 before each Nav2 file of several"
    assert told == f"{nav2}: is a Nav2 parameter file; expected a scenario file{hint}"


def test_other_files_given_as_a_map_are_one_line(tmp_path):
    path = tmp_path / "other.yaml"
    path.write_text("amcl: {ros__parameters: {a: 1}}\nmap_server: {ros__parameters: {b: 1}}")
    assert refusal(load_map, path) == f"{path}: is a Nav2 parameter file; expected a map file"
    path.write_text("points: [[1, 2]]\nframe: map\nloops: 2\nwait_s: 1\n")
    assert refusal(load_map, path) == (
        f"{path}: is no map file; expected image, resolution and origin, found points, frame, loops"
    )
    assert refusal(load_map, ROBOT_PATH) == f"{ROBOT_PATH}: is a robot file; expected a map file"


def test_a_scenario_given_as_a_robot_is_called_one():
    told = refusal(load_robot, str(SCENARIO_PATH))
    assert told == f"{SCENARIO_PATH}: is a scenario file; expected a robot file"


@pytest.mark.parametrize(
    "text",
    [
        "waypoints: {kitchen: [-3.2, 0.2], home: [3.4, 2.8]}",
        '{"type": "FeatureCollection", "name": "g", "features": []}',
    ],
)
def test_waypoints_and_graphs_are_told_to_be_those_of_goals(tmp_path, text):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    is_one = f"{path}: is a file of goals, for --goals beside a map; expected"
    assert refusal(load_scenario, str(path)) == f"{is_one} a scenario file"
    assert refusal(load_map, path) == f"{is_one} a map file"


def test_a_nav2_file_without_controller_server_is_told_by_its_nodes(tmp_path):
    path = tmp_path / "nav2_params.yaml"
    path.write_text("amcl: {ros__parameters: {a: 1}}\nmap_server: {ros__parameters: {b: 1}}")
    assert refusal(load_parameter_file, path) == (
        f"{path}: no parameters of a controller_server with controller_plugins; "
        "it is a Nav2 parameter file of amcl, map_server"
    )


@pytest.mark.parametrize("name", SCENARIO_FILES.names)
def test_every_built_in_scenario_is_taken_for_one(name):
    assert load_scenario(name).name == name
