"""`run --package PATH` finds the robot, its Nav2 files, its maps and worlds, and says which."""

from __future__ import annotations

import numpy as np
import pytest
from descriptions_scenes import ROOM, world, write_repository

from drake_navbench.campaign.package_arguments import with_package
from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.doctor import main as doctor
from drake_navbench.commands.run import build_parser, main
from drake_navbench.errors import InputError
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.driven_file import driven_file

NAV2 = """controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      desired_linear_vel: 0.9
local_costmap:
  local_costmap:
    ros__parameters: {robot_base_frame: base_footprint, robot_radius: 0.9}
"""
DWB = """controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: dwb_core::DWBLocalPlanner
      max_vel_x: 0.3
      max_vel_theta: 4.0
      critics: [BaseObstacle, PathDist, GoalDist]
"""
SMOOTHER = """velocity_smoother:
  ros__parameters:
    max_velocity: [0.5, 0.0, 1.0]
    min_velocity: [-0.5, 0.0, -1.0]
    scale_velocities: false
"""


@pytest.fixture
def repository(tmp_path):
    """A repository with a robot, a file of parts, a Nav2 file, two worlds and a keepout mask."""
    root = tmp_path / "cart"
    write_repository(root)
    files = {
        "cart_description/urdf/lidar_macro.xacro": '<robot name="part"><link name="a"/></robot>',
        "cart_nav/config/nav2_params.yaml": NAV2,
        "cart_nav/config/slam.yaml": "slam_toolbox:\n  ros__parameters: {mode: mapping}\n",
        "cart_gazebo/worlds/empty.world": world(""),
        "cart_gazebo/worlds/room.world": world(ROOM),
        "cart_gazebo/worlds/room.wbt": "#VRML_SIM",
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def filled(*words):
    parser = build_parser()
    return with_package(parser.parse_args(list(words)), parser.get_default("robot"))


def test_a_repository_gives_robot_nav2_file_and_world(repository):
    arguments, lines = filled("--package", str(repository))
    assert arguments.robot.endswith("cart.urdf.xacro")
    assert [path.name for path in arguments.nav2] == ["nav2_params.yaml"]
    assert [name.rpartition("/")[2] for name in arguments.scenarios] == ["room.world"]
    assert arguments.goals == 5
    request = request_from_arguments(arguments)
    assert request.map_task.worlds == tuple(arguments.scenarios)
    assert "world: 2 found, another by --pick world=N" in lines
    assert any(line.startswith("  *  1") and "room.world" in line for line in lines)


def test_the_next_world_is_taken_for_one_of_broken_xml(repository):
    worlds = repository / "cart_gazebo" / "worlds"
    (worlds / "a.world").write_text(world(ROOM).replace("</world>", "<<<<<<< HEAD</world>"))
    arguments, lines = filled("--package", str(repository))
    assert arguments.scenarios[0].endswith("room.world")
    assert "  *  2 cart_gazebo/worlds/room.world" in lines
    (left_out,) = [line for line in lines if line.startswith("left out, the next world is taken:")]
    assert f"{worlds}/a.world: " in left_out
    arguments, lines = filled("--package", str(repository), "--pick", "world=1")
    assert arguments.scenarios[0].endswith("a.world")


def test_of_worlds_that_cannot_be_read_the_first_tells_why(repository, capsys):
    for name in ("empty", "room"):
        (repository / "cart_gazebo" / "worlds" / f"{name}.world").write_text("<sdf><world")
    assert main(["--package", str(repository), "--trials", "1"]) == 2
    told = capsys.readouterr()
    assert "room.world: " in told.err
    assert "left out" not in told.out


def test_a_urdf_without_links_is_no_robot(tmp_path):
    """Webots takes the robot from its world, and only its plugins from such a file."""
    (tmp_path / "cart.urdf").write_text(
        '<robot name="cart"><webots><plugin type="cart_driver.Driver"/></webots></robot>'
    )
    assert find_package_files([tmp_path]).files["robot"] == ()


def test_a_number_picks_another_and_none_nothing(repository):
    arguments, _ = filled("--package", str(repository), "--pick", "world=2", "--pick", "nav2=none")
    assert arguments.scenarios[0].endswith("empty.world")
    assert not arguments.nav2
    with pytest.raises(
        InputError, match="--pick world=9: expected a number of the list, 1 to 2, or none"
    ):
        filled("--package", str(repository), "--pick", "world=9")
    with pytest.raises(InputError, match=r"--pick 'robt=1': expected one of robot=N, nav2=N"):
        filled("--package", str(repository), "--pick", "robt=1")
    with pytest.raises(InputError, match=r"--pick 'world=1': world is given twice"):
        filled("--package", str(repository), "--pick", "world=2", "--pick", "world=1")


def test_goals_are_listed_and_taken_only_if_they_are_picked(repository, capsys):
    folder = repository / "cart_nav" / "config"
    for name in ("waypoints.yaml", "goals.csv", "gps_waypoints.yaml"):
        (folder / name).write_text("lat: 1\nlon: 2" if "gps" in name else "0 0 0\n1 0 0")
    (folder / "waypoints.yaml").write_text("waypoints: [[0, 0, 0], [2, 0, 0]]")
    arguments, lines = filled("--package", str(repository))
    assert arguments.goals == 5
    assert lines[-3:] == [
        "goals: 2 found, used by --pick goals=N",
        "     1 cart_nav/config/goals.csv",
        "     2 cart_nav/config/waypoints.yaml",
    ]
    arguments, lines = filled("--package", str(repository), "--pick", "goals=2")
    assert arguments.goals == folder / "waypoints.yaml"
    assert "  *  2 cart_nav/config/waypoints.yaml" in lines
    arguments, _ = filled("--package", str(repository), "--pick", "goals=2", "--goals", "3")
    assert arguments.goals == 3
    asked = ["--package", str(repository), "--pick", "goals=1"]
    assert doctor([*asked, "--out", str(repository / "out")]) == 2
    assert "no map; expected one for --goals" in capsys.readouterr().err
    assert doctor([*asked, "--read-only"]) == 2
    assert capsys.readouterr().err.startswith("--pick goals: is of no use with --read-only")


def test_what_the_command_line_names_itself_counts_more(repository):
    arguments, _ = filled(
        "--package", str(repository), "--robot", "jackal", "--controllers", "rpp", "doorway"
    )
    assert (arguments.robot, arguments.scenarios, arguments.nav2) == ("jackal", ["doorway"], [])


def test_a_map_counts_more_than_a_world_and_a_mask_is_none(repository):
    folder = repository / "cart_nav" / "maps"
    folder.mkdir()
    (folder / "room.pgm").write_bytes(b"P5 2 2 255\n" + bytes(4))
    said = "image: room.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
    (folder / "keepout_mask.yaml").write_text(said)
    (folder / "room.yaml").write_text(said)
    arguments, _ = filled("--package", str(repository))
    assert arguments.map.name == "room.yaml"
    assert not arguments.scenarios
    assert filled("--package", str(repository), "--pick", "world=1")[0].map is None


def test_without_map_and_world_a_built_in_scenario_is_driven_and_told(tmp_path):
    write_repository(tmp_path / "cart")
    arguments, lines = filled("--package", str(tmp_path / "cart"))
    assert arguments.scenarios == ["static_obstacles"]
    assert lines[-1].startswith("neither map nor world")
    arguments, lines = filled("--package", str(tmp_path / "cart"), "--goals", "2")
    assert arguments.goals is None
    assert lines[-1] == "--goals is not used: static_obstacles has its own start and goal"


def test_a_robot_that_stands_in_a_world_alone_is_found_and_drives_there(tmp_path):
    """Walls first, then a cart of 0.5 x 0.3 m with a plugin that drives it."""
    path = tmp_path / "hall.world"
    size = "<box><size>0.5 0.3 0.2</size></box>"
    cart = (
        '<model name="cart"><pose>1 1 0.1 0 0 0</pose><link name="chassis">'
        f'<collision name="c"><geometry>{size}</geometry></collision></link>'
        '<plugin filename="libgazebo_ros_diff_drive.so" name="d">'
        "<wheel_diameter>0.2</wheel_diameter></plugin></model>"
    )
    path.write_text(world(ROOM + cart))
    arguments, lines = filled("--package", str(tmp_path))
    assert (arguments.robot, arguments.scenarios) == (str(path), [str(path)])
    assert lines[0] == "robot: 1 found"
    robot = load_robot(arguments.robot)
    assert np.ptp(robot.outline, axis=0).tolist() == [0.5, 0.3]
    path.write_text(world(ROOM))
    with pytest.raises(
        InputError, match=r"no robot that drives in \.xacro, \.urdf, \.sdf, \.world or"
    ):
        filled("--package", str(tmp_path))


@pytest.mark.parametrize("is_launched", [False, True])
@pytest.mark.parametrize("name", ["robot.urdf.xacro", "hauler_base.urdf.xacro"])
def test_of_two_robots_each_has_its_own_nav2_file(repository, name, is_launched):
    """The words of their folders tell, not `robot`, which each robot is; a launch file as well."""
    cart = next(repository.rglob("cart.urdf.xacro"))
    hauler = repository / "hauler_description" / "urdf" / name
    hauler.parent.mkdir(parents=True)
    hauler.write_text(cart.read_text())
    of_hauler = repository / "hauler_nav" / "params.yaml"
    of_cart = repository / "cart_nav" / "config" / "my_robot.yaml"
    for file in (of_hauler, of_cart):
        file.parent.mkdir(exist_ok=True)
        file.write_text(NAV2)
    if is_launched:
        (repository / "start.launch.py").write_text(f"start('{name}', 'my_robot.yaml')")
    files = find_package_files([repository])
    assert files.fitting("nav2", hauler) == (of_cart if is_launched else of_hauler)
    assert files.fitting("nav2", cart) == of_cart.parent / "nav2_params.yaml"


def test_a_folder_given_twice_is_listed_once(tmp_path):
    write_repository(tmp_path)
    assert len(find_package_files([tmp_path, tmp_path]).files["robot"]) == 1


def test_a_folder_without_a_robot_is_one_line(tmp_path, capsys):
    assert main(["--package", str(tmp_path)]) == 2
    assert (
        "no robot that drives in .xacro, .urdf, .sdf, .world or .model" in capsys.readouterr().err
    )
    assert main(["--pick", "robot=1"]) == 2
    assert "expected --package as well" in capsys.readouterr().err


def test_the_doctor_reads_the_nav2_file_of_a_repository_for_its_robot(repository, capsys):
    """The Nav2 file's radius of 0.1 m lies within the body of the repository's model."""
    file = repository / "cart_nav" / "config" / "nav2_params.yaml"
    file.write_text(NAV2.replace("robot_radius: 0.9", "robot_radius: 0.1"))
    assert doctor(["--package", str(repository), "--read-only"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "* 1 cart_nav/config/nav2_params.yaml" in told
    assert "world:" not in told
    assert "Read: FollowPath (rpp)" in told
    assert "but the body of the robot's own model goes from x =" in told
    other = repository / "other.yaml"
    other.write_text(DWB)
    assert doctor([str(other), "--package", str(repository), "--read-only"]) == 0
    assert "Read: FollowPath (dwb)" in capsys.readouterr().out


def test_a_robot_that_the_user_names_is_enough_even_if_it_is_the_usual_one(repository, capsys):
    words = ["--package", str(repository), "--pick", "robot=none", "--read-only"]
    assert doctor([*words, "--robot", "wheelchair"]) == 0
    assert "Read: FollowPath (rpp)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--goals", "3", "--out", "x"], "no map; expected one for --goals, or --map"),
        (["--pick", "nav2=none", "--read-only"], "no Nav2 file; expected one, or FILE"),
        (["--pick", "world=1", "--read-only"], "--pick world: is of no use here"),
        (["--pick", "robot=none", "--read-only"], "expected one, or --robot"),
    ],
)
def test_what_the_doctor_lacks_in_a_repository_is_one_line(repository, capsys, options, line):
    assert doctor(["--package", str(repository), *options]) == 2
    told = capsys.readouterr().err
    assert line in told
    assert told.count("\n") == 1


