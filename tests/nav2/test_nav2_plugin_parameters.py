"""Parameters that a plugin of Nav2 reads in a way of its own, or has read in a release."""

import pytest
from nav2_texts import DWB, GRACEFUL, MPPI, RPP, SHIM, VECTOR_PURSUIT, as_nested

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import as_yaml
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.controllers import load_parameter_file


def test_before_lyrical_the_cruise_speed_had_one_name(preset_of):
    given = {"max_linear_vel": 9.0, "desired_linear_vel": 0.75, "nav2_release": "kilted"}
    preset = preset_of(RPP, given)
    assert preset.parameters.max_linear_vel == 0.75
    assert preset.ignored == ("max_linear_vel",)


def test_the_older_name_of_the_speed_of_rpp_prevails_as_in_nav2(preset_of):
    preset = preset_of(RPP, "{max_linear_vel: 0.8, desired_linear_vel: 0.4}")
    assert preset.parameters.max_linear_vel == 0.4
    assert preset.ignored == ("max_linear_vel",)


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


def test_rpp_takes_a_least_lookahead_of_nothing_as_nav2_does(preset_of):
    scaled = {"use_velocity_scaled_lookahead_dist": True, "min_lookahead_dist": 0.0}
    assert preset_of(RPP, scaled).parameters.min_lookahead_dist == 0.0
    with pytest.raises(InputError, match="min_lookahead_dist"):
        preset_of(RPP, scaled | {"min_lookahead_dist": -0.1})


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


def test_before_lyrical_no_block_belongs_to_a_motion_model(preset_of):
    car = {"motion_model": "Ackermann", "Ackermann": {"min_turning_r": 0.7}}
    limits = {"AckermannConstraints.min_turning_r": 0.4}
    preset = preset_of(MPPI, car | limits | {"nav2_release": "jazzy"})
    assert preset.parameters.motion_model == "Ackermann"
    assert preset.parameters.AckermannConstraints.min_turning_r == 0.4
    assert preset.ignored == ("Ackermann.min_turning_r",)
    with pytest.raises(InputError, match=r"motion_model: Ackermann\.plugin: got None"):
        preset_of(MPPI, car | {"nav2_release": "lyrical"})


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


def test_a_preset_from_a_nav2_file_reads_back_as_the_same(preset_of, tmp_path):
    preset = preset_of(MPPI, JAZZY_PATH | {"critics": ["GoalCritic"], "GoalCritic.cost_power": 2})
    path = tmp_path / "again.yaml"
    path.write_text(as_yaml(preset))
    (again,) = load_parameter_file(path)
    assert again.parameters == preset.parameters
    assert again.path_handler == preset.path_handler


@pytest.mark.parametrize("plugin", [MPPI, SHIM])
def test_a_preset_of_an_older_release_keeps_that_releases_defaults(plugin, preset_of, tmp_path):
    given = {"nav2_release": "humble", "critics": ["ObstaclesCritic"]}
    if plugin == SHIM:
        given |= {"primary_controller": MPPI, "angular_dist_threshold": 0.5}
    preset = preset_of(plugin, given)
    path = tmp_path / "kept.yaml"
    path.write_text(as_yaml(preset))
    (again,) = load_parameter_file(path)

    def driven(column):
        parameters = column.parameters
        if plugin == SHIM:
            parameters = parameters.primary_controller.parameters
        return parameters.as_read()

    # Since Jazzy it is ten times that.
    assert driven(preset).ObstaclesCritic.collision_cost == 1e4
    assert driven(again) == driven(preset)


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
