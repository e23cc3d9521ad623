"""A robot's model as it lies in its repository says its outline, mass, drive and limits."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from descriptions_scenes import BOX, XACRO, collision, link, rows, urdf, write_repository

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.descriptions.body import shape_points
from drake_navbench.inputs.descriptions.model import Shape
from drake_navbench.inputs.robot import load_robot


def test_lidar_drive_mass_and_wheels_are_those_of_the_model(tmp_path):
    robot = load_robot(str(write_repository(tmp_path)))
    lidar = robot.lidar
    assert lidar.pose == pytest.approx((0.2, 0.0, 0.0))
    assert lidar.height_m == pytest.approx(0.3)
    assert (lidar.beam_count, lidar.range_max_m, lidar.range_std_m) == (180, 8.0, 0.02)
    assert lidar.angle_span_rad == pytest.approx(3.14)
    assert lidar.period_s == pytest.approx(0.2)
    assert robot.drive.max_linear_velocity_mps == 0.4
    assert robot.drive.max_linear_acceleration_mps2 == 1.5
    assert robot.mass_kg == pytest.approx(22.0)


@pytest.mark.parametrize(
    ("kind", "size", "lowest", "highest"),
    [
        ("box", (0.6, 0.4, 0.2), (-0.3, -0.2, -0.1), (0.3, 0.2, 0.1)),
        ("cylinder", (0.1, 0.4), (-0.1, -0.1, -0.2), (0.1, 0.1, 0.2)),
        ("cone", (0.1, 0.4), (-0.1, -0.1, -0.2), (0.1, 0.1, 0.2)),
        ("sphere", (0.1,), (-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)),
        ("ellipsoid", (0.1, 0.2, 0.3), (-0.1, -0.2, -0.3), (0.1, 0.2, 0.3)),
        ("capsule", (0.1, 0.4), (-0.1, -0.1, -0.3), (0.1, 0.1, 0.3)),
        ("polyline", (0.4,), (0.0, 0.0, 0.0), (1.0, 2.0, 0.4)),
    ],
)
def test_a_shape_reaches_as_far_as_its_size_says(kind, size, lowest, highest):
    """A polyline stands on its corners; the other shapes have their middle at the origin."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]])
    points = shape_points(Shape(kind, np.eye(4), size, corners))
    assert points.min(axis=0) == pytest.approx(lowest)
    assert points.max(axis=0) == pytest.approx(highest)


CONTROLLERS = """
/**:
  base:
    ros__parameters:
      left_wheel_names: [left_wheel_joint]
      right_wheel_names: [right_wheel_joint]
      linear.x.max_velocity: 0.7
  controller_manager:
    ros__parameters:
      base: {type: diff_drive_controller/DiffDriveController}
"""


def test_the_limits_are_those_of_the_controllers_file_that_names_the_wheels(tmp_path):
    """The model names neither a drive's plugin nor a file of ros2_control."""
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    file = tmp_path / "my_controllers.yaml"
    # Of a key that is given twice the later one counts, as in ROS.
    line = "      linear.x.max_velocity: 0.7\n"
    file.write_text(CONTROLLERS.replace(line, line.replace("0.7", "0.6") + line))
    assert load_robot(str(path)).drive.max_linear_velocity_mps == 0.7
    file.write_text(CONTROLLERS.replace("left_wheel_joint", "other_wheel_joint"))
    assert load_robot(str(path), arguments={"length": "1"}).drive.max_linear_velocity_mps == 0.5


OF_ROS1 = """
type: diff_drive_controller/DiffDriveController
left_wheel: [left_wheel_joint]
right_wheel: right_wheel_joint
linear: {x: {has_velocity_limits: true, max_velocity: 0.7}}
"""


@pytest.mark.parametrize("indented", [False, True], ids=["a whole file", "under its name"])
def test_a_controllers_file_of_ros_1_is_known_by_its_type_whatever_its_name(tmp_path, indented):
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    text = f"cart: {{base: {{{','.join(OF_ROS1.split(chr(10))[1:-1])}}}}}" if indented else OF_ROS1
    (tmp_path / "drive.yaml").write_text(text)
    drive = load_robot(str(path)).drive
    assert (drive.type, drive.max_linear_velocity_mps) == ("differential", 0.7)


def test_the_controllers_file_is_the_robot_s_own_not_that_of_a_robot_beside_it(tmp_path):
    """Other packages in the folder of a workspace have wheels of the same names."""
    path = write_repository(tmp_path / "cart")
    (tmp_path / "cart" / ".git").rmdir()
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    for folder, speed in (("a_robot", "0.9"), ("cart/cart_bringup", "0.6")):
        file = tmp_path / folder / "my_controllers.yaml"
        file.parent.mkdir()
        file.write_text(CONTROLLERS.replace("0.7", speed))
    (tmp_path / "cart" / "package.xml").write_text("<package><name>cart</name></package>")
    assert load_robot(str(path)).drive.max_linear_velocity_mps == 0.6
    file.unlink()
    own = [tmp_path / "cart"]
    assert load_robot(str(path), packages=own).drive.max_linear_velocity_mps == 0.5


