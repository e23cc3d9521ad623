"""`run --package PATH` takes the files that the repository's launch files start together."""

from __future__ import annotations

import pytest
from descriptions_scenes import BOX, ROOM, collision, link, urdf, world, write_repository

from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.launch_files import read_launch_files
from drake_navbench.inputs.package_search import find_package_files

NAV2 = """controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
local_costmap:
  local_costmap:
    ros__parameters: {robot_base_frame: base_link, robot_radius: 0.3}
"""
# Two wheels 0.5 m apart, as in a URDF and in an SDF model.
URDF_WHEEL = (
    '<link name="{name}"/><joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
    '<child link="{name}"/><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>'
)
SDF_WHEEL = (
    '<link name="{name}"><pose>0 {y} 0 0 0 0</pose></link><joint name="{name}_joint" '
    'type="revolute"><parent>base_link</parent><child>{name}</child><axis><xyz>0 1 0</xyz></axis>'
    "</joint>"
)
LIDAR = (
    '<sensor name="scan" type="ray"><ray><scan><horizontal><samples>90</samples></horizontal>'
    "</scan><range><min>0.1</min><max>3.5</max></range></ray></sensor>"
)
DRIVE = '<plugin name="drive" filename="libgazebo_ros_diff_drive.so"/>'


@pytest.fixture
def repository(tmp_path):
    """A repository with a robot, a Nav2 file, two worlds and two maps; no launch file."""
    root = tmp_path / "cart"
    write_repository(root)
    files = {
        "nav/config/nav2_params.yaml": NAV2,
        "nav/worlds/barn.world": world(ROOM),
        "nav/worlds/empty.world": world(""),
    }
    for name in ("attic", "yard"):
        files[f"nav/maps/{name}.yaml"] = f"image: {name}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
        files[f"nav/maps/{name}.pgm"] = "P2 2 2 255\n0 0 0 0\n"
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def picked(root, kind):
    """Returns the name of the file of a kind that is taken; None for none."""
    file = find_package_files([root]).picked([])[kind]
    return file and file.name


@pytest.mark.parametrize(
    ("launched", "taken"),
    [
        # No map: the world that Nav2 is started with is no place of the attic's map.
        ("'nav2_params.yaml', 'barn.world'", None),
        ("'nav2_params.yaml', 'barn.world', 'yard.yaml'", "yard.yaml"),
        ("'nav2_params.yaml'", "attic.yaml"),
    ],
)
def test_a_launch_file_that_starts_a_world_without_a_map_takes_no_other_place_s_map(
    repository, launched, taken
):
    (repository / "nav" / "sim.launch.py").write_text(launched)
    assert picked(repository, "map") == taken
    assert picked(repository, "world") == "barn.world"


def test_the_map_of_the_launched_world_is_known_by_its_name(repository):
    (repository / "nav" / "worlds" / "barn.world").rename(
        repository / "nav" / "worlds" / "yard_world.sdf"
    )
    (repository / "sim.launch.py").write_text("'nav2_params.yaml', 'yard_world.sdf'")
    assert picked(repository, "map") == "yard.yaml"


def test_the_only_map_of_a_repository_is_that_of_its_world(repository):
    for file in (repository / "nav" / "maps").glob("attic.*"):
        file.unlink()
    (repository / "sim.launch.py").write_text("'nav2_params.yaml', 'barn.world'")
    assert picked(repository, "map") == "yard.yaml"


def test_of_maps_without_a_launch_file_it_is_that_of_the_launched_world(repository):
    """By its name alone attic.yaml would come first."""
    barn = repository / "nav" / "worlds" / "barn.world"
    barn.rename(barn.with_name("yard.world"))
    (repository / "sim.launch.py").write_text("'worlds', 'yard.world'")
    assert picked(repository, "map") == "yard.yaml"


@pytest.mark.parametrize(
    ("launched", "told"),
    [
        ("'nav2_params.yaml', 'maps', 'cellar.yaml'", ["cellar.yaml, which nav.launch.py names"]),
        ("'nav2_params.yaml', 'config', 'cellar.yaml'", []),
        # The launch file starts another map, which is there.
        ("'nav2_params.yaml', 'maps', 'cellar.yaml', 'maps', 'yard.yaml'", []),
    ],
)
def test_a_launched_map_that_is_not_in_the_repository_is_told(repository, launched, told):
    (repository / "nav.launch.py").write_text(launched)
    found = find_package_files([repository])
    lines = [line.strip() for line in found.lines(found.picked([]))]
    assert [line for line in lines if "not there" in line] == [f"not there: {t}" for t in told]


