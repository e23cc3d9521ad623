"""A robot's xacro, URDF or SDF is read as it lies in its repository, and says what it told."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import shapely
from descriptions_scenes import XACRO, write_repository

from drake_navbench.analysis.replay.robot_model import load_model
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.descriptions.xacro_file import expand_xacro
from drake_navbench.inputs.robot import load_robot
from drake_navbench.processes.limited_call import call_limited


def link(body: str, name: str = "base_link") -> str:
    return f'<link name="{name}">{body}</link>'


def collision(geometry: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


BOX = collision('<box size="0.6 0.4 0.2"/>')


def urdf(folder, body, name="cart.urdf"):
    path = folder / name
    path.write_text(f'<robot name="cart">{body}</robot>')
    return path


def rows(path, status):
    return [row.text for row in describe_robot(path).check.of(status)]


def test_xacro_finds_its_packages_by_package_xml_and_takes_arguments(tmp_path):
    path = write_repository(tmp_path)
    robot = load_robot(str(path), arguments={"length": "1.0"})
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.5, -0.27, 0.5, 0.27))
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.3)
    assert "xacro arguments (length=0.6)" in describe_robot(path).check.as_text(200)


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


def test_a_package_elsewhere_is_found_by_packages_alone(tmp_path):
    path = write_repository(tmp_path / "a")
    other = tmp_path / "b" / "cart_parts"
    (tmp_path / "b").mkdir()
    (path.parents[2] / "deeper" / "cart_parts").rename(other)
    with pytest.raises(InputError, match=r"needs the package 'cart_parts'.*--packages"):
        load_robot(str(path))
    assert load_robot(str(path), packages=[tmp_path / "b"]).mass_kg == pytest.approx(22.0)


def test_a_comment_before_the_declaration_hinders_neither_xacro_nor_urdf(tmp_path):
    head = '<!-- licence -->\n<?xml version="1.0"?>\n'
    for size in ("0.6", "${0.3 * 2}"):
        path = tmp_path / "cart.urdf"
        box = collision(f'<box size="{size} 0.4 0.2"/>')
        path.write_text(f'{head}<robot name="cart">{link(box)}</robot>')
        assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.3)


def test_a_package_that_is_not_there_and_whose_macros_nobody_asks_for_is_told(tmp_path):
    path = write_repository(tmp_path)
    include = '<xacro:include filename="$(find sick_scan)/urdf/lms.xacro"/>'
    path.write_text(XACRO.replace("<link", f"{include}<link", 1))
    assert load_robot(str(path)).mass_kg == pytest.approx(22.0)
    assert any("the package sick_scan describes" in row for row in rows(path, Status.STAND_IN))


def test_a_part_of_a_package_that_is_not_there_is_left_out_and_told(tmp_path):
    path = write_repository(tmp_path)
    include = '<xacro:include filename="$(find realsense2_description)/urdf/d435.xacro"/>'
    call = '<xacro:sensor_d435 parent="base_link"><origin xyz="0 0 0"/></xacro:sensor_d435>'
    path.write_text(XACRO.replace("<link", f"{include}{call}<link", 1))
    assert load_robot(str(path)).mass_kg == pytest.approx(22.0)
    told = rows(path, Status.STAND_IN)
    assert any("left out sensor_d435: defined by a package that is not found" in t for t in told)


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


def test_a_relative_include_after_a_package_that_is_not_there_starts_at_its_own_file(tmp_path):
    """The package is asked for in a file of another folder, where there is no extras.xacro."""
    path = write_repository(tmp_path)
    folder = path.parent / "parts"
    folder.mkdir()
    asks = '<robot><xacro:include filename="$(find gone)/urdf/a.xacro"/></robot>'
    (folder / "arm.xacro").write_text(asks.replace("<robot", '<robot xmlns:xacro="x"'))
    (path.parent / "extras.xacro").write_text("<robot/>")
    files = ("parts/arm.xacro", "extras.xacro")
    includes = "".join(f'<xacro:include filename="{name}"/>' for name in files)
    path.write_text(XACRO.replace("<link", f"{includes}<link", 1))
    assert load_robot(str(path)).mass_kg == pytest.approx(22.0)


def test_the_limits_are_those_of_the_controllers_file_that_names_the_wheels(tmp_path):
    """The model names neither a drive's plugin nor a file of ros2_control."""
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("gz-sim-diff-drive-system", "x").replace("DiffDrive", "x"))
    file = tmp_path / "my_controllers.yaml"
    file.write_text(CONTROLLERS)
    assert load_robot(str(path)).drive.max_linear_velocity_mps == 0.7
    file.write_text(CONTROLLERS.replace("left_wheel_joint", "other_wheel_joint"))
    assert load_robot(str(path), arguments={"length": "1"}).drive.max_linear_velocity_mps == 0.5


