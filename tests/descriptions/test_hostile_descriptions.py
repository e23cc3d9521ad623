"""What files of robots and worlds try to do to their reader: each ends in one line."""

from __future__ import annotations

import os
import time
import warnings

import numpy as np
import pytest
from descriptions_scenes import box, world

from drake_navbench.analysis.replay.robot_model import SdfModel
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs import gazebo_world
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.descriptions import meshes, sdf
from drake_navbench.inputs.descriptions.model import Shape
from drake_navbench.inputs.descriptions.world import read_world
from drake_navbench.inputs.gazebo_world import load_gazebo_world
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.robot_model import read_robot_model

LIMIT_S = 30.0
BOX = '<collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
BOMB = '<!DOCTYPE a [<!ENTITY a "{}"><!ENTITY b "{}">]>'.format("lol" * 100, "&a;" * 100)


def cart(folder, body, *, name="cart.urdf"):
    path = folder / name
    path.write_text(f'<robot name="cart"><link name="base_link">{body}</link></robot>')
    return path


def refusal(read, *arguments, **options):
    """Returns the one line with which something is refused, in time."""
    began_s = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        with pytest.raises(InputError) as caught:
            read(*arguments, **options)
    assert time.process_time() - began_s < LIMIT_S
    line = str(caught.value)
    assert "\n" not in line
    assert len(line) < 2000
    return line


TRIANGLE = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
HUGE = ((0, 0, 0), ("1e9", 0, 0), (0, "1e9", 0))
CORNER = "vertex {} {} {}\n"


# The text of each mesh file that holds no mesh, and what is told of it.
NO_MESHES = {
    "nan.stl": (TRIANGLE.format(3 * CORNER.format("nan", 0, 0)), "with finite corners"),
    "huge.stl": (
        TRIANGLE.format("".join(CORNER.format(*xyz) for xyz in HUGE)),
        "huge.stl: reaches 1e+09 m, expected at most 1e+06 m",
    ),
    "none.stl": ("", "none.stl: "),
    "above.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n", "above.obj: "),
    "below.obj": ("v 0 0 0\nf -5 -6 -7\n", "below.obj: "),
    "bomb.dae": (f"<?xml version='1.0'?>{BOMB}<COLLADA>&b;</COLLADA>", "bomb.dae: "),
    "deep.gltf": ("[" * 100_000, "deep.gltf: "),
}


@pytest.mark.usefixtures("real_children")
def test_a_mesh_that_is_none_is_told_and_not_drawn(tmp_path):
    for name, (content, _) in NO_MESHES.items():
        head, tail = ("solid a\n", "endsolid a\n") if name.endswith(".stl") else ("", "")
        (tmp_path / name).write_text(head + content + tail)
    path = cart(tmp_path, "".join(map(MESH.format, NO_MESHES)))
    line = refusal(read_robot_model, path)
    assert "no outline found: left out" in line
    for _, reason in NO_MESHES.values():
        assert reason in line
    # An OBJ file is drawn by the browser, as far as it goes.
    assert len(list(SdfModel(path).visuals)) == sum(name.endswith(".obj") for name in NO_MESHES)


def test_a_mesh_of_a_million_triangles_and_more_is_told_by_its_head(tmp_path):
    count = 5_000_000
    with (tmp_path / "all.stl").open("wb") as file:
        file.write(b"a".ljust(80) + count.to_bytes(4, "little"))
        file.truncate(84 + 50 * count)
    line = refusal(read_robot_model, cart(tmp_path, MESH.format("all.stl")))
    assert "has 5000000 triangles, expected at most 1000000" in line


def test_a_mesh_that_takes_too_long_is_told_at_once_the_next_time_and_read_again_after_a_day(
    tmp_path, monkeypatch
):
    tries, folder = [], tmp_path / "cache"

    def too_long(*given):
        tries.append(given)
        raise InputError("meshes: not read within 30 s")

    monkeypatch.setattr(meshes, "call_limited", too_long)
    monkeypatch.setattr(meshes, "user_cache_folder", lambda: folder)
    (tmp_path / "a.stl").write_text("solid a\nendsolid a\n")
    shape = Shape("mesh", np.eye(4), (1.0, 1.0, 1.0), mesh=tmp_path / "a.stl")
    for _ in range(3):
        assert meshes.mesh_outlines([shape], np.eye(4)) == [meshes.TOO_LARGE]
    assert len(tries) == 1
    (kept,) = folder.rglob("*.json")
    yesterday = time.time() - 86_401.0
    os.utime(kept, (yesterday, yesterday))
    meshes.mesh_outlines([shape], np.eye(4))
    assert len(tries) == 2


