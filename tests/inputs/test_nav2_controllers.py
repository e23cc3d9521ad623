"""What a Nav2 file gives a controller reaches it whole; what it has no use for is told."""

import textwrap
import warnings
from pathlib import Path

import pytest
import yaml

from drake_navbench.controller import CONTROLLERS
from drake_navbench.controllers.critic_parameters import ParametersWithCritics
from drake_navbench.controllers.rotation_shim import RotationShimParameters
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.nav2_controllers import OUR_CONTROLLERS
from drake_navbench.inputs.parameter_files import load_parameter_file
from drake_navbench.inputs.presets import as_yaml, installed_controllers
from drake_navbench.inputs.robot import load_robot
from drake_navbench.parameter_names import flattened
from drake_navbench.trial.column_controller import make_controller

DWB = "dwb_core::DWBLocalPlanner"
MPPI = "nav2_mppi_controller::MPPIController"
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
TEB = "teb_local_planner::TebLocalPlannerROS"
GRACEFUL = "nav2_graceful_controller::GracefulController"
SHIM = "nav2_rotation_shim_controller::RotationShimController"
VECTOR_PURSUIT = "vector_pursuit_controller::VectorPursuitController"


@pytest.fixture
def presets_of(tmp_path: Path):
    """A function from the text of a Nav2 file to its presets."""

    def load(text: str):
        path = tmp_path / "nav2_params.yaml"
        path.write_text(textwrap.dedent(text))
        return load_parameter_file(path)

    return load


@pytest.fixture
def preset_of(presets_of):
    """A function from plugin type and parameters of FollowPath to its preset."""

    def load(plugin: str, parameters: dict | str, **server):
        if isinstance(parameters, str):
            parameters = yaml.safe_load(textwrap.dedent(parameters))
        server |= {"controller_plugins": ["FollowPath"]}
        server["FollowPath"] = {"plugin": plugin} | parameters
        text = yaml.safe_dump({"controller_server": {"ros__parameters": server}}, sort_keys=False)
        (preset,) = presets_of(text)
        return preset

    return load


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


# Other values than the defaults, where one step away from them is not possible.
OTHER_VALUES = {
    "dwb": {
        "trajectory_generator_name": "dwb_plugins::LimitedAccelGenerator",
        "default_critic_namespaces": ["dwb_critics", "mine"],
        "decel_lim_x": -1.5,
        "decel_lim_y": -1.5,
        "decel_lim_theta": -1.5,
        "sim_period": 0.125,
        "nav2_release": "humble",
    },
    "mppi": {
        "motion_model": "Ackermann",
        "nav2_release": "lyrical",
        "max_robot_pose_search_dist": 3.5,
        "TrajectoryValidator.plugin": "mppi::DefaultOptimalTrajectoryValidator",
        "VelocityDeadbandCritic.deadband_velocities": [0.125, 0.25, 0.375],
        "CostCritic.inflation_layer_name": "my_layer",
        "ObstaclesCritic.inflation_layer_name": "my_layer",
    },
    "graceful": {
        "nav2_release": "lyrical",
        "initial_rotation": False,
        "allow_backward": True,
        "max_robot_pose_search_dist": 3.5,
    },
    "rotation_shim": {
        "nav2_release": "jazzy",
        "primary_controller.plugin": VECTOR_PURSUIT,
        "primary_controller.nav2_release": "jazzy",
        "primary_controller.max_robot_pose_search_dist": 3.5,
    },
    "rpp": {"nav2_release": "lyrical", "max_robot_pose_search_dist": 3.5},
    "vector_pursuit": {"nav2_release": "lyrical", "max_robot_pose_search_dist": 3.5},
    "teb": {
        "footprint_model.type": "two_circles",
        "footprint_model.line_start": [-0.25, 0.125],
        "footprint_model.line_end": [0.5, 0.0],
        "footprint_model.vertices": [[0.5, 0.25], [0.5, -0.25], [-0.25, 0.0]],
    },
}
# Ours alone, no part of Nav2's files.
OURS = {"mppi": {"polish"}, "teb": {"solver"}}