def test_a_replay_draws_what_was_read_of_xacro_with_its_wheels(tmp_path):
    model = load_model(load_robot(str(write_repository(tmp_path))).model_path, np.zeros((0, 2)))
    assert len(model.visuals) == 3
    assert len(model.moving_links) == 2
    # The base link is at the axles, 0.1 m over the floor, and so are both wheels.
    heights = [pose.translation()[2] for pose in model.rest_poses().values()]
    np.testing.assert_allclose(heights, 0.1, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('<robot xmlns:xacro="a"><xacro:include filename="gone.xacro"/></robot>', "gone.xacro"),
        ('<robot><link name="${nothing}"/></robot>', "nothing"),
        ('<robot><link name="$(arg arm)"/></robot>', "arm; give it by --set arm=VALUE"),
        ("<robot><link", "xacro cannot expand it"),
    ],
)
def test_xacro_that_cannot_be_expanded_is_one_line(tmp_path, text, reason):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        load_robot(str(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_fault_in_an_included_file_names_that_file(tmp_path):
    (tmp_path / "lidar.xacro").write_text("<robot>\n<link</robot>")
    path = tmp_path / "cart.urdf.xacro"
    path.write_text('<robot xmlns:xacro="a"><xacro:include filename="lidar.xacro"/></robot>')
    with pytest.raises(InputError, match=r"cannot expand lidar\.xacro: .* line 2, column 5"):
        load_robot(str(path))


def test_xacro_that_never_ends_or_eats_memory_is_stopped(tmp_path):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text('<robot><link name="${len([0]*10**9)}"/></robot>')
    began = time.monotonic()
    with pytest.raises(InputError, match="at most 1 GB of memory and 30 s"):
        expand_xacro(path)
    assert time.monotonic() - began < 30.0


def test_a_call_that_takes_too_long_is_one_line():
    with pytest.raises(InputError, match=r"^the file: not read within 1 s$"):
        call_limited("time:sleep", 10, "the file", time_s=1)


def test_an_expansion_bomb_is_refused_before_it_is_expanded(tmp_path):
    path = tmp_path / "cart.urdf"
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    path.write_text(f'<!DOCTYPE r [<!ENTITY a0 "x">{entities}]><robot name="&a9;"/>')
    with pytest.raises(InputError, match=r"cart\.urdf: declares XML entities; expected none"):
        load_robot(str(path))


def test_a_package_uri_leads_out_of_no_package(tmp_path):
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    folder = tmp_path / "repository" / "cart"
    folder.mkdir(parents=True)
    (tmp_path / "repository" / ".git").mkdir()
    (folder / "package.xml").write_text("<package><name>cart</name></package>")
    for uri in ("package://../../secret.obj", "package://cart/../../secret.obj"):
        path = urdf(folder, link(BOX + collision(f'<mesh filename="{uri}"/>')))
        assert any("no such file or package" in row for row in rows(path, Status.STAND_IN))


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


COLLADA = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"
 version="1.4.1"><asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">-20 0 -10 20 0 -10 0 50 30</float_array>
<technique_common><accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


@pytest.mark.usefixtures("reads_meshes_here")
def test_a_collada_mesh_has_its_unit_and_as_in_gazebo_no_upright_axis_of_its_own(tmp_path):
    """In centimetres: 0.4 m along x, 0.5 m along y, 0.4 m high, though the file says that y is up.

    Gazebo and ROS do not heed <up_axis>, and the worlds of TurtleBot 3 stand right only without.
    """
    (tmp_path / "hull.dae").write_text(COLLADA)
    path = urdf(tmp_path, link(collision('<mesh filename="hull.dae"/>')))
    robot = load_robot(str(path))
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.2, -0.01, 0.2, 0.5))
    assert describe_robot(path).height_m == pytest.approx(0.4)