MECANUM = """
controller_manager:
  ros__parameters:
    base: {type: mecanum_drive_controller/MecanumDriveController}
base:
  ros__parameters:
    front_left_wheel_command_joint_name: left_wheel_joint
    rear_right_wheel_command_joint_name: right_wheel_joint
"""


def test_a_controllers_file_of_mecanum_wheels_makes_an_omnidirectional_base(tmp_path):
    """It names each wheel's joint by a key of its own, not the wheels of a side."""
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    file = tmp_path / "my_controllers.yaml"
    file.write_text(MECANUM)
    assert "(omnidirectional, by my_controllers.yaml)" in describe_robot(path).check.as_text(400)
    file.write_text(MECANUM.replace("left_wheel_joint", "other_wheel_joint"))
    told = describe_robot(path, arguments={"length": "1"}).check.as_text(300)
    # Nothing but the wheels tells the drive: mecanum wheels may look like any others.
    assumed = told.partition("Assumed; no file tells it")[2].partition("\n\n")[0]
    assert "drive: differential, by 2 wheels" in assumed


def test_a_controllers_file_tells_the_sideways_limits_of_mecanum_wheels(tmp_path):
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    limits = "    linear: {{x: {{max_velocity: 0.5}}{}}}\n"
    file = tmp_path / "my_controllers.yaml"
    file.write_text(MECANUM + limits.format(", y: {max_velocity: 0.3, max_acceleration: 0.8}"))
    drive = load_robot(str(path)).drive
    assert (drive.max_lateral_velocity_mps, drive.max_lateral_acceleration_mps2) == (0.3, 0.8)
    assert "max_lateral_velocity_mps 0.3" in describe_robot(path).check.as_text(400)
    # Untold, it is the limit ahead.
    file.write_text(MECANUM + limits.format(""))
    again = load_robot(str(path), arguments={"length": "1"})
    assert again.drive.max_lateral_velocity_mps == 0.5


def test_an_expansion_bomb_is_refused_before_it_is_expanded(tmp_path):
    path = tmp_path / "cart.urdf"
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    path.write_text(f'<!DOCTYPE r [<!ENTITY a0 "x">{entities}]><robot name="&a9;"/>')
    with pytest.raises(InputError, match=r"cart\.urdf: declares XML entities; expected none"):
        load_robot(str(path))


def test_a_body_without_collision_shapes_is_seen_where_a_wheel_alone_has_one(tmp_path):
    """The wheel is 0.3 m beside the base link: its hull is no outline around it."""
    wheel = collision('<cylinder radius="0.1" length="0.04"/>', '<origin xyz="0 0.3 0"/>')
    seen = BOX.replace("collision", "visual")
    path = urdf(tmp_path, link(wheel + seen))
    assert shapely.Polygon(load_robot(str(path)).outline).bounds == pytest.approx(
        (-0.3, -0.2, 0.3, 0.2)
    )
    assert "0.6 x 0.4 m, hull of the visual shapes" in describe_robot(path).check.as_text(300)


def test_what_was_refused_before_is_told(tmp_path):
    """No mass, a mesh that is gone beside a box, a material twice, an element nobody knows."""
    path = urdf(
        tmp_path,
        '<material name="a"/><material name="a"/><whatever/>'
        + link(BOX + collision('<mesh filename="package://gone/hull.stl"/>'), "chassis"),
    )
    with pytest.warns(InputWarning, match=r"left out package://gone/hull\.stl"):
        robot = load_robot(str(path))
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.3, -0.2, 0.3, 0.2))
    told = " ".join(rows(path, Status.STAND_IN))
    assert "0 kg in all links" in told
    assert "base frame (chassis)" in describe_robot(path).check.as_text(200)


def test_relative_to_places_links_and_inertials_of_an_sdf(tmp_path):
    """The mast stands at x = 1 of the base, by way of a frame 0.5 m ahead of it."""
    path = tmp_path / "cart.sdf"
    path.write_text(
        '<sdf version="1.8"><model name="cart"><link name="base_link">'
        "<inertial><pose relative_to='base_link'>0 0 1 0 0 0</pose><mass>3</mass></inertial>"
        '<collision name="a"><geometry><box><size>0.2 0.2 0.1</size></box></geometry></collision>'
        '</link><frame name="f" attached_to="base_link"><pose>0.5 0 0 0 0 0</pose></frame>'
        '<link name="mast"><pose relative_to="f">0.5 0 0 0 0 1.5707963</pose>'
        '<collision name="b"><geometry><box><size>0.4 0.2 0.1</size></box></geometry></collision>'
        "</link></model></sdf>"
    )
    robot = load_robot(str(path))
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.1, -0.2, 1.1, 0.2))
    assert robot.mass_kg == 3.0


