"""A whole Nav2 file becomes a robot and columns, and every one of its parameters is told of."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest
import yaml

from drake_navbench.errors import InputError
from drake_navbench.inputs.nav2_check import Check, CheckRow, Status
from drake_navbench.inputs.nav2_node_reader import similar_name_hint
from drake_navbench.inputs.nav2_outline import parse_points
from drake_navbench.inputs.nav2_parameters import read_parameter_file
from drake_navbench.inputs.nav2_robot import Nav2Setup, read_nav2_files
from drake_navbench.inputs.robot import load_robot

FILES = Path(__file__).parent / "nav2_files"
RELEASES = ("humble", "iron", "jazzy", "kilted", "lyrical")
BASES = ("wheelchair", "round_robot")
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
COLUMN = f"""
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: {RPP}
"""
LOCAL = "local_costmap: {local_costmap: {ros__parameters: {%s}}}\n"
SEEING = "rolling_window: true, plugins: [obstacles], obstacles: {plugin: %s, %s}"


@pytest.fixture
def setup_of(tmp_path):
    """A function from the texts of Nav2 files, and values to be set, to what they make."""

    def read(*texts: str, base: str = "wheelchair", **values: str):
        paths = []
        for number, text in enumerate(texts):
            paths.append(tmp_path / f"nav2_{number}.yaml")
            paths[-1].write_text(textwrap.dedent(text))
        return read_nav2_files(paths, load_robot(base), base, values)

    return read


def row_of(setup, parameter: str) -> CheckRow:
    """Returns the only row about a parameter."""
    (row,) = (row for row in setup.check.rows if row.parameter == parameter)
    return row


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("release", RELEASES)
def test_a_file_in_the_form_of_each_release_runs_whole(release, base):
    setup = read_nav2_files([FILES / f"{release}.yaml"], load_robot(base), base)
    assert setup.check.is_whole
    assert setup.check.of(Status.UNREAD) == ()
    assert [preset.name for preset in setup.presets] == {
        "kilted": ["kilted/Window", "kilted/Pursuit"]
    }.get(release, [f"{release}/FollowPath"])


@pytest.mark.parametrize("release", RELEASES)
def test_every_parameter_of_a_node_that_is_read_has_exactly_one_row(release):
    path = FILES / f"{release}.yaml"
    setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair")
    places = [(row.node, row.parameter) for row in setup.check.rows]
    assert len(places) == len(set(places))
    for section in read_parameter_file(path).sections:
        node = section.name.lstrip("/")
        told = {parameter for name, parameter in places if name == node}
        if node in ("map_server", "amcl"):
            assert told == {""}
            continue
        blocks = {
            name for name in told if any(p.startswith(f"{name}.") for p in section.parameters)
        }
        for parameter in section.parameters:
            in_block = any(parameter.startswith(f"{block}.") for block in blocks)
            assert parameter in told or in_block, parameter


def test_the_settings_of_a_file_reach_the_robot():
    robot = read_nav2_files([FILES / "iron.yaml"], load_robot("wheelchair"), "wheelchair").robot
    navigation = robot.navigation
    assert robot.footprint == [(0.4, 0.25), (0.4, -0.25), (-0.35, -0.25), (-0.35, 0.25)]
    assert navigation.local_costmap.footprint_padding == 0.02
    assert navigation.controller_server.failure_tolerance == 0.3
    assert navigation.goal_checker.yaw_goal_tolerance == 0.3
    assert navigation.progress_checker.movement_time_allowance == 12.0
    assert navigation.local_costmap.obstacle_layer.obstacle_max_range == 2.8
    assert navigation.global_costmap.inflation_layer.cost_scaling_factor == 4.0
    assert navigation.planner.plugin == "nav2_theta_star_planner::ThetaStarPlanner"
    assert navigation.behavior_server.simulate_ahead_time == 1.5
    assert navigation.waypoint_follower.pause_s == 0.3
    assert navigation.velocity_smoother.max_velocity == (0.5, 0.0, 1.5)
    # Up to humble and iron more than max_points points trigger.
    assert navigation.collision_monitor.polygons["Slow"].min_points == 6
    assert navigation.collision_monitor.polygons["Slow"].points[0] == (0.7, 0.4)


def test_what_a_file_cannot_tell_stays_the_base_robots():
    base = load_robot("wheelchair")
    robot = read_nav2_files([FILES / "humble.yaml"], base, "wheelchair").robot
    assert robot.lidar == base.lidar
    assert robot.localization == base.localization
    assert robot.drive.response_time_constant_s == base.drive.response_time_constant_s
    assert robot.drive.max_linear_velocity_mps == 0.35
    assert robot.drive.max_angular_velocity_radps == 1.2
    # It is no chair any more.
    assert robot.model is None


def test_the_robot_can_be_kept_as_a_file(tmp_path):
    setup = read_nav2_files([FILES / "jazzy.yaml"], load_robot("round_robot"), "round_robot")
    path = tmp_path / "mine.yaml"
    path.write_text(setup.robot_file())
    kept, made = load_robot(str(path)), setup.robot
    assert kept.model_dump(mode="json") == made.model_dump(mode="json")


def test_a_missing_parameter_has_nav2s_default_not_the_base_robots(setup_of):
    setup = setup_of(COLUMN, LOCAL % "robot_radius: 0.3, rolling_window: true")
    assert load_robot("wheelchair").navigation.local_costmap.resolution == 0.05
    assert setup.robot.navigation.local_costmap.resolution == 0.1
    assert setup.robot.navigation.local_costmap.inflation_layer.inflation_radius == 0.55


def test_smac_2d_of_a_file_behaves_as_nav2s_does():
    robot = read_nav2_files([FILES / "kilted.yaml"], load_robot("wheelchair"), "wheelchair").robot
    planner = robot.navigation.planner
    assert planner.cost_travel_multiplier == 2.0
    assert planner.allow_corner_cutting
    assert not planner.use_exact_end_points


def test_of_several_files_the_later_one_counts(setup_of):
    override = "controller_server: {ros__parameters: {controller_frequency: 10.0}}"
    setup = setup_of(COLUMN, override)
    assert setup.robot.navigation.controller_server.controller_frequency == 10.0


def test_an_error_names_the_file_and_line_of_the_value_that_counts(setup_of):
    override = "# mine\ncontroller_server:\n  ros__parameters: {controller_frequency: fast}"
    with pytest.raises(InputError, match=r"nav2_1\.yaml, line 3: .*controller_frequency: .*'fast'"):
        setup_of(COLUMN, override)


def test_a_misspelt_parameter_is_told_with_the_right_one(setup_of):
    setup = setup_of(COLUMN, LOCAL % "robot_radius: 0.3, rolling_window: true, resolutoin: 0.02")
    row = row_of(setup, "resolutoin")
    assert row.status == Status.UNREAD
    assert row.line == 1
    assert row.remark == "unknown; did you mean 'resolution'?"


def test_no_other_parameter_is_offered_for_one_that_is_no_slip():
    assert similar_name_hint("min_vel_x", ["max_vel_x", "vx_max"]) == ""
    assert similar_name_hint("a.cost_weight", ["a.cost_power"]) == ""
    assert similar_name_hint("lookahead_dits", ["lookahead_dist"]) == (
        "; did you mean 'lookahead_dist'?"
    )


def test_a_source_that_no_layer_listens_to_is_told(setup_of):
    scan = "max_obstacle_height: 2.0, clearing: true"
    sources = f"observation_sources: a, a: {{{scan}}}, b: {{{scan}}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", sources)))
    assert row_of(setup, "obstacles.b").status == Status.UNREAD


def test_a_controller_that_moves_sideways_makes_the_base_omnidirectional(setup_of):
    omni = COLUMN.replace(RPP, "nav2_mppi_controller::MPPIController\n      motion_model: Omni")
    setup = setup_of(omni + "      vy_max: 0.3\n      critics: [GoalCritic]\n")
    assert setup.presets[0].parameters.motion_model == "Omni"
    assert row_of(setup, "FollowPath.motion_model").status == Status.USED
    assert setup.robot.drive.lateral_speed_mps == 0.3
    assert row_of(setup, "drive.type").status == Status.OTHER_FORM


def test_a_velocity_limit_that_no_controller_uses_makes_no_base_omnidirectional(setup_of):
    # bringup gives vy_max to the motion model DiffDrive, too.
    diff = COLUMN.replace(RPP, "nav2_mppi_controller::MPPIController\n      vy_max: 0.5")
    setup = setup_of(diff + "      critics: [GoalCritic]\n")
    assert setup.robot.drive.lateral_speed_mps == 0.0


def test_an_acceleration_that_the_base_does_not_have_is_told(setup_of):
    # The wheelchair has 2.5 m/s^2 and 3 rad/s^2.
    diff = COLUMN.replace(RPP, "nav2_mppi_controller::MPPIController\n      ax_max: 4.0")
    setup = setup_of(diff + "      az_max: 3.0\n      critics: [GoalCritic]\n")
    row = row_of(setup, "drive.max_linear_acceleration_mps2")
    assert row.remark == "2.5, that of wheelchair; a controller counts on 4"
    told = [row.parameter for row in setup.check.rows if row.node == "robot"]
    assert "drive.max_angular_acceleration_radps2" not in told
    assert setup.robot.drive.max_linear_acceleration_mps2 == 2.5


@pytest.mark.parametrize(("radius_m", "is_small"), [(0.29, True), (0.3, False)])
def test_costs_that_do_not_reach_as_far_as_the_robot_are_doubtful(setup_of, radius_m, is_small):
    inflation = (
        f"inflate: {{plugin: 'nav2_costmap_2d::InflationLayer', inflation_radius: {radius_m}}}"
    )
    costmap = f"rolling_window: true, robot_radius: 0.29, plugins: [inflate], {inflation}"
    # Nav2 makes the circle a polygon of 16 corners and pads it by 0.01 m.
    row = row_of(setup_of(COLUMN, LOCAL % costmap), "inflate.inflation_radius")
    assert row.status == (Status.DOUBTFUL if is_small else Status.USED)
    assert ("less than the robot's inscribed radius, 0.294 m" in row.remark) == is_small


def test_a_controller_that_is_not_there_costs_its_column_alone(setup_of):
    more = "controller_plugins: [FollowPath, Mine], Mine: {plugin: my::Own}"
    mine = f"controller_server: {{ros__parameters: {{{more}}}}}"
    setup = setup_of(COLUMN, mine)
    assert [preset.name for preset in setup.presets] == ["nav2_1/FollowPath"]
    assert row_of(setup, "Mine.plugin").status == Status.STAND_IN


def test_a_file_with_no_controller_that_is_there_is_refused(setup_of):
    with pytest.raises(InputError, match=r"line 6: .*FollowPath\.plugin: 'my::Own' has no"):
        setup_of(COLUMN.replace(RPP, "my::Own"))


SHIM = "nav2_rotation_shim_controller::RotationShimController"


@pytest.mark.parametrize(
    "primary",
    [f"primary_controller: {RPP}", f"primary_controller: {{plugin: {RPP}}}"],
    ids=["beside", "block"],
)
def test_a_rotation_shim_drives_with_its_primary_controller(primary, setup_of):
    setup = setup_of(COLUMN.replace(RPP, f"{SHIM}\n      {primary}"))
    (preset,) = setup.presets
    assert preset.controller == "rotation_shim"
    assert preset.parameters.primary_controller.plugin == "rpp"
    assert row_of(setup, "FollowPath.plugin").status == Status.USED
    name = "primary_controller" + (".plugin" if "{" in primary else "")
    assert row_of(setup, f"FollowPath.{name}").status == Status.USED


def test_a_rotation_shim_over_a_controller_that_is_not_there_costs_its_column(setup_of):
    shim = f"{{plugin: '{SHIM}', primary_controller: 'my::Own'}}"
    more = f"controller_plugins: [FollowPath, Mine], Mine: {shim}"
    mine = f"controller_server: {{ros__parameters: {{{more}}}}}"
    setup = setup_of(COLUMN, mine)
    assert [preset.name for preset in setup.presets] == ["nav2_1/FollowPath"]


@pytest.mark.parametrize("kind", ["ObstacleLayer", "VoxelLayer"])
def test_a_camera_that_the_robot_does_not_have_is_put_where_its_lidar_is(setup_of, kind):
    points = "topic: /rear_camera/points, data_type: PointCloud2, obstacle_max_range: 7.5"
    camera = f"observation_sources: c, c: {{{points}}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % (f"nav2_costmap_2d::{kind}", camera)))
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["obstacles"]
    assert costmap.plugin_blocks["obstacles"].observation_sources["c"].sensor == (
        "rear_camera_points"
    )
    (sensor,) = setup.robot.depth_sensors.values()
    assert sensor.range_max_m == 7.5
    assert sensor.pose == pytest.approx((0.0, 0.0, 3.14159265))
    row = row_of(setup, "obstacles.c.topic")
    assert row.status == Status.OTHER_FORM
    assert "depth_sensors.rear_camera_points in a robot file says otherwise" in row.remark
    assert setup.check.is_whole


def test_a_camera_of_the_robot_is_taken_by_the_name_of_its_source(setup_of, tmp_path):
    robot = tmp_path / "seeing.yaml"
    robot.write_text("description: r\nrobot_radius: 0.2\ndepth_sensors: {oak: {height_m: 0.9}}\n")
    source = "observation_sources: oak, oak: {data_type: PointCloud2, topic: /points}"
    text = LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source))
    setup = setup_of(COLUMN, text, base=str(robot))
    assert list(setup.robot.depth_sensors) == ["oak"]
    assert row_of(setup, "obstacles.oak.topic").remark == "the robot's depth sensor oak"


@pytest.mark.parametrize(
    ("names", "degrees"),
    [
        ("front_camera", 0), ("left", 90), ("cam_right", -90), ("back", 180), ("frontleft", 45),
        ("rear_right_depth", -135),
    ],
)  # fmt: skip
def test_a_camera_looks_where_its_name_says(setup_of, names, degrees):
    source = f"observation_sources: {names}, {names}: {{data_type: PointCloud2}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source)))
    (sensor,) = setup.robot.depth_sensors.values()
    assert sensor.pose[2] == pytest.approx(degrees * 3.14159265 / 180.0)


def test_a_lidar_of_many_layers_looks_all_around(setup_of):
    source = "observation_sources: p, p: {data_type: PointCloud2, topic: /velodyne_points}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source)))
    assert setup.robot.depth_sensors["velodyne_points"].horizontal_fov_rad == pytest.approx(
        6.2831853
    )


TWO_SCANS = (
    "observation_sources: a b, a: {topic: /a, clearing: true, max_obstacle_height: 2.0},"
    " b: {topic: /b, max_obstacle_height: 2.0, obstacle_max_range: 1.0}"
)


def test_a_lidar_that_sees_all_around_is_every_scanner(setup_of):
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS)))
    sources = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"].observation_sources
    assert {name: source.scanner for name, source in sources.items()} == {"a": None, "b": None}
    assert (sources["b"].obstacle_max_range, sources["b"].clearing) == (1.0, False)
    assert setup.check.is_whole


def test_two_scanners_of_the_robot_are_two_sources(setup_of, tmp_path):
    robot = tmp_path / "two.yaml"
    robot.write_text(
        "description: r\nrobot_radius: 0.2\nlidar: {angle_span_rad: 3.0, "
        "further_poses: [[-0.1, 0.0, 3.14]]}\n"
    )
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS))
    setup = setup_of(COLUMN, text, base=str(robot))
    sources = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"].observation_sources
    assert {name: source.scanner for name, source in sources.items()} == {"a": 1, "b": 2}


def test_a_lidar_that_does_not_see_all_around_only_stands_in_for_a_second_one(setup_of, tmp_path):
    robot = tmp_path / "half.yaml"
    robot.write_text("description: r\nrobot_radius: 0.2\nlidar: {angle_span_rad: 3.0}\n")
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS))
    setup = setup_of(COLUMN, text, base=str(robot))
    assert row_of(setup, "obstacles.b.topic").status == Status.STAND_IN


def test_a_second_layer_of_a_type_is_a_layer_of_its_own(setup_of):
    scan = "observation_sources: s, s: {clearing: true, max_obstacle_height: 2.0}"
    voxels = "nav2_costmap_2d::VoxelLayer"
    text = (SEEING % (voxels, scan)).replace("[obstacles]", "[obstacles, more]")
    setup = setup_of(COLUMN, LOCAL % f"{text}, more: {{plugin: {voxels}, {scan}, z_voxels: 5}}")
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["voxel_layer", "more"]
    assert costmap.plugin_blocks["more"].z_voxels == 5
    assert setup.check.is_whole


@pytest.mark.parametrize(
    ("release_mark", "method", "plugins"),
    [
        ("costmap_update_timeout: 0.3", 3, ["obstacle_layer"]),
        ("costmap_update_timeout: 0.3", 2, ["obstacle_layer"]),
        ("progress_checker_plugin: p", 3, []),
        ("progress_checker_plugin: p", 2, []),
        ("progress_checker_plugin: p", 1, ["obstacle_layer"]),
    ],
)
def test_a_way_to_combine_that_nav2_does_not_know(setup_of, release_mark, method, plugins):
    scan = (
        f"combination_method: {method}, observation_sources: s, "
        "s: {clearing: true, max_obstacle_height: 2.0}"
    )
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", scan))
    mark = f"controller_server: {{ros__parameters: {{{release_mark}, p: {{plugin: 'x'}}}}}}"
    if "progress" in release_mark:
        mark = mark.replace("'x'", "nav2_controller::SimpleProgressChecker")
    setup = setup_of(COLUMN, text, mark)
    assert setup.robot.navigation.local_costmap.plugins == plugins
    if plugins:
        layer = setup.robot.navigation.local_costmap.obstacle_layer
        assert layer.combination_method == (method if method <= 2 else 1)


def test_a_layer_that_sees_nothing_in_nav2_sees_nothing_here(setup_of):
    # Without max_obstacle_height a source of Nav2 takes points up to 0 m only.
    scan = "observation_sources: scan, scan: {data_type: LaserScan, clearing: true}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", scan)))
    assert setup.robot.navigation.local_costmap.plugins == []
    row = row_of(setup, "obstacles")
    assert row.status == Status.DOUBTFUL
    assert "too low or too high" in row.remark


def test_a_spatio_temporal_layer_is_there_with_its_own_parameters(setup_of):
    stvl = "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer"
    source = "eye: {topic: /eye, clearing: true, horizontal_fov_angle: 1.2, max_z: 9.0}"
    layer = f"voxel_decay: 15.0, observation_sources: eye, {source}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % (stvl, layer)))
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["obstacles"]
    assert costmap.plugin_blocks["obstacles"].voxel_decay == 15.0
    assert setup.robot.depth_sensors["eye"].horizontal_fov_rad == 1.2
    assert setup.robot.depth_sensors["eye"].range_max_m == 9.0
    assert setup.check.is_whole


def test_an_obstacle_layer_stands_in_for_one_of_others_that_sees(setup_of):
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nvblox::nav2::NvbloxCostmapLayer", "a: 1")))
    assert setup.robot.navigation.local_costmap.plugins == ["obstacle_layer"]
    assert not setup.check.is_whole


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("[[1, 2], [-3.5, .4]]", [[1.0, 2.0], [-3.5, 0.4]]),
        ("[ [1 2],[3\t4] ]", [[1.0, 2.0], [3.0, 4.0]]),
        ("[[1e-1, 2]]", [[0.1, 2.0]]),
        ("[[1, 2]", None),
        ("[[a, 2]]", None),
    ],
)
def test_points_are_read_as_nav2_reads_them(text, points):
    assert parse_points(text) == points


@pytest.mark.parametrize(
    ("parameters", "fault"),
    [
        ('footprint: "[[0.1, 0.1], [x"', "footprint: expected '[[x, y], [x, y], ...]'"),
        ('footprint: "[[1, 1], [2, 1], [2, 2]]"', "footprint must be a simple polygon"),
        ("robot_radius: -1.0", "robot_radius: expected 0.0001 to 10000, got -1.0"),
        ("resolution: 1.0e-9", "resolution: expected 0.001 to 100, got 1e-09"),
        ("plugins: [mine, mine]", "plugins: 'mine' is listed twice, expected once"),
        ("plugins: [mine]", "plugins: 'mine' is listed, but mine.plugin is missing"),
        ("width: 3.5", "width: input should be a valid integer, got 3.5"),
    ],
)
def test_a_wrong_value_is_one_line_with_file_line_and_parameter(setup_of, parameters, fault):
    with pytest.raises(InputError) as refused:
        setup_of(COLUMN, LOCAL % parameters)
    (line,) = str(refused.value).splitlines()
    assert "nav2_1.yaml, line 1: local_costmap/local_costmap.ros__parameters." in line
    assert fault in line


def test_a_monitor_that_nav2_could_not_start_is_not_there(setup_of):
    monitor = """
