"""xacro is expanded without ROS, as it lies in its repository; what it lacks is told in a line."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import numpy as np
import pytest
import shapely
from descriptions_scenes import BOX, XACRO, collision, link, rows, write_repository

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xacro_file import expand_xacro
from drake_navbench.inputs.robot import load_robot
from drake_navbench.processes import limited_call
from drake_navbench.processes.limited_call import call_limited


def test_xacro_finds_its_packages_by_package_xml_and_takes_arguments(tmp_path):
    path = write_repository(tmp_path)
    robot = load_robot(str(path), arguments={"length": "1.0"})
    assert shapely.Polygon(robot.outline).bounds == pytest.approx((-0.5, -0.27, 0.5, 0.27))
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.3)
    assert "xacro arguments (length=0.6)" in describe_robot(path).check.as_text(200)


def test_a_file_that_a_robot_includes_is_read_anew_when_it_has_changed(tmp_path):
    path = write_repository(tmp_path)
    assert load_robot(str(path)).mass_kg == pytest.approx(22.0)
    assert describe_robot(path) is describe_robot(path)
    wheel = path.parents[2] / "deeper" / "cart_parts" / "urdf" / "wheel.xacro"
    wheel.write_text(wheel.read_text().replace('<mass value="1"/>', '<mass value="2"/>'))
    assert load_robot(str(path)).mass_kg == pytest.approx(24.0)


def test_a_package_that_was_missing_is_found_once_it_is_there(tmp_path):
    path = write_repository(tmp_path)
    package = path.parents[2] / "deeper" / "cart_parts"
    hidden = package.rename(tmp_path / ".git" / "cart_parts")
    with pytest.raises(InputError, match="needs the package 'cart_parts'"):
        load_robot(str(path))
    hidden.rename(package)
    assert load_robot(str(path)).mass_kg == pytest.approx(22.0)


@pytest.mark.parametrize("place", ["src/deeper/cart_parts", "install/cart_parts/share/cart_parts"])
def test_an_include_by_a_path_of_the_authors_computer_is_the_repositorys_file(tmp_path, place):
    path = write_repository(tmp_path / "cart")
    text = path.read_text()
    assert "$(find cart_parts)" in text
    path.write_text(text.replace("$(find cart_parts)", f"/elsewhere/{place}"))
    assert describe_robot(path).fields["drive"]


def test_a_package_elsewhere_is_found_by_packages_alone(tmp_path):
    path = write_repository(tmp_path / "a")
    other = tmp_path / "b" / "cart_parts"
    (tmp_path / "b").mkdir()
    (path.parents[2] / "deeper" / "cart_parts").rename(other)
    with pytest.raises(InputError, match=r"needs the package 'cart_parts'.*--packages"):
        load_robot(str(path))
    assert load_robot(str(path), packages=[tmp_path / "b"]).mass_kg == pytest.approx(22.0)


def test_all_packages_that_a_robot_lacks_are_named(tmp_path):
    path = write_repository(tmp_path)
    text = XACRO.replace("$(find cart_parts)", "$(find mir_description)")
    arm = '<xacro:include filename="$(find ur_description)/ur.xacro"/>'
    path.write_text(text.replace("<link", f"{arm}<link", 1))
    with pytest.raises(InputError, match="packages 'mir_description', 'ur_description', which"):
        load_robot(str(path))


def test_an_argument_in_a_package_that_is_missing_names_the_package_and_no_folder_of_ours(tmp_path):
    path = write_repository(tmp_path)
    limits = '<xacro:arg name="limits" default="$(find ur_description)/limits.yaml"/>'
    path.write_text(XACRO.replace("<link", f"{limits}<link", 1))
    assert expand_xacro(path).arguments["limits"] == "package://ur_description/limits.yaml"


def test_a_mesh_of_a_gazebo_model_is_searched_by_the_models_name(tmp_path):
    """The library that expands xacro puts the file's folder between model:// and the name."""
    path = write_repository(tmp_path)
    mesh = collision('<mesh filename="model://gone/hull.stl"/>')
    path.write_text(XACRO.replace('<link name="laser"/>', f'<link name="laser">{mesh}</link>'))
    assert "left out model://gone/hull.stl" in " ".join(rows(path, Status.STAND_IN))