@pytest.mark.parametrize(
    ("launched", "told"),
    [("'other.world'", ""), ("'empty.world'", " (sim.launch.py starts empty.world)")],
)
def test_the_world_that_a_launch_file_starts_instead_is_told(repository, launched, told):
    (repository / "nav" / "sim.launch.py").write_text(launched)
    found = find_package_files([repository])
    assert f"  *  1 nav/worlds/barn.world{told}" in found.lines(found.picked([]))


def test_a_chosen_file_far_down_the_list_is_listed(repository):
    for number in range(20):
        (repository / "nav" / "config" / f"nav2_params_{number:02}.yaml").write_text(NAV2)
    found = find_package_files([repository])
    lines = found.lines(found.picked(["nav2=15"]))
    (marked,) = (line for line in lines if line.startswith("  *") and "config" in line)
    assert marked == f"  * 15 nav/config/{found.files['nav2'][14].name}"
    # Twelve are listed before it.
    assert "       and 8 more" in lines


def test_every_python_file_in_a_folder_launch_is_a_launch_file(repository):
    worlds = repository / "nav" / "worlds"
    (worlds / "yard.world").write_text(world(ROOM))
    (repository / "nav" / "launch").mkdir()
    (repository / "nav" / "launch" / "robot_in_yard.py").write_text("'yard.world'")
    (repository / "nav" / "yard_and_barn.py").write_text("'barn.world'")
    assert picked(repository, "world") == "yard.world"


@pytest.mark.parametrize(
    ("text", "is_named"),
    [
        ("kind = 'small'; 'cart_' + kind + '.urdf.xacro'", True),
        ("DeclareLaunchArgument('kind', default_value='small'); f'cart_{kind}.urdf.xacro'", True),
        ("default_value='small', ['cart_', LaunchConfiguration('kind'), '.urdf.xacro']", True),
        # Values of variables, one of which holds an argument, make the beginning as well.
        ("kind = 'cart_small'\nf'{kind}.urdf.xacro'", True),
        ("kind = 'small'\n'robots/cart_' + kind + '.urdf.xacro'", True),
        (
            "k = LaunchConfiguration('kind')\nname = context.perform_substitution(k)\n"
            "f'{name}.urdf.xacro'\nDeclareLaunchArgument('kind', default_value='cart_small')",
            True,
        ),
        # A variable with two values, one in a remark, another value, a name that is said nowhere.
        ("kind = 'cart_small'\nkind = 'b'\nf'{kind}.urdf.xacro'", False),
        ("kind = 'b'\n# kind = 'cart_small'\nf'{kind}.urdf.xacro'", False),
        ("kind = 'large'; 'cart_' + kind + '.urdf.xacro'", False),
        ("'small', '.urdf.xacro'", False),
    ],
)
def test_a_file_s_name_may_be_composed_in_a_launch_file(tmp_path, text, is_named):
    launch = tmp_path / "a.launch.py"
    launch.write_text(text)
    found = read_launch_files([launch]).folders(tmp_path / "cart_small.urdf.xacro")
    assert (found >= 0) is is_named


@pytest.mark.parametrize("chosen", ["apple", "pear"])
def test_an_argument_s_default_tells_which_robot_s_folder_it_is(tmp_path, chosen):
    """One launch file composes the path, another one gives the folder."""
    wheels = "".join(SDF_WHEEL.format(name=n, y=y) for n, y in (("a_wheel", 1), ("b_wheel", -1)))
    body = f'<link name="base_link">{LIDAR}</link>{wheels}{DRIVE}'
    for name in ("apple", "pear"):
        (tmp_path / "robots" / name).mkdir(parents=True)
        text = f'<sdf version="1.6"><model name="{name}">{body}</model></sdf>'
        (tmp_path / "robots" / name / "model.sdf").write_text(text)
    (tmp_path / "spawn.launch.py").write_text("share / 'robots' / robot / 'model.sdf'")
    (tmp_path / "all.launch.py").write_text(f"Argument('robot', default_value='{chosen}')")
    robot = find_package_files([tmp_path]).picked([])["robot"]
    assert robot is not None
    assert robot.parent.name == chosen


def test_a_copy_of_nav2_s_own_sources_comes_after_the_robot_s_files(repository):
    examples = repository / "navigation2"
    for file, text in {
        "nav2_costmap_2d/package.xml": "<package><name>nav2_costmap_2d</name></package>",
        "nav2_bringup/params/nav2_params.yaml": NAV2.replace("0.3", "0.22"),
        "nav2_bringup/launch/a.launch.py": "'params', 'nav2_params.yaml', 'maps', 'yard.yaml'",
    }.items():
        (examples / file).parent.mkdir(parents=True, exist_ok=True)
        (examples / file).write_text(text)
    nav2 = find_package_files([repository]).picked([])["nav2"]
    assert nav2 == repository / "nav/config/nav2_params.yaml"


