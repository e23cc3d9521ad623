"""Presets, variants and parameter files."""

import textwrap
from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.presets import (
    as_yaml,
    load_parameter_file,
    load_preset,
    preset_files,
)
from drake_navbench.robot import load_robot
from drake_navbench.typed_yaml import parse_yaml


def test_every_preset_that_is_shipped_loads():
    for name in preset_files():
        assert load_preset(name).parameters is not None


def test_a_variant_changes_one_parameter_and_is_a_column_of_its_own():
    variant = load_preset("rpp:lookahead_dist=0.9")
    assert variant.name == "rpp:lookahead_dist=0.9"
    assert variant.parameters.lookahead_dist == 0.9
    assert load_preset("rpp").parameters.lookahead_dist == 0.6


def test_a_variant_may_change_several_parameters():
    variant = load_preset("rpp:lookahead_dist=0.9:use_rotate_to_heading=false")
    assert variant.parameters.lookahead_dist == 0.9
    assert variant.parameters.use_rotate_to_heading is False


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rpq", r"controller 'rpq' is not known; did you mean 'rpp'\?"),
        ("rpp:lookahead=1.0", r"controller rpp:lookahead=1.0: lookahead: unknown field; did you"),
        ("rpp:lookahead_dist=fast", r"lookahead_dist: input should be a valid number, got 'fast'"),
        ("rpp:lookahead_dist", r"got 'lookahead_dist', expected param=value"),
    ],
)
def test_a_wrong_name_or_value_is_one_line(text, message):
    with pytest.raises(InputError, match=message) as caught:
        load_preset(text)
    assert "\n" not in str(caught.value)


def test_a_preset_written_with_all_parameters_reads_back_as_the_same(tmp_path: Path):
    preset = load_preset("rpp")
    path = tmp_path / "again.yaml"
    path.write_text(as_yaml(preset))
    (again,) = load_parameter_file(path)
    assert again.name == "again"
    assert again.parameters == preset.parameters


def test_a_preset_may_ask_for_a_longer_local_plan(tmp_path: Path):
    path = tmp_path / "far.yaml"
    path.write_text(
        "controller: rpp\ndescription: sees farther\npath_handler: {prune_distance: 3.0}\n"
    )
    (preset,) = load_parameter_file(path)
    robot = load_robot("wheelchair")
    assert robot.navigation.path_handler.prune_distance == 2.0
    changed = preset.robot(robot)
    assert changed.navigation.path_handler.prune_distance == 3.0
    assert changed.model_path == robot.model_path


def test_a_wrong_field_of_the_path_handler_is_named(tmp_path: Path):
    path = tmp_path / "far.yaml"
    path.write_text("controller: rpp\ndescription: sees farther\npath_handler: {prune_dist: 3.0}\n")
    (preset,) = load_parameter_file(path)
    with pytest.raises(InputError, match=r"prune_dist: unknown field; did you mean"):
        preset.robot(load_robot("wheelchair"))


def nav2_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(textwrap.dedent(text))
    return path


def test_a_nav2_parameter_file_makes_a_column_for_each_of_its_controllers(tmp_path: Path):
    path = nav2_file(
        tmp_path,
        """
        controller_server:
          ros__parameters:
            controller_plugins: [FollowPath]
            FollowPath:
              plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
              lookahead_dist: 0.7
        """,
    )
    (preset,) = load_parameter_file(path)
    assert preset.name == "nav2_params/FollowPath"
    assert preset.controller == "rpp"
    assert preset.parameters.lookahead_dist == 0.7


def test_parameters_that_the_controller_does_not_have_are_named_as_ignored(tmp_path: Path):
    path = nav2_file(
        tmp_path,
        """
        controller_server:
          ros__parameters:
            controller_plugins: [FollowPath]
            FollowPath:
              plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
              desired_linear_vel: 0.4
              transform_tolerance: 0.1
        """,
    )
    (preset,) = load_parameter_file(path)
    assert preset.ignored == ("transform_tolerance",)
    assert preset.parameters.max_linear_vel == 0.4


def test_a_plugin_without_counterpart_is_named(tmp_path: Path):
    path = nav2_file(
        tmp_path,
        """
        controller_server:
          ros__parameters:
            controller_plugins: [FollowPath]
            FollowPath: {plugin: "my_pkg::MyController"}
        """,
    )
    with pytest.raises(InputError, match="plugin 'my_pkg::MyController' has no counterpart here"):
        load_parameter_file(path)


def test_resolved_parameters_are_all_written():
    text = as_yaml(load_preset("rpp"))
    parameters = parse_yaml(text, "preset")["parameters"]
    assert set(parameters) == set(type(load_preset("rpp").parameters).model_fields)