def test_an_omnidirectional_receiver_or_caster_makes_no_omnidirectional_base(tmp_path):
    path = write_repository(tmp_path)
    receiver = '<gazebo><plugin filename="ir.so" name="ir_omni"/></gazebo>'
    caster = '<xacro:wheel name="omni_wheel_caster_wheel" y="0"/>'
    drive = XACRO[XACRO.index("<gazebo><plugin") :]
    path.write_text(XACRO.replace(drive, f"{receiver}{caster}</robot>"))
    assert "differential" in describe_robot(path).check.as_text(300)
    path.write_text(XACRO.replace("</robot>", f"{receiver}</robot>"))
    assert load_robot(str(path)).drive.max_linear_velocity_mps == 0.4


def test_the_limits_of_ros2_control_are_those_of_its_file(tmp_path):
    path = write_repository(tmp_path)
    config = path.parents[1] / "controllers.yaml"
    config.write_text(
        "controller_manager:\n  ros__parameters:\n    base:\n"
        "      type: diff_drive_controller/DiffDriveController\n"
        "base:\n  ros__parameters:\n    wheel_separation: 0.4\n"
        "    wheel_separation_multiplier: 1.5\n"
        "    linear.x.max_velocity: 0.7\n    angular: {z: {max_velocity: 1.9}}\n"
    )
    text = XACRO[: XACRO.index("<gazebo><plugin")]
    path.write_text(
        f'{text}<gazebo><plugin filename="libgazebo_ros2_control.so" name="c">'
        "<parameters>$(find cart_description)/controllers.yaml</parameters></plugin></gazebo>"
        "</robot>"
    )
    robot = load_robot(str(path))
    assert robot.drive.max_linear_velocity_mps == 0.7
    assert robot.drive.max_angular_velocity_radps == 1.9
    # Wheels that skid are commanded as if they were farther apart.
    assert robot.actuators.wheel_separation_m == pytest.approx(0.6)
    off = "    linear.x.has_velocity_limits: false\n    linear.x.min_velocity: 0.0\n"
    config.write_text(config.read_text() + off)
    drive = load_robot(str(path), arguments={"length": "1"}).drive
    assert drive.min_linear_velocity_mps < 0.0
    assert drive.max_linear_velocity_mps != 0.7
    assert drive.max_angular_velocity_radps == 1.9


def test_a_base_frame_outside_of_the_shapes_is_told_and_taken_in(tmp_path):
    origin = '<origin xyz="1 0 0"/>'
    path = urdf(tmp_path, link(collision('<box size="0.6 0.4 0.2"/>', origin)))
    assert load_robot(str(path)).outline[:, 0].min() == pytest.approx(-0.01, abs=1e-3)
    assert any("base_link lies outside of it" in row for row in rows(path, Status.STAND_IN))


def test_a_mujoco_model_is_told_in_one_line(tmp_path):
    path = tmp_path / "cart.sdf"
    path.write_text("<mujoco><worldbody/></mujoco>")
    with pytest.raises(InputError, match="is a model of MuJoCo; expected URDF, SDF or xacro"):
        load_robot(str(path))


def test_a_robot_file_may_be_like_a_model(tmp_path):
    path = write_repository(tmp_path)
    own = path.parent / "mine.yaml"
    own.write_text("description: mine\nlike: cart.urdf.xacro\nlidar: {range_max_m: 3.0}\n")
    robot = load_robot(str(own))
    assert (robot.lidar.range_max_m, robot.lidar.beam_count) == (3.0, 180)


@pytest.mark.parametrize(
    "named", ["base: {type: diff_drive_controller/A}", "base.type: diff_drive_controller/A"]
)
def test_the_limits_are_those_of_the_controllers_file_that_xacro_is_given(tmp_path, named):
    (tmp_path / "control.yaml").write_text(
        "base:\n  ros__parameters:\n"
        "    linear.x.max_velocity: 2.0\n    linear.x.max_acceleration: 20.0\n"
        f"manager:\n  ros__parameters:\n    {named}"
    )
    path = tmp_path / "cart.urdf.xacro"
    argument = f'<xacro:arg name="controllers" default="{tmp_path}/control.yaml"/>'
    path.write_text(
        f'<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{argument}{link(BOX)}</robot>'
    )
    drive = load_robot(str(path)).drive
    assert (drive.max_linear_velocity_mps, drive.max_linear_acceleration_mps2) == (2.0, 20.0)
