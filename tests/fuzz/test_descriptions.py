"""The same of models and worlds of Gazebo, of drawings of models, and of Clearpath's robot.yaml."""

from __future__ import annotations

import warnings

from bounds import fuzz, only_input_errors
from damage import as_text, damaged, damaged_text
from hypothesis import given

from drake_navbench.analysis.replay.robot_model import SdfModel
from drake_navbench.inputs.descriptions.clearpath_robot import clearpath_xacro
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.gazebo_world import load_gazebo_world, scenario_in_world
from drake_navbench.inputs.robot import load_robot

SDF = """<sdf version="1.8"><model name="cart">
  <link name="base_link">
    <inertial><pose>0 0 0.1 0 0 0</pose><mass>12</mass>
      <inertia><ixx>0.5</ixx><iyy>0.5</iyy><izz>0.8</izz></inertia></inertial>
    <collision name="c"><geometry><box><size>0.6 0.4 0.2</size></box></geometry></collision>
    <visual name="v"><geometry><capsule><radius>0.1</radius><length>0.3</length></capsule>
      </geometry><material><diffuse>1 0 0 1</diffuse></material></visual>
    <sensor name="scan" type="gpu_lidar"><update_rate>5</update_rate><lidar><scan><horizontal>
      <samples>90</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal></scan>
      <range><min>0.1</min><max>8</max></range></lidar></sensor>
  </link>
  <link name="left_wheel"><pose relative_to="base_link">0 0.2 0 -1.57 0 0</pose>
    <collision name="c"><geometry><cylinder><radius>0.1</radius><length>0.04</length></cylinder>
      </geometry></collision></link>
  <joint name="left_wheel_joint" type="revolute"><parent>base_link</parent>
    <child>left_wheel</child><axis><xyz>0 0 1</xyz><limit><lower>-1e16</lower><upper>1e16</upper>
      <velocity>8</velocity></limit><dynamics><damping>0.1</damping></dynamics></axis></joint>
  <plugin name="drive" filename="gz-sim-diff-drive-system"><wheel_separation>0.4</wheel_separation>
    <wheel_radius>0.1</wheel_radius><max_linear_velocity>0.7</max_linear_velocity></plugin>
</model></sdf>
"""
WORLD = """<sdf version="1.8"><world name="room">
  <model name="wall"><static>true</static><pose>3 0 0.5 0 0 0.3</pose><link name="l">
    <collision name="c"><geometry><box><size>0.2 4 1</size></box></geometry></collision>
    <collision name="d"><pose>0 1 0 0.5 0 0</pose><geometry><cylinder><radius>0.3</radius>
      <length>1</length></cylinder></geometry></collision></link></model>
  <model name="post"><link name="l"><collision name="c"><geometry><polyline>
    <point>0 0</point><point>1 0</point><point>0 1</point><height>2</height></polyline></geometry>
    </collision></link><model name="in"><pose>1 1 0 0 0 0</pose><link name="l">
    <collision name="c"><geometry><sphere><radius>0.4</radius></sphere></geometry></collision>
    </link></model></model>
  <include><uri>model://gone</uri><pose>1 0 0 0 0 0</pose></include>
  <actor name="walker"><script><loop>true</loop><trajectory id="0" type="walk">
    <waypoint><time>0</time><pose>0 2 0 0 0 0</pose></waypoint>
    <waypoint><time>4</time><pose>2 2 0 0 0 0</pose></waypoint></trajectory></script></actor>
  <state world_name="room"><model name="wall"><pose>4 0 0.5 0 0 0</pose></model></state>
</world></sdf>
"""
ROBOT = {
    "serial_number": "a200-0000",
    "platform": {"attachments": [{"name": "a", "type": "a200.bumper", "xyz": [0.1, 0, 0]}]},
    "mounts": {"bracket": [{"parent": "base_link"}]},
    "sensors": {
        "lidar2d": [
            {"model": "ust", "parent": "a", "rpy": [0, 0, 1], "ros_parameters": {"angle_min": -1.5}}
        ]
    },
}


@fuzz
@given(text=damaged_text(SDF))
def test_models_of_gazebo_and_their_drawings(text, file):
    path = file("robot.sdf", text)
    with only_input_errors(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        load_robot(str(path))
    with only_input_errors():
        SdfModel(path)


@fuzz
@given(text=damaged_text(WORLD))
def test_worlds_of_gazebo(text, file):
    path = file("room.world", text)
    with only_input_errors(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = load_gazebo_world(path, lidar_m=0.2, top_m=0.4)
        scenario_in_world(found, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


@fuzz
@given(document=damaged(ROBOT))
def test_robots_of_clearpath(document, file):
    path = file("robot.yaml", as_text(document))
    for place in ("a200/a200", "a200/attachments/bumper", "ust"):
        package = "sensors" if place == "ust" else "platform"
        name = f"clearpath_{package}_description"
        file(f"{name}/package.xml", f"<package><name>{name}</name></package>")
        macro = place.rpartition("/")[2]
        file(
            f"{name}/urdf/{place}.urdf.xacro",
            f'<robot><xacro:macro name="{macro}" params="name parent_link *origin"/></robot>',
        )
    with only_input_errors():
        clearpath_xacro(path, Packages(path))