@pytest.mark.usefixtures("reads_meshes_here")
def test_a_mesh_of_too_many_triangles_is_told(tmp_path):
    count = 1_000_001
    triangles = np.zeros(count, dtype=[("floats", "<f4", 12), ("attribute", "<u2")])
    data = b"".ljust(80) + count.to_bytes(4, "little") + triangles.tobytes()
    (tmp_path / "hull.stl").write_bytes(data)
    path = urdf(tmp_path, link(BOX + collision('<mesh filename="hull.stl"/>')))
    told = " ".join(rows(path, Status.STAND_IN))
    assert "has 1000001 triangles, expected at most 1000000" in told


def sensor(kind: str, body: str) -> str:
    return f'<gazebo reference="eye"><sensor name="eye" type="{kind}">{body}</sensor></gazebo>'


EYE = (
    '<joint name="j" type="fixed"><parent link="base_link"/><child link="eye"/>'
    '<origin xyz="0.1 0.05 0.4" rpy="{rpy}"/></joint><link name="eye"/>'
)


def test_a_depth_camera_looks_down_as_the_model_says(tmp_path):
    camera = (
        "<camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width>"
        "<height>480</height></image><clip><near>0.2</near><far>4</far></clip></camera>"
    )
    body = link(BOX) + EYE.format(rpy="0 0.3 0") + sensor("depth_camera", camera)
    found = load_robot(str(urdf(tmp_path, body))).depth_sensors["eye"]
    assert found.pitch_rad == pytest.approx(0.3, abs=1e-4)
    assert found.horizontal_fov_rad == pytest.approx(1.2)
    # tan(v / 2) = tan(0.6) x 480 / 640
    assert found.vertical_fov_rad == pytest.approx(2 * math.atan(0.75 * math.tan(0.6)), abs=1e-4)
    assert (found.range_min_m, found.range_max_m) == (0.2, 4.0)


def test_a_lidar_upside_down_counts_its_angles_the_other_way(tmp_path):
    ray = (
        "<ray><scan><horizontal><samples>90</samples><min_angle>-0.5</min_angle>"
        "<max_angle>1.5</max_angle></horizontal></scan><range><max>5</max></range></ray>"
    )
    body = link(BOX) + EYE.format(rpy="3.1415926 0 0") + sensor("ray", ray)
    lidar = load_robot(str(urdf(tmp_path, body))).lidar
    assert lidar.angle_min_rad == pytest.approx(-1.5, abs=1e-4)
    assert lidar.angle_span_rad == pytest.approx(2.0)


def test_two_lidars_of_a_kind_scan_together_and_of_two_kinds_the_first(tmp_path):
    path = write_repository(tmp_path)
    second = XACRO[XACRO.index('<gazebo reference="laser">') : XACRO.index("<gazebo><plugin")]
    second = second.replace('name="front"', 'name="rear"').replace(
        "<update", "<pose>-0.4 0 0 0 0 3.14159265</pose><update"
    )
    path.write_text(XACRO.replace("<gazebo><plugin", f"{second}<gazebo><plugin"))
    assert load_robot(str(path)).lidar.further_poses[0][0] == pytest.approx(-0.2)
    other = second.replace("<max>8</max>", "<max>20</max>")
    path.write_text(XACRO.replace("<gazebo><plugin", f"{other}<gazebo><plugin"))
    assert not load_robot(str(path)).lidar.further_poses
    assert any("of another kind than front" in row for row in rows(path, Status.STAND_IN))


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
        "base:\n  ros__parameters:\n    wheel_separation: 0.5\n"
        "    linear.x.max_velocity: 0.7\n    angular: {z: {max_velocity: 1.9}}\n"
    )
    text = XACRO[: XACRO.index("<gazebo><plugin")]
    path.write_text(
        f'{text}<gazebo><plugin filename="libgazebo_ros2_control.so" name="c">'
        "<parameters>$(find cart_description)/controllers.yaml</parameters></plugin></gazebo>"
        "</robot>"
    )
    drive = load_robot(str(path)).drive
    assert drive.max_linear_velocity_mps == 0.7
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


def test_xacro_of_ros_1_without_prefixes_is_read(tmp_path):
    path = tmp_path / "cart.urdf.xacro"
    (tmp_path / "sizes.xacro").write_text('<robot><property name="length" value="0.8"/></robot>')
    box = collision('<box size="${length} 0.4 0.2"/>')
    path.write_text(f'<robot name="a"><include filename="sizes.xacro"/>{link(box)}</robot>')
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.4)


