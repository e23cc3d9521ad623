"""Presets, variants and parameter files."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drake_navbench.controller import CONTROLLERS
from drake_navbench.errors import InputError
from drake_navbench.inputs import presets
from drake_navbench.inputs.presets import (
    as_yaml,
    load_preset,
    preset_files,
)
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.typed_files.typed_yaml import parse_yaml


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
        (
            "mine.yaml",
            r"controller mine.yaml: expected a name; a file of parameters is for --params",
        ),
        ("rpp:lookahead=1.0", r"controller rpp:lookahead=1.0: lookahead: unknown field; did you"),
        ("rpp:lookahead_dist=fast", r"lookahead_dist: input should be a valid number, got 'fast'"),
        ("rpp:lookahead_dist", r"got 'lookahead_dist': expected param=value"),
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


@pytest.mark.parametrize(
    "block",
    [
        "GoalCritic: {cost_weight: 7.0}",
        "GoalCritic.cost_weight: 7.0",
        "polish.enabled: false\n  GoalCritic: {cost_weight: 7.0}\n  polish: {knot_count: 9}",
    ],
)
def test_names_in_a_preset_file_may_be_dotted_or_nested(block, tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text(f"controller: mppi\ndescription: mine\nparameters:\n  {block}\n")
    (preset,) = load_parameter_file(path)
    assert preset.parameters.GoalCritic.cost_weight == 7.0


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("{GoalCritic: {cost_weight: 1.0}, GoalCritic.cost_weight: 2.0}", "is given twice"),
        ("{GoalCritic: 1.0, GoalCritic.cost_weight: 2.0}", "expected a block, but GoalCritic has"),
        ("{GoalCritic.cost_weight: 2.0, GoalCritic: 1.0}", "expected a block, got 1.0"),
    ],
)
def test_a_preset_file_that_contradicts_itself_is_one_line(block, message, tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text(f"controller: mppi\ndescription: mine\nparameters: {block}\n")
    with pytest.raises(InputError) as caught:
        load_parameter_file(path)
    assert str(caught.value).startswith(f"{path}: GoalCritic")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_field_of_the_path_handler_is_named(tmp_path: Path):
    path = tmp_path / "far.yaml"
    path.write_text("controller: rpp\ndescription: sees farther\npath_handler: {prune_dist: 3.0}\n")
    (preset,) = load_parameter_file(path)
    with pytest.raises(InputError, match=r"prune_dist: unknown field; did you mean"):
        preset.robot(load_robot("wheelchair"))


def test_a_preset_may_have_other_parameters_for_a_robot_given_by_a_radius(tmp_path: Path):
    path = tmp_path / "either.yaml"
    path.write_text(
        "controller: rpp\ndescription: either\nparameters: {lookahead_dist: 0.7}\n"
        "parameters_for_radius: {lookahead_dist: 0.8}\n"
    )
    (preset,) = load_parameter_file(path)
    assert preset.for_robot(load_robot("wheelchair")).parameters.lookahead_dist == 0.7
    assert preset.for_robot(load_robot("round_robot")).parameters.lookahead_dist == 0.8


def test_a_wrong_parameter_for_a_robot_given_by_a_radius_is_named(tmp_path: Path):
    path = tmp_path / "either.yaml"
    path.write_text(
        "controller: rpp\ndescription: either\nparameters_for_radius: {lookahead: 0.8}\n"
    )
    with pytest.raises(InputError, match=r"lookahead: unknown field; did you mean"):
        load_parameter_file(path)


def test_what_a_variant_asks_for_holds_for_every_robot():
    variant = load_preset("mppi_nav2:ObstaclesCritic.consider_footprint=true")
    round_one = variant.for_robot(load_robot("round_robot"))
    assert round_one.parameters.ObstaclesCritic.consider_footprint
    plain = load_preset("mppi_nav2:gamma=0.1").for_robot(load_robot("round_robot")).parameters
    assert (plain.gamma, plain.ObstaclesCritic.consider_footprint) == (0.1, False)


def test_resolved_parameters_are_all_written():
    text = as_yaml(load_preset("rpp"))
    parameters = parse_yaml(text, "preset")["parameters"]
    assert set(parameters) == set(type(load_preset("rpp").parameters).model_fields)


PLUGIN = """
from drake_navbench.controller import ControllerParameters


class Plugin:
    Parameters = ControllerParameters
    nav2_plugin = "theirs::Plugin"

    def __init__(self, parameters, setup): ...
    def initial_memory(self): ...
    def step(self, observation, memory): ...
