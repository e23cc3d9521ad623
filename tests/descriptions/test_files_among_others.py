"""`run --package DIR` among files that another has replaced, of other robots and of ROS 1."""

from __future__ import annotations

import pytest
from descriptions_scenes import BOX, link, urdf

from drake_navbench.campaign.package_arguments import with_package
from drake_navbench.commands.run import build_parser
from drake_navbench.errors import InputError
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.nav2.known_base import known_base_of


def wheel(name, x, y):
    return (
        f'<link name="{name}"/><joint name="{name}_joint" type="continuous">'
        f'<parent link="base_link"/><child link="{name}"/><origin xyz="{x} {y} 0"/>'
        '<axis xyz="0 1 0"/></joint>'
    )


WHEELS = wheel("left_wheel", 0, 0.25) + wheel("right_wheel", 0, -0.25)
DRIVE = '<gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so"/></gazebo>'
NAV2 = (
    "controller_server:\n  ros__parameters:\n    controller_plugins: [FollowPath]\n"
    "    FollowPath: {plugin: '%s'}\n"
)
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def sdf_wheels():
    """Returns two wheels of an SDF model, 0.4 m apart."""
    return "".join(
        f'<link name="{side}_wheel"><pose>0 {y} 0 0 0 0</pose></link>'
        f'<joint name="{side}_joint" type="revolute"><parent>base_link</parent>'
        f"<child>{side}_wheel</child><axis><xyz>0 1 0</xyz></axis></joint>"
        for side, y in (("left", 0.2), ("right", -0.2))
    )


def written(root, files):
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def maps(*names):
    return {f"{n}.yaml": "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n" for n in names} | {
        f"{n.rpartition('/')[0]}/m.pgm": "P2 2 2 255\n0 0 0 0\n" for n in names
    }


BODY = f'<robot name="bot">{link(BOX)}{WHEELS}</robot>'
ENV = (
    '<robot name="bot" xmlns:xacro="http://wiki.ros.org/xacro">'
    "<xacro:if value=\"${'$(env BOT_TYPE)' == 'tank'}\"><xacro:include filename=\"tank.xacro\"/>"
    "</xacro:if><xacro:if value=\"${'$(env BOT_TYPE)' == 'acker'}\">"
    '<xacro:include filename="acker.xacro"/></xacro:if></robot>'
)


def test_a_launched_robot_is_not_replaced_by_a_part_that_its_environment_chooses(
    tmp_path, monkeypatch
):
    root = written(
        tmp_path,
        {
            "urdf/bot.xacro": ENV,
            "urdf/acker.xacro": BODY,
            "urdf/tank.xacro": BODY,
            "launch/bot.launch.py": "path = os.path.join(share, 'urdf/bot.xacro')",
        },
    )
    monkeypatch.delenv("BOT_TYPE", raising=False)
    assert taken(root, "robot") == "urdf/bot.xacro"
    with pytest.raises(InputError, match="asks for the environment variable BOT_TYPE, which is"):
        describe_robot(root / "urdf/bot.xacro")
    monkeypatch.setenv("BOT_TYPE", "tank")
    assert taken(root, "robot") == "urdf/bot.xacro"


def test_a_file_in_a_package_comes_before_one_in_a_template_of_it(tmp_path):
    files = {"scripts/models/bot.urdf": BODY, "src/bot/models/bot.urdf": BODY}
    files |= {"scripts/package.xml": "<package/>", "src/bot/package.xml": "<package/>"}
    root = written(tmp_path, {**files, "src/bot/setup.py": "setup(name='bot')"})
    assert taken(root, "robot") == "src/bot/models/bot.urdf"


def taken(root, kind):
    """Returns the path, in the repository, of the file of a kind that is taken."""
    return find_package_files([root]).picked([])[kind].relative_to(root).as_posix()


def test_a_model_that_another_has_replaced_is_not_taken_for_its_plugin(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE, "old.urdf")
    urdf(tmp_path, link(BOX) + WHEELS, "chair_3.urdf")
    assert taken(tmp_path, "robot") == "chair_3.urdf"


@pytest.mark.parametrize(
    ("launched", "robot"),
    [("nothing", "urdf/cart.urdf"), ("cart.urdf.xacro", "urdf/cart.urdf.xacro")],
)
def test_a_launched_model_that_drives_gives_way_to_no_other_for_its_lidar(
    tmp_path, launched, robot
):
    """The lidar of the launched one is a plugin of its authors."""
    lidar = '<gazebo reference="base_link"><sensor name="s" type="ray"/></gazebo>'
    written(tmp_path, {"launch/a.launch.py": f"'urdf', '{launched}'", "urdf/README": ""})
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE, "urdf/cart.urdf.xacro")
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE + lidar, "urdf/cart.urdf")
    assert taken(tmp_path, "robot") == robot


