"""A robot may come from its SDF or URDF: outline and mass from the model, all else by default."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.robot_model import read_robot_model
from drake_navbench.kernels.footprint import pad_footprint

# A box of 0.6 m x 0.4 m, 0.1 m ahead of the base link, above which stands a base_footprint; a wheel
# of 0.1 m radius lies on its side beyond it. The visual is larger, and is not asked.
URDF = """<robot name="cart">
  <link name="base_footprint"/>
  <joint name="up" type="fixed"><parent link="base_footprint"/><child link="base_link"/>
    <origin xyz="0 0 0.1"/></joint>
  <link name="base_link">
    <inertial><mass value="20"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.1 0 0.1"/><geometry><box size="0.6 0.4 0.2"/></geometry></collision>
    <visual><geometry><box size="2 2 0.1"/></geometry></visual>
  </link>
  <joint name="axle" type="continuous"><parent link="base_link"/><child link="wheel"/>
    <origin xyz="0 0.25 0"/><axis xyz="0 1 0"/></joint>
  <link name="wheel">
    <inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5707963 0 0"/>
      <geometry><cylinder radius="0.1" length="0.04"/></geometry></collision>
  </link>
</robot>
"""


def test_outline_is_the_hull_of_the_collision_shapes_and_mass_that_of_all_links(tmp_path):
    (tmp_path / "cart.urdf").write_text(URDF)
    model = read_robot_model(tmp_path / "cart.urdf")
    corners = [[-0.2, -0.2], [0.4, -0.2], [0.4, 0.2], [0.1, 0.27], [-0.1, 0.27], [-0.2, 0.2]]
    difference = shapely.Polygon(model.outline) ^ shapely.Polygon(corners)
    assert difference.area < 1e-4
    assert shapely.Polygon(model.outline).exterior.is_ccw
    assert model.mass_kg == pytest.approx(22.0)


def test_a_model_alone_is_a_robot(tmp_path):
    path = tmp_path / "cart.urdf"
    path.write_text(URDF)
    robot = load_robot(str(path))
    assert robot.mass_kg == pytest.approx(22.0)
    assert robot.model_path == path
    assert robot.footprint is not None


def test_a_robot_file_beside_it_counts_more(tmp_path):
    (tmp_path / "cart.urdf").write_text(URDF)
    path = tmp_path / "cart.yaml"
    path.write_text("description: cart\nmodel: cart.urdf\nmass_kg: 50.0\n")
    robot = load_robot(str(path))
    assert robot.mass_kg == 50.0
    np.testing.assert_allclose(robot.outline, load_robot(str(tmp_path / "cart.urdf")).outline)
    path.write_text("description: cart\nmodel: cart.urdf\nrobot_radius: 0.5\n")
    assert load_robot(str(path)).is_circle


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<robot", "cannot be read as a robot's model"),
        (URDF.replace("base_link", "chassis"), "cannot be read as a robot's model"),
        ('<robot name="a"><link name="base_link"/></robot>', "found none"),
    ],
)
def test_a_model_that_is_wrong_is_one_line_with_its_file(tmp_path, text, reason):
    path = tmp_path / "cart.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        load_robot(str(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_model_is_named(tmp_path):
    with pytest.raises(InputError, match=r"cart\.sdf"):
        load_robot(str(tmp_path / "cart.sdf"))


def test_the_costmap_may_take_another_outline_than_the_one_that_touches():
    robot = load_robot("turtlebot3_waffle")
    assert robot.is_circle
    np.testing.assert_allclose(np.hypot(*robot.costmap_outline.T), 0.22)
    np.testing.assert_allclose(robot.outline, robot.collision_outline)
    padding = robot.navigation.local_costmap.footprint_padding
    np.testing.assert_array_equal(
        robot.padded_outline, pad_footprint(robot.costmap_outline, padding)
    )