def test_a_folder_closed_by_another_user_hides_no_package_beside_it(tmp_path, monkeypatch):
    for name in ("cart", "closed"):
        (tmp_path / name).mkdir()
    (tmp_path / "cart" / "package.xml").write_text("<package><name>cart</name></package>")

    def refused_in_closed(path, *, follow_symlinks=True):
        if path.parent.name == "closed":
            raise PermissionError(13, "Permission denied", str(path))
        return os.stat(path, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(Path, "stat", refused_in_closed)
    packages = Packages(tmp_path / "cart" / "cart.urdf", [tmp_path])
    assert packages.folder("cart") == tmp_path / "cart"
    assert packages.model("cone") is None


def test_a_file_of_a_folder_without_model_config_is_found_by_a_model_s_name(tmp_path):
    """As below GZ_SIM_RESOURCE_PATH; a folder of that name without the file is none."""
    mesh = tmp_path / "props" / "crate" / "meshes" / "crate.dae"
    mesh.parent.mkdir(parents=True)
    mesh.write_text("<COLLADA/>")
    (tmp_path / "crate").mkdir()
    (tmp_path / "package.xml").write_text("<package><name>hall</name></package>")
    (tmp_path / "worlds").mkdir()
    packages = Packages(tmp_path / "worlds" / "hall.world", [tmp_path])
    assert packages.place("model://crate/meshes/crate.dae") == mesh
    assert packages.place("model://crate/meshes/other.dae") is None


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


@pytest.mark.usefixtures("real_children")
def test_an_included_file_that_git_lfs_keeps_elsewhere_is_told_as_such(tmp_path):
    path = write_repository(tmp_path)
    (tmp_path / "cart_description/urdf/part.xacro").write_text(
        "version https://git-lfs.github.com/spec"
    )
    path.write_text(XACRO.replace("<link", '<xacro:include filename="part.xacro"/><link', 1))
    with pytest.raises(InputError, match=r"part\.xacro: a pointer of Git LFS, not the file; run"):
        describe_robot(path)


def test_a_file_to_include_that_is_not_there_is_told_once(tmp_path):
    path = write_repository(tmp_path)
    path.write_text(XACRO.replace("<link", '<xacro:include filename="gone.xacro"/><link', 1))
    with pytest.raises(InputError, match=r"expand it: No such file or directory: \S*gone\.xacro$"):
        describe_robot(path)


def test_a_fault_in_an_included_file_names_that_file(tmp_path):
    (tmp_path / "lidar.xacro").write_text("<robot>\n<link</robot>")
    path = tmp_path / "cart.urdf.xacro"
    path.write_text('<robot xmlns:xacro="a"><xacro:include filename="lidar.xacro"/></robot>')
    with pytest.raises(InputError, match=r"cannot expand lidar\.xacro: .* line 2, column 5"):
        load_robot(str(path))


def processor_time_s() -> float:
    """Returns the processor time of the children that have ended."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


@pytest.mark.usefixtures("real_children")
def test_xacro_that_never_ends_or_eats_memory_is_stopped(tmp_path):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text('<robot><link name="${len([0]*10**9)}"/></robot>')
    began_s = processor_time_s()
    with pytest.raises(InputError, match="at most 1 GB of memory and 30 s"):
        expand_xacro(path)
    assert processor_time_s() - began_s < 30.0


@pytest.mark.usefixtures("real_children")
def test_a_call_may_wait_on_a_busy_computer():
    """A sleep takes no processor time, as a process that others keep from running."""
    assert call_limited("time:sleep", 1.5, "the file", time_s=1) is None


@pytest.mark.usefixtures("real_children")
def test_a_call_that_takes_too_long_is_one_line(monkeypatch):
    monkeypatch.setattr(limited_call, "WAITING", 1)
    with pytest.raises(InputError, match=r"^the file: not read within 1 s$"):
        call_limited("time:sleep", 10, "the file", time_s=1)


@pytest.mark.parametrize(
    ("launch", "text"),
    [
        ("a.launch.py", "x = 'cart.xacro'\nDeclareLaunchArgument('arm', default_value='left')"),
        ("a.launch.py", "Command(['xacro ', 'cart.xacro', ' arm:=left'])"),
        ("a.launch.py", "process_file('cart.xacro', mappings={'arm': 'left'})"),
        ("a.launch.xml", '<arg name="arm" default="left"/><x file="cart.xacro"/>'),
    ],
)
def test_an_argument_without_a_default_has_the_value_of_a_launch_file(tmp_path, launch, text):
    path = tmp_path / "cart.xacro"
    path.write_text(
        '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg arm)"/>'
        "</robot>"
    )
    (tmp_path / launch).write_text(text)
    found = expand_xacro(path)
    assert '<link name="left"/>' in found.text
    assert found.remarks == (f"argument arm has no default: left, as in {launch}",)
    assert '<link name="right"/>' in expand_xacro(path, {"arm": "right"}).text


CHASSIS = (
    '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="chassis" '
    'default="short"/><xacro:arg name="sim" default="true"/><xacro:arg name="prefix" default=""/>'
    "<xacro:if value=\"${'$(arg chassis)' == 'long'}\"><link name=\"long\"/></xacro:if>"
    "<xacro:if value=\"${'$(arg chassis)' == 'short'}\"><link name=\"short\"/></xacro:if>"
    '<xacro:if value="$(arg sim)"><link name="simulated"/></xacro:if></robot>'
)
DECLARED = "x = 'cart.xacro'\nDeclareLaunchArgument('chassis', default_value='{}')\n"


@pytest.mark.parametrize(
    ("launched", "taken"),
    [
        (["long"], "long"),
        (["long", "long"], "long"),
        # They do not agree: the model's own default holds.
        (["long", "short"], "short"),
    ],
)
def test_launch_files_choose_the_branch_of_a_model(tmp_path, launched, taken):
    path = tmp_path / "cart.xacro"
    path.write_text(CHASSIS)
    for number, value in enumerate(launched):
        text = DECLARED.format(value) + "DeclareLaunchArgument('sim', default_value='false')"
        text += "DeclareLaunchArgument('prefix', default_value='robot1_')"
        (tmp_path / f"{number}.launch.py").write_text(text)
    found = expand_xacro(path)
    assert f'<link name="{taken}"/>' in found.text
    # A flag is no choice: a launch file of the real robot leaves out the simulation's parts.
    assert "simulated" in found.text
    told = f"argument chassis: {taken}, as in 0.launch.py; its own default is short"
    assert found.remarks == ((told,) if taken != "short" else ())
    assert '<link name="short"/>' in expand_xacro(path, {"chassis": "short"}).text


SCANNING = (
    '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base_link"/>'
    '<xacro:arg name="sim_gz" default="false"/><xacro:arg name="arm" default="false"/>'
    '<xacro:if value="$(arg sim_gz)"><gazebo><sensor name="eye" type="{}"/></gazebo></xacro:if>'
    '<xacro:if value="$(arg arm)"><link name="arm"/></xacro:if></robot>'
)


@pytest.mark.parametrize(
    ("launched", "sensor", "remarks"),
    [
        (
            "'xacro', 'cart.xacro', ' sim_gz:=', \"true\", ' arm:=true'",
            "gpu_lidar",
            ("argument sim_gz: true, as in a.launch.py; its own default is false",),
        ),
        (
            "sim = 'true'\n'xacro', 'cart.xacro', ' sim_gz:=', sim",
            "gpu_lidar",
            ("argument sim_gz: true, as in a.launch.py; its own default is false",),
        ),
        # Nothing is won by a flag that brings no lidar, and none is tried that nobody sets.
        ("'xacro', 'cart.xacro', ' sim_gz:=true'", "camera", ()),
        ("'xacro', 'cart.xacro'", "gpu_lidar", ()),
    ],
)
def test_a_flag_of_the_simulation_that_brings_the_lidar_is_set(tmp_path, launched, sensor, remarks):
    path = tmp_path / "cart.xacro"
    path.write_text(SCANNING.format(sensor))
    (tmp_path / "a.launch.py").write_text(launched)
    found = expand_xacro(path)
    assert found.remarks == remarks
    assert ("<sensor" in found.text) == bool(remarks)
    assert '<link name="arm"/>' not in found.text
    assert "<sensor" not in expand_xacro(path, {"sim_gz": "false"}).text


@pytest.mark.parametrize(
    ("passed", "how"),
    [
        ("true", "as in sim.launch.py"),
        # Nobody sets it; it is tried, and told, for its name.
        ("false", "with which model.launch.py simulates (else --set sim_gz=false)"),
    ],
)
def test_a_flag_that_a_launch_file_has_as_an_argument_is_set(tmp_path, passed, how):
    path = tmp_path / "cart.xacro"
    path.write_text(SCANNING.format("gpu_lidar"))
    (tmp_path / "model.launch.py").write_text(
        "sim = LaunchConfiguration('simulated')\n'xacro', 'cart.xacro', ' sim_gz:=', sim\n"
        "DeclareLaunchArgument('simulated', default_value='false')"
    )
    (tmp_path / "sim.launch.py").write_text(f"'model.launch.py', {{'simulated': '{passed}'}}")
    found = expand_xacro(path)
    assert "<sensor" in found.text
    assert found.remarks == (f"argument sim_gz: true, {how}; its own default is false",)


def test_a_launch_file_of_another_model_gives_no_value(tmp_path):
    path = tmp_path / "cart.xacro"
    path.write_text('<robot name="a"><link name="$(arg arm)"/></robot>')
    (tmp_path / "b.launch.py").write_text(
        "'other.xacro' DeclareLaunchArgument('arm', default_value='x')"
    )
    with pytest.raises(InputError, match="give it by --set arm=VALUE"):
        expand_xacro(path)


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


@pytest.mark.usefixtures("real_children")
def test_a_xacro_file_that_asks_the_environment_is_told_in_words(tmp_path, monkeypatch):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(f'<robot name="a">{link(BOX.replace("0.6", "$(env CART_LENGTH)"))}</robot>')
    with pytest.raises(InputError, match="CART_LENGTH=VALUE drake-navbench"):
        load_robot(str(path))
    monkeypatch.setenv("CART_LENGTH", "0.8")
    assert load_robot(str(path)).outline[:, 0].max() == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("launch", "text"),
    [
        ("a.launch.py", "SetEnvironmentVariable('CART_LENGTH', '0.8')"),
        ("a.launch.py", "SetEnvironmentVariable(name='CART_LENGTH', value='0.8')"),
        ("a.launch.py", 'os.environ["CART_LENGTH"] = "0.8"'),
        ("a.launch.py", "length = os.environ.get('CART_LENGTH', '0.8')"),
        ("a.launch.xml", '<set_env name="CART_LENGTH" value="0.8"/>'),
        ("a.launch", '<env name="CART_LENGTH" value="0.8"/>'),
    ],
)
def test_an_environment_variable_that_is_not_set_has_the_value_of_the_launch_files(
    tmp_path, monkeypatch, launch, text
):
    monkeypatch.delenv("CART_LENGTH", raising=False)
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(f'<robot name="a">{link(BOX.replace("0.6", "$(env CART_LENGTH)"))}</robot>')
    (tmp_path / launch).write_text(f"# SetEnvironmentVariable('CART_LENGTH', '0.2')\n{text}\n")
    found = expand_xacro(path)
    assert 'size="0.8 0.4' in found.text
    assert found.remarks == (f"environment variable CART_LENGTH: 0.8, as in {launch}",)
    assert "CART_LENGTH" not in os.environ
    # The file's own default is for those who launch it without.
    path.write_text(path.read_text().replace("(env CART_LENGTH", "(optenv CART_LENGTH 0.5"))
    assert 'size="0.8 0.4' in expand_xacro(path).text
    (tmp_path / "b.launch.py").write_text("SetEnvironmentVariable('CART_LENGTH', '0.7')")
    assert 'size="0.5 0.4' in expand_xacro(path).text
    monkeypatch.setenv("CART_LENGTH", "0.9")
    assert 'size="0.9 0.4' in expand_xacro(path).text


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