def test_a_flat_mesh_is_an_obstacle_and_a_point_is_none(tmp_path):
    flat = "solid a\n" + TRIANGLE.format("vertex 0 0 0\nvertex 2 0 0\nvertex 0 2 0\n")
    (tmp_path / "flat.stl").write_text(flat + "endsolid a\n")
    outline = read_robot_model(cart(tmp_path, MESH.format("flat.stl"))).outline
    assert outline.max() == pytest.approx(2.0)
    point = flat.replace("2 0 0", "0 0 0").replace("0 2 0", "0 0 0")
    (tmp_path / "flat.stl").write_text(point + "endsolid a\n")
    assert "no outline found" in refusal(read_robot_model, cart(tmp_path, MESH.format("flat.stl")))


@pytest.mark.parametrize(
    "code",
    [
        "${__import__('os').mkdir('made')}",
        "${().__class__.__base__.__subclasses__()}",
        "${open('made', 'w')}",
        "${eval('1')}",
        "$(eval __import__('os').mkdir('made'))",
    ],
)
def test_xacro_runs_no_code(tmp_path, code):
    path = cart(tmp_path, BOX.replace("0.6", code), name="cart.urdf.xacro")
    assert "xacro cannot expand it" in refusal(read_robot_model, path)
    assert not (tmp_path / "made").exists()


@pytest.mark.usefixtures("real_children")
@pytest.mark.parametrize(
    "body",
    [
        '<xacro:include filename="cart.urdf.xacro"/>',
        '<xacro:macro name="a"><xacro:a/></xacro:macro><xacro:a/>',
        '<xacro:property name="a" value="${\'x\' * 10**12}"/><link name="${a}"/>',
    ],
)
def test_xacro_without_end_is_stopped(tmp_path, body):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(f'<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{body}</robot>')
    assert str(path) in refusal(read_robot_model, path)


@pytest.mark.parametrize(
    "uri",
    [
        "package://../../secret.obj",
        "package://cart/../../secret.obj",
        "model://cart/../../secret.obj",
        "../secret.obj",
        "file://{outside}/secret.obj",
        "{outside}/secret.obj",
        "link.obj",
    ],
)
def test_no_uri_leads_out_of_the_repository(tmp_path, uri):
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    package = tmp_path / "repository" / "cart"
    package.mkdir(parents=True)
    (package.parent / ".git").mkdir()
    (package / "package.xml").write_text("<package><name>cart</name></package>")
    os.symlink(tmp_path / "secret.obj", package / "link.obj")
    path = cart(package, MESH.format(uri.format(outside=tmp_path)))
    assert "no such file or package" in refusal(read_robot_model, path)


def test_entities_of_a_world_and_of_what_it_includes_are_refused(tmp_path):
    text = world(box("wall", "1 1 1", "3 0 0.5 0 0 0"))
    path = tmp_path / "room.world"
    path.write_text(BOMB + text)
    line = refusal(load_gazebo_world, path, lidar_m=0.2, top_m=0.4)
    assert "declares XML entities" in line
    model = tmp_path / "crate"
    model.mkdir()
    (model / "model.config").write_text("<model/>")
    (model / "model.sdf").write_text(f"{BOMB}<sdf>&b;</sdf>")
    path.write_text(world("<include><uri>model://crate</uri></include>"))
    found = load_gazebo_world(path, lidar_m=0.21, top_m=0.4)
    assert any("declares XML entities" in remark for remark in found.remarks)


def test_models_that_include_each_other_twice_are_bounded(tmp_path, monkeypatch):
    """Each model includes the next one four times: 4 to the 12 models, without a link."""
    for level in range(12):
        folder = tmp_path / f"m{level}"
        folder.mkdir()
        (folder / "model.config").write_text("<model/>")
        include = f"<include><uri>model://m{level + 1}</uri><name>{{}}</name></include>"
        body = "".join(map(include.format, "abcd")) if level < 11 else ""
        (folder / "model.sdf").write_text(
            f'<sdf version="1.7"><model name="m">{body}</model></sdf>'
        )
    monkeypatch.setattr(sdf, "MAX_PARTS", 1000)
    path = tmp_path / "room.world"
    path.write_text(world("<include><uri>model://m0</uri></include>"))
    line = refusal(load_gazebo_world, path, lidar_m=0.2, top_m=0.4)
    assert "more than 1000 links and models" in line


