"""Values that Nav2 takes at its start, although hardly anybody means them, are taken, and told."""

import pytest
from nav2_setups import read_nav2_files
from nav2_texts import row_of

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.robot import load_robot

CONTROLLER = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
ODD = f"""
controller_server:
  ros__parameters:
    min_x_velocity_threshold: -0.1
    failure_tolerance: -2.0
    costmap_update_timeout: -0.3
    goal_checker_plugins: [goal]
    goal: {{plugin: "nav2_controller::SimpleGoalChecker", yaw_goal_tolerance: -0.1}}
    progress_checker_plugins: [progress]
    progress: {{plugin: "nav2_controller::SimpleProgressChecker", movement_time_allowance: -1.0}}
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_rotation_shim_controller::RotationShimController
      primary_controller: {CONTROLLER}
      lookahead_dist: 0.0
      desired_linear_vel: 0.4
local_costmap:
  local_costmap:
    ros__parameters:
      footprint: "[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]"
      footprint_padding: -0.05
      lethal_cost_threshold: 120
      unknown_cost_value: -1
      plugins: [obstacles, quiet, inflation]
      obstacles:
        plugin: nav2_costmap_2d::ObstacleLayer
        observation_sources: scan
        scan: {{max_obstacle_height: 2.0, raytrace_max_range: 0.0}}
      quiet:
        plugin: nav2_costmap_2d::DenoiseLayer
        minimal_group_size: -3
        group_connectivity_type: 6
      inflation: {{plugin: "nav2_costmap_2d::InflationLayer", cost_scaling_factor: 0.0}}
      filters: [keepout]
      keepout: {{plugin: "nav2_costmap_2d::KeepoutFilter", lethal_override_cost: -1}}
behavior_server:
  ros__parameters:
    backup: {{acceleration_limit: -1.5, deceleration_limit: 2.0}}
waypoint_follower:
  ros__parameters:
    waypoint_task_executor_plugin: wait
    wait: {{plugin: "nav2_waypoint_follower::WaitAtWaypoint", waypoint_pause_duration: -5}}
"""


def setup_of(tmp_path, text, release):
    path = tmp_path / "nav2.yaml"
    path.write_text(text)
    return read_nav2_files([path], load_robot("wheelchair"), "wheelchair", release=release)


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """What is made of a file of such values, by the rules of Kilted."""
    return setup_of(tmp_path_factory.mktemp("odd"), ODD, "kilted")


@pytest.mark.parametrize(
    ("parameter", "remark"),
    [
        ("min_x_velocity_threshold", "-0.1: no velocity counts as 0"),
        ("failure_tolerance", "-2: as 0, a failed cycle ends the task"),
        ("costmap_update_timeout", "-0.3: as 0"),
        ("goal.yaw_goal_tolerance", "-0.1: the robot never arrives"),
        (
            "progress.movement_time_allowance",
            "-1: the task fails at the first cycle without progress",
        ),
        (
            "FollowPath.lookahead_dist",
            "0: the carrot is the pose of the plan nearest to the robot",
        ),
        (
            "footprint_padding",
            "-0.05: the costmaps take the robot for smaller than its footprint",
        ),
        ("obstacles.scan.raytrace_max_range", "0: clears nothing"),
        ("quiet.minimal_group_size", "-3: as 0"),
        ("inflation.cost_scaling_factor", "0: all cells within the radius cost 252"),
        ("wait.waypoint_pause_duration", "-5: as 0"),
    ],
)
def test_an_unusual_value_is_used_and_doubted(odd, parameter, remark):
    row = row_of(odd, parameter)
    assert (row.status, row.remark) == (Status.DOUBTFUL, remark)


@pytest.mark.parametrize(
    ("parameter", "remark"),
    [
        ("lethal_cost_threshold", "100, as in Nav2, in place of 120"),
        ("unknown_cost_value", "255, as in Nav2, in place of -1"),
        ("quiet.group_connectivity_type", "8, as in Nav2, in place of 6"),
        ("keepout.lethal_override_cost", "252, as in Nav2, in place of -1"),
        ("backup.acceleration_limit", "1.5, as in Nav2, in place of -1.5"),
        ("backup.deceleration_limit", "-2, as in Nav2, in place of 2"),
    ],
)
def test_a_value_that_nav2_changes_is_changed_likewise(odd, parameter, remark):
    row = row_of(odd, parameter)
    assert (row.status, row.remark) == (Status.OTHER_FORM, remark)


def test_the_robot_has_the_values_that_nav2_uses(odd):
    navigation = odd.robot.navigation
    assert navigation.behavior_server.backup.acceleration_limit == 1.5
    assert navigation.behavior_server.backup.deceleration_limit == -2.0
    assert navigation.waypoint_follower.pause_s == 0.0
    # 0.3 m and 0.2 m less 0.05 m.
    assert abs(odd.robot.padded_outline).max(axis=0).tolist() == pytest.approx([0.25, 0.15])
    costmap = navigation.local_costmap
    assert (costmap.lethal_cost_threshold, costmap.unknown_cost_value) == (100, 255)


SIX = """velocity_smoother:
  ros__parameters:
    max_velocity: [0.4, 0.1, 0.0, 0.0, 0.0, 1.5]
    min_velocity: [-0.2, -0.1, 0.0, 0.0, 0.0, -1.5]
    max_accel: [1.0, 2.0, 0.0, 0.0, 0.0, 3.0]
    max_decel: [-1.0, -2.0, 0.0, 0.0, 0.0, -3.0]
    deadband_velocity: [0.0, 0.0, 0.0, 0.0, 0.0, 0.1]
"""


def test_of_a_smoother_of_six_axes_those_in_the_plane_count(tmp_path):
    setup = setup_of(tmp_path, SIX, "lyrical")
    smoother = setup.robot.navigation.velocity_smoother
    assert smoother.max_velocity == (0.4, 0.1, 1.5)
    assert smoother.deadband_velocity == (0.0, 0.0, 0.1)
    assert row_of(setup, "max_velocity").status is Status.OTHER_FORM
    with pytest.raises(InputError, match=r"line 3: .*max_velocity"):
        setup_of(tmp_path, SIX, "kilted")


def test_only_humbles_smoother_starts_without_a_standstill(tmp_path):
    text = "velocity_smoother: {ros__parameters: {min_velocity: [0.1, 0.0, -1.0]}}"
    row = row_of(setup_of(tmp_path, text, "humble"), "min_velocity")
    assert (row.status, row.remark) == (Status.DOUBTFUL, "the robot never stands still")
    fault = "min_velocity: the robot never stands still, and the smoother of iron does not start"
    with pytest.raises(InputError, match=fault):
        setup_of(tmp_path, text, "iron")