def another_value(default):
    """Returns a value one step away from a default, away from zero."""
    if isinstance(default, bool):
        return not default
    assert isinstance(default, int | float), f"needs a value in OTHER_VALUES, default {default!r}"
    step = 1 if isinstance(default, int) else 0.125
    return default - step if default < 0 else default + step


def every_parameter_changed(controller, release=None):
    """Returns dotted names with other values than the defaults: all that a release reads."""
    others = OTHER_VALUES[controller] | ({"nav2_release": release} if release else {})
    release = others.get("nav2_release")
    model = installed_controllers()[controller].Parameters
    required = {}
    if issubclass(model, ParametersWithCritics):
        required = {"critics": model.CRITICS.names}
    if issubclass(model, RotationShimParameters):
        required = {"primary_controller": {"plugin": "vector_pursuit"}}
    defaults = model(**required).model_dump(mode="json", exclude=OURS.get(controller, set()))
    values = {}
    for name, default in flattened(defaults):
        if not model.is_read(name, release):
            continue
        if name.endswith(".class"):
            values[name] = name.removesuffix(".class")
        elif name.endswith(".aggregation_type"):
            values[name] = "sum"
        elif name == "critics":
            values[name] = required["critics"]
        elif name in others:
            values[name] = others[name]
        else:
            values[name] = another_value(default)
    return values


def as_nested(values):
    result = {}
    for name, value in values.items():
        *blocks, last = name.split(".")
        target = result
        for block in blocks:
            target = target.setdefault(block, {})
        target[last] = value
    return result


def as_mixed(values):
    """Returns every second parameter dotted, the others in blocks."""
    dotted = dict(list(values.items())[::2])
    return dotted | as_nested({n: v for n, v in values.items() if n not in dotted})


PLUGINS = {
    "dwb": DWB,
    "graceful": GRACEFUL,
    "mppi": MPPI,
    "rotation_shim": SHIM,
    "rpp": RPP,
    "teb": TEB,
    "vector_pursuit": VECTOR_PURSUIT,
}


@pytest.mark.parametrize("form", [dict, as_nested, as_mixed], ids=["dotted", "nested", "mixed"])
@pytest.mark.parametrize("controller", PLUGINS)
def test_every_parameter_of_a_controller_and_its_critics_arrives(controller, form, preset_of):
    changed = every_parameter_changed(controller)
    preset = preset_of(PLUGINS[controller], form(changed))
    resolved = dict(flattened(preset.parameters.model_dump(mode="json")))
    expected = dict(changed)
    if controller == "rotation_shim":
        expected["primary_controller.plugin"] = "vector_pursuit"
    assert {name: resolved[name] for name in changed} == expected
    model = preset.controller_class.Parameters
    assert set(preset.ignored) == {
        name for name in changed if model.is_without_effect(name, changed)
    }


@pytest.mark.parametrize("release", ["humble", "iron", "jazzy", "kilted"])
@pytest.mark.parametrize("controller", ["mppi", "rpp"])
def test_every_parameter_that_an_earlier_release_reads_arrives(controller, release, preset_of):
    changed = every_parameter_changed(controller, release)
    changed.pop("max_linear_vel", None)
    preset = preset_of(PLUGINS[controller], changed)
    resolved = dict(flattened(preset.parameters.model_dump(mode="json")))
    assert {name: resolved[name] for name in changed} == changed
    model = preset.controller_class.Parameters
    assert set(preset.ignored) == {
        name for name in changed if model.is_without_effect(name, changed)
    }


def test_before_lyrical_the_cruise_speed_had_one_name(preset_of):
    given = {"max_linear_vel": 9.0, "desired_linear_vel": 0.75, "nav2_release": "kilted"}
    preset = preset_of(RPP, given)
    assert preset.parameters.max_linear_vel == 0.75
    assert preset.ignored == ("max_linear_vel",)


