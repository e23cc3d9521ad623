"""A robot may come from its SDF or URDF: outline and mass from the model, all else by default."""

from __future__ import annotations

import os

import numpy as np
import pytest
import shapely

from drake_navbench.errors import InputError, InputWarning
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
    assert robot.footprint is not None
    # Its axles are at the height of the base link: the replay draws it lifted onto the floor.
    assert robot.model_path != path


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
        ("<robot", "is not XML: "),
        ("<html/>", "cannot be read as a robot's model: expected <robot> or <sdf>, found <html>"),
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


# A flat square of 0.5 m x 0.5 m around the origin; bounds of the cart that has it as its box.
SQUARE = "v -0.25 -0.25 0\nv 0.25 -0.25 0\nv 0.25 0.25 0\nv -0.25 0.25 0\nf 1 2 3\nf 1 3 4\n"
SQUARE_CART = (-0.15, -0.25, 0.35, 0.27)
SEEN_BOX = '<box size="2 2 0.1"/>'
TOUCHING_BOX = '<box size="0.6 0.4 0.2"/>'


@pytest.mark.parametrize(
    "uri",
    ["package://cart_parts/meshes/hull.dae", "model://cart/hull.dae", "hull.obj", "file:///no.obj"],
)
def test_a_mesh_that_is_only_seen_and_not_there_is_left_out_with_a_warning(tmp_path, uri):
    path = tmp_path / "cart.urdf"
    path.write_text(URDF)
    whole = read_robot_model(path)
    path.write_text(URDF.replace(SEEN_BOX, f'<mesh filename="{uri}"/>'))
    with pytest.warns(InputWarning, match=rf"cart\.urdf: left out {uri}.*only looks change"):
        robot = load_robot(str(path))
    np.testing.assert_array_equal(robot.outline, whole.outline)
    assert robot.mass_kg == whole.mass_kg


def test_of_what_is_only_seen_the_rest_makes_the_outline(tmp_path):
    """Without collision shapes the outline is that of the visual ones: here of one of two."""
    path = tmp_path / "cart.urdf"
    gone = '<visual><geometry><mesh filename="package://gone/hull.dae"/></geometry></visual>'
    path.write_text(
        '<robot name="cart"><link name="base_link"><visual><geometry><box size="0.8 0.6 0.1"/>'
        f"</geometry></visual>{gone}{gone.replace('hull', 'mast')}</link></robot>"
    )
    with pytest.warns(InputWarning, match=r"gone/hull\.dae and 1 more, no such file"):
        outline = read_robot_model(path).outline
    assert shapely.Polygon(outline).bounds == pytest.approx((-0.4, -0.3, 0.4, 0.3))


def test_a_mesh_that_touches_must_be_there_where_nothing_else_tells_the_outline(tmp_path):
    path = tmp_path / "cart.urdf"
    mesh = '<mesh filename="package://cart_parts/hull.obj"/>'
    path.write_text(
        f'<robot name="cart"><link name="base_link"><collision><geometry>{mesh}</geometry>'
        "</collision></link></robot>"
    )
    reason = r"cart\.urdf: no outline found: left out package://cart_parts/hull\.obj, no such file"
    with pytest.raises(InputError, match=reason) as caught:
        load_robot(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("package", "variable", "value"),
    [
        ("", "", ""),
        ("cart_parts", "", ""),
        ("install/share/cart_parts", "AMENT_PREFIX_PATH", "install"),
        ("workspace/cart_parts", "ROS_PACKAGE_PATH", "workspace"),
        ("parts", "ROS_PACKAGE_PATH", "parts"),
    ],
)
def test_a_package_is_found_above_beside_and_where_ros_looks(
    tmp_path, monkeypatch, package, variable, value
):
    root = tmp_path / "my cart"
    (root / package / "meshes").mkdir(parents=True)
    (root / package / "meshes" / "square.obj").write_text(SQUARE)
    (root / package / "package.xml").write_text("<package><name>cart_parts</name></package>")
    if variable:
        monkeypatch.setenv(variable, f"{root / 'nothing'}{os.pathsep}{root / value}")
    path = root / "urdf" / "cart.urdf"
    path.parent.mkdir()
    mesh = '<mesh filename="package://cart_parts/meshes/square.obj"/>'
    path.write_text(URDF.replace(TOUCHING_BOX, mesh))
    assert shapely.Polygon(load_robot(str(path)).outline).bounds == pytest.approx(SQUARE_CART)


