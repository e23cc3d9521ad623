"""A whole Nav2 file becomes a robot and columns, and every one of its parameters is told of."""

from pathlib import Path

import pytest
import yaml
from nav2_setups import read_nav2_files
from nav2_texts import COLUMN, LOCAL, RPP, SHIM, row_of

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Check, CheckRow, Status
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.node_reader import similar_name_hint
from drake_navbench.nav2.outline import parse_points
from drake_navbench.nav2.parameters import read_parameter_file

FILES = Path(__file__).parent / "nav2_files"
RELEASES = ("humble", "iron", "jazzy", "kilted", "lyrical")
BASES = ("wheelchair", "round_robot")


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
    assert (
        navigation.local_costmap.obstacle_layer.observation_sources["front"].obstacle_max_range
        == 2.8
    )
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
    # Twelve letters of "_deceleration" are alike, but not the first words.
    assert similar_name_hint("max_deceleration", ["cancel_deceleration"]) == ""
    assert similar_name_hint("a.cost_weight", ["a.cost_power"]) == ""
    assert similar_name_hint("lookahead_dits", ["lookahead_dist"]) == (
        "; did you mean 'lookahead_dist'?"
    )


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
    assert row.remark == "2.5, that of wheelchair, although a controller expects 4"
    told = [row.parameter for row in setup.check.rows if row.node == "robot"]
    assert "drive.max_angular_acceleration_radps2" not in told
    assert setup.robot.drive.max_linear_acceleration_mps2 == 2.5


def test_a_controller_that_is_not_there_costs_its_column_alone(setup_of):
    more = "controller_plugins: [FollowPath, Mine], Mine: {plugin: my::Own}"
    mine = f"controller_server: {{ros__parameters: {{{more}}}}}"
    setup = setup_of(COLUMN, mine)
    assert [preset.name for preset in setup.presets] == ["nav2_1/FollowPath"]
    assert row_of(setup, "Mine.plugin").status == Status.STAND_IN


def test_a_file_with_no_controller_that_is_there_is_refused(setup_of):
    with pytest.raises(InputError, match=r"line 6: .*FollowPath\.plugin: 'my::Own' has no"):
        setup_of(COLUMN.replace(RPP, "my::Own"))


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


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("[[1, 2], [-3.5, .4]]", [[1.0, 2.0], [-3.5, 0.4]]),
        ("[ [1 2],[3\t4] ]", [[1.0, 2.0], [3.0, 4.0]]),
        ("[[1e-1, 2]]", [[0.1, 2.0]]),
        ("[[1, 2]", None),
        ("[[a, 2]]", None),
        ("[[1,\n2], [3, 4]]", [[1.0, 2.0], [3.0, 4.0]]),
        ("[[1, 2],\n[3, 4]]", None),
        ("[[1, 2], [3, 4]]\n", None),
        ("[1, 2]", None),
    ],
)
def test_points_are_read_as_nav2_reads_them(text, points):
    assert parse_points(text) == points