def critics_of(preset):
    """Returns the critics of the controller that a preset builds for a built-in robot."""
    controller = make_controller(preset, preset.robot(load_robot("wheelchair")))
    if preset.controller == "dwb":
        return {type(c).__name__: c._parameters for c in controller._planner._critics}
    return {type(c).__name__: c.parameters for c in controller._sampler.critics}


@pytest.mark.parametrize("controller", ["dwb", "mppi"])
def test_every_parameter_of_a_critic_reaches_the_critic_itself(controller, preset_of):
    changed = every_parameter_changed(controller)
    critics = changed["critics"]
    given = {name: changed[name] for name in changed if name.partition(".")[0] in critics}
    preset = preset_of(PLUGINS[controller], given | {"critics": critics})
    built = critics_of(preset)
    assert set(built) == set(critics)
    for name, value in given.items():
        critic, _, parameter = name.partition(".")
        held = getattr(built[critic], "critic_class" if parameter == "class" else parameter)
        assert (list(held) if isinstance(held, tuple) else held) == value, name


def test_a_parameter_that_the_controller_does_not_have_is_told_and_left_out(preset_of):
    preset = preset_of(RPP, "{desired_linear_vel: 0.4, transform_tolerance: 0.1, a: {b: 1, c: 2}}")
    assert preset.ignored == ("transform_tolerance", "a.b", "a.c")
    assert preset.parameters.max_linear_vel == 0.4


@pytest.mark.parametrize("form", [dict, as_nested], ids=["dotted", "nested"])
def test_an_unknown_parameter_of_a_critic_is_told_like_any_other(form, preset_of):
    given = {"critics": ["PathAlign"], "PathAlign.scale": 5.0, "PathAlign.scael": 6.0}
    preset = preset_of(DWB, form(given))
    assert preset.ignored == ("PathAlign.scael",)
    assert preset.parameters.critic("PathAlign").scale == 5.0
    given = {"critics": ["GoalCritic"], "GoalCritic.cost_weight": 7.0, "GoalCritic.weight": 8.0}
    preset = preset_of(MPPI, form(given))
    assert preset.ignored == ("GoalCritic.weight",)
    assert preset.parameters.critic("GoalCritic").cost_weight == 7.0
    preset = preset_of(TEB, form({"footprint_model.radius": 0.25, "footprint_model.line": 1.0}))
    assert preset.ignored == ("footprint_model.line",)
    assert preset.parameters.footprint_model.radius == 0.25


@pytest.mark.parametrize(
    ("name", "block"),
    [("primary_controller", ""), ("primary_controller.plugin", "primary_controller.")],
    ids=["beside", "block"],
)
def test_a_shims_primary_controller_reads_its_parameters_wherever_they_are(name, block, preset_of):
    preset = preset_of(
        SHIM,
        {
            name: MPPI,
            "angular_dist_threshold": 0.5,
            "angular_dist_treshold": 0.5,
            f"{block}vx_max": 0.4,
            f"{block}vx_mux": 0.4,
            f"{block}critics": ["GoalCritic"],
            f"{block}GoalCritic.cost_weight": 7.0,
            f"{block}CostCritic.cost_weight": 8.0,
            f"{block}publish_optimal_trajectory": True,
            f"{block}prune_distance": 1.5,
        },
    )
    assert preset.ignored == (
        "angular_dist_treshold",
        f"{block}vx_mux",
        f"{block}CostCritic.cost_weight",
        f"{block}publish_optimal_trajectory",
    )
    assert preset.path_handler == {"prune_distance": 1.5}
    assert preset.parameters.angular_dist_threshold == 0.5
    primary = preset.parameters.primary_controller
    assert primary.plugin == "mppi"
    assert primary.parameters.vx_max == 0.4
    assert primary.parameters.critic("GoalCritic").cost_weight == 7.0


@pytest.mark.parametrize("form", [dict, as_nested], ids=["dotted", "nested"])
def test_a_shim_over_a_shim_is_refused(form, preset_of):
    with pytest.raises(InputError, match=r"expected a controller other than a rotation shim"):
        preset_of(SHIM, form({"primary_controller.plugin": SHIM}))


