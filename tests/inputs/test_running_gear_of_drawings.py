"""Wheels and masses come from a model itself, never from what a replay draws of it."""

from __future__ import annotations

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot

# The axles are at the base link, 0.1 m above the floor: a replay draws a copy that stands on it.
CART = """
<robot name="cart">
  <link name="base_link">
    <inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><box size="0.5 0.4 0.2"/></geometry></visual>
    <collision><geometry><box size="0.5 0.4 0.2"/></geometry></collision>
  </link>
  {wheels}
</robot>
"""
WHEEL = """
  <link name="{side}_wheel">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision>
      <origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry>
    </collision>
  </link>
  <joint name="{side}_joint" type="continuous">
    <parent link="base_link"/><child link="{side}_wheel"/>
    <origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>
  </joint>
"""


def test_a_drawing_of_a_model_gives_no_wheels(tmp_path):
    wheels = WHEEL.format(side="left", y=0.22) + WHEEL.format(side="right", y=-0.22)
    (tmp_path / "cart.urdf").write_text(CART.format(wheels=wheels))
    robot_file = tmp_path / "cart.yaml"
    text = "description: cart\nlike: cart.urdf\ndrive: {physics: multibody}\n"
    robot_file.write_text(text)
    with pytest.raises(InputError, match=r"cart.yaml: drive.physics: multibody takes wheels and "):
        load_robot(str(robot_file)).running_gear(str(robot_file))
    robot_file.write_text(f"{text}model: cart.urdf\n")
    # The model itself is asked, and has no casters.
    with pytest.raises(InputError, match=r"cart.urdf: expected casters"):
        load_robot(str(robot_file)).running_gear(str(robot_file))
