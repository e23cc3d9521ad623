"""What Nav2 starts with is taken, and what it does not read is told, release by release."""

from pathlib import Path

import pytest
from nav2_setups import read_nav2_files

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.speed_check import lines_of
from drake_navbench.nav2.nav2_setup import Nav2Setup

HYBRID = """
planner_server:
  ros__parameters:
    planner_plugins: [GridBased]
    GridBased:
      plugin: nav2_smac_planner::SmacPlannerHybrid
      minimum_turning_radius: {radius}
      downsampling_factor: 2
global_costmap:
  global_costmap: {{ros__parameters: {{resolution: 0.05}}}}
"""
MONITOR = """
collision_monitor:
  ros__parameters:
    polygons: [Zero, One]
    Zero: {type: circle, radius: 0.0, action_type: none}
    One: {type: circle, radius: 0.5, action_type: stop}
"""
CONTROLLER = """
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
"""


@pytest.fixture
def setup_in(tmp_path: Path):
    """A function from a text and a release to what is made of it."""

    def read(text: str, release: str) -> Nav2Setup:
        path = tmp_path / "nav2.yaml"
        path.write_text(text)
        return read_nav2_files([path], load_robot("wheelchair"), "wheelchair", release=release)

    return read


def row_of(setup: Nav2Setup, name: str):
    (row,) = [row for row in setup.check.rows if row.place.endswith(name)]
    return row


@pytest.mark.parametrize(
    ("release", "given", "radius_m", "status"),
    [
        # Two cells of 0.05 m: the factor counts even where nothing is downsampled.
        ("jazzy", "0.0", 0.1, Status.OTHER_FORM),
        ("lyrical", "0.02", 0.1, Status.OTHER_FORM),
        ("humble", "0.02", 0.02, Status.USED),
        ("humble", "0.0", 0.1, Status.STAND_IN),
        ("jazzy", "0.4", 0.4, Status.USED),
    ],
)
def test_a_turning_radius_of_nothing_is_a_cell(setup_in, release, given, radius_m, status):
    setup = setup_in(HYBRID.format(radius=given), release)
    assert setup.robot.navigation.planner.minimum_turning_radius == pytest.approx(radius_m)
    assert row_of(setup, "minimum_turning_radius").status is status


def test_a_negative_turning_radius_is_still_refused(setup_in):
    with pytest.raises(InputError, match=r"minimum_turning_radius: expected 0 or more, got -1"):
        setup_in(HYBRID.format(radius=-1.0), "jazzy")


def test_a_circle_of_radius_0_is_left_out_as_nothing_is_ever_in_it(setup_in):
    setup = setup_in(MONITOR, "jazzy")
    assert list(setup.robot.navigation.collision_monitor.polygons) == ["One"]
    assert row_of(setup, "Zero").status is Status.DOUBTFUL


def test_of_mppis_limits_in_the_wrong_order_the_upper_one_holds(setup_in):
    block = "      {plugin: 'nav2_mppi_controller::MPPIController', vx_max: 0.2, vx_min: 0.3}\n"
    setup = setup_in(CONTROLLER + block, "jazzy")
    row = row_of(setup, "vx_min")
    assert row.status is Status.DOUBTFUL
    assert row.remark == "0.3, more than vx_max, 0.2: the samples all have vx_max"
    assert setup.robot.drive.max_linear_velocity_mps == 0.2


def test_the_recoveries_server_is_not_read_since_humble(setup_in):
    text = "recoveries_server: {ros__parameters: {max_rotational_vel: 0.7}}\n"
    setup = setup_in(text, "humble")
    assert row_of(setup, "recoveries_server").status is Status.UNREAD
    own = load_robot("wheelchair").navigation.behavior_server
    assert setup.robot.navigation.behavior_server.max_rotational_vel == own.max_rotational_vel


