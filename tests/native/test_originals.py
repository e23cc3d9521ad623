"""The parameters of a preset as the original of a release has them."""

from __future__ import annotations

import pytest

from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.rotation_shim.parameters import RotationShimParameters
from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def test_most_have_the_same_names_in_every_release():
    values = {"lookahead_dist": 0.5}
    assert RegulatedPurePursuitParameters.for_original(values, "humble") == values


@pytest.mark.parametrize(
    ("given", "release", "expected"),
    [
        ({}, "jazzy", {"motion_model": "DiffDrive"}),
        (
            {},
            "lyrical",
            {"motion_model": "diff_drive", "diff_drive": {"plugin": "mppi::DiffDriveMotionModel"}},
        ),
        (
            {"motion_model": "Ackermann", "AckermannConstraints": {"min_turning_r": 0.3}},
            "lyrical",
            {
                "motion_model": "Ackermann",
                "Ackermann": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.3},
            },
        ),
        (
            {
                "motion_model": "car",
                "car": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.3},
            },
            "kilted",
            {"motion_model": "Ackermann", "AckermannConstraints": {"min_turning_r": 0.3}},
        ),
    ],
)
def test_mppis_motion_model_is_a_plugin_since_lyrical(given, release, expected):
    assert (
        MppiParameters.for_original({"vx_max": 0.4} | given, release) == {"vx_max": 0.4} | expected
    )


def test_the_shims_primary_controller_has_a_block_since_lyrical():
    given = {
        "primary_controller": {"plugin": "rpp", "lookahead_dist": 0.5},
        "rotate_to_goal_heading": True,
        "nav2_release": "jazzy",
    }
    newest = RotationShimParameters.for_original(given, "lyrical")
    assert newest == {
        "primary_controller": {"plugin": RPP, "lookahead_dist": 0.5},
        "rotate_to_goal_heading": True,
    }
    earlier = RotationShimParameters.for_original(given, "jazzy")
    assert earlier == {
        "primary_controller": RPP,
        "lookahead_dist": 0.5,
        "rotate_to_goal_heading": True,
    }