@pytest.mark.parametrize(("half_m", "taken"), [(0.25, "model.sdf"), (0.4, "cart.urdf")])
def test_a_urdf_without_lidar_gives_way_to_an_sdf_model_with_the_same_wheels(
    tmp_path, half_m, taken
):
    """Gazebo is often started with an SDF model, and robot_state_publisher with a bare URDF."""
    (tmp_path / "package.xml").write_text("<package><name>cart</name></package>")
    (tmp_path / "urdf").mkdir()
    (tmp_path / "models" / "cart").mkdir(parents=True)
    sides = (("left_wheel", 1), ("right_wheel", -1))
    wheels = "".join(URDF_WHEEL.format(name=name, y=0.25 * side) for name, side in sides)
    urdf(tmp_path / "urdf", link(BOX) + wheels)
    wheels = "".join(SDF_WHEEL.format(name=name, y=half_m * side) for name, side in sides)
    (tmp_path / "models" / "cart" / "model.sdf").write_text(
        f'<sdf version="1.6"><model name="cart"><link name="base_link">{LIDAR}</link>'
        f"{wheels}{DRIVE}</model></sdf>"
    )
    assert picked(tmp_path, "robot") == taken


def test_a_urdf_in_a_file_called_model_is_a_robot_and_furniture_is_none(tmp_path):
    wheels = "".join(URDF_WHEEL.format(name=f"{n}_wheel", y=y) for n, y in (("a", 1), ("b", -1)))
    drive = f"<gazebo>{DRIVE}</gazebo>"
    urdf(tmp_path, link(BOX) + wheels + drive, "cart.model")
    urdf(tmp_path, link(BOX), "bed.model")
    found = find_package_files([tmp_path]).files["robot"]
    assert [file.name for file in found] == ["cart.model"]
    assert "drive (differential, by libgazebo" in describe_robot(found[0]).check.as_text(300)


def test_a_base_link_with_a_robot_s_prefix_is_the_base(tmp_path):
    """robot1/base_link lies 0.2 m ahead of robot1/base_footprint."""
    path = urdf(
        tmp_path,
        link("", "robot1/base_footprint")
        + link(BOX, "robot1/base_link")
        + '<joint name="j" type="fixed"><parent link="robot1/base_footprint"/>'
        '<child link="robot1/base_link"/><origin xyz="0.2 0 0.1"/></joint>'
        + link(collision('<box size="0.1 0.1 0.1"/>'), "mast")
        + '<joint name="k" type="fixed"><parent link="robot1/base_link"/>'
        '<child link="mast"/></joint>',
    )
    assert describe_robot(path).base == "robot1/base_link"


COSTMAP = "local_costmap:\n  local_costmap:\n    ros__parameters: {robot_radius: 0.3}\n"
PLANNER = "planner_server:\n  ros__parameters: {planner_plugins: [GridBased]}\n"
CONTROLLER = NAV2.partition("local_costmap")[0]
SMOOTHER = "velocity_smoother:\n  ros__parameters: {smoothing_frequency: 20.0}\n"


@pytest.mark.parametrize(
    ("launched", "others", "merged"),
    [
        # A launch file starts the servers with a file each; nobody starts the smoother.
        (
            "'nav2_params.yaml', 'costmap.yaml', 'planner.yaml'",
            {"costmap.yaml": COSTMAP, "planner.yaml": PLANNER, "smoother.yaml": SMOOTHER},
            ["costmap.yaml", "planner.yaml", "nav2_params.yaml"],
        ),
        # No launch file: the only ones beside it that have what it lacks.
        (
            "",
            {"costmap.yaml": COSTMAP, "smac.yaml": PLANNER, "theta.yaml": PLANNER},
            ["costmap.yaml", "nav2_params.yaml"],
        ),
        # A launch file starts the Nav2 file, and not the other.
        ("'nav2_params.yaml'", {"costmap.yaml": COSTMAP}, ["nav2_params.yaml"]),
        # Another whole file is no half.
        ("'nav2_params.yaml', 'other.yaml'", {"other.yaml": NAV2 + PLANNER}, ["nav2_params.yaml"]),
    ],
)
def test_a_nav2_file_in_several_parts_is_merged(repository, launched, others, merged):
    (repository / "nav" / "nav.launch.py").write_text(launched)
    # Another package's file of the same name, which comes first in the alphabet.
    (repository / "arm" / "config").mkdir(parents=True)
    (repository / "arm" / "config" / "costmap.yaml").write_text(COSTMAP)
    for name, text in {"nav2_params.yaml": CONTROLLER, **others}.items():
        (repository / "nav" / "config" / name).write_text(text)
    found = find_package_files([repository])
    taken = found.picked([])
    files = found.options(taken, "nav2")["nav2"]
    assert [file.relative_to(repository).as_posix() for file in files] == [
        f"nav/config/{name}" for name in merged
    ]
    told = [line for line in found.lines(taken) if "  *  + " in line]
    assert [line.rpartition("/")[2].partition(":")[0] for line in told] == merged[:-1]