def test_a_macro_of_ros_1_is_called_without_prefix(tmp_path):
    """Not by an element of URDF that is called as a macro and has other attributes."""
    path = tmp_path / "cart.urdf.xacro"
    macros = (
        '<macro name="base" params="length"><link name="base_link">'
        + collision('<box size="${length} 0.4 0.2"/>')
        + '</link></macro><macro name="box" params="side"><link name="${side}"/></macro>'
        '<xacro:macro name="tail"><link name="tail"/></xacro:macro>'
    )
    calls = '<base length="0.8"/><box side="left"/><tail/>'
    path.write_text(f'<robot name="a" xmlns:xacro="http://ros.org/xacro">{macros}{calls}</robot>')
    source = read_source(path)
    assert list(source.model.links) == ["base_link", "left", "tail"]
    assert source.model.links["base_link"].collisions[0].size == (0.8, 0.4, 0.2)


def test_a_file_that_only_defines_a_macro_of_its_name_is_that_robot(tmp_path):
    path = tmp_path / "j1.urdf.xacro"
    head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name='
    body = f"{link(BOX)}</xacro:macro></robot>"
    path.write_text(f'{head}"j1" params="wheel:=\'a b\' prefix">{body}')
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.3)
    remark = 'only defines a macro; expanded as <xacro:j1 prefix=""/>'
    assert any(remark in row for row in rows(path, Status.STAND_IN))
    path.write_text(f'{head}"j1" params="side">{body}'.replace("0.6 0.4", "${side} 0.4"))
    with pytest.raises(InputError, match=r"only defines the macro j1; .* by --set side=VALUE"):
        load_robot(str(path))
    told = describe_robot(path, arguments={"side": "0.8"}).check.as_text(200)
    assert "footprint (0.8 x 0.4 m" in told


def test_a_xacro_file_that_asks_the_environment_is_told_in_words(tmp_path, monkeypatch):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(f'<robot name="a">{link(BOX.replace("0.6", "$(env CART_LENGTH)"))}</robot>')
    with pytest.raises(InputError, match="CART_LENGTH=VALUE drake-navbench"):
        load_robot(str(path))
    monkeypatch.setenv("CART_LENGTH", "0.8")
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.4)


@pytest.mark.usefixtures("reads_meshes_here")
@pytest.mark.parametrize(
    "uri", ["package://cart/meshes/hull.stl", "./meshes/hull.stl", "meshes/hull.stl"]
)
def test_a_mesh_is_found_where_the_sources_have_it(tmp_path, uri):
    """Packages are installed with other folders: here cart/models/a/meshes becomes cart/meshes."""
    package = tmp_path / "cart"
    path = package / "models" / "a" / "urdf" / "cart.urdf"
    (path.parents[1] / "meshes").mkdir(parents=True)
    path.parent.mkdir()
    (package / "package.xml").write_text("<package><name>cart</name></package>")
    (path.parents[1] / "meshes" / "hull.stl").write_text(TRIANGLE)
    path.write_text(
        f'<robot name="a">{link(collision(f"<mesh filename={uri!r}/>"))}</robot>'.replace("'", '"')
    )
    assert shapely.Polygon(load_robot(str(path)).outline).bounds[2] == pytest.approx(1.0)


TRIANGLE = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex -1 -1 0\nvertex 1 -1 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid a\n"
)


def test_a_lidar_above_two_metres_is_seen_by_the_costmaps(tmp_path):
    mast = '<joint name="j" type="fixed"><parent link="base_link"/><child link="laser"/>'
    top = f'{link("", "laser")}{mast}<origin xyz="0 0 2.3"/></joint>'
    path = urdf(tmp_path, link(BOX) + top)
    navigation = load_robot(str(path)).navigation
    # The floor is 0.1 m below the base link.
    for costmap in (navigation.local_costmap, navigation.global_costmap):
        layer = costmap.obstacle_layer
        assert layer.max_obstacle_height == pytest.approx(2.4)
        assert layer.observation_sources["scan"].max_obstacle_height == pytest.approx(2.4)
        assert layer.observation_sources["scan"].clearing
    assert any("look up to 2.4 m" in row for row in rows(path, Status.OTHER_FORM))


def test_without_a_lidar_the_default_one_is_where_its_link_is(tmp_path):
    laser = link("", "laser") + (
        '<joint name="j" type="fixed"><parent link="base_link"/><child link="laser"/>'
        '<origin xyz="0.2 0 0.35" rpy="0 0 3.14159"/></joint>'
    )
    path = urdf(tmp_path, link(BOX) + laser)
    lidar = load_robot(str(path)).lidar
    assert lidar.pose == pytest.approx((0.2, 0.0, 3.14159))
    # The box reaches from -0.1 to 0.1 m: its underside is the floor.
    assert lidar.height_m == pytest.approx(0.45)
    assert any("the default one where the link laser is" in r for r in rows(path, Status.STAND_IN))