@pytest.mark.parametrize(
    ("parameters", "fault"),
    [
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
        "collision_monitor: polygons (line 5): Slow is listed, but has no type: Nav2's collision "
        "monitor does not start, so there is none here"
    )


def test_a_node_that_is_used_is_not_listed_as_one_without_effect(setup_of):
    monitor = """
collision_monitor:
  ros__parameters:
    observation_sources: [scan]
    polygons: [Stop]
    Stop: {type: circle, radius: 0.3, action_type: stop}
"""
    text = setup_of(COLUMN, monitor, "map_server: {ros__parameters: {use_sim_time: true}}")
    assert "- whole nodes: map_server\n" in f"{text.check.as_text()}\n"


def test_two_controllers_of_one_name_are_refused(setup_of):
    with pytest.raises(InputError, match=r"line 4: .*'FollowPath' is listed twice"):
        setup_of(COLUMN.replace("[FollowPath]", "[FollowPath, FollowPath]"))


def test_controllers_listed_as_in_2019_are_called_so(setup_of):
    """Without the refusal Nav2's default would be taken, DWB, of which critics would be missing."""
    text = """controller_server:
  ros__parameters:
    controller_plugin_types: ["teb_local_planner::TebLocalPlannerROS"]
    controller_plugin_ids: [FollowPath]
    FollowPath.max_vel_x: 0.46
"""
    with pytest.raises(InputError, match=r"line 4: .*controller_plugin_ids: is of 2019, before Fo"):
        setup_of(text)
    named = text.replace("FollowPath.max", "controller_plugins: [FollowPath]\n    FollowPath.max")
    with pytest.raises(InputError, match=r"FollowPath.plugin: missing|missing, but listed|critics"):
        setup_of(named)


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


def test_a_parameter_that_was_renamed_is_told_with_todays_name(setup_of):
    """`obstacle_min_range` is more alike to the old name, but has another meaning."""
    layers = (
        "robot_radius: 0.3, plugins: [walls], walls: {plugin: 'nav2_costmap_2d::ObstacleLayer', "
        "observation_sources: scan, scan: {topic: /scan, obstacle_range: 8.0}}"
    )
    row = row_of(setup_of(COLUMN, LOCAL % layers), "walls.scan.obstacle_range")
    assert row.status == Status.UNREAD
    assert row.remark == "no effect: since Galactic it is called obstacle_max_range"


def test_a_topic_of_the_collision_monitor_is_not_offered_to_another_server(setup_of):
    override = "velocity_smoother: {ros__parameters: {cmd_vel_topic: /cmd_vel}}"
    assert row_of(setup_of(COLUMN, override), "cmd_vel_topic").remark == "unknown"


def test_a_node_within_the_parameters_of_another_is_not_read(setup_of):
    override = "/**:\n  ros__parameters:\n    amcl:\n      ros__parameters: {alpha1: 0.1}"
    row = row_of(setup_of(COLUMN, override), "amcl")
    assert (row.status, row.line) == (Status.UNREAD, 4)
    said = "ros__parameters stands within the parameters of **; begin amcl at the left margin"
    assert row.remark == said


def test_a_corner_that_is_none_is_named(setup_of):
    """A comma in place of a point makes three numbers of two."""
    corners = "'[[0.5, 0.2], [0.5, -0,2], [-0.5, 0.0]]'"
    setup = setup_of(COLUMN, LOCAL % f"footprint: {corners}, robot_radius: 0.3")
    row = row_of(setup, "footprint")
    told = "got the corner [0.5, -0.0, 2.0]: robot_radius, by default 0.1 m, is used in its place"
    assert (row.status, row.remark.endswith(told)) == (Status.DOUBTFUL, True)
    assert setup.robot.robot_radius == 0.3


def test_a_footprint_that_is_none_leaves_nav2s_radius(setup_of):
    setup = setup_of(COLUMN, LOCAL % "footprint: __FOOTPRINT__")
    assert (setup.robot.footprint, setup.robot.robot_radius) == (None, 0.1)


@pytest.mark.parametrize(("tolerance_m", "is_told"), [(2.5, True), (0.6, False), (0.25, False)])
def test_a_tolerance_of_the_goal_that_reaches_beyond_the_robot_is_told(
    setup_of, tolerance_m, is_told
):
    goal = (
        "controller_server: {ros__parameters: {goal_checker_plugins: [goal], goal: {plugin: "
        f"'nav2_controller::SimpleGoalChecker', xy_goal_tolerance: {tolerance_m}}}}}}}\n"
    )
    # A radius of 0.7 m and Nav2's padding of 0.01 m.
    setup = setup_of(COLUMN, goal, LOCAL % "robot_radius: 0.7, rolling_window: true")
    row = row_of(setup, "goal.xy_goal_tolerance")
    assert (row.status is Status.DOUBTFUL) == is_told
    assert ("where none of it, up to 0.71 m" in row.remark) == is_told