collision_monitor:
  ros__parameters:
    observation_sources: [scan]
    polygons: [Stop, Slow]
    Stop: {type: circle, radius: 0.3, action_type: stop}
"""
    setup = setup_of(COLUMN, monitor)
    assert setup.robot.navigation.collision_monitor is None
    (row,) = setup.check.stand_ins
    assert row.text == (
        "collision_monitor: polygons (line 5): Slow is listed, but has no type: Nav2's does not "
        "start, there is none"
    )


def test_two_controllers_of_one_name_are_refused(setup_of):
    with pytest.raises(InputError, match=r"line 4: .*'FollowPath' is listed twice"):
        setup_of(COLUMN.replace("[FollowPath]", "[FollowPath, FollowPath]"))


def test_a_whole_float_is_taken_for_an_integer_and_told(setup_of):
    setup = setup_of(COLUMN, LOCAL % "robot_radius: 0.2, width: 4.0")
    assert setup.robot.navigation.local_costmap.width == 4
    assert row_of(setup, "width").status == Status.OTHER_FORM


def test_values_are_put_in_for_names(setup_of):
    text = COLUMN.replace("[FollowPath]", "[FollowPath]\n    controller_frequency: $(var rate)")
    assert setup_of(text, rate="25.0").robot.navigation.controller_server.controller_frequency == 25
    with pytest.raises(InputError, match=r"line 5: .*rate has no value; expected --set rate=value"):
        setup_of(text)
    with pytest.raises(InputError, match=r"--set rat: no file has .* found: rate"):
        setup_of(text, rat="25.0")


def test_a_substitution_that_is_not_closed_is_refused(setup_of):
    with pytest.raises(InputError, match=r"nav2_0.yaml, line 4: expected \$\(var name\)"):
        setup_of(COLUMN.replace("[FollowPath]", "$(var plugins"))


def test_the_table_fits_its_width_and_leaves_no_row_out():
    rows = read_nav2_files(
        [FILES / "jazzy.yaml"], load_robot("wheelchair"), "wheelchair"
    ).check.rows
    text = Check(rows).as_text(80)
    assert max(map(len, text.splitlines())) <= 80
    words = " ".join(text.split())
    assert all(row.parameter in words for row in rows)


def test_the_fixtures_are_files_of_their_own():
    assert {path.stem for path in FILES.glob("*.yaml")} == set(RELEASES)
    assert all(yaml.safe_load(path.read_text()) for path in FILES.glob("*.yaml"))


def test_a_global_costmap_that_rolls_is_taken_with_its_size(setup_of):
    rolls = "global_costmap: {global_costmap: {ros__parameters: {rolling_window: true, width: 9}}}"
    setup = setup_of(COLUMN, rolls)
    costmap = setup.robot.navigation.global_costmap
    assert costmap.rolling_window
    assert (costmap.width, costmap.height, costmap.resolution) == (9, 5, 0.1)
    assert not any(row.node.startswith("global_costmap") for row in setup.check.stand_ins)


def test_a_window_that_a_file_without_controllers_leaves_open_is_no_stand_in(setup_of):
    outline = LOCAL % "robot_radius: 0.3"
    assert setup_of(outline).check.is_whole
    assert not setup_of(COLUMN, outline).check.is_whole


def test_what_stands_in_is_told_of_the_column_whose_controller_it_is_in():
    def stand_in(node, parameter):
        return CheckRow(Status.STAND_IN, node, parameter)

    rows = (
        stand_in("controller_server", "Slow.motion_model"),
        stand_in("controller_server", "Slower.motion_model"),
        stand_in("planner_server", "Slow"),
        CheckRow(Status.USED, "controller_server", "Slow.plugin"),
    )
    places = {"a/Slow": ("controller_server", "Slow"), "a/Quick": ("controller_server", "Quick")}
    setup = Nav2Setup((), load_robot("wheelchair"), Check(rows), places)
    assert setup.stand_ins_of("a/Slow") == ["controller_server: Slow.motion_model"]
    assert setup.stand_ins_of("a/Quick") == []
    # Slower is no column: its controller may be one that is not there.
    assert setup.stand_ins_of_all() == [
        "controller_server: Slower.motion_model",
        "planner_server: Slow",
    ]