@pytest.mark.parametrize(
    ("launched", "nav2"),
    [("nothing", "nav2_params.yaml"), ("nav2_params_diy.yaml", "nav2_params_diy.yaml")],
)
def test_a_launched_nav2_file_comes_before_one_of_a_plainer_name(tmp_path, launched, nav2):
    """The map's name is made while launching, so no launch file names it."""
    files = {f"{name}.yaml": NAV2 % RPP for name in ("nav2_params", "nav2_params_diy")}
    written(tmp_path, files | maps("maps/hall") | {"a.launch.py": f"'{launched}'"})
    assert taken(tmp_path, "nav2") == nav2


@pytest.mark.parametrize("name", ["wheelchair", "farm_cart", "simulation_cart", "with_sensors"])
def test_a_robot_s_name_that_contains_a_part_s_name_is_a_robot_s(tmp_path, name):
    """The other model, of the wheels of a cart, comes first by its name."""
    urdf(tmp_path, link(BOX) + WHEELS, "a_wheel.urdf")
    urdf(tmp_path, link(BOX) + WHEELS, f"{name}.urdf")
    assert taken(tmp_path, "robot") == f"{name}.urdf"


def test_a_whole_robot_may_be_called_gazebo(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS, "cart.xacro")
    include = '<xacro:include filename="cart.xacro"/>'
    written(
        tmp_path,
        {
            "cart.gazebo": f'<robot name="c" xmlns:xacro="http://ros.org/x">{include}{DRIVE}</robot>',
            "launch/a.launch.py": "'cart.xacro'",
        },
    )
    assert taken(tmp_path, "robot") == "cart.gazebo"
    told = describe_robot(tmp_path / "cart.gazebo").check.as_text(300)
    assert "drive (differential, by libgazebo_ros_diff_drive.so)" in told


def test_a_robot_whose_base_is_in_a_missing_package_is_refused_with_its_name(tmp_path):
    include = '<xacro:include filename="$(find body_description)/urdf/body.xacro"/>'
    mount = '<link name="imu"/><joint name="j" type="fixed"><parent link="base_link"/>'
    mount += '<child link="imu"/></joint>'
    path = tmp_path / "cart.xacro"
    path.write_text(f'<robot name="c" xmlns:xacro="http://ros.org/x">{include}{mount}</robot>')
    with pytest.raises(InputError, match="found no link base_link; left out what the package body"):
        describe_robot(path)


def test_a_body_without_any_link_names_the_missing_package(tmp_path):
    include = '<xacro:include filename="$(find body_description)/urdf/body.xacro"/>'
    path = tmp_path / "cart.xacro"
    path.write_text(f'<robot name="c" xmlns:xacro="http://ros.org/x">{include}</robot>')
    with pytest.raises(InputError, match="found none; left out what the package body_description"):
        describe_robot(path)