ROBOT_YAML = """serial_number: a200-0001
version: 0
platform:
  attachments: [{name: plate, type: a200.plate, parent: base_link, size: 0.8}]
mounts: {bracket: [{parent: base_link, model: horizontal}]}
sensors:
  lidar2d:
    - {model: ust, parent: base_link, xyz: [0.3, 0, 0.2], rpy: [0, 0, 0],
       ros_parameters: {driver: {angle_min: -1.5}}}
    - {model: gone, parent: base_link}
"""


def test_a_robot_yaml_of_clearpath_is_the_robot_of_its_packages(tmp_path):
    head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name='
    fixed = (
        '<link name="${name}"><collision><geometry><box size="${size} 0.1 0.1"/></geometry>'
        '</collision></link><joint name="${name}_joint" type="fixed"><parent link="${parent_link}"'
        '/><child link="${name}"/><xacro:insert_block name="origin"/></joint></xacro:macro></robot>'
    )
    sensor = (
        '<gazebo reference="${name}"><sensor type="ray" name="s"><ray><scan><horizontal>'
        "<min_angle>${min_ang}</min_angle><max_angle>1.5</max_angle><samples>90</samples>"
        "</horizontal></scan></ray></sensor></gazebo></xacro:macro></robot>"
    )
    files = {
        "clearpath_platform_description/urdf/a200/a200": (
            f'{head}"a200" params="wheel:=\'default\'">{link(BOX)}</xacro:macro></robot>'
        ),
        "clearpath_platform_description/urdf/a200/attachments/plate": (
            f'{head}"plate" params="name parent_link size *origin">{fixed}'
        ),
        # Where Clearpath's generator looks for risers and brackets.
        "clearpath_mounts_description/urdf/pacs/bracket": (
            f'{head}"bracket" params="name parent_link size:=0.1 *origin">{fixed}'
        ),
        "clearpath_sensors_description/urdf/ust": (
            f'{head}"ust" params="name parent_link size:=0.1 min_ang:=-2 *origin">'
            + fixed.replace("</xacro:macro></robot>", sensor)
        ),
    }
    for name, text in files.items():
        file = tmp_path / "common" / f"{name}.urdf.xacro"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        package = name.partition("/")[0]
        (tmp_path / "common" / package / "package.xml").write_text(
            f"<package><name>{package}</name></package>"
        )
    path = tmp_path / "mine" / "robot.yaml"
    path.parent.mkdir()
    path.write_text(ROBOT_YAML)
    robot = load_robot(str(path), packages=[tmp_path / "common"])
    # The plate of 0.8 m, and the platform's 0.4 m.
    assert np.ptp(robot.outline, axis=0) == pytest.approx([0.8, 0.4])
    assert robot.lidar.pose == pytest.approx((0.3, 0.0, 0.0))
    assert (robot.lidar.angle_min_rad, robot.lidar.beam_count) == (-1.5, 90)
    told = describe_robot(path, folders=[tmp_path / "common"]).check.as_text(200)
    assert "left out lidar2d_1" in told
    assert "left out bracket_0" not in told
    for text, reason in (
        (ROBOT_YAML, "needs the package 'clearpath_platform_description'"),
        (ROBOT_YAML.replace("a200-0001", "7"), "serial_number: expected one such as a200-0000"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=reason):
            load_robot(str(path))


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


@pytest.mark.usefixtures("reads_meshes_here")
def test_the_meshes_of_a_robot_in_xacro_are_drawn(tmp_path):
    """The drawing lies in the user's cache and names meshes in the robot's repository."""
    (tmp_path / "hull.stl").write_text(TRIANGLE)
    path = tmp_path / "cart.urdf.xacro"
    mesh = '<visual name="hull"><geometry><mesh filename="hull.stl"/></geometry></visual>'
    path.write_text(f'<robot name="a"><link name="base_link">{BOX}{mesh}</link></robot>')
    drawing = load_robot(str(path)).model_path
    assert drawing is not None
    assert drawing.parent != tmp_path
    (hull,) = load_model(drawing, np.zeros((0, 2))).visuals
    assert hull.shape.extension() == ".obj"
