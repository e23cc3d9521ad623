"""The parameters of a preset as the original of a release has them."""

from __future__ import annotations

from ast import literal_eval

import pytest

from drake_navbench.controller import CONTROLLERS
from drake_navbench.controllers.external.messages import configure_message
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.rotation_shim.parameters import RotationShimParameters
from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.inputs.presets import original_plugin
from drake_navbench.inputs.robot import load_robot
from drake_navbench.trial.column_controller import controller_setup

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def test_most_have_the_same_names_in_every_release():
    values = {"lookahead_dist": 0.5}
    given = values | {"nav2_release": "jazzy"}
    assert RegulatedPurePursuitParameters.for_original(given, "humble") == values


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


def test_tebs_original_has_the_robots_outline_as_a_polygon_in_one_text():
    given = {"max_vel_x": 0.4, "footprint_model": {"type": "from_footprint"}}
    values = TebUpstreamParameters.for_original(given, "humble")
    assert values["max_vel_x"] == 0.4
    setup = controller_setup(load_robot("wheelchair"))
    told = configure_message(setup, {"parameters": values})["parameters"]["parameters"]
    assert told["footprint_model"]["type"] == "polygon"
    assert literal_eval(told["footprint_model"]["vertices"]) == setup.footprint.tolist()


def test_tebs_original_has_given_corners_in_one_text():
    corners = [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]]
    given = {"footprint_model": {"type": "polygon", "vertices": corners}}
    (model,) = TebUpstreamParameters.for_original(given, "humble").values()
    assert literal_eval(model["vertices"]) == corners


def test_tebs_original_has_the_resizing_as_a_number():
    assert TebUpstreamParameters.for_original({"teb_autosize": False}, "humble") == {
        "teb_autosize": 0.0
    }


def test_the_port_of_teb_names_its_original_and_a_nav2_file_selects_the_other_one():
    assert original_plugin("teb_upstream") == "teb_local_planner::TebLocalPlannerROS"
    assert CONTROLLERS.load("teb_upstream").nav2_plugin is None