def test_of_two_maps_with_one_name_the_launched_one_is_taken(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = maps("a/maps/yard", "navigation/maps/yard/yard")
    launch = '<arg name="map" default="$(find navigation)/maps/yard/yard.yaml"/>'
    written(tmp_path, files | {"navigation/launch/nav.launch": launch})
    assert taken(tmp_path, "map") == "navigation/maps/yard/yard.yaml"


def test_of_two_maps_with_one_name_the_folder_named_before_it_counts(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = maps("config/hall", "map/hall") | {"config/nav2.yaml": NAV2 % RPP}
    launch = "join(share, 'map', 'hall.yaml'), join(share, 'config', 'nav2.yaml')"
    written(tmp_path, files | {"launch/a.launch.py": launch})
    assert taken(tmp_path, "map") == "map/hall.yaml"


def test_the_launch_file_of_the_nav2_file_s_own_folder_gives_the_map(tmp_path):
    """Both folders have files of the same names, and launch files that name them."""
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = maps("cart_a/maps/map", "cart_b/maps/map")
    for folder in ("cart_a", "cart_b"):
        files[f"{folder}/param/nav2.yaml"] = NAV2 % RPP
    for launch, folder in (("a", "cart_b"), ("b", "cart_a")):
        files[f"launch/{launch}.launch.py"] = f"'{folder}', 'param', 'nav2.yaml', 'maps/map.yaml'"
    written(tmp_path, files)
    assert taken(tmp_path, "nav2") == "cart_a/param/nav2.yaml"
    assert taken(tmp_path, "map") == "cart_a/maps/map.yaml"


def test_a_launch_file_of_localization_alone_gives_no_map_beside_one_that_drives(tmp_path):
    files = {"src/nav2.yaml": NAV2 % RPP, **maps("src/hall", "src/lab")}
    launch = {
        "launch/localization_launch.py": "'src', 'nav2.yaml', 'hall.yaml'",
        "launch/nav_launch.py": "'nav2.yaml', 'lab.yaml'",
    }
    assert taken(written(tmp_path, files | launch), "map") == "src/lab.yaml"


@pytest.mark.parametrize("is_launched", [True, False])
def test_a_robot_in_a_world_replaces_no_launched_model_that_cannot_be_read(tmp_path, is_launched):
    """Such as a lift in a factory, where the robot's packages are elsewhere."""
    drive = '<plugin filename="libgazebo_ros_diff_drive.so" name="d"/>'
    lift = f'<model name="lift"><link name="base_link"/>{sdf_wheels()}{drive}</model>'
    broken = '<robot name="cart"><link name="a">'
    files = {"urdf/cart.urdf": broken, "hall.world": f"<sdf><world>{lift}</world></sdf>"}
    launch = {"launch/a.launch.py": "'urdf', 'cart.urdf'"} if is_launched else {}
    robot = "urdf/cart.urdf" if is_launched else "hall.world"
    assert taken(written(tmp_path, files | launch), "robot") == robot


def test_the_launch_file_of_the_robot_gives_the_map(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = maps("maps/yard", "maps/barn") | {
        "params/nav2.yaml": NAV2 % RPP,
        "launch/a.launch.py": "'nav2.yaml', 'yard.yaml', 'other.urdf'",
        "launch/b.launch.py": "'nav2.yaml', 'barn.yaml', 'cart.urdf'",
    }
    assert taken(written(tmp_path, files), "map") == "maps/barn.yaml"


@pytest.mark.parametrize("launched", ["map", "slam"])
def test_a_launched_nav2_file_counts_more_than_its_name(tmp_path, launched):
    """A file with slam in its name is often one for mapping alone, but not where it is launched."""
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = {f"nav2_with_{name}.yaml": NAV2 % RPP for name in ("map", "slam")}
    files |= maps("maps/map") | {"launch/a.launch.py": f"'nav2_with_{launched}.yaml', 'map.yaml'"}
    assert taken(written(tmp_path, files), "nav2") == f"nav2_with_{launched}.yaml"


@pytest.mark.parametrize(("other", "used"), [("big", "cart"), ("spare", "spare")])
def test_a_nav2_file_of_another_robot_is_no_substitute(tmp_path, other, used):
    """The cart's own file has a controller of its authors; `big` is a robot, `spare` is none."""
    for name in ("cart", "big"):
        (tmp_path / "robots" / name).mkdir(parents=True)
        urdf(tmp_path / "robots" / name, link(BOX) + WHEELS + DRIVE, f"{name}.urdf")
    written(
        tmp_path,
        {
            "config/cart/nav2.yaml": NAV2 % "their_planner::TheirPlanner",
            f"config/{other}/nav2.yaml": NAV2 % RPP,
            "launch/a.launch.py": "'robots/cart/cart.urdf'",
        },
    )
    parser = build_parser()
    words = parser.parse_args(["--package", str(tmp_path)])
    arguments, lines = with_package(words, parser.get_default("robot"))
    assert [path.parent.name for path in arguments.nav2] == [used]
    assert any("left out, the next Nav2 file" in line for line in lines) is (used == "spare")


def test_files_of_move_base_are_told(tmp_path):
    urdf(tmp_path, link(BOX) + WHEELS + DRIVE)
    files = {
        f"param/{name}.yaml": f"{key}: 1\n"
        for name, key in (
            ("a", "obstacle_range"),
            ("b", "TebLocalPlannerROS"),
            ("c", "  planner_patience"),
            ("d", "base_local_planner"),
            ("e", "x"),
        )
    } | {
        "param/f.yaml": "local_costmap:  # of ROS 1\n  global_frame: odom\n",
        "param/g.yaml": "local_costmap:\n  local_costmap:\n    global_frame: odom\n",
    }
    found = find_package_files([written(tmp_path, files)])
    (line,) = (line for line in found.lines(found.picked([])) if line.startswith("nav2:"))
    assert line == (
        "nav2: none found; not read, as of ROS 1's move_base: param/a.yaml, param/b.yaml, "
        "param/c.yaml and 2 more"
    )


@pytest.mark.parametrize(
    ("nav2", "told"),
    [
        ("", "drive: differential, by 4 wheels"),
        ("amcl: {ros__parameters: {robot_model_type: nav2_amcl::OmniMotionModel}}", "omni"),
        ("controller_server: {ros__parameters: {F: {max_vel_y: 0.2}}}", "omni"),
        ("controller_server: {ros__parameters: {F: {motion_model: Omni}}}", "omni"),
        ("controller_server: {ros__parameters: {F: {max_vel_y: 0.0}}}", "differential, by 4"),
        ("amcl: {ros__parameters: {robot_model_type: differential}}", "differential, by 4"),
    ],
)
def test_a_nav2_file_tells_whether_four_plain_wheels_roll_sideways(tmp_path, nav2, told):
    sides = ((0.2, 0.25), (0.2, -0.25), (-0.2, 0.25), (-0.2, -0.25))
    wheels = "".join(wheel(f"wheel_{number}", x, y) for number, (x, y) in enumerate(sides))
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2)
    model = urdf(tmp_path, link(BOX) + wheels)
    found = describe_robot(model, known=known_base_of([path]))
    assert ("omnidirectional, as in the Nav2 file" if told == "omni" else told) in (
        found.check.as_text(300)
    )
    assert (found.fields.get("drive", {}).get("type") == "omnidirectional") is (told == "omni")
