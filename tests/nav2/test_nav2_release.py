"""The release of Nav2 is told by what only some releases read, and changes what it changed."""

from __future__ import annotations

from pathlib import Path

import pytest
from nav2_setups import read_nav2_files
from nav2_texts import COLUMN, LOCAL, row_of

from drake_navbench.commands.run import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.nav2.parameters import read_parameter_file
from drake_navbench.nav2.release import Found, release_of, release_row
from drake_navbench.plugins.releases import Release

NAME = "inflation_layer"
LEGACY = "nav2_costmap_2d::LegacyInflationLayer"
FILES = Path(__file__).parent / "nav2_files"
WHEELCHAIR = load_robot("wheelchair")
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def told_by(tmp_path, *lines: str, given: str | None = None) -> Found:
    path = tmp_path / "nav2.yaml"
    indented = "".join(f"    {line}\n" for line in lines)
    path.write_text(f"some_server:\n  ros__parameters:\n    use_sim_time: true\n{indented}")
    return release_of(read_parameter_file(path).sections, given)


@pytest.mark.parametrize(
    ("lines", "release"),
    [
        (["progress_checker_plugin: a"], "humble"),
        (["FollowPath: {prune_plan: true}"], "kilted"),
        # Humble's planners are called so as well, and nothing came with Iron.
        (['GridBased: {plugin: "nav2_navfn_planner/NavfnPlanner"}'], "humble"),
        (['GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner"}'], "jazzy"),
        (["progress_checker_plugins: [a]"], "iron"),
        (["error_code_name_prefixes: [a]"], "kilted"),
        (["path_handler_plugins: [a]"], "lyrical"),
        # What needs a release counts more than what was left over from an older one.
        (["costmap_update_timeout: 0.3", "progress_checker_plugin: a"], "jazzy"),
        (["costmap_update_timeout: 0.3", "service_introspection_mode: off"], "kilted"),
        (["FollowPath: {reset_period: 1.0}"], "humble"),
        (["home_dock: {dock_direction: backward}"], "kilted"),
        # What went before Humble is nearest to Humble.
        (["plugin_names: [a]"], "humble"),
        (["planner_plugin: a", "service_introspection_mode: off"], "kilted"),
        ([], "lyrical"),
    ],
)
def test_a_release_is_told_by_its_marks(tmp_path, lines, release):
    assert told_by(tmp_path, *lines).release == release


SLASH = "GridBased: {plugin: nav2_navfn_planner/NavfnPlanner}"
COLONS = 'GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner"}'


@pytest.mark.parametrize(
    ("lines", "release", "mark"),
    [
        # Jazzy would not start with the slash, but leaves a parameter that it does not read alone.
        ([SLASH, "costmap_update_timeout: 0.3"], "humble", "nav2_navfn_planner/NavfnPlanner"),
        ([SLASH, "service_introspection_mode: off"], "humble", "nav2_navfn_planner/NavfnPlanner"),
        # With Iron's parameters alone it is Iron's.
        ([SLASH, "progress_checker_plugins: [a]"], "iron", "progress_checker_plugins"),
        (
            [SLASH, "progress_checker_plugins: [a]", "costmap_update_timeout: 0.3"],
            "humble",
            "nav2_navfn_planner/NavfnPlanner",
        ),
        (
            [SLASH, "action_server_result_timeout: 900.0", "progress_checker_plugin: a"],
            "humble",
            "progress_checker_plugin",
        ),
        # What is left over from an older release does not make a file that starts in Jazzy older.
        ([COLONS, "FollowPath: {reset_period: 1.0}"], "jazzy", "nav2_navfn_planner::NavfnPlanner"),
        ([SLASH, 'spin: {plugin: "nav2_behaviors::Spin"}'], "jazzy", "nav2_behaviors::Spin"),
        # Listed, where from jazzy on nothing but one's own libraries may be.
        (
            ["plugin_lib_names: [nav2_follow_path_action_bt_node]", "costmap_update_timeout: 0.3"],
            "humble",
            "nav2_follow_path_action_bt_node",
        ),
        (["plugin_lib_names: [my_own_bt_node]"], "lyrical", ""),
        # A class that came with a release tells it where the names' form allows it.
        ([COLONS, f"a: {{plugin: {LEGACY}}}"], "lyrical", LEGACY),
        ([SLASH, f"a: {{plugin: {LEGACY}}}"], "humble", "nav2_navfn_planner/NavfnPlanner"),
    ],
)
def test_what_a_release_can_load_counts_more_than_what_it_reads(tmp_path, lines, release, mark):
    assert told_by(tmp_path, *lines) == (release, mark)


