"""`run --package PATH` finds the robot, its Nav2 files, its maps and worlds, and says which."""

from __future__ import annotations

import numpy as np
import pytest
from descriptions_scenes import ROOM, world, write_repository
from package_scenes import filled, map_files

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.doctor import main as doctor
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.inputs.robot import load_robot


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


def test_a_map_without_its_picture_is_told(repository):
    map_files(repository / "cart_nav" / "maps", "hall")
    (repository / "cart_nav" / "maps" / "hall.pgm").unlink()
    _, lines = filled("--package", str(repository))
    said = "the picture that cart_nav/maps/hall.yaml names is not there, perhaps by upper and lower"
    assert f"map: none found; {said} case, or a pointer of Git LFS" in lines