CONTROLLED = (
    '<gazebo><plugin name="control" filename="libgazebo_ros2_control.so">'
    "<parameters>control.yaml</parameters></plugin></gazebo>"
)


def test_a_launched_model_that_ros2_control_drives_gives_way_to_no_other(tmp_path):
    """Although a model that nobody launches has a lidar and a plugin that drives."""
    sides = (("left_wheel", 1), ("right_wheel", -1))
    wheels = "".join(URDF_WHEEL.format(name=name, y=0.25 * side) for name, side in sides)
    (tmp_path / "package.xml").write_text("<package><name>cart</name></package>")
    (tmp_path / "urdf").mkdir()
    urdf(tmp_path / "urdf", link(BOX) + wheels + CONTROLLED)
    wheels = "".join(SDF_WHEEL.format(name=name, y=0.1 * side) for name, side in sides)
    (tmp_path / "urdf" / "waffle.sdf").write_text(
        f'<sdf version="1.6"><model name="waffle"><link name="base_link">{LIDAR}</link>'
        f"{wheels}{DRIVE}</model></sdf>"
    )
    (tmp_path / "a.launch.py").write_text("'urdf', 'cart.urdf'")
    assert picked(tmp_path, "robot") == "cart.urdf"


PASSES = "'navigation_launch.py', launch_arguments={'params_file': '%s'}"


@pytest.mark.parametrize(
    ("launched", "taken"),
    [
        # Alone, the default of a copy of Nav2's launch file counts.
        ({}, "nav2_params.yaml"),
        ({"sim": PASSES % "mine_nav2.yaml"}, "mine_nav2.yaml"),
        # One launch file still uses the default.
        ({"sim": PASSES % "mine_nav2.yaml", "slam": "'navigation_launch.py'"}, "nav2_params.yaml"),
        # The default of a launch file between them is not used either.
        (
            {
                "bringup": PASSES % "nav2_params.yaml",
                "sim": "'bringup.launch.py', 'params_file', 'mine_nav2.yaml'",
            },
            "mine_nav2.yaml",
        ),
        ({"sim": PASSES % "nav2_params.yaml"}, "nav2_params.yaml"),
        # A Nav2 file of another repository takes the default's place, too.
        ({"sim": PASSES % "mine_nav2.yaml", "demo": PASSES % "tb3_nav2.yaml"}, "mine_nav2.yaml"),
    ],
)
def test_a_default_parameter_file_that_other_launch_files_override_is_not_launched(
    repository, launched, taken
):
    write_launch_files(repository, launched)
    assert picked(repository, "nav2") == taken


def test_a_launch_file_that_names_a_map_is_started_alone_too_and_keeps_its_default(repository):
    write_launch_files(repository, {"sim": PASSES % "mine_nav2.yaml"}, "'yard.yaml'")
    assert picked(repository, "nav2") == "nav2_params.yaml"


def test_of_nav2_files_with_one_name_that_of_another_package_is_the_launched_one(repository):
    other = repository / "real" / "config" / "nav2_params.yaml"
    other.parent.mkdir(parents=True)
    other.write_text(NAV2)
    (repository / "real" / "real.launch.py").write_text("'real', 'config', 'nav2_params.yaml'")
    (repository / "nav" / "config" / "mine_nav2.yaml").write_text(NAV2)
    (repository / "nav" / "sim.launch.py").write_text("'nav', 'config', 'mine_nav2.yaml'")
    found = find_package_files([repository]).files["nav2"]
    assert [file.parts[-3:][::2] for file in found] == [
        ("real", "nav2_params.yaml"),
        ("nav", "mine_nav2.yaml"),
        ("nav", "nav2_params.yaml"),
    ]


def write_launch_files(repository, launched, more=""):
    """Writes launch files by name, and navigation_launch.py with a default and `more`."""
    config, launch = repository / "nav" / "config", repository / "nav" / "launch"
    (config / "mine_nav2.yaml").write_text(NAV2)
    launch.mkdir()
    default = "DeclareLaunchArgument('params_file', default_value='config/nav2_params.yaml')"
    (launch / "navigation_launch.py").write_text(default + more)
    # Nobody starts this copy, and it would start no controller.
    (launch / "localization_launch.py").write_text(default)
    for name, text in launched.items():
        (launch / f"{name}.launch.py").write_text(text)