@pytest.mark.parametrize(
    ("path", "release"),
    [
        ("/opt/ros/jazzy/share/nav2_bt_navigator/behavior_trees/a.xml", "jazzy"),
        ("[b.xml, /opt/ros/iron/share/a.xml]", "iron"),
        # None of ours.
        ("/opt/ros/foxy/share/a.xml", "humble"),
        ("/opt/ros/jazzy_of_mine/share/a.xml", "humble"),
    ],
)
def test_a_path_in_the_installation_of_a_release_tells_it_outright(tmp_path, path, release):
    found = told_by(tmp_path, SLASH, f"default_nav_to_pose_bt_xml: {path}")
    assert found.release == release
    assert found.mark in (f"/opt/ros/{release}", "nav2_navfn_planner/NavfnPlanner")


def test_of_plugins_named_as_in_different_releases_the_more_frequent_names_tell_it(tmp_path):
    behaviors = [f'{n}: {{plugin: "nav2_behaviors/{n}"}}' for n in ("Spin", "BackUp")]
    planner = 'GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner"}'
    assert told_by(tmp_path, *behaviors, planner).release == "humble"
    # One of each: the newer one.
    assert told_by(tmp_path, behaviors[0], planner).release == "jazzy"


def test_the_recoveries_server_is_of_before_humble(tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text("recoveries_server:\n  ros__parameters:\n    use_sim_time: false\n")
    found = release_of(read_parameter_file(path).sections, None)
    assert found == (Release.HUMBLE, "recoveries_server")


def test_what_is_given_counts_more_than_any_mark(tmp_path):
    found = told_by(tmp_path, "path_handler_plugins: [a]", given="humble")
    assert found == (Release.HUMBLE, "--nav2-release")


@pytest.mark.parametrize("release", [path.stem for path in sorted(FILES.glob("*.yaml"))])
def test_our_own_files_are_of_the_release_that_they_are_named_after(release):
    rows = read_nav2_files([FILES / f"{release}.yaml"], WHEELCHAIR, "wheelchair").check.rows
    (told,) = [r for r in rows if r.node == "nav2_release" and r.remark.startswith("recognised by")]
    # Kilted's own marks are in no parameter that this one gives.
    assert told.parameter == {"kilted": "jazzy"}.get(release, release)


def test_the_tree_and_the_waiting_are_those_of_the_release():
    def navigation(release):
        files = [FILES / "jazzy.yaml"]
        return read_nav2_files(files, WHEELCHAIR, "chair", release=release).robot.navigation

    humble, lyrical = navigation("humble"), navigation("lyrical")
    assert humble.behavior_tree.nav2_release == "humble"
    assert humble.behavior_tree.wrap_around
    assert humble.behavior_tree.backup_speed == 0.05
    assert humble.controller_server.costmap_update_timeout == 0.0
    assert navigation("jazzy").behavior_tree.backup_speed == 0.15
    assert lyrical.behavior_tree.nav2_release == "lyrical"
    assert not lyrical.behavior_tree.wrap_around


def test_the_release_is_told_with_its_mark():
    row = release_row(Found(Release("humble"), "a mark"))
    assert (row.node, row.parameter, row.remark) == (
        "nav2_release",
        "humble",
        "recognised by a mark",
    )


def test_the_length_of_the_plan_keeps_no_goal_from_being_reached_before_lyrical():
    def tolerance(release):
        files = [FILES / "jazzy.yaml"]
        setup = read_nav2_files(files, WHEELCHAIR, "chair", release=release)
        return setup.robot.navigation.goal_checker.path_length_tolerance

    assert [tolerance(release) for release in ("humble", "kilted", "lyrical")] == [None, None, 1.0]


def test_what_a_release_does_not_read_is_told(tmp_path):
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "controller_server: {ros__parameters: {controller_plugins: [F], F: {plugin: "
        "'nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController', "
        "use_dynamic_window: true, max_robot_pose_search_dist: 3.0}}}\n"
    )

    def told(release):
        setup = read_nav2_files([file], WHEELCHAIR, "chair", release=release)
        (preset,) = setup.presets
        rows = {row.parameter: row for row in setup.check.rows}
        row = rows["F.use_dynamic_window"]
        return row.status.name, row.remark, preset.path_handler, preset.parameters

    status, remark, handler, parameters = told("jazzy")
    assert (status, remark, handler) == ("UNREAD", "jazzy does not read it", {})
    assert parameters.max_robot_pose_search_dist == 3.0
    status, _, handler, parameters = told("lyrical")
    assert (status, handler) == ("USED", {"max_robot_pose_search_dist": 3.0})
    assert parameters.use_dynamic_window


