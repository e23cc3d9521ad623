"""A controller server of a Nav2 file makes columns; one of another shape is told in a line."""

import warnings

import pytest
from nav2_texts import (
    DWB,
    MPPI,
    RPP,
)

from drake_navbench.controller import CONTROLLERS
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.presets import installed_controllers
from drake_navbench.nav2.controllers import OUR_CONTROLLERS


def test_every_controller_of_a_file_makes_a_column(presets_of):
    first, second = presets_of(
        f"""
        controller_server:
          ros__parameters:
            controller_plugins: [FollowPath, Slow]
            FollowPath:
              plugin: {RPP}
              lookahead_dist: 0.7
            Slow: {{plugin: {DWB}, critics: [PathDist], PathDist.scale: 3.0}}
        """
    )
    assert (first.name, first.controller) == ("nav2_params/FollowPath", "rpp")
    assert first.parameters.lookahead_dist == 0.7
    assert (second.name, second.controller) == ("nav2_params/Slow", "dwb")
    assert second.parameters.critic("PathDist").scale == 3.0


def test_the_servers_of_several_robots_make_columns_of_their_own(presets_of):
    section = f"controller_server: {{ros__parameters: {{FollowPath: {{plugin: '{RPP}'}}}}}}"
    presets = presets_of(f"robot1: {{{section}}}\nrobot2: {{{section}}}")
    names = [preset.name for preset in presets]
    assert names == ["nav2_params/robot1/FollowPath", "nav2_params/robot2/FollowPath"]


def test_without_plugins_named_the_one_controller_is_nav2s_default(presets_of):
    (preset,) = presets_of(
        "controller_server: {ros__parameters: {FollowPath: {critics: [PathDist]}}}"
    )
    assert (preset.name, preset.controller) == ("nav2_params/FollowPath", "dwb")


def test_a_key_given_twice_is_warned_of_and_the_last_one_holds(presets_of):
    with pytest.warns(InputWarning, match=r"nav2_params.yaml, line 2: .*lookahead_dist is given"):
        (preset,) = presets_of(
            f"""controller_server: {{ros__parameters: {{FollowPath: {{plugin: '{RPP}',
            lookahead_dist: 0.7, lookahead_dist: 0.8}}}}}}"""
        )
    assert preset.parameters.lookahead_dist == 0.8


def test_a_file_without_mistakes_warns_of_nothing(preset_of):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        preset_of(RPP, {"lookahead_dist": 0.7})


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("controller_plugins: FollowPath", "controller_plugins: expected a list of names, got"),
        ("controller_plugins: [{a: 1}]", "controller_plugins: expected a list of names, got"),
        ("controller_plugins: [A]", "A: missing, but listed in controller_plugins; expected"),
        ("controller_plugins: [FollowPath]", "FollowPath: missing, but listed in controller_plu"),
        ("controller_plugins: [A], A: {b: 1}", "A: missing, but listed in controller_plugins"),
        ("FollowPath: {plugin: [a]}", "FollowPath.plugin: expected a plugin type, got ['a']"),
        ("FollowPath: {plugin: }", "FollowPath.plugin: expected a plugin type, got None"),
        ("FollowPath: {plugin: 'a::B'}", "FollowPath.plugin: 'a::B' has no counterpart here"),
        (f"FollowPath: {{plugin: '{MPPI}', a.b: 1, a: 2}}", "FollowPath: a: expected a block, got"),
        (f"FollowPath: {{plugin: '{MPPI}', motion_model: [1]}}", "FollowPath: motion_model: input"),
        (f"FollowPath: {{plugin: '{MPPI}', critics: 3}}", "FollowPath: critics: input should be"),
    ],
)
def test_a_controller_server_of_another_shape_is_one_line(block, message, presets_of, tmp_path):
    with pytest.raises(InputError) as caught:
        presets_of(f"controller_server: {{ros__parameters: {{{block}}}}}")
    place = f"{tmp_path / 'nav2_params.yaml'}, line 1"
    assert str(caught.value).startswith(f"{place}: controller_server.ros__parameters.{message}")
    assert "\n" not in str(caught.value)


WRONG_DWB = """\
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: dwb_core::DWBLocalPlanner
      critics: [PathAlign]
      max_vel_x: 0.5
      PathAlign:
        scale: 32.0
"""


@pytest.mark.parametrize(
    ("right", "wrong", "line", "message"),
    [
        ("0.5", "fast", 7, "max_vel_x: input should be a valid number, got 'fast'"),
        ("32.0", "high", 9, "PathAlign.scale: input should be a valid number, got 'high'"),
        ("[PathAlign]", "[Foo]", 6, "critics: critic 'Foo' is not registered"),
        # The file does not give min_vel_x; the line is that of the parameter it is held against.
        ("0.5", "-0.5", 7, "min_vel_x: got 0.0, expected at most max_vel_x -0.5"),
    ],
)
def test_a_wrong_value_is_named_with_its_own_line(
    right, wrong, line, message, presets_of, tmp_path
):
    with pytest.raises(InputError) as caught:
        presets_of(WRONG_DWB.replace(right, wrong))
    place = f"{tmp_path / 'nav2_params.yaml'}, line {line}: controller_server.ros__parameters."
    assert str(caught.value).startswith(f"{place}FollowPath: {message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("planner_server: {ros__parameters: {a: 1}}", "no parameters of a controller_server with"),
        ("controller_server: {FollowPath: {a: 1}}", "expected a mapping with ros__parameters"),
    ],
)
def test_a_file_without_controllers_is_one_line(text, message, presets_of):
    with pytest.raises(InputError, match=message) as caught:
        presets_of(text)
    assert "\n" not in str(caught.value)


def test_our_controllers_are_known_by_their_type_without_being_imported():
    ours = {name: c for name, c in installed_controllers().items() if not CONTROLLERS.origin(name)}
    assert {c.nav2_plugin: name for name, c in ours.items() if c.nav2_plugin} == OUR_CONTROLLERS