@pytest.mark.parametrize("scheme", ["file://", "file:"])
def test_a_mesh_by_its_whole_path_is_found_with_two_slashes_and_with_none(tmp_path, scheme):
    (tmp_path / "square.obj").write_text(SQUARE)
    (tmp_path / "package.xml").write_text("<package><name>cart</name></package>")
    path = tmp_path / "cart.urdf.xacro"
    mesh = f'<mesh filename="{scheme}$(find cart)/square.obj"/>'
    path.write_text(URDF.replace(TOUCHING_BOX, mesh))
    assert shapely.Polygon(load_robot(str(path)).outline).bounds == pytest.approx(SQUARE_CART)


def test_a_folder_whose_package_has_another_name_is_another_package(tmp_path):
    folder = tmp_path / "cart_parts"
    folder.mkdir()
    (folder / "square.obj").write_text(SQUARE)
    (folder / "package.xml").write_text("<package><name>other_parts</name></package>")
    path = tmp_path / "cart.urdf"
    mesh = '<mesh filename="package://cart_parts/square.obj"/>'
    path.write_text(URDF.replace(TOUCHING_BOX, mesh))
    with pytest.warns(InputWarning, match=r"left out package://cart_parts/square\.obj, no such"):
        read_robot_model(path)


def test_a_relative_mesh_stays_where_it_is_when_another_is_left_out(tmp_path):
    folder = tmp_path / "my cart"
    folder.mkdir()
    (folder / "square.obj").write_text(SQUARE)
    path = folder / "cart.urdf"
    text = URDF.replace(TOUCHING_BOX, '<mesh filename="square.obj"/>')
    path.write_text(text.replace(SEEN_BOX, '<mesh filename="package://gone/hull.dae"/>'))
    with pytest.warns(InputWarning, match="left out package://gone/hull.dae"):
        bounds = shapely.Polygon(load_robot(str(path)).outline).bounds
    assert bounds == pytest.approx(SQUARE_CART)


@pytest.mark.parametrize("name", ["", " "])
@pytest.mark.parametrize("shape", ["visual", "collision"])
def test_a_shape_whose_name_is_empty_has_none(tmp_path, shape, name):
    path = tmp_path / "cart.urdf"
    path.write_text(URDF)
    whole = read_robot_model(path)
    path.write_text(URDF.replace(f"<{shape}>", f'<{shape} name="{name}">'))
    np.testing.assert_array_equal(read_robot_model(path).outline, whole.outline)


def test_xacro_in_a_file_that_is_not_called_so_is_expanded_as_well(tmp_path):
    path = tmp_path / "cart.urdf"
    path.write_text(URDF.replace('radius="0.1"', 'radius="${0.2 / 2}"'))
    assert shapely.Polygon(load_robot(str(path)).outline).bounds[3] == pytest.approx(0.27)


def test_an_sdf_leaves_out_what_is_only_seen_and_not_there_as_well(tmp_path):
    path = tmp_path / "cart.sdf"
    path.write_text(
        '<sdf version="1.8"><model name="cart"><link name="base_link">'
        '<collision name="a"><geometry><box><size>0.8 0.6 0.1</size></box></geometry></collision>'
        '<visual name="b"><geometry><mesh><uri>model://gone/hull.dae</uri></mesh></geometry>'
        "</visual></link></model></sdf>"
    )
    with pytest.warns(InputWarning, match=r"left out model://gone/hull\.dae"):
        outline = read_robot_model(path).outline
    assert shapely.Polygon(outline).bounds == pytest.approx((-0.4, -0.3, 0.4, 0.3))