MPPI = "nav2_mppi_controller::MPPIController"
SHIM = "nav2_rotation_shim_controller::RotationShimController"
LAYER, PERIOD = "inflation_layer_name: inflation_layer", "reset_period: 1.0"
CAR = "AckermannConstraints.min_turning_r: 0.4"
NOT_HERE, UNREAD = "no effect in simulation", "not read by Nav2"


@pytest.mark.parametrize(
    ("plugin", "line", "release", "status", "remark"),
    [
        # Which of several inflation layers the critic asks; here there is one.
        (MPPI, f"CostCritic.{LAYER}", "humble", NOT_HERE, ""),
        (MPPI, f"CostCritic.{LAYER}", "lyrical", NOT_HERE, ""),
        (MPPI, f"ObstaclesCritic.{LAYER}", "humble", UNREAD, "humble does not read it"),
        (MPPI, f"ObstaclesCritic.{LAYER}", "iron", NOT_HERE, ""),
        (MPPI, PERIOD, "humble", "used", ""),
        (MPPI, PERIOD, "iron", UNREAD, "iron does not read it"),
        (MPPI, PERIOD, "jazzy", UNREAD, "jazzy does not read it"),
        (MPPI, CAR, "jazzy", UNREAD, "only motion_model: Ackermann reads it"),
        (SHIM, PERIOD, "humble", "used", ""),
        (SHIM, f"CostCritic.{LAYER}", "humble", NOT_HERE, ""),
    ],
)
def test_what_becomes_of_a_parameter_of_mppi_is_told(
    tmp_path, plugin, line, release, status, remark
):
    primary = f"primary_controller: '{MPPI}', " if plugin == SHIM else ""
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "controller_server: {ros__parameters: {controller_plugins: [F], F: "
        f"{{plugin: '{plugin}', {primary}critics: [CostCritic, ObstaclesCritic], {line}}}}}}}\n"
    )
    rows = read_nav2_files([file], WHEELCHAIR, "chair", release=release).check.rows
    (row,) = [row for row in rows if row.parameter == f"F.{line.partition(':')[0]}"]
    assert (row.status, row.remark) == (status, remark)


def test_what_no_release_since_humble_reads_is_not_said_to_be_used(tmp_path):
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "controller_server: {ros__parameters: {controller_plugins: [F], F: "
        f"{{plugin: '{RPP}', max_allowed_time_to_collision: 1.0, prune_plan: true}}}}}}\n"
    )
    rows = read_nav2_files([file], WHEELCHAIR, "chair", release="humble").check.rows
    told = {row.parameter: row for row in rows}
    for name in ("max_allowed_time_to_collision", "prune_plan"):
        assert told[f"F.{name}"].status == UNREAD
    assert told["F.max_allowed_time_to_collision"].remark == (
        "unknown; did you mean 'max_allowed_time_to_collision_up_to_carrot'?"
    )


