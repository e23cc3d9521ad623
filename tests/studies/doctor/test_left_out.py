"""What cannot be read of a file is left out and told; the rest is read."""

from __future__ import annotations

import pytest
from doctor_texts import DWB, DWB_BLOCK, MPPI, MPPI_BLOCK, RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import findings_of

# 0.1 m of inflation around an outline that reaches 0.2 m to the side.
LOW = {"local_costmap": {"inflation_layer": {
    "plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": 0.1}}}  # fmt: skip


@pytest.fixture
def patient(tmp_path):
    def of(text, plugin=""):
        path = tmp_path / "nav2.yaml"
        path.write_text(text)
        return Patient((path,), "wheelchair", {}, plugin=plugin)

    return of


def names(facts):
    return {finding.rule.name for finding in findings_of(facts)}


@pytest.mark.parametrize(
    ("block", "plugin", "own"),
    [(DWB_BLOCK, DWB, "VelocityObstacle"), (MPPI_BLOCK, MPPI, "mine::PersonCritic")],
)
def test_a_critic_of_the_robots_own_is_left_out_and_told(block, plugin, own, patient):
    with_own = block | {"critics": [*block["critics"], own]}
    found = patient(nav2_text(with_own, plugin=plugin)).facts()
    (line,) = found.left_out
    assert f"critic '{own}' is not registered" in line
    assert "FollowPath.critics" not in found.unread
    known = patient(nav2_text(block, plugin=plugin)).facts()
    assert found["controller.critics"] == known["controller.critics"]


def test_critics_that_are_not_known_may_look_at_obstacles(patient):
    blind = DWB_BLOCK | {"critics": ["PathDist", "GoalDist"]}
    assert "dwb-no-obstacle-critic" in names(patient(nav2_text(blind, plugin=DWB)).facts())
    own = DWB_BLOCK | {"critics": ["PathDist", "GoalDist", "PersonCritic"]}
    assert "dwb-no-obstacle-critic" not in names(patient(nav2_text(own, plugin=DWB)).facts())


def test_of_a_file_with_an_unknown_controller_the_servers_are_read(patient):
    found = patient(nav2_text(RPP_BLOCK, plugin="mine::Controller", **LOW)).facts()
    assert "'mine::Controller' has no counterpart here" in found.left_out[0]
    assert found.kinds == ()
    assert "inflation-below-inscribed-radius" in names(found)


def test_a_value_that_is_refused_is_left_out_and_the_default_counts(patient):
    found = patient(nav2_text(RPP_BLOCK | {"lookahead_dist": "far"}, plugin=RPP)).facts()
    (line,) = found.left_out
    assert "FollowPath" in line
    assert "lookahead_dist" in line
    assert found["controller.lookahead_dist"] == 0.6


def test_a_controller_without_parameters_is_left_out(patient):
    lists = {"controller_server": {"controller_plugins": ["FollowPath", "Docking"]}}
    found = patient(nav2_text(RPP_BLOCK, plugin=RPP, **lists)).facts()
    (line,) = found.left_out
    assert "Docking: missing, but listed in controller_plugins" in line
    assert found.plugin == "FollowPath"


def test_a_controller_that_is_asked_for_must_be_readable(patient):
    with pytest.raises(InputError, match="expected one of FollowPath"):
        patient(nav2_text(RPP_BLOCK, plugin=RPP), "Other").facts()


def test_of_a_file_without_controllers_the_rest_is_read(tmp_path, capsys):
    """Nav2 before Foxy had a controller's parameters in the server itself."""
    path = tmp_path / "nav2.yaml"
    text = nav2_text({}, plugin=RPP, **LOW).replace("controller_plugins", "older_plugins")
    path.write_text(text.replace("FollowPath", "max_vel_x"))
    assert main([str(path), "--read-only"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert told.startswith("Read: all but the file's controllers, of which it gives none, Nav2")
    assert "inflation-below-inscribed-radius" in told
    assert main([str(path), "--out", str(tmp_path / "out")]) == 2
    assert "no controller_server with controller_plugins" in capsys.readouterr().err


def test_a_controller_that_lacks_what_it_needs_is_left_out_once(tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text({"sim_time": 1.7}, plugin=DWB))
    assert main([str(path), "--read-only"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert told.count("Left out:") == 1
    assert "FollowPath: critics: missing, but required" in told
    assert "No findings but what was left out" in told


def test_a_drive_needs_the_whole_file(tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(RPP_BLOCK, plugin="mine::Controller", **LOW))
    assert main([str(path), "--read-only"]) == 0
    assert "\nLeft out:" in capsys.readouterr().out
    assert main([str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "'mine::Controller' has no counterpart here; name another controller" in line


# A disc without collision or visual shapes; only its wheels' joints tell how it drives.
BARE_MODEL = """
<robot name="bare">
  <link name="base_link"/>
  <link name="left_wheel"/><link name="right_wheel"/>
  <joint name="left_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="left_wheel"/><origin xyz="0 0.2 0.1"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="right_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="right_wheel"/><origin xyz="0 -0.2 0.1"/>
    <axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def test_the_outline_of_a_model_without_shapes_is_that_of_the_nav2_file(tmp_path, capsys):
    path, model = tmp_path / "nav2.yaml", tmp_path / "bare.urdf"
    model.write_text(BARE_MODEL)
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP, **LOW))
    assert main([str(path), "--robot", str(model), "--read-only"]) == 0
    assert "inflation-below-inscribed-radius" in capsys.readouterr().out


def test_a_xacro_argument_of_the_model_is_given_by_set(tmp_path, capsys):
    path, model = tmp_path / "nav2.yaml", tmp_path / "bare.urdf.xacro"
    wanted = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="$(arg kind)">'
    model.write_text(
        BARE_MODEL[BARE_MODEL.index("<robot") :].replace('<robot name="bare">', wanted)
    )
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP, **LOW))
    command = [str(path), "--robot", str(model), "--read-only"]
    assert main([*command, "--set", "kind=bare"]) == 0
    assert "inflation-below-inscribed-radius" in capsys.readouterr().out
    assert main(command) == 2
    assert "kind" in capsys.readouterr().err


TWO_ROBOTS = """
robot1:
  controller_server:
    ros__parameters:
      controller_plugins: [FollowPath]
      FollowPath:
        plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
        desired_linear_vel: 0.3
robot2:
  controller_server:
    ros__parameters:
      controller_plugins: [FollowPath]
      FollowPath:
        plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
        desired_linear_vel: 0.6
"""


def test_of_a_file_of_two_robots_the_first_is_read_and_the_second_named(patient):
    """Both controllers are called FollowPath."""
    facts = patient(TWO_ROBOTS).facts()
    assert facts.asked_mps == 0.3
    assert facts.others == ("robot2/FollowPath",)
    facts = patient(TWO_ROBOTS, "robot2/FollowPath").facts()
    assert facts.asked_mps == 0.6
    assert facts.others == ("FollowPath",)