def test_a_world_of_too_many_boxes_is_bounded(tmp_path, monkeypatch):
    boxes = "".join(
        box(f"b{k}", "0.1 0.1 1", f"{k % 300 * 0.2} {k // 300 * 0.2} 0.5 0 0 0") for k in range(101)
    )
    path = tmp_path / "room.world"
    path.write_text(world(boxes))
    monkeypatch.setattr(gazebo_world, "MAX_POLYGONS", 100)
    line = refusal(load_gazebo_world, path, lidar_m=0.2, top_m=0.4)
    assert "makes more than 100 polygons" in line
    monkeypatch.setattr(gazebo_world, "MAX_SHAPES", 100)
    line = refusal(load_gazebo_world, path, lidar_m=0.22, top_m=0.4)
    assert "101 shapes stand in it, expected at most 100" in line


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('xyz="0.1 nan 0"', "<origin> xyz='0.1 nan 0': expected numbers"),
        ('rpy="1.5.7 0 0"', "<origin> rpy='1.5.7 0 0': expected numbers"),
        ('xyz="1e200 0 0"', "<origin> xyz='1e200 0 0': expected numbers of at most 1e+06"),
        ('xyz="0.1 0"', "<origin> xyz='0.1 0': expected 3 numbers, found 2"),
        ('xyz="0.1, 0, 0"', "<origin> xyz='0.1, 0, 0': expected no commas; read as spaces"),
    ],
)
def test_a_text_that_is_no_number_is_told(tmp_path, text, told):
    path = cart(tmp_path, BOX.replace("<geometry>", f"<origin {text}/><geometry>"))
    assert told in " ".join(describe_robot(path).check.as_text(400).split())


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (
            '<joint name="arm" type="continous"><parent link="base_link"/><child link="hand"/>'
            '</joint><link name="hand"/>',
            "joint arm: type 'continous' is none of URDF's; taken as fixed",
        ),
        (
            '<joint name="arm" type="fixed"><parent link="bse_link"/><child link="hand"/></joint>'
            '<link name="hand"/>',
            "joint arm: its parent link 'bse_link' is not there",
        ),
        (
            '<link name="hand"><inertial><mass value="5kg"/></inertial></link>',
            "<mass> value='5kg': expected numbers of at most 1e+06; 0 is taken for others",
        ),
    ],
)
def test_a_slip_in_a_joint_or_a_mass_is_told(tmp_path, part, told):
    # What follows the base link, without its own end.
    path = cart(tmp_path, f"{BOX}</link>{part}<link name='last'>")
    assert told in " ".join(describe_robot(path).check.as_text(400).split())


def test_the_numbers_of_a_world_are_told_and_those_of_its_plugins_are_not(tmp_path):
    path = tmp_path / "w.world"
    plugin = '<plugin name="p" filename="q"><pose>left of it</pose></plugin>'
    negative, word = ("a", "1 -1 1", "4 0 0 0 0 0"), ("b", "1 one 1", "0 4 0 0 0 0")
    few = ("c", "1 1", "0 0 0 0 0")
    path.write_text(world(box(*negative) + box(*word) + box(*few) + plugin))
    negative, word, pose, size = read_world(path).remarks
    assert pose == "<pose> '0 0 0 0 0': expected 6 numbers, found 5; 0 is taken for others"
    assert size == "<size> '1 1': expected 3 numbers, found 2; 0 is taken for others"
    assert negative == "<size> '1 -1 1': expected no length below 0"
    assert word.startswith("<size> '1 one 1': expected numbers")


def test_pipes_and_links_in_a_loop_are_no_robots(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "a.urdf").symlink_to("b.urdf")
    (tmp_path / "b.urdf").symlink_to("a.urdf")
    assert find_package_files([tmp_path]).files["robot"] == ()
    assert "pipe.yaml: expected a regular file" in refusal(load_robot, str(tmp_path / "pipe.yaml"))


def test_a_size_in_words_is_told_where_it_leaves_no_outline(tmp_path):
    line = refusal(read_robot_model, cart(tmp_path, BOX.replace("0.6", "long")))
    assert "<box> size='long 0.4 0.2': expected numbers" in line