@pytest.mark.parametrize(
    ("release", "limit", "interpolates"),
    [("humble", 255.0, False), ("iron", 255.0, False), ("lyrical", None, None)],
)
def test_the_hybrid_planner_before_it_had_a_limit_of_cost(release, limit, interpolates, tmp_path):
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "planner_server: {ros__parameters: {planner_plugins: [GridBased], GridBased: {plugin: "
        "'nav2_smac_planner/SmacPlannerHybrid', analytic_expansion_max_cost: true}}}\n"
    )
    if limit is None:
        with pytest.raises(InputError, match="analytic_expansion_max_cost: input should be a"):
            read_nav2_files([file], WHEELCHAIR, "chair", release=release)
        return
    setup = read_nav2_files([file], WHEELCHAIR, "chair", release=release)
    planner = setup.robot.navigation.planner
    assert planner.analytic_expansion_max_cost == limit
    assert planner.allow_primitive_interpolation is interpolates


@pytest.mark.parametrize(
    ("own", "given", "read_as"),
    [
        ("", None, "humble, recognised by progress_checker_plugin"),
        ("", "kilted", "kilted, set by --nav2-release"),
        ("nav2_release: jazzy, ", "kilted", "jazzy, recognised by nav2_release"),
    ],
)
def test_a_file_of_controllers_alone_is_of_its_release_too(tmp_path, own, given, read_as):
    path = tmp_path / "nav2.yaml"
    path.write_text(
        "controller_server: {ros__parameters: {progress_checker_plugin: a, controller_plugins: "
        f"[F], F: {{{own}plugin: '{RPP}', use_fixed_curvature_lookahead: true}}}}}}\n"
    )
    (preset,) = load_parameter_file(path, given)
    assert preset.read_as == read_as
    assert preset.parameters.nav2_release == read_as.partition(",")[0]
    # Humble does not read it.
    assert preset.parameters.as_read().use_fixed_curvature_lookahead == ("humble" not in read_as)


@pytest.mark.parametrize("release", [path.stem for path in sorted(FILES.glob("*.yaml"))])
def test_controllers_alone_are_read_as_with_the_whole_file(release):
    path = FILES / f"{release}.yaml"
    alone = load_parameter_file(path)
    whole = read_nav2_files([path], WHEELCHAIR, "wheelchair").presets
    assert [p.parameters for p in alone] == [p.parameters for p in whole]


def test_a_release_for_a_preset_is_refused(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    path.write_text("controller: rpp\ndescription: mine\n")
    assert main(["empty", "--params", str(path), "--nav2-release", "jazzy"]) == 2
    assert "--nav2-release: expected a Nav2 file by --nav2 or --params" in capsys.readouterr().err


def test_a_release_without_a_nav2_file_is_refused(capsys):
    assert main(["empty", "--nav2-release", "jazzy"]) == 2
    assert "--nav2-release: expected a Nav2 file by --nav2 or" in capsys.readouterr().err


@pytest.mark.parametrize("release", ["humble", "iron", "jazzy", "kilted", "lyrical"])
def test_up_to_jazzy_mppi_checks_the_polygon_of_a_round_robot(release, tmp_path, capsys):
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "controller_server: {ros__parameters: {controller_plugins: [F], F: {plugin: "
        "'nav2_mppi_controller::MPPIController', critics: [ObstaclesCritic], "
        "ObstaclesCritic: {consider_footprint: true}}}}\n"
        "local_costmap: {local_costmap: {ros__parameters: {robot_radius: 0.2, "
        "rolling_window: true, plugins: []}}}\n"
    )
    code = main(["empty", "--nav2", str(file), "--nav2-release", release, "--check"])
    out, err = capsys.readouterr()
    if release in ("kilted", "lyrical"):
        assert code == 2
        assert "ObstaclesCritic.consider_footprint: got true, expected false for a robot" in err
    else:
        assert code == 0
        doubtful = out.partition("Probably a mistake")[2]
        assert "F.ObstaclesCritic.consider_footprint (line 1): the costmap" in doubtful