@pytest.mark.parametrize("name", ["primary_controller", "primary_controller.plugin"])
def test_a_shim_over_a_controller_that_is_not_there_is_refused(name, preset_of):
    with pytest.raises(InputError, match=rf"FollowPath\.{name}: 'a::B' has no counterpart here"):
        preset_of(SHIM, {name: "a::B"})


def test_driving_backwards_is_told_where_a_graceful_controller_turns_first(preset_of):
    preset = preset_of(GRACEFUL, {"allow_backward": True})
    assert preset.ignored == ("allow_backward",)
    preset = preset_of(GRACEFUL, {"allow_backward": True, "initial_rotation": False})
    assert preset.ignored == ()


@pytest.mark.parametrize("plugin", [GRACEFUL, VECTOR_PURSUIT])
def test_the_search_distance_of_earlier_controllers_is_the_path_handlers(plugin, preset_of):
    preset = preset_of(plugin, {"max_robot_pose_search_dist": 4.0})
    assert preset.path_handler == {"max_robot_pose_search_dist": 4.0}
    assert preset.ignored == ()


def test_blocks_of_critics_that_are_not_listed_are_told_because_nav2_does_not_read_them(preset_of):
    preset = preset_of(DWB, "{critics: [PathDist], Twirling: {scale: 1.0}, GoalDist.scale: fast}")
    assert preset.ignored == ("Twirling.scale", "GoalDist.scale")
    preset = preset_of(MPPI, "{critics: [GoalCritic], CostCritic.cost_weight: 9.0}")
    assert preset.ignored == ("CostCritic.cost_weight",)
    assert "CostCritic" not in preset.parameters.model_dump()


def test_a_wrong_value_of_a_critic_is_still_refused(preset_of):
    with pytest.raises(InputError, match=r"FollowPath: PathAlign.scale: input should be a valid"):
        preset_of(DWB, "{critics: [PathAlign], PathAlign.scale: fast}")


@pytest.mark.parametrize("name", ["vx_samples", "vy_samples", "vtheta_samples"])
def test_fewer_samples_than_two_are_two_as_in_nav2(name, preset_of):
    assert getattr(preset_of(DWB, {"critics": ["PathDist"], name: 0}).parameters, name) == 0


def test_the_motion_model_of_mppi_may_be_named_by_its_block(preset_of):
    preset = preset_of(
        MPPI,
        """
        motion_model: car
        car: {plugin: "mppi::AckermannMotionModel", min_turning_r: 0.6}
        omni: {plugin: "mppi::OmniMotionModel"}
        AckermannConstraints: {min_turning_r: 0.9}
        """,
    )
    assert preset.parameters.motion_model == "Ackermann"
    # Where the model has a block, nothing else is read.
    assert preset.parameters.AckermannConstraints.min_turning_r == 0.6
    assert preset.ignored == ("omni.plugin", "AckermannConstraints.min_turning_r")


def test_the_motion_model_of_mppi_may_be_named_as_before_lyrical(preset_of):
    car = {"motion_model": "Ackermann", "AckermannConstraints.min_turning_r": 0.4}
    preset = preset_of(MPPI, car)
    assert preset.parameters.motion_model == "Ackermann"
    assert preset.parameters.AckermannConstraints.min_turning_r == 0.4
    assert preset.ignored == ()
    preset = preset_of(MPPI, car | {"motion_model": "DiffDrive"})
    assert preset.ignored == ("AckermannConstraints.min_turning_r",)


def test_parameters_that_a_motion_model_does_not_have_are_told(preset_of):
    preset = preset_of(MPPI, '{diff_drive: {plugin: "mppi::DiffDriveMotionModel", radius: 1.0}}')
    assert preset.parameters.motion_model == "DiffDrive"
    assert preset.ignored == ("diff_drive.radius",)
    car = {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.6, "radius": 1.0}
    preset = preset_of(MPPI, {"motion_model": "car", "car": car})
    assert preset.parameters.AckermannConstraints.min_turning_r == 0.6
    assert preset.ignored == ("car.radius",)


