"""The meshes that a robot's model names are found, measured and drawn; which are not is told."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from descriptions_scenes import BOX, collision, link, rows, urdf, write_repository

from drake_navbench.analysis.replay.robot_model import load_model
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.robot import load_robot


def test_a_replay_draws_what_was_read_of_xacro_with_its_wheels(tmp_path):
    model = load_model(load_robot(str(write_repository(tmp_path))).model_path, np.zeros((0, 2)))
    assert len(model.visuals) == 3
    assert len(model.moving_links) == 2
    # The base link is at the axles, 0.1 m over the floor, and so are both wheels.
    heights = [pose.translation()[2] for pose in model.rest_poses().values()]
    np.testing.assert_allclose(heights, 0.1, atol=1e-9)


def test_a_package_uri_leads_out_of_no_package(tmp_path):
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    folder = tmp_path / "repository" / "cart"
    folder.mkdir(parents=True)
    (tmp_path / "repository" / ".git").mkdir()
    (folder / "package.xml").write_text("<package><name>cart</name></package>")
    for uri in ("package://../../secret.obj", "package://cart/../../secret.obj"):
        path = urdf(folder, link(BOX + collision(f'<mesh filename="{uri}"/>')))
        assert any("no such file or package" in row for row in rows(path, Status.STAND_IN))


@pytest.mark.parametrize(
    "named",
    [
        "/elsewhere/ws/src/cart/meshes/hull.stl",
        "file:///elsewhere/ws/install/cart/share/cart/meshes/hull.stl",
        "file:///elsewhere/a_clone/meshes/hull.stl",
    ],
)
def test_an_absolute_path_of_the_authors_computer_leads_to_the_file_of_the_package(tmp_path, named):
    """The triangle reaches from -1 to 1 m along x."""
    (tmp_path / ".git").mkdir()
    (tmp_path / "cart/meshes").mkdir(parents=True)
    (tmp_path / "cart/package.xml").write_text("<package><name>cart</name></package>")
    (tmp_path / "cart/meshes/hull.stl").write_text(TRIANGLE)
    path = urdf(tmp_path / "cart", link(collision(f'<mesh filename="{named}"/>')))
    assert shapely.Polygon(load_robot(str(path)).outline).bounds[0::2] == pytest.approx((-1.0, 1.0))


def test_a_path_of_a_container_leads_to_the_file_of_an_unpacked_archive(tmp_path):
    """`file:/cart/meshes/hull.stl` lies in the folder of --package, which has no `.git`."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "urdf").mkdir()
    (tmp_path / "meshes/hull.stl").write_text(TRIANGLE)
    path = urdf(tmp_path / "urdf", link(collision('<mesh filename="file:/cart/meshes/hull.stl"/>')))
    robot = load_robot(str(path), packages=[tmp_path])
    assert shapely.Polygon(robot.outline).bounds[0::2] == pytest.approx((-1.0, 1.0))


def test_an_absolute_path_leads_out_of_no_repository(tmp_path):
    (tmp_path / "hull.stl").write_text(TRIANGLE)
    folder = tmp_path / "repository" / "cart"
    folder.mkdir(parents=True)
    (tmp_path / "repository/.git").mkdir()
    mesh = collision(f'<mesh filename="{tmp_path}/hull.stl"/>')
    told = rows(urdf(folder, link(BOX + mesh)), Status.STAND_IN)
    assert any("no such file or package" in row for row in told)


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


TRIANGLE = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex -1 -1 0\nvertex 1 -1 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid a\n"
)


def test_a_collada_mesh_has_its_unit_and_as_in_gazebo_no_upright_axis_of_its_own(tmp_path):
    """In centimetres: 0.4 m along x, 0.5 m along y, 0.4 m high, though the file says that y is up.

    Gazebo and ROS do not heed <up_axis>, and the worlds of TurtleBot 3 stand right only without.
    """
    (tmp_path / "hull.dae").write_text(COLLADA)
    path = urdf(tmp_path, link(collision('<mesh filename="hull.dae"/>')))
    robot = load_robot(str(path))
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.2, -0.01, 0.2, 0.5))
    assert describe_robot(path).height_m == pytest.approx(0.4)


def test_a_mesh_that_git_lfs_keeps_elsewhere_is_told_as_such(tmp_path):
    (tmp_path / "hull.stl").write_text("version https://git-lfs.github.com/spec/v1\nsize 9\n")
    path = urdf(tmp_path, link(BOX + collision('<mesh filename="hull.stl"/>')))
    told = rows(path, Status.STAND_IN)
    assert any(
        "hull.stl: a pointer of Git LFS, not the file; run git lfs pull" in row for row in told
    )


def test_a_mesh_of_too_many_triangles_is_told(tmp_path):
    count = 1_000_001
    triangles = np.zeros(count, dtype=[("floats", "<f4", 12), ("attribute", "<u2")])
    data = b"".ljust(80) + count.to_bytes(4, "little") + triangles.tobytes()
    (tmp_path / "hull.stl").write_bytes(data)
    path = urdf(tmp_path, link(BOX + collision('<mesh filename="hull.stl"/>')))
    told = " ".join(rows(path, Status.STAND_IN))
    assert "has 1000001 triangles, expected at most 1000000" in told


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
