"""The body of the robot that a Nav2 file drives is the model's, where the user has one."""

from pathlib import Path

import numpy as np
import pytest
from nav2_setups import read_nav2_files

from drake_navbench.controller import AskedSpeeds
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.body import drive_for

FILE = """
local_costmap:
  local_costmap:
    ros__parameters: {footprint: "[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]"}
"""
URDF = """<robot name="cart"><link name="base_link">
  <inertial><mass value="40"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <collision><geometry><box size="0.8 1.2 0.4"/></geometry></collision>
</link></robot>
"""


@pytest.fixture
def rows_and_robot(tmp_path: Path):
    """A function from a base robot to what becomes of FILE's footprint, and to the robot."""
    path = tmp_path / "nav2.yaml"
    path.write_text(FILE)

    def read(base: str):
        setup = read_nav2_files([path], load_robot(base), base)
        rows = [row for row in setup.check.rows if row.parameter == "footprint"]
        return rows, setup.robot

    return read


def test_the_body_of_a_model_touches_obstacles_and_the_files_outline_is_the_costmaps(
    rows_and_robot, tmp_path
):
    model = tmp_path / "cart.urdf"
    model.write_text(URDF)
    (row,), robot = rows_and_robot(str(model))
    assert np.ptp(robot.outline, axis=0).tolist() == [0.8, 1.2]
    assert np.ptp(robot.costmap_outline, axis=0).tolist() == [0.4, 0.4]
    assert robot.model_path is not None
    # Padded by 0.01 m: the corner (0.4, 0.6) is 0.19 and 0.39 m outside.
    assert row.status is Status.DOUBTFUL
    assert row.remark.endswith("0.80 x 1.20 m, which reaches 0.43 m beyond it")


def test_a_robot_file_of_the_users_own_keeps_its_body(rows_and_robot, tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text("description: own\nrobot_radius: 0.1\n")
    (row,), robot = rows_and_robot(str(own))
    np.testing.assert_allclose(np.hypot(*robot.outline.T), 0.1)
    assert not robot.is_circle
    assert row.status is Status.OTHER_FORM


def test_a_built_in_robot_lends_its_drive_and_the_file_gives_the_body(rows_and_robot):
    (row,), robot = rows_and_robot("round_robot")
    assert np.ptp(robot.outline, axis=0).tolist() == [0.4, 0.4]
    assert row.status is Status.USED


def test_the_body_of_the_same_outline_needs_no_word(rows_and_robot, tmp_path):
    own = tmp_path / "own.yaml"
    square = "[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]"
    own.write_text(f"description: own\nfootprint: {square}\n")
    (row,), robot = rows_and_robot(str(own))
    assert robot.collision_outline is None
    assert row.status is Status.USED


def test_a_footprint_whose_edge_the_base_frame_lies_on_is_made_larger(tmp_path):
    """A forklift drives with the axle at the rear end of its outline; Nav2 takes it as it is."""
    path = tmp_path / "nav2.yaml"
    path.write_text(FILE.replace("-0.2, -0.2], [-0.2, 0.2", "0.0, -0.2], [0.0, 0.2"))
    setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair")
    (row,) = [row for row in setup.check.rows if row.parameter == "footprint"]
    assert row.status is Status.STAND_IN
    assert "the base frame's origin is no point inside it" in row.remark
    assert setup.robot.outline.min(axis=0) == pytest.approx([-0.01, -0.2])
    assert setup.robot.outline.max(axis=0) == pytest.approx([0.2, 0.2])


def test_the_base_drives_as_the_fastest_controller_of_a_file_needs():
    """One controller drives sideways, another ahead only, as fast as the base."""
    base = load_robot("wheelchair")
    needed = [AskedSpeeds(max_lateral_mps=0.3), AskedSpeeds(max_linear_mps=0.9)]
    for order in (needed, needed[::-1]):
        fields, remarks = drive_for({}, order, base, "wheelchair")
        assert fields["max_lateral_velocity_mps"] == 0.3
        assert fields["max_linear_velocity_mps"] == 0.9
        assert remarks["type"].startswith("omnidirectional, as a controller drives sideways")