def test_a_robot_that_is_not_to_spin_has_rates_of_0(setup_in):
    rates = "{max_rotational_vel: 0.0, min_rotational_vel: 0.0, rotational_acc_lim: 0.0}"
    setup = setup_in(f"behavior_server: {{ros__parameters: {rates}}}\n", "humble")
    assert setup.robot.navigation.behavior_server.max_rotational_vel == 0.0


RPP = "plugin: 'nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController'"
RADIUS = "robot_radius: 0.2, plugins: [a], a: {plugin: 'nav2_costmap_2d::ObstacleLayer', "
SCAN = f"{RADIUS}observation_sources: scan, scan: {{obstacle_min_range: 3.0, data_type: LaserScan}}"


@pytest.mark.parametrize(
    ("text", "place", "remark"),
    [
        (
            f"{CONTROLLER}      {{{RPP}, rotate_to_heading_angular_vel: 57.0}}\n",
            "rotate_to_heading_angular_vel",
            "57 rad/s, 9.1 turns a second: in degrees?",
        ),
        (
            "local_costmap: {local_costmap: {ros__parameters: {robot_radius: 0.5, resolution: 5.0,"
            " rolling_window: true}}}",
            "resolution",
            "a cell of 5 m is wider than the robot, 1 m: in metres?",
        ),
        (
            f"local_costmap: {{local_costmap: {{ros__parameters: {{{SCAN}}}}}}}}}",
            "obstacle_min_range",
            "3 m, not below obstacle_max_range, 2.5 m: nothing is marked",
        ),
    ],
)
def test_a_slip_in_a_unit_is_doubted(setup_in, text, place, remark):
    row = row_of(setup_in(text, "jazzy"), place)
    assert row.status is Status.DOUBTFUL
    assert row.remark == remark


def test_what_nav2_does_not_start_with_names_its_line(setup_in):
    text = (
        f"controller_server: {{ros__parameters: {{FollowPath: {{{RPP}}}, "
        "controller_plugins: [FollowPath], goal_checker_plugins: [precise]}}"
    )
    fault = "goal_checker_plugins: 'precise' is listed, but precise.plugin is missing"
    with pytest.raises(InputError, match=f"line 1: .*{fault}"):
        setup_in(text, "jazzy")


def test_parameters_that_stand_twice_in_their_key_are_told(setup_in):
    text = "controller_server: {ros__parameters: {ros__parameters: {controller_frequency: 5.0}}}"
    row = row_of(setup_in(text, "jazzy"), "ros__parameters")
    assert row.status is Status.UNREAD
    assert row.remark == "ros__parameters stands within itself: ROS gives the node none of these"


@pytest.mark.parametrize("name", ["dwb_core/DWBLocalPlanner", "dwb_core:DWBLocalPlanner"])
def test_a_slip_in_a_controllers_type_is_told_with_the_right_one(setup_in, name):
    blocks = f"A: {{{RPP}}}, B: {{plugin: '{name}'}}"
    text = f"controller_server: {{ros__parameters: {{controller_plugins: [A, B], {blocks}}}}}\n"
    hint = "no such controller here, no column; did you mean 'dwb_core::DWBLocalPlanner'?"
    assert row_of(setup_in(text, "jazzy"), "B.plugin").remark.endswith(hint)


@pytest.mark.parametrize(
    ("release", "value", "status"),
    [
        ("lyrical", "false", Status.USED),
        ("lyrical", "true", Status.STAND_IN),
        ("kilted", "true", Status.UNREAD),
    ],
)
def test_part_of_a_plan_through_poses_is_no_plan_here(setup_in, release, value, status):
    text = f"planner_server: {{ros__parameters: {{allow_partial_planning: {value}}}}}\n"
    assert row_of(setup_in(text, release), "allow_partial_planning").status is status