def test_what_nav2_file_and_model_contradict_is_told(repository, capsys):
    """The file asks for 0.9 m/s of a base of 0.4 m/s, and its radius is 0.6 m beyond the body."""
    assert main(["--package", str(repository), "--check"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "linear speed: asks for up to 0.9 m/s, the model allows 0.4 m/s" in told
    assert "the costmap's padded outline reaches 0.6" in told
    assert "base frame (base_footprint)" in told


def test_the_doctor_tells_the_same_contradictions_of_nav2_file_and_model(repository, capsys):
    assert doctor(["--package", str(repository), "--read-only"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "Nav2 file and model cart.urdf.xacro contradict each other (2)" in told
    assert "- FollowPath: linear speed: asks for up to 0.9 m/s, the model allows 0.4 m/s" in told
    assert "the costmap's padded outline reaches 0.6" in told
    nav2 = repository / "cart_nav" / "config" / "nav2_params.yaml"
    assert doctor([str(nav2), "--read-only"]) == 0
    assert "contradict" not in capsys.readouterr().out


def test_a_velocity_smoother_that_cuts_the_controller_s_turns_is_told(repository, capsys):
    """The controller turns with up to 4 rad/s and checks tight arcs; 1 rad/s comes through."""
    file = repository / "cart_nav" / "config" / "nav2_params.yaml"
    file.write_text(DWB + SMOOTHER)
    assert main(["--package", str(repository), "--check"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "turns with up to 4 rad/s, the velocity smoother lets 1 rad/s pass" in told
    file.write_text(DWB + SMOOTHER.replace("false", "true"))
    assert main(["--package", str(repository), "--check"]) == 0
    assert "velocity smoother lets" not in " ".join(capsys.readouterr().out.split())


def test_a_model_without_shapes_has_the_outline_of_the_nav2_file(tmp_path, capsys):
    """A file of frames alone, as for TF; so is one whose meshes are not there."""
    (tmp_path / "nav2.yaml").write_text(NAV2)
    path = tmp_path / "cart.urdf"
    path.write_text('<robot name="a"><link name="base_footprint"/></robot>')
    robot = ["--robot", str(path)]
    assert main([*robot, "--check"]) == 2
    assert "or by a Nav2 file's footprint or robot_radius" in capsys.readouterr().err
    assert main([*robot, "--nav2", str(tmp_path / "nav2.yaml"), "--check"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "found none; that of the Nav2 file is taken" in told
    assert "costmap's padded outline" not in told


def test_a_file_that_another_has_replaced_comes_after_it(tmp_path):
    for name in ("a_backup.yaml", "a.old.yaml", "a_copy.yaml", "bold.yaml", "scopy.yaml", "z.yaml"):
        (tmp_path / name).write_text(NAV2)
    found = [path.name for path in find_package_files([tmp_path]).files["nav2"]]
    assert found[:3] == ["bold.yaml", "scopy.yaml", "z.yaml"]


def map_files(folder, *names):
    folder.mkdir(parents=True)
    for name in names:
        (folder / f"{name}.pgm").write_bytes(b"P5 2 2 255\n" + bytes(4))
        said = f"image: {name}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
        (folder / f"{name}.yaml").write_text(said)


def test_a_launch_file_tells_which_nav2_file_and_map_belong_together(repository):
    """By their names alone, real.yaml and attic.yaml would come first."""
    config = repository / "cart_nav" / "config"
    (config / "nav2_params.yaml").rename(config / "sim_nav2.yaml")
    (config / "real_nav2.yaml").write_text(NAV2)
    map_files(repository / "cart_nav" / "maps", "attic", "hall")
    map_files(repository / "cart_old" / "maps", "hall")
    launch = repository / "cart_nav" / "launch"
    launch.mkdir()
    (launch / "sim.launch.py").write_text(
        "# default: attic.yaml\n"
        "share = get_package_share_directory('cart_nav')\n"
        "nav2 = os.path.join(share, 'config', 'sim_nav2.yaml')\n"
        "map = share + '/maps/hall.yaml'\n"
    )
    arguments, lines = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["sim_nav2.yaml"]
    assert arguments.map == repository / "cart_nav" / "maps" / "hall.yaml"
    assert any("cart_nav/maps/hall.yaml (as in sim.launch.py)" in line for line in lines)
    picked, _ = filled("--package", str(repository), "--pick", "map=2")
    assert picked.map != arguments.map


def test_a_launch_file_that_adds_a_mask_makes_it_no_map(repository):
    map_files(repository / "cart_nav" / "maps", "hall", "keepout_mask")
    (repository / "keepout.launch.py").write_text("'nav2_params.yaml', 'keepout_mask.yaml'")
    assert filled("--package", str(repository))[0].map.name == "hall.yaml"


def test_the_rest_of_a_file_whose_controllers_do_not_exist_here_is_checked_and_drives(
    repository, capsys
):
    file = repository / "cart_nav" / "config" / "nav2_params.yaml"
    text = file.read_text()
    type_name = text.partition("plugin: ")[2].partition("\n")[0]
    file.write_text(text.replace(type_name, "mine::Controller"))
    asked = ["--package", str(repository)]
    assert main([*asked, "--check"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "FollowPath.plugin" in told
    assert "mine::Controller: no such controller here, no column" in told
    assert "Columns: none, as the file has no controller that exists here" in told
    with pytest.raises(InputError, match="'mine::Controller' has no counterpart here"):
        request_from_arguments(filled(*asked)[0]).campaign()
    chosen, _ = filled(*asked, "--controllers", "rpp", "--pick", "nav2=1")
    campaign = request_from_arguments(chosen).campaign()
    assert {spec.preset.controller for spec in campaign.specs} == {"rpp"}


def test_of_nav2_files_of_one_name_it_is_the_one_in_the_folder_of_the_launch_file(repository):
    map_files(repository / "cart_bringup" / "maps", "hall")
    for package in ("cart_bringup", "cart_start"):
        (repository / package / "config").mkdir(parents=True, exist_ok=True)
        (repository / package / "config" / "nav2_params.yaml").write_text(NAV2)
    (repository / "start.launch.py").write_text(
        "share('cart_start', 'nav2_params.yaml'), 'hall.yaml'"
    )
    arguments, _ = filled("--package", str(repository))
    assert arguments.nav2 == [repository / "cart_start" / "config" / "nav2_params.yaml"]


def test_of_nav2_files_of_one_name_it_is_the_one_without_further_folders(repository):
    """A launch file of another robot names the further folder."""
    map_files(repository / "cart_nav" / "maps", "hall")
    further = repository / "cart_nav" / "config" / "a_client" / "nav2_params.yaml"
    further.parent.mkdir()
    further.write_text(NAV2)
    cart = repository / "cart_description" / "urdf" / "cart.urdf.xacro"
    other = repository / "other" / "urdf" / "other.urdf.xacro"
    other.parent.mkdir(parents=True)
    other.write_text(cart.read_text())
    cart.rename(cart.with_name("a_wagon.urdf.xacro"))
    asked = "'config', '{}nav2_params.yaml', 'hall.yaml', '{}'"
    (repository / "a.launch.py").write_text(asked.format("a_client', '", "other.urdf.xacro"))
    (repository / "wagon.launch.py").write_text(asked.format("", "a_wagon.urdf.xacro"))
    arguments, _ = filled("--package", str(repository))
    assert arguments.robot.endswith("a_wagon.urdf.xacro")
    assert arguments.nav2 == [repository / "cart_nav" / "config" / "nav2_params.yaml"]


def test_of_two_models_it_is_the_one_that_a_launch_file_names(repository):
    cart = repository / "cart_description" / "urdf" / "cart.urdf.xacro"
    newer = cart.with_name("wagon_v2.urdf.xacro")
    newer.write_text(cart.read_text())
    (repository / "a.launch.py").write_text("share, 'urdf', 'wagon_v2.urdf.xacro'")
    assert find_package_files([repository]).files["robot"][0] == newer


def test_of_two_models_it_is_the_one_with_the_base_frame_of_the_nav2_file(repository):
    cart = next(repository.rglob("cart.urdf.xacro"))
    text = cart.read_text()
    assert "base_link" in text
    other = cart.with_name("other.urdf.xacro")
    other.write_text(text.replace("base_link", "body_link"))
    for frame, model in (("base_link", cart), ("<robot>/body_link", other)):
        nav2 = NAV2.replace("base_footprint", frame)
        (repository / "cart_nav" / "config" / "nav2_params.yaml").write_text(nav2)
        arguments, _ = filled("--package", str(repository))
        assert arguments.robot == str(model)


def test_without_launch_files_the_plainest_name_of_a_nav2_file_counts(repository):
    config = repository / "cart_nav" / "config"
    (config / "nav2_explore_params.yaml").write_text(NAV2)
    arguments, _ = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["nav2_params.yaml"]


def test_a_file_that_names_the_controller_server_only_in_a_remark_is_no_nav2_file(repository):
    text = NAV2.partition("local_costmap:")
    (repository / "cart_nav" / "config" / "nav2.yaml").write_text(
        f"# no controller_server here: FollowPath is a node of ours\n{text[1]}{text[2]}"
    )
    found = find_package_files([repository]).files["nav2"]
    assert [file.name for file in found] == ["nav2_params.yaml"]


def test_a_nav2_file_of_whose_controllers_none_exists_here_gives_way_to_the_next(repository):
    folder = repository / "cart_nav" / "config"
    own = NAV2.replace("nav2_regulated_pure_pursuit_controller::Regulated", "cart_nav::Own")
    (folder / "nav2_params.yaml").write_text(own)
    (folder / "nav2_params_rpp.yaml").write_text(NAV2)
    assert driven_file([folder / "nav2_params.yaml"]) == (folder / "nav2_params.yaml", [])
    arguments, lines = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["nav2_params_rpp.yaml"]
    (told,) = (line for line in lines if line.startswith("left out, the next Nav2 file is taken: "))
    assert "'cart_nav::OwnPurePursuitController' has no counterpart here" in told
    picked, _ = filled("--package", str(repository), "--pick", "nav2=1")
    assert [path.name for path in picked.nav2] == ["nav2_params.yaml"]
    # A controller server of 2019 lists none.
    (folder / "nav2_params.yaml").write_text(
        "controller_server:\n  ros__parameters: {max_vel_x: 1}"
    )
    files = [folder / "nav2_params.yaml", folder / "nav2_params_rpp.yaml"]
    taken, (line,) = driven_file(files)
    assert taken == files[1]
    assert line.endswith("nav2_params.yaml: its controller_server lists no controller")


@pytest.mark.parametrize("more", ["", ", nav2=N with another of the list"])
def test_a_refused_nav2_file_of_a_repository_is_told_with_the_way_on(repository, capsys, more):
    (file,) = repository.rglob("nav2_params.yaml")
    file.write_text(NAV2.replace("controller_plugins: [FollowPath]", "controller_plugins: 3"))
    if more:
        (file.parent / "nav2_params_other.yaml").write_text(NAV2)
    asked = ["--package", str(repository), "--check", "--pick", "nav2=1"]
    assert main(asked) == 2
    *_, line = capsys.readouterr().err.splitlines()
    assert "expected a list of names, got 3" in line
    assert line.endswith(f"; --pick nav2=none goes on without it{more}")
    # A file that the user names himself is no choice among those found.
    assert main([*asked[:3], "--nav2", str(file)]) == 2
    assert "--pick" not in capsys.readouterr().err


@pytest.mark.parametrize("more", ["", ", --pick nav2=N another of the list"])
def test_the_doctor_tells_the_way_on_from_a_refused_nav2_file(repository, capsys, more):
    (file,) = repository.rglob("nav2_params.yaml")
    file.write_text(NAV2.replace("controller_plugins: [FollowPath]", "controller_plugins: 3"))
    if more:
        (file.parent / "nav2_params_other.yaml").write_text(NAV2)
    asked = ["--package", str(repository), "--pick", "nav2=1"]
    assert doctor([*asked, "--out", "visit"]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    assert line.startswith(str(file))
    assert line.endswith(f"; --read-only reads what it can of it{more}")
    # And so it does.
    assert doctor([*asked, "--read-only"]) == 0


def test_a_value_of_an_undeclared_argument_of_xacro_counts_as_used(repository):
    """xacro's message on such an argument says to give it by --set."""
    model = repository / "cart_description" / "urdf" / "cart.urdf.xacro"
    model.write_text(model.read_text().replace('name="laser"', 'name="$(arg robot_name)/laser"'))
    asked = ["--package", str(repository), "--check"]
    with pytest.raises(InputError, match="give it by --set robot_name=VALUE"):
        request_from_arguments(filled(*asked)[0]).nav2_columns()
    arguments, _ = filled(*asked, "--set", "robot_name=cart")
    assert request_from_arguments(arguments).nav2_columns()


def test_the_nav2_file_of_a_model_in_gazebo_s_form_is_found_by_its_folder(repository):
    model = repository / "models" / "cart_mini" / "model.sdf"
    model.parent.mkdir(parents=True)
    model.write_text("")
    config = repository / "cart_nav" / "config"
    (config / "cart_mini_nav2.yaml").write_text(NAV2)
    fitting = find_package_files([repository]).fitting("nav2", model)
    assert fitting == config / "cart_mini_nav2.yaml"


def test_a_map_without_its_picture_is_told(repository):
    map_files(repository / "cart_nav" / "maps", "hall")
    (repository / "cart_nav" / "maps" / "hall.pgm").unlink()
    _, lines = filled("--package", str(repository))
    said = "the picture that cart_nav/maps/hall.yaml names is not there, perhaps by upper and lower"
    assert f"map: none found; {said} case, or a pointer of Git LFS" in lines
