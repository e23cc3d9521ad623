"""Files of small robots and worlds, for the tests of what describes them, and what is told."""

from __future__ import annotations

from pathlib import Path

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot

# A box of 0.6 m x 0.4 m on two wheels of 0.1 m radius, 0.5 m apart, with a lidar 0.3 m over the
# floor and 0.2 m ahead; its plugin lets it drive 0.4 m/s.
XACRO = """<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="length" default="0.6"/>
  <xacro:include filename="$(find cart_parts)/urdf/wheel.xacro"/>
  <link name="base_footprint"/>
  <joint name="up" type="fixed"><parent link="base_footprint"/><child link="base_link"/>
    <origin xyz="0 0 0.1"/></joint>
  <link name="base_link">
    <inertial><mass value="20"/></inertial>
    <collision><origin xyz="0 0 0.05"/>
      <geometry><box size="$(arg length) 0.4 0.2"/></geometry></collision>
  </link>
  <xacro:wheel name="left_wheel" y="0.25"/>
  <xacro:wheel name="right_wheel" y="-0.25"/>
  <joint name="mount" type="fixed"><parent link="base_link"/><child link="laser"/>
    <origin xyz="0.2 0 0.2"/></joint>
  <link name="laser"/>
  <gazebo reference="laser"><sensor name="front" type="gpu_lidar">
    <update_rate>5</update_rate>
    <lidar><scan><horizontal><samples>180</samples><min_angle>-1.57</min_angle>
      <max_angle>1.57</max_angle></horizontal></scan>
      <range><min>0.1</min><max>8</max></range>
      <noise><type>gaussian</type><stddev>0.02</stddev></noise></lidar>
  </sensor></gazebo>
  <gazebo><plugin filename="gz-sim-diff-drive-system" name="gz::sim::systems::DiffDrive">
    <wheel_separation>0.5</wheel_separation><wheel_radius>0.1</wheel_radius>
    <max_linear_velocity>0.4</max_linear_velocity>
    <max_linear_acceleration>1.5</max_linear_acceleration>
  </plugin></gazebo>
</robot>
"""
WHEEL = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="name y">
    <joint name="${name}_joint" type="continuous"><parent link="base_link"/>
      <child link="${name}"/><origin xyz="0 ${y} 0"/><axis xyz="0 1 0"/></joint>
    <link name="${name}"><inertial><mass value="1"/></inertial>
      <collision><origin rpy="${pi/2} 0 0"/>
        <geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  </xacro:macro>
</robot>
"""


def write_repository(folder: Path) -> Path:
    """Writes a repository with two packages beside each other; returns the robot's xacro file."""
    (folder / ".git").mkdir(parents=True)
    for name, file, text in (
        ("cart_description", "urdf/cart.urdf.xacro", XACRO),
        ("deeper/cart_parts", "urdf/wheel.xacro", WHEEL),
    ):
        package = folder / name
        (package / file).parent.mkdir(parents=True)
        (package / file).write_text(text)
        said = f"<package><name>{package.name}</name></package>"
        (package / "package.xml").write_text(said)
    return folder / "cart_description" / "urdf" / "cart.urdf.xacro"


def world(body: str) -> str:
    """Returns the text of a world."""
    return f'<sdf version="1.7"><world name="w">{body}</world></sdf>'


def standing(name: str, geometry: str, pose: str) -> str:
    """Returns a static model of one shape."""
    return (
        f'<model name="{name}"><static>true</static><pose>{pose}</pose><link name="l">'
        f'<collision name="c"><geometry>{geometry}</geometry></collision></link></model>'
    )


def box(name: str, size: str, pose: str) -> str:
    """Returns a static box."""
    return standing(name, f"<box><size>{size}</size></box>", pose)


# Walls around 8 m x 6 m with the origin in the middle, 0.2 m thick and 1 m high.
ROOM = "".join(
    box(f"wall_{index}", size, pose)
    for index, (size, pose) in enumerate(
        (
            ("8.4 0.2 1", "0 3.1 0.5 0 0 0"),
            ("8.4 0.2 1", "0 -3.1 0.5 0 0 0"),
            ("0.2 6 1", "4.1 0 0.5 0 0 0"),
            ("6 0.2 1", "-4.1 0 0.5 0 0 1.5707963"),
        )
    )
)


def link(body: str, name: str = "base_link") -> str:
    """Returns a link of a robot."""
    return f'<link name="{name}">{body}</link>'


def collision(geometry: str, origin: str = "") -> str:
    """Returns a shape that a link collides with."""
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


# 0.6 m x 0.4 m.
BOX = collision('<box size="0.6 0.4 0.2"/>')


def urdf(folder: Path, body: str, name: str = "cart.urdf") -> Path:
    """Writes a robot of these links; returns its file."""
    path = folder / name
    path.write_text(f'<robot name="cart">{body}</robot>')
    return path


def rows(path: Path, status: Status) -> list[str]:
    """Returns what is told of a robot's model with this status."""
    return [row.text for row in describe_robot(path).check.of(status)]