def test_what_differs_where_another_planner_takes_the_place_of_state_lattice_is_told(setup_in):
    text = (
        "planner_server: {ros__parameters: {planner_plugins: [GridBased], GridBased: {plugin: "
        "nav2_smac_planner::SmacPlannerLattice}}}\n"
    )
    row = row_of(setup_in(text, "jazzy"), "GridBased")
    assert row.status is Status.STAND_IN
    assert "never reverse, State Lattice's are joined from the motions" in row.text
    other = row_of(
        setup_in(text.replace("nav2_smac_planner::SmacPlannerLattice", "a/B"), "jazzy"), "GridBased"
    )
    assert other.text.endswith("SmacPlanner2D with its defaults is used instead")


@pytest.mark.parametrize(
    ("value", "status"),
    [("costmap_converter::CostmapToLinesDBSMCCH", Status.STAND_IN), ("''", Status.NO_MEANING)],
)
def test_shapes_of_a_costmap_converter_are_not_there(setup_in, value, status):
    block = "      plugin: teb_local_planner::TebLocalPlannerROS\n"
    setup = setup_in(f"{CONTROLLER}{block}      costmap_converter_plugin: {value}\n", "humble")
    assert row_of(setup, "costmap_converter_plugin").status is status


@pytest.mark.parametrize("name", ["max_linear_vel", "min_linear_vel", "use_dynamic_window"])
def test_a_name_of_lyricals_pure_pursuit_is_not_read_by_jazzy(setup_in, name):
    kind = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
    value = "true" if name.startswith("use") else "0.3"
    setup = setup_in(f"{CONTROLLER}      {{plugin: '{kind}', {name}: {value}}}\n", "jazzy")
    row = row_of(setup, name)
    assert (row.status, row.remark) == (Status.UNREAD, "jazzy does not read it")


def test_a_least_speed_that_the_smoother_does_not_let_through_is_told(setup_in):
    block = (
        "      {plugin: 'dwb_core::DWBLocalPlanner', critics: [PathDist], "
        "min_vel_x: 0.4, max_vel_x: 0.5}\n"
    )
    smoother = "velocity_smoother: {ros__parameters: {max_velocity: [0.26, 0.0, 1.0]}}\n"
    row = row_of(setup_in(CONTROLLER + block + smoother, "jazzy"), "min_vel_x")
    assert row.status is Status.DOUBTFUL
    assert row.remark == "0.4 m/s, but the velocity smoother lets through 0.26 m/s"


def test_a_preset_that_asks_for_more_than_the_base_drives_is_told():
    burger = load_robot("turtlebot3_burger")
    slow = load_preset("rpp:max_linear_vel=0.22")
    (told,) = lines_of([(load_preset("rpp"), burger), (slow, burger)])
    assert told.startswith("controller rpp: asks 0.5 m/s ahead of a base that drives 0.22")


@pytest.mark.parametrize(
    ("plugin", "hint"),
    [
        (
            "neo_local_planner::NeoLocalPlanner",
            "has no counterpart here; name another controller in a further --nav2 file, or "
            "install one with nav2_plugin = 'neo_local_planner::NeoLocalPlanner' "
            "(docs/controllers.md)",
        ),
        ("dwb_core::DWBLocalPlaner", "did you mean 'dwb_core::DWBLocalPlanner'?"),
        # Nav2 spells planners with a slash up to Iron, but never a controller.
        ("dwb_core/DWBLocalPlanner", "did you mean 'dwb_core::DWBLocalPlanner'?"),
    ],
)
def test_an_unknown_controller_is_told_with_a_near_name_or_what_to_do(setup_in, plugin, hint):
    with pytest.raises(InputError) as refused:
        setup_in(f"{CONTROLLER}      {{plugin: '{plugin}'}}\n", "humble")
    assert str(refused.value).endswith(hint)


def test_a_hint_at_a_critic_ends_the_line(setup_in):
    block = "      {plugin: 'dwb_core::DWBLocalPlanner', critics: [BaseObstacl]}\n"
    with pytest.raises(InputError) as refused:
        setup_in(CONTROLLER + block, "humble")
    assert str(refused.value).endswith("is not registered; did you mean 'BaseObstacle'?")
