"""Files of another kind than asked for are told for what they are, with what is expected."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.nav2.parameters import read_parameter_file
from drake_navbench.navigation.behavior_tree.tree_file import read_tree_file
from drake_navbench.navigation.costmaps.map_file import load_map

URDF = """<robot name="a"><link name="base_link">{mass}{shapes}</link></robot>"""
BOX = "<collision{name}><geometry><box size='0.4 0.6 0.2'/></geometry></collision>"
MASS = "<inertial><mass value='4'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"


@pytest.fixture
def in_folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["place.pgm", "place.png"])
def test_an_image_where_a_map_belongs_is_told_with_the_file_beside_it(in_folder, name):
    Image.new("L", (4, 3)).save(name)
    with pytest.raises(InputError, match=r"is an image; expected .* a YAML file with image"):
        load_map(name)
    Path("place.yaml").write_text("image: place.pgm")
    with pytest.raises(InputError, match=r"is an image; expected .* place\.yaml beside it"):
        load_map(name)


def test_an_image_of_another_machines_path_is_taken_from_beside_the_map(in_folder):
    Image.new("L", (4, 3), 254).save("place.pgm")
    Path("place.yaml").write_text(
        "image: /elsewhere/place.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    with pytest.warns(InputWarning, match="no such file; place.pgm beside it is taken"):
        assert load_map("place.yaml").occupancy.shape == (3, 4)


def test_a_folder_that_may_not_be_listed_is_told_as_a_folder(in_folder, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(InputError, match=r"is a folder; expected a file \("):
        load_robot(str(in_folder))


@pytest.mark.parametrize("name", ["lab.world", "lab.sdf"])
def test_a_simulators_world_is_no_scenario(in_folder, name):
    Path(name).write_text("<sdf version='1.6'/>")
    for given in (name, f"./{name}", str(in_folder / name)):
        with pytest.raises(InputError, match="is a simulator's world; expected a YAML file"):
            load_scenario(given)


def test_a_folder_is_no_robot_but_what_is_in_it_may_be(in_folder):
    Path("robots").mkdir()
    (in_folder / "robots" / "cart.urdf").write_text("<robot/>")
    for given in ("robots", "./robots"):
        with pytest.raises(InputError, match=r"is a folder; expected a file, such as cart\.urdf"):
            load_robot(given)


@pytest.mark.parametrize("name", ["nav2.launch.py", "nav2.launch.xml"])
def test_a_launch_file_is_no_parameter_file(in_folder, name):
    Path(name).write_text("def generate_launch_description(): ...")
    with pytest.raises(InputError, match="is a launch file; expected the parameter file"):
        read_parameter_file(Path(name))


def test_a_model_without_mass_is_a_robot_of_unknown_mass(in_folder):
    Path("cart.urdf").write_text(URDF.format(mass="", shapes=BOX.format(name="")))
    robot = load_robot("cart.urdf")
    assert robot.mass_kg is None
    assert np.ptp(robot.outline, axis=0).tolist() == [0.4, 0.6]


def test_a_model_of_more_shapes_than_drake_takes_in_seconds_is_read(in_folder):
    shapes = 501 * BOX.format(name="")
    Path("cart.urdf").write_text(URDF.format(mass=f"{MASS}</inertial>", shapes=shapes))
    assert np.ptp(load_robot("cart.urdf").outline, axis=0).tolist() == [0.4, 0.6]


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("bringup.launch.py", "def generate_launch_description(): ...", "Python"),
        ("bringup.launch", "<launch><arg name='a'/></launch>", "XML"),
        ("bringup.launch.xml", "<?xml version='1.0'?>\n<launch/>", "XML"),
    ],
)
@pytest.mark.parametrize("load", [load_robot, load_map, load_scenario])
def test_what_is_no_yaml_is_told_for_what_it_is(in_folder, name, text, kind, load):
    (in_folder / name).write_text(text)
    with pytest.raises(InputError, match=rf"{re.escape(name)}: is {kind}; expected a YAML file"):
        load(str(in_folder / name))


def test_a_template_that_begins_with_a_placeholder_is_yaml(in_folder):
    Path("nav2.yaml").write_text("<robot_namespace>:\n  amcl: {ros__parameters: {a: 1}}\n")
    assert len(read_parameter_file(Path("nav2.yaml")).sections) == 1


def test_a_xacro_file_without_links_is_told_so(in_folder):
    Path("cart.urdf.xacro").write_text("<robot xmlns:xacro='http://ros.org/wiki/xacro'/>")
    with pytest.raises(InputError, match=r"cart\.urdf\.xacro: .*expected links, found none"):
        load_robot("cart.urdf.xacro")


def test_a_model_without_base_link_is_read_from_its_root(in_folder):
    links = "".join(f"<link name='l{i}'>{BOX.format(name='')}</link>" for i in range(7))
    joints = "".join(
        f"<joint name='j{i}' type='fixed'><parent link='l0'/><child link='l{i}'/></joint>"
        for i in range(1, 7)
    )
    Path("cart.urdf").write_text(f"<robot name='a'>{links}{joints}</robot>")
    assert np.ptp(load_robot("cart.urdf").outline, axis=0).tolist() == [0.4, 0.6]


def test_a_list_of_tree_nodes_is_no_tree(in_folder):
    Path("nodes.xml").write_text("<root><TreeNodesModel/></root>")
    with pytest.raises(
        InputError, match=r"expected one BehaviorTree, or main_tree_to_.*; found no"
    ):
        read_tree_file(Path("nodes.xml"))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("mass_kg: 3\n", "mine/robot.yaml: description: missing, but required"),
        ("{description: a, robot_radius: 0.2, model: b.sdf}", "model: no such file: mine/b.sdf"),
        ("{like: other.yaml}", "mine/other.yaml: like: 'robot.yaml' is like this file itself"),
    ],
)
def test_an_error_names_a_robot_file_as_it_was_given(in_folder, text, told):
    Path("mine").mkdir()
    Path("mine/robot.yaml").write_text(text)
    Path("mine/other.yaml").write_text("like: robot.yaml\n")
    with pytest.raises(InputError, match=re.escape(told)) as caught:
        load_robot("mine/robot.yaml")
    assert str(in_folder) not in str(caught.value)


def test_an_error_names_a_scenario_file_as_it_was_given(in_folder):
    Path("mine.yaml").write_text("{description: a, plan: 3}")
    with pytest.raises(InputError, match=r"^mine\.yaml, line 1: plan: input"):
        load_scenario("mine.yaml")


def test_a_robot_keeps_its_folder_when_the_working_folder_changes(in_folder, monkeypatch):
    Path("mine").mkdir()
    text = "{description: a, robot_radius: 0.2, model: cart.urdf}"
    Path("mine/robot.yaml").write_text(text)
    Path("mine/cart.urdf").write_text(URDF.format(mass="", shapes=BOX.format(name="")))
    robot = load_robot("mine/robot.yaml")
    monkeypatch.chdir("/")
    assert robot.model_path == in_folder / "mine" / "cart.urdf"