def test_what_gazebos_sensors_and_plugins_have_is_not_asked_of_an_sdf(tmp_path):
    path = tmp_path / "cart.sdf"
    path.write_text(
        '<sdf version="1.8"><model name="cart"><plugin name="p" filename="p.so"><a/></plugin>'
        '<link name="base_link"><inertial><mass>3</mass></inertial>'
        '<sensor name="scan" type="gpu_lidar"><gz_frame_id>scan</gz_frame_id></sensor>'
        '<collision name="a"><geometry><box><size>0.8 0.6 0.1</size></box></geometry></collision>'
        "</link></model></sdf>"
    )
    model = read_robot_model(path)
    assert shapely.Polygon(model.outline).bounds == pytest.approx((-0.4, -0.3, 0.4, 0.3))
    assert model.mass_kg == pytest.approx(3.0)


def test_what_is_drakes_own_in_an_sdf_stays_so_where_sensors_are_left_out(tmp_path):
    path = tmp_path / "cart.sdf"
    path.write_text(
        '<sdf version="1.8" xmlns:drake="http://drake.mit.edu" xmlns:ns0="http://a.b">'
        '<model name="cart"><link name="base_link"><inertial><mass>3</mass></inertial>'
        '<sensor name="scan" type="gpu_lidar"><gz_frame_id>scan</gz_frame_id></sensor>'
        '<collision name="a"><geometry><drake:ellipsoid><a>0.4</a><b>0.3</b><c>0.2</c>'
        "</drake:ellipsoid></geometry></collision></link></model></sdf>"
    )
    bounds = shapely.Polygon(read_robot_model(path).outline).bounds
    assert bounds == pytest.approx((-0.4, -0.3, 0.4, 0.3), abs=2e-3)


# SQUARE as an STL text, and as 80 free bytes, the number of triangles, and 50 bytes for each.
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]]) / 4.0
STL_TEXT = (
    b"solid a\n"
    + b"".join(
        b"facet normal 0 0 1\nouter loop\n"
        + b"".join(b"vertex %g %g %g\n" % tuple(corner) for corner in triangle)
        + b"endloop\nendfacet\n"
        for triangle in CORNERS.reshape(2, 3, 3)
    )
    + b"endsolid a\n"
)
STL_BINARY = (
    b"solid".ljust(80)
    + (2).to_bytes(4, "little")
    + b"".join(
        np.float32([0, 0, 1, *triangle.ravel()]).tobytes() + b"\0\0"
        for triangle in CORNERS.reshape(2, 3, 3)
    )
)


@pytest.mark.parametrize("data", [STL_TEXT, STL_BINARY])
@pytest.mark.parametrize("role", ["collision", "visual"])
def test_an_stl_mesh_makes_the_outline_with_its_scale(tmp_path, data, role):
    (tmp_path / "hull.STL").write_bytes(data)
    path = tmp_path / "cart.urdf"
    path.write_text(
        f'<robot name="cart"><link name="base_link"><{role}><geometry>'
        f'<mesh filename="hull.STL" scale="2 1 1"/></geometry></{role}></link></robot>'
    )
    outline = read_robot_model(path).outline
    assert shapely.Polygon(outline).bounds == pytest.approx((-0.5, -0.25, 0.5, 0.25))
    assert shapely.Polygon(outline).area == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("hull.stl", r"cart\.urdf: no outline found: left out hull\.stl: "),
        ("hull.dae", r"cart\.urdf: no outline found: left out hull\.dae: "),
        ("hull.step", r"left out hull\.step: expected a mesh in \.stl, \.obj, \.dae"),
    ],
)
@pytest.mark.parametrize("role", ["collision", "visual"])
def test_a_mesh_that_cannot_be_read_is_one_line(tmp_path, name, reason, role):
    (tmp_path / name).write_bytes(b"solid of nothing")
    path = tmp_path / "cart.urdf"
    path.write_text(
        f'<robot name="cart"><link name="base_link"><{role}><geometry>'
        f'<mesh filename="{name}"/></geometry></{role}></link></robot>'
    )
    with pytest.raises(InputError, match=reason) as caught:
        read_robot_model(path)
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    "outline", ["robot_radius: 200", "footprint: [[300, 200], [300, -200], [-300, 0]]"]
)
def test_a_robot_in_millimetres_is_refused(tmp_path, outline):
    path = tmp_path / "mine.yaml"
    path.write_text(f"description: mine\n{outline}\n")
    with pytest.raises(
        InputError, match=rf"{outline.partition(':')[0]}: expected metres, at most 50"
    ):
        load_robot(str(path))