"""


@pytest.fixture
def install(install_package) -> Iterator[Callable[..., Path]]:
    """A function that installs a controller as a package of its own, for the length of a test."""

    def install_plugin(name: str, module: str = PLUGIN, *, value: str = "") -> Path:
        value = value or f"{name}_package.{name}_package:Plugin"
        group = {"drake_navbench.controllers": {name: value}}
        folder = install_package(f"{name}_package", module, group)
        presets.installed_controllers.cache_clear()
        return folder

    yield install_plugin
    presets.installed_controllers.cache_clear()


BROKEN_PLUGINS = {
    "does not parse": ("def step(:", "SyntaxError: invalid syntax"),
    "needs what is not installed": ("import no_such_package", "ModuleNotFoundError: No module"),
    "fails when imported": ("1 / 0", "ZeroDivisionError: division by zero"),
    "pretends Ctrl-C when imported": ("raise KeyboardInterrupt", "KeyboardInterrupt"),
    "leaves Python when imported": ("raise SystemExit('no licence')", "SystemExit: no licence"),
    "has no such class": ("", "AttributeError: "),
    "is a number": (
        "Plugin = 3",
        "is not a class with Parameters, nav2_plugin, initial_memory, step",
    ),
    "is an object": (
        PLUGIN + "Plugin = Plugin(None, None)",
        "is not a class with Parameters, nav2_",
    ),
    "has no step": (
        PLUGIN.replace("def step(", "def walk("),
        "is not a class with step, as docs/controllers.md describes it",
    ),
}


@pytest.mark.parametrize("case", BROKEN_PLUGINS)
def test_a_broken_plugin_is_named_and_leaves_the_others_alone(case, install, tmp_path):
    module, reason = BROKEN_PLUGINS[case]
    install("broken", module)
    path = tmp_path / "nav2_params.yaml"
    path.write_text(
        "controller_server: {ros__parameters: {FollowPath: {plugin: "
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController}}}"
    )
    named = "controller 'broken' of package 'broken_package': "
    assert load_preset("rpp").controller == "rpp"
    with pytest.warns(UserWarning, match=named) as warned:
        assert load_parameter_file(path)[0].controller == "rpp"
    (warning,) = warned
    assert reason in str(warning.message)
    with pytest.raises(InputError, match=named) as caught:
        CONTROLLERS.load("broken")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_plugin_in_a_folder_without_init_has_its_presets_beside_it(install):
    folder = install("lonely") / "presets"
    folder.mkdir()
    (folder / "lonely_slow.yaml").write_text("controller: lonely\ndescription: slow\n")
    assert load_preset("lonely_slow").controller == "lonely"
    assert load_preset("rpp").controller == "rpp"


def test_two_controllers_of_one_folder_share_its_presets(install):
    folder = install("first") / "presets"
    install("second", value="first_package.first_package:Plugin")
    folder.mkdir()
    (folder / "first_slow.yaml").write_text("controller: first\ndescription: slow\n")
    assert load_preset("first_slow").controller == "first"


def test_a_preset_that_two_controllers_ship_is_refused_by_both_files(install):
    files = []
    for name in ("first", "second"):
        folder = install(name) / "presets"
        folder.mkdir()
        files.append(folder / "slow.yaml")
        files[-1].write_text(f"controller: {name}\ndescription: slow\n")
    with pytest.raises(InputError) as caught:
        preset_files()
    assert all(str(path) in str(caught.value) for path in files)


def test_a_parameter_without_effect_is_named_and_one_with_effect_is_not():
    preset = load_preset("teb:weight_obstacle=500:max_vel_x=0.4")
    assert preset.ignored == ("weight_obstacle",)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("mppi:critics=3", "critics: input should be a valid array, got 3"),
        ("mppi:critics=[1]", "critics[0]: input should be a valid string, got 1"),
        ("mppi:motion_model=[1]", "motion_model: input should be 'DiffDrive', 'Omni' or 'Acker"),
        ("mppi:motion_model=car:car=3", "motion_model: got 'car', expected one of"),
        ("mppi:motion_model=car:car.plugin=[x]", "car.plugin: got ['x'], expected one of"),
        ("mppi:batch_size=1000000:time_steps=10000", "expected a product of at most 10000000"),
        ("mppi:model_dt=1.0e-9", "model_dt: expected 0.001 to 3600"),
        ("dwb:vx_samples=100000:vtheta_samples=100000", "poses, expected at most 1e+07"),
    ],
)
def test_odd_parameters_are_one_line(text, expected):
    with pytest.raises(InputError) as caught:
        load_preset(text)
    assert expected in str(caught.value)
