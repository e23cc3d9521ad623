"""`run --check` and `doctor` with `--package PATH`: the Nav2 file beside the model."""

from __future__ import annotations

import pytest
from package_scenes import DWB, NAV2, SMOOTHER, filled

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.doctor import main as doctor
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError


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