JAZZY_PATH = {
    "prune_distance": 1.7,
    "max_robot_pose_search_dist": 5.0,
    "enforce_path_inversion": True,
    "inversion_xy_tolerance": 0.15,
    "inversion_yaw_tolerance": 0.3,
}


def test_what_mppi_read_for_its_own_path_handler_is_the_path_handlers(preset_of):
    preset = preset_of(MPPI, JAZZY_PATH | {"batch_size": 500})
    assert preset.path_handler == JAZZY_PATH
    assert preset.ignored == ()
    assert preset.parameters.batch_size == 500
    handler = preset.robot(load_robot("wheelchair")).navigation.path_handler
    assert handler.model_dump(include=set(JAZZY_PATH)) == JAZZY_PATH


def test_a_server_that_cuts_the_plan_itself_leaves_such_parameters_unread(preset_of):
    preset = preset_of(MPPI, {"prune_distance": 1.7}, path_handler_plugins=["PathHandler"])
    assert preset.path_handler == {}
    assert preset.ignored == ("prune_distance",)


def test_the_older_name_of_the_speed_of_rpp_prevails_as_in_nav2(preset_of):
    preset = preset_of(RPP, "{max_linear_vel: 0.8, desired_linear_vel: 0.4}")
    assert preset.parameters.max_linear_vel == 0.4
    assert preset.ignored == ("max_linear_vel",)


def test_a_preset_from_a_nav2_file_reads_back_as_the_same(preset_of, tmp_path):
    preset = preset_of(MPPI, JAZZY_PATH | {"critics": ["GoalCritic"], "GoalCritic.cost_power": 2})
    path = tmp_path / "again.yaml"
    path.write_text(as_yaml(preset))
    (again,) = load_parameter_file(path)
    assert again.parameters == preset.parameters
    assert again.path_handler == preset.path_handler


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


USERS_CRITICS = """
    from pydantic import Field

    from drake_navbench.controllers.dwb.critics import base as dwb
    from drake_navbench.controllers.mppi.critics import base as mppi
    from drake_navbench.typed_files.typed_yaml import FrozenModel


    class KeepLeft(dwb.Critic):
        class Parameters(dwb.CriticParameters):
            border_y: float = Field(0.0, description="Smallest y of an end pose [m].")

        def score(self, scene, memory): ...


    class Curve(FrozenModel):
        radius: float = 1.0


    class TurnLeft(mppi.Critic):
        class Parameters(mppi.CriticParameters):
            weight: float = Field(1.0, ge=0.0, description="Weight of the yaw [1/rad].")
            curve: Curve = Curve()

        def score(self, batch): ...
"""


@pytest.fixture
def users_critics(install_package):
    """Installs a distribution with a critic for DWB and one for MPPI."""
    points = {
        "drake_navbench.dwb_critics": {"KeepLeft": "users_critics.users_critics:KeepLeft"},
        "drake_navbench.mppi_critics": {"TurnLeft": "users_critics.users_critics:TurnLeft"},
    }
    install_package("users_critics", USERS_CRITICS, points)


@pytest.mark.usefixtures("users_critics")
@pytest.mark.parametrize("form", [dict, as_nested], ids=["dotted", "nested"])
def test_the_parameters_of_a_users_own_critic_reach_it(form, preset_of):
    preset = preset_of(
        DWB, form({"critics": ["KeepLeft"], "KeepLeft.scale": 3.0, "KeepLeft.border_y": 0.5})
    )
    held = critics_of(preset)["KeepLeft"]
    assert (held.scale, held.border_y) == (3.0, 0.5)
    given = {"critics": ["TurnLeft"], "TurnLeft.weight": 3.0, "TurnLeft.curve.radius": 0.5}
    preset = preset_of(MPPI, form(given))
    held = critics_of(preset)["TurnLeft"]
    assert (held.weight, held.curve.radius, held.enabled) == (3.0, 0.5, True)
    assert preset.ignored == ()


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