def test_a_class_that_the_release_lacks_keeps_nav2_from_starting(tmp_path):
    file = tmp_path / "nav2.yaml"
    layer = f"plugins: [{NAME}], {NAME}: {{plugin: {LEGACY}}}"
    file.write_text(COLUMN + LOCAL % f"rolling_window: true, {layer}")
    row = row_of(read_nav2_files([file], WHEELCHAIR, "chair", release="humble"), f"{NAME}.plugin")
    assert row.status == "not supported; replaced"
    assert row.remark.startswith(f"{LEGACY} exists from lyrical on, not in humble")
    row = row_of(read_nav2_files([file], WHEELCHAIR, "chair", release="lyrical"), f"{NAME}.plugin")
    assert row.status == "used"


SLIPS = """
amcl: {ros__parameters: {robot_model_type: differential}}
behavior_server:
  ros__parameters:
    behavior_plugins: [spin, wait]
    spin: {plugin: nav2_behaviors/Spin}
    wait: {plugin: "nav2_behaviors::Wait"}
bt_navigator:
  ros__parameters:
    navigators: [navigate_to_pose]
    navigate_to_pose: {plugin: nav2_bt_navigator/NavigateToPoseNavigator}
    plugin_lib_names: [nav2_spin_action_bt_node]
local_costmap:
  local_costmap:
    ros__parameters:
      rolling_window: true
      plugins: [inflation]
      inflation: {plugin: nav2_costmap_2d/InflationLayer}
      forgotten: {plugin: nav2_costmap_2d/StaticLayer}
"""


def told_slips(tmp_path, release):
    file = tmp_path / "nav2.yaml"
    file.write_text(COLUMN + SLIPS)
    check = read_nav2_files([file], WHEELCHAIR, "chair", release=release).check
    return {row.place: row.remark for row in check.stand_ins}


def test_the_check_tells_names_with_a_slash_where_the_release_wants_colons(tmp_path):
    stops = "this node of Nav2 does not start"
    assert told_slips(tmp_path, "jazzy") == {
        "behavior_server: spin.plugin": f"nav2_behaviors/Spin is called nav2_behaviors::Spin in "
        f"jazzy: {stops}; used here all the same",
        "local_costmap/local_costmap: inflation.plugin": "nav2_costmap_2d/InflationLayer is called "
        f"nav2_costmap_2d::InflationLayer in jazzy: {stops}; used here all the same",
        # What is not read here has to start on the robot, too.
        "amcl: robot_model_type": "differential is called nav2_amcl::DifferentialMotionModel in "
        f"jazzy: {stops}",
        "bt_navigator: navigate_to_pose.plugin": "nav2_bt_navigator/NavigateToPoseNavigator is "
        f"called nav2_bt_navigator::NavigateToPoseNavigator in jazzy: {stops}",
        "bt_navigator: plugin_lib_names": "lists nav2_spin_action_bt_node, which jazzy's "
        "bt_navigator loads by itself and cannot load a second time: bt_navigator does not start",
    }


def test_the_check_tells_colons_where_the_release_wants_a_slash(tmp_path):
    told = told_slips(tmp_path, "humble")
    assert (
        "nav2_behaviors::Wait is called nav2_behaviors/Wait in humble"
        in (told["behavior_server: wait.plugin"])
    )
    # Humble loads no navigators, and all the libraries that it is told to.
    assert not any(place.startswith("bt_navigator") for place in told)


def test_a_run_with_a_misspelt_plugin_says_so(tmp_path, capsys):
    file = tmp_path / "nav2.yaml"
    file.write_text(COLUMN + SLIPS)
    main(["empty", "--nav2", str(file), "--nav2-release", "jazzy", "--check"])
    assert "nav2_behaviors/Spin is called nav2_behaviors::Spin" in (
        " ".join(capsys.readouterr().out.split())
    )
