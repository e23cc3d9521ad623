"""What a Nav2 file gives a controller reaches it whole; what it has no use for is told."""

import pytest
from nav2_texts import DWB, GRACEFUL, MPPI, RPP, SHIM, TEB, VECTOR_PURSUIT, as_nested

from drake_navbench.controllers.critic_parameters import ParametersWithCritics
from drake_navbench.controllers.rotation_shim import RotationShimParameters
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import installed_controllers
from drake_navbench.inputs.robot import load_robot
from drake_navbench.trial.column_controller import make_controller
from drake_navbench.typed_files.dotted_names import flattened

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
    # By near_collision_cost alone it would be of Jazzy.
    release = {"nav2_release": "lyrical"}
    preset = preset_of(PLUGINS[controller], given | {"critics": critics} | release)
    built = critics_of(preset)
    assert set(built) == set(critics)
    for name, value in given.items():
        critic, _, parameter = name.partition(".")
        held = getattr(built[critic], "critic_class" if parameter == "class" else parameter)
        assert (list(held) if isinstance(held, tuple) else held) == value, name


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


def test_blocks_of_critics_that_are_not_listed_are_told_because_nav2_does_not_read_them(preset_of):
    preset = preset_of(DWB, "{critics: [PathDist], Twirling: {scale: 1.0}, GoalDist.scale: fast}")
    assert preset.ignored == ("Twirling.scale", "GoalDist.scale")
    preset = preset_of(MPPI, "{critics: [GoalCritic], CostCritic.cost_weight: 9.0}")
    assert preset.ignored == ("CostCritic.cost_weight",)
    assert "CostCritic" not in preset.parameters.model_dump()


def test_a_wrong_value_of_a_critic_is_still_refused(preset_of):
    with pytest.raises(InputError, match=r"FollowPath: PathAlign.scale: input should be a valid"):
        preset_of(DWB, "{critics: [PathAlign], PathAlign.scale: fast}")
