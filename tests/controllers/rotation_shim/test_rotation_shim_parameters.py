"""Parameters of the Rotation Shim: a block of the primary controller, or all in one block."""

from __future__ import annotations

import pytest

from drake_navbench.controller import AskedSpeeds
from drake_navbench.controllers.rotation_shim import RotationShimParameters
from drake_navbench.errors import InputError
from drake_navbench.typed_files.typed_yaml import validate

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
SHIM = "nav2_rotation_shim_controller::RotationShimController"


def parameters_of(values):
    return validate(RotationShimParameters, values, "file")


def test_both_eras_of_a_file_give_the_same_parameters():
    own = {"angular_dist_threshold": 0.5}
    nested = parameters_of(own | {"primary_controller": {"plugin": RPP, "lookahead_dist": 0.7}})
    flat = parameters_of(own | {"primary_controller": RPP, "lookahead_dist": 0.7})
    assert nested == flat
    assert nested.primary_controller.plugin == "rpp"
    assert nested.primary_controller.parameters.lookahead_dist == 0.7


def test_in_one_block_a_parameter_of_both_goes_to_both_and_in_two_to_its_own():
    flat = parameters_of({"primary_controller": RPP, "max_angular_accel": 1.5})
    assert flat.max_angular_accel == 1.5
    assert flat.primary_controller.parameters.max_angular_accel == 1.5
    nested = parameters_of({"primary_controller": {"plugin": RPP}, "max_angular_accel": 1.5})
    assert nested.primary_controller.parameters.max_angular_accel == 3.2


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (
            {"primary_controller": SHIM},
            f"file: primary_controller: expected a controller other than a rotation shim, "
            f"got '{SHIM}'",
        ),
        (
            {"primary_controller": {"plugin": "rotation_shim"}},
            "file: primary_controller.plugin: expected a controller other than a rotation shim, "
            "got 'rotation_shim'",
        ),
        ({}, "file: primary_controller: expected a controller's name or plugin type"),
        (
            {"primary_controller": {"plugin": "rp"}},
            "file: primary_controller.plugin: expected a controller's name or plugin type; "
            "did you mean 'rpp'?, got 'rp'",
        ),
        (
            {"primary_controller": {"plugin": "rpp", "lookahed_dist": 1.0}},
            "file: primary_controller.lookahed_dist: unknown field; "
            "did you mean 'lookahead_dist'?, got 1.0",
        ),
        (
            {"primary_controller": {"plugin": "rpp", "max_lookahead_dist": -1.0}},
            "file: primary_controller.max_lookahead_dist: input should be greater than 0, got -1.0",
        ),
        (
            {"primary_controller": "rpp", "lookahead_dist": "far"},
            "file: lookahead_dist: input should be a valid number, got 'far'",
        ),
        (
            {"primary_controller": {"plugin": "rpp"}, "lookahead_dist": 1.0},
            "file: lookahead_dist: unknown field",
        ),
        (
            {"primary_controller": {"plugin": "dwb", "critics": ["PathDist"], "PathDist.x": 1}},
            "file: primary_controller.PathDist.x: unknown field",
        ),
        (
            {"primary_controller": {"plugin": "dwb"}},
            "file: primary_controller.critics: missing, but required",
        ),
        (
            {"primary_controller": {"plugin": "rpp"}, "nav2_release": "foxy"},
            "file: nav2_release: input should be 'humble', 'iron', 'jazzy', 'kilted' or 'lyrical'",
        ),
    ],
)
def test_what_is_wrong_is_one_line_with_its_place(values, told):
    with pytest.raises(InputError) as raised:
        parameters_of(values)
    (line,) = str(raised.value).splitlines()
    assert line.startswith(told)


@pytest.mark.parametrize("primary", [{"plugin": "rpp"}, {"plugin": "graceful", "lambda": 3.0}])
def test_resolved_parameters_can_be_read_again(primary):
    resolved = parameters_of({"primary_controller": primary, "closed_loop": False})
    assert parameters_of(resolved.model_dump(mode="json")) == resolved


def test_a_primary_controller_with_critics_keeps_their_blocks():
    block = {"plugin": "dwb", "critics": ["PathDist"], "PathDist": {"scale": 7.0}}
    resolved = parameters_of({"primary_controller": block})
    assert resolved.primary_controller.parameters.critic("PathDist").scale == 7.0
    dumped = resolved.model_dump(mode="json")["primary_controller"]
    assert dumped["PathDist"]["scale"] == 7.0
    assert parameters_of(resolved.model_dump(mode="json")) == resolved


def test_the_base_must_turn_as_fast_as_the_shim_does():
    block = {"plugin": "dwb", "critics": [], "max_vel_x": 0.4, "max_vel_theta": 1.0}
    block["critics"] = ["PathDist"]
    asked = parameters_of({"primary_controller": block}).asked_speeds()
    # DWB's limits of acceleration are 0 unless they are given.
    assert asked == AskedSpeeds(0.4, 0.0, 1.8, 0.0, 0.0, 0.0)
    rpp = parameters_of({"primary_controller": "rpp"})
    assert rpp.asked_speeds() == AskedSpeeds(0.5, None, None)


@pytest.mark.parametrize("nested", [True, False])
def test_a_shim_over_itself_has_no_parameters_of_a_primary_controller(nested):
    plugin = "nav2_rotation_shim_controller::RotationShimController"
    values = {"primary_controller": {"plugin": plugin} if nested else plugin, "lookahead_dist": 1.0}
    assert RotationShimParameters.primary_model(values) is None
    assert RotationShimParameters.path_handler_fields(values) == {}
