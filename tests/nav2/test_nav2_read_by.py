"""What a release of Nav2 does not read has no effect and is told; its own defaults count."""

from __future__ import annotations

import json

import pytest
from nav2_setups import read_nav2_files
from nav2_texts import DWB, MPPI, RPP, SHIM, row_of
from pydantic import BaseModel

from drake_navbench.controller import CONTROLLERS
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.release import SINCE, UNTIL
from drake_navbench.navigation.smoother_parameters import SimpleSmootherParameters
from drake_navbench.plugins.releases import Release, read_by

WHEELCHAIR = load_robot("wheelchair")
ALL = ("humble", "iron", "jazzy", "kilted", "lyrical")


@pytest.fixture
def read_as(tmp_path):
    """A function from a release, a node and its parameters as text to what they make."""

    def read(release: str, node: str, parameters: str, of_plugin: str = "") -> Nav2Setup:
        file = tmp_path / "nav2.yaml"
        if node == "controller_server":
            own = of_plugin or f"plugin: {RPP!r}"
            parameters += f", controller_plugins: [F], F: {{{own}}}"
        file.write_text(f"{node}: {{ros__parameters: {{{parameters}}}}}\n")
        return read_nav2_files([file], WHEELCHAIR, "wheelchair", release=release)

    return read


def of_each(value_of) -> list:
    """Returns a value for each release, the oldest first."""
    return [value_of(release) for release in ALL]


def models() -> list[type[BaseModel]]:
    """Returns the models of parameters that say what reads them, controllers' too."""
    for name in CONTROLLERS.names:
        CONTROLLERS.load(name)
    found: dict[str, type[BaseModel]] = {}
    left: list[type[BaseModel]] = [BaseModel]
    while left:
        model = left.pop()
        left += model.__subclasses__()
        if vars(model).get("READ_BY"):
            found[f"{model.__module__}.{model.__name__}"] = model
    return [found[name] for name in sorted(found)]


@pytest.mark.parametrize("model", models(), ids=lambda model: model.__name__)
def test_a_model_says_what_reads_parameters_and_values_that_it_has(model: type[BaseModel]):
    """But for lists of plugins, which no model has, and critics' blocks, which have their own."""
    for name, known in vars(model)["READ_BY"].items():
        if "plugin" not in name and "." not in name:
            assert name in {*model.model_fields, "TrajectoryValidator"}
            for value in known.defaults.values():
                partly = json.dumps({name: value})
                model.__pydantic_validator__.validate_assignment(
                    model.model_construct(), name, json.loads(partly)[name]
                )


# Iron reads it with a warning, as the nearest of Humble's marks.
WARNED_OF = {"progress_checker_plugin"}


def test_the_marks_of_releases_agree_with_what_the_models_say():
    """A mark is the last part of a name: `near_collision_cost` of the block of a critic."""
    told = 0
    for model in models():
        for place, known in vars(model)["READ_BY"].items():
            name = place.rpartition(".")[2]
            if name in SINCE:
                assert min(known.releases) is SINCE[name], name
                told += 1
            if name in UNTIL and name not in WARNED_OF:
                assert max(known.releases) is UNTIL[name], name
                told += 1
    assert told >= 8


def test_a_model_made_from_another_is_read_as_that_one():
    class Mine(SimpleSmootherParameters):
        pass

    assert read_by(Mine, "refinement_num").defaults == {Release.HUMBLE: 4}
    assert read_by(Mine, "w_data").releases == set(Release)


def test_only_since_jazzy_a_costmap_that_is_late_stops_the_controller_server(read_as):
    def timeout(release):
        setup = read_as(release, "controller_server", "costmap_update_timeout: 0.7")
        row = row_of(setup, "costmap_update_timeout")
        return setup.robot.navigation.controller_server.costmap_update_timeout, row.status

    unread, used = (0.0, Status.UNREAD), (0.7, Status.USED)
    assert of_each(timeout) == [unread, unread, used, used, used]


PROGRESS = (
    "progress_checker_plugin: one, progress_checker_plugins: [two], "
    "one: {plugin: 'nav2_controller::SimpleProgressChecker', movement_time_allowance: 1.0}, "
    "two: {plugin: 'nav2_controller::SimpleProgressChecker', movement_time_allowance: 2.0}"
)


def test_of_two_ways_to_name_a_progress_checker_each_release_reads_its_own(read_as):
    """Iron reads both, and the older one prevails."""

    def found(release):
        setup = read_as(release, "controller_server", PROGRESS)
        names = ("progress_checker_plugin", "progress_checker_plugins")
        unread = [name for name in names if row_of(setup, name).status == Status.UNREAD]
        return setup.robot.navigation.progress_checker.movement_time_allowance, unread

    single, several = ["progress_checker_plugin"], ["progress_checker_plugins"]
    assert of_each(found) == [(1.0, several), (1.0, several), *3 * [(2.0, single)]]


def test_without_a_list_that_the_release_reads_the_progress_checker_has_nav2s_name(read_as):
    text = (
        "progress_checker_plugin: mine, mine: {plugin: 'nav2_controller::PoseProgressChecker'}, "
        "progress_checker: {movement_time_allowance: 3.0}"
    )
    checker = read_as("jazzy", "controller_server", text).robot.navigation.progress_checker
    assert checker.plugin == "nav2_controller::SimpleProgressChecker"
    assert checker.movement_time_allowance == 3.0


def test_iron_takes_no_yaw_for_its_opposite(read_as):
    text = (
        "goal_checker_plugins: [g], g: {plugin: 'nav2_controller::SimpleGoalChecker', "
        "symmetric_yaw_tolerance: true}"
    )

    def symmetric(release):
        setup = read_as(release, "controller_server", text)
        return setup.robot.navigation.goal_checker.symmetric_yaw_tolerance

    assert of_each(symmetric) == [True, False, True, True, True]


def smac(name: str, block: str) -> str:
    return f"planner_plugins: [P], P: {{plugin: 'nav2_smac_planner/{name}', smoother: {{{block}}}}}"


@pytest.mark.parametrize("name", ["SmacPlanner2D", "SmacPlannerHybrid"])
@pytest.mark.parametrize(("block", "since_iron"), [("refinement_num: 3", 3), ("", 2)])
def test_smacs_smoother_goes_over_a_path_four_times_again_in_humble(
    read_as, name, block, since_iron
):
    def refinements(release):
        setup = read_as(release, "planner_server", smac(name, block))
        return setup.robot.navigation.planner.smoother.refinement_num

    assert of_each(refinements) == [4, *4 * [since_iron]]


def test_what_smac_does_not_read_is_told(read_as):
    setup = read_as("humble", "planner_server", smac("SmacPlanner2D", "refinement_num: 3"))
    row = row_of(setup, "P.smoother.refinement_num")
    assert (row.status, row.remark) == (Status.UNREAD, "humble does not read it")


def test_only_lyrical_reads_how_long_navfns_path_may_be(read_as):
    text = (
        "planner_plugins: [P], P: {plugin: 'nav2_navfn_planner/NavfnPlanner', max_cycles_factor: 9}"
    )

    def factor(release):
        setup = read_as(release, "planner_server", text)
        return setup.robot.navigation.planner.max_cycles_factor

    assert of_each(factor) == [4, 4, 4, 4, 9]


def test_navfn_plans_by_the_rules_of_the_files_release(read_as):
    text = "planner_plugins: [P], P: {plugin: 'nav2_navfn_planner/NavfnPlanner'}"

    def rules(release):
        return read_as(release, "planner_server", text).robot.navigation.planner.nav2_release

    assert of_each(rules) == list(Release)


def of_global_costmap(tmp_path, release: str, parameters: str) -> Nav2Setup:
    file = tmp_path / "nav2.yaml"
    file.write_text(f"global_costmap: {{global_costmap: {{ros__parameters: {{{parameters}}}}}}}\n")
    return read_nav2_files([file], WHEELCHAIR, "wheelchair", release=release)


def test_before_lyrical_no_byte_of_a_map_is_an_inscribed_obstacle(tmp_path):
    """It is the byte of unknown space, which comes first: 200 here."""
    text = "plugins: [], unknown_cost_value: 200, inscribed_obstacle_cost_value: 90"

    def inscribed(release):
        setup = of_global_costmap(tmp_path, release, text)
        return setup.robot.navigation.global_costmap.inscribed_obstacle_cost_value

    assert of_each(inscribed) == [200, 200, 200, 200, 90]


def test_up_to_iron_a_voxel_layer_marks_points_however_low(tmp_path):
    text = (
        "plugins: [v], v: {plugin: 'nav2_costmap_2d::VoxelLayer', min_obstacle_height: 0.3, "
        "observation_sources: s, s: {max_obstacle_height: 2.0}}"
    )

    def height(release):
        setup = of_global_costmap(tmp_path, release, text)
        return setup.robot.navigation.global_costmap.plugin_blocks["v"].min_obstacle_height

    assert of_each(height) == [-1000.0, -1000.0, 0.3, 0.3, 0.3]


def test_before_kilted_the_map_below_the_robot_stays_cleared(tmp_path):
    text = "plugins: [s], s: {plugin: 'nav2_costmap_2d::StaticLayer'}"

    def restores(release):
        setup = of_global_costmap(tmp_path, release, text)
        return setup.robot.navigation.global_costmap.static_layer.restore_cleared_footprint

    assert of_each(restores) == [False, False, False, True, True]


CORNERS = "'[[0.5, 0.4], [0.5, -0.4], [-0.5, -0.4], [-0.5, 0.4]]'"
NUMBERS = "[0.5, 0.4, 0.5, -0.4, -0.5, -0.4, -0.5, 0.4]"
ZONE = "polygons: [Z], Z: {type: %s, action_type: %s, %s}"


def test_the_collision_monitor_of_humble_has_max_points_only(read_as):
    """As many as trigger are one more; where both are given, max_points prevails."""
    both = ZONE % ("circle", "stop", "radius: 0.6, min_points: 9, max_points: 5")
    least = ZONE % ("circle", "stop", "radius: 0.6, min_points: 9")

    def points(release, text):
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.min_points, row_of(setup, "Z.min_points").status

    assert of_each(lambda release: points(release, both)) == 5 * [(6, Status.UNREAD)]
    assert points("humble", least) == (4, Status.UNREAD)
    assert points("iron", least) == (9, Status.USED)


@pytest.mark.parametrize(
    ("release", "kind", "action", "rest", "reason"),
    [
        ("humble", "polygon", "stop", f"points: {CORNERS}", "humble takes a list of numbers"),
        ("iron", "polygon", "stop", f"points: {CORNERS}", "iron takes a list of numbers"),
        (
            "humble",
            "circle",
            "limit",
            "radius: 1.0",
            "the action limit, which humble does not have",
        ),
        (
            "iron",
            "velocity_polygon",
            "stop",
            "radius: 1.0",
            "a velocity_polygon, which iron does not have",
        ),
        ("jazzy", "PolygonStop", "stop", "radius: 1.0", "a PolygonStop, which jazzy does not have"),
    ],
)
def test_a_collision_monitor_that_the_release_cannot_start_is_not_there(
    read_as, release, kind, action, rest, reason
):
    setup = read_as(release, "collision_monitor", ZONE % (kind, action, rest))
    assert setup.robot.navigation.collision_monitor is None
    row = row_of(setup, "polygons")
    assert row.status == Status.STAND_IN
    assert reason in row.remark


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        # More than any scan has, so that the shape never acts: 6e9 - 2**32.
        (6_000_000_000, 1_705_032_704),
        (2**32 + 7, 7),
        (2**31 - 1, 2**31 - 1),
    ],
)
def test_of_many_points_the_last_32_bits_count_as_in_nav2(read_as, given, kept):
    text = ZONE % ("circle", "stop", f"radius: 0.6, min_points: {given}")
    setup = read_as("jazzy", "collision_monitor", text)
    assert setup.robot.navigation.collision_monitor.polygons["Z"].min_points == kept
    row = row_of(setup, "Z.min_points")
    assert row.status == (Status.USED if given == kept else Status.OTHER_FORM)


@pytest.mark.parametrize("release", ["jazzy", "kilted", "lyrical"])
def test_since_jazzy_corners_are_a_text_and_a_list_is_told(read_as, release):
    def corners(points):
        text = ZONE % ("polygon", "stop", f"points: {points}")
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.points[0], row_of(setup, "Z.points").status

    assert corners(CORNERS) == ((0.5, 0.4), Status.USED)
    assert corners(NUMBERS) == ((0.5, 0.4), Status.OTHER_FORM)


def test_what_approaches_in_humble_is_the_robot_whatever_its_corners(read_as):
    def points(release):
        text = ZONE % ("polygon", "approach", f"points: {NUMBERS}")
        setup = read_as(release, "collision_monitor", text)
        zone = setup.robot.navigation.collision_monitor.polygons["Z"]
        return zone.points and zone.points[0], row_of(setup, "Z.points").status

    assert points("humble") == (None, Status.UNREAD)
    assert points("iron") == ((0.5, 0.4), Status.USED)


WATCHED = (
    "observation_sources: [scan, cloud, left], scan: {type: scan}, cloud: {type: pointcloud}, "
    "left: {type: range, topic: sonar_left}, polygons: [Z], "
    "Z: {type: circle, radius: 0.6, action_type: stop, sources_names: %s}"
)


def test_a_shape_looks_at_its_own_sources_since_jazzy(read_as):
    def own(release, names):
        setup = read_as(release, "collision_monitor", WATCHED % names)
        monitor = setup.robot.navigation.collision_monitor
        zone = monitor and monitor.polygons["Z"].sources_names
        return zone, row_of(setup, "Z.sources_names").status

    # The robot has no sensor for the cloud and the range; its lidar stands for them.
    assert own("jazzy", "[cloud, scan]") == (("scan",), Status.OTHER_FORM)
    assert own("lyrical", "[scan]") == (("scan",), Status.USED)
    assert own("iron", "[scan]") == (None, Status.UNREAD)
    # Nav2's monitor refuses to start with a source that it does not have.
    assert own("kilted", "[radar]") == (None, Status.NO_MEANING)


@pytest.mark.parametrize("block", ["backup", "drive_on_heading"])
@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("", [(None, None, 0.0)] * 3 + [(2.5, -2.5, 0.1)] * 2),
        (
            "acceleration_limit: 1.0, deceleration_limit: -2.0, minimum_speed: 0.2",
            [(1.0, -2.0, 0.2), *2 * [(None, None, 0.0)], *2 * [(1.0, -2.0, 0.2)]],
        ),
    ],
)
def test_iron_and_jazzy_drive_straight_without_a_ramp_and_humble_if_it_is_given(
    read_as, block, given, expected
):
    def limits(release):
        setup = read_as(release, "behavior_server", f"{block}: {{{given}}}")
        found = getattr(setup.robot.navigation.behavior_server, block)
        return found.acceleration_limit, found.deceleration_limit, found.minimum_speed

    assert of_each(limits) == expected


@pytest.mark.parametrize(
    ("limit", "found"), [("acceleration_limit: 1.0", None), ("deceleration_limit: -1.0", None)]
)
def test_in_humble_one_limit_without_the_other_is_none(read_as, limit, found):
    setup = read_as("humble", "behavior_server", f"backup: {{{limit}, minimum_speed: 0.02}}")
    backup = setup.robot.navigation.behavior_server.backup
    assert (backup.acceleration_limit, backup.deceleration_limit) == (found, found)
    assert backup.minimum_speed == 0.02


def test_without_a_behavior_server_in_the_file_the_robots_own_drives_as_the_release(read_as):
    def limits(release):
        setup = read_as(release, "waypoint_follower", "stop_on_failure: true")
        backup = setup.robot.navigation.behavior_server.backup
        return backup.acceleration_limit, backup.minimum_speed

    own = WHEELCHAIR.navigation.behavior_server.backup
    ours = (own.acceleration_limit, own.minimum_speed)
    assert of_each(limits) == [*3 * [(None, 0.0)], ours, ours]


def test_an_exclusion_zone_that_is_enabled_is_told(read_as):
    def status(release, enabled):
        text = (
            "observation_sources: [scan], scan: {type: scan, exclusion_zones: [dock]}, "
            f"dock: {{enabled: {enabled}, type: circle, radius: 0.5}}, polygons: [Z], "
            "Z: {type: circle, radius: 0.6, action_type: stop}"
        )
        return row_of(read_as(release, "collision_monitor", text), "dock").status

    assert status("lyrical", "true") == Status.STAND_IN
    assert status("lyrical", "false") == Status.NO_MEANING
    assert status("kilted", "true") == Status.UNREAD


@pytest.mark.parametrize(
    ("node", "parameter"),
    [
        ("controller_server", "search_window"),
        ("behavior_server", "projection_time"),
        ("behavior_server", "simulation_time_step"),
        ("bt_navigator", "allow_navigator_preemption"),
        ("bt_navigator", "navigator_preemption_timeout"),
        ("bt_navigator", "bt_log_idle_transitions"),
        ("bt_navigator", "waypoint_statuses_blackboard_id"),
    ],
)
def test_what_lyrical_reads_without_an_effect_here_is_not_called_unknown(read_as, node, parameter):
    setup = read_as("lyrical", node, f"{parameter}: 0.0")
    assert row_of(setup, parameter).status == Status.NO_MEANING


SHIM_OF_RPP = f"{SHIM!r}, primary_controller: {RPP!r}"
DWB_WITH_CRITIC = f"{DWB!r}, critics: [PathDist]"
MPPI_WITH_CRITIC = f"{MPPI!r}, critics: [GoalAngleCritic]"


@pytest.mark.parametrize(
    ("plugin", "parameter", "value", "not_by"),
    [
        (SHIM_OF_RPP, "max_cost_threshold", "100.0", {"humble", "iron", "kilted"}),
        (SHIM_OF_RPP, "rotate_to_heading_once", "true", {"humble", "iron"}),
        (SHIM_OF_RPP, "use_path_orientations", "true", {"humble", "iron"}),
        (SHIM_OF_RPP, "closed_loop", "false", {"iron"}),
        (DWB_WITH_CRITIC, "limit_vel_cmd_in_traj", "true", {"iron"}),
        (DWB_WITH_CRITIC, "prune_plan", "false", {"lyrical"}),
        (MPPI_WITH_CRITIC, "publish_critics_stats", "true", {"humble", "iron", "jazzy", "lyrical"}),
        (MPPI_WITH_CRITIC, "GoalAngleCritic.symmetric_yaw_tolerance", "true", {"iron"}),
    ],
)
def test_a_controllers_parameter_is_told_where_its_release_does_not_read_it(
    read_as, plugin, parameter, value, not_by
):
    def is_unread(release):
        of_plugin = f"plugin: {plugin}, {parameter}: {value}"
        setup = read_as(release, "controller_server", "controller_frequency: 20.0", of_plugin)
        return row_of(setup, f"F.{parameter}").status == Status.UNREAD

    assert {release for release in ALL if is_unread(release)} == not_by


def test_only_iron_drives_as_if_a_parameter_were_not_given_that_it_does_not_read():
    def dwb(release):
        limited = {"critics": ["PathDist"], "limit_vel_cmd_in_traj": True}
        model = CONTROLLERS.load("dwb").Parameters
        return model(**limited, nav2_release=release).as_read().limit_vel_cmd_in_traj

    def mppi(release):
        symmetric = {"GoalAngleCritic": {"symmetric_yaw_tolerance": True}}
        model = CONTROLLERS.load("mppi").Parameters
        given = model(critics=["GoalAngleCritic"], **symmetric, nav2_release=release)
        return given.as_read().critic("GoalAngleCritic").symmetric_yaw_tolerance

    assert of_each(dwb) == of_each(mppi) == [True, False, True, True, True]


def test_a_custom_inscribed_radius_counts_in_lyrical_and_threads_nowhere(read_as):
    layer = (
        "plugins: [inflate], inflate: {plugin: 'nav2_costmap_2d::InflationLayer', "
        "custom_inscribed_radius: 0.2, num_threads: 2}"
    )

    def read(release):
        setup = read_as(release, "local_costmap/local_costmap", layer)
        radius = row_of(setup, "inflate.custom_inscribed_radius").status
        return radius, row_of(setup, "inflate.num_threads").status

    assert read("lyrical") == (Status.USED, Status.NO_MEANING)
    assert read("kilted")[0] == Status.UNREAD


@pytest.mark.parametrize(
    "plugin", ["SmacPlanner2D", "SmacPlannerHybrid", "ThetaStarPlanner", "Unknown"]
)
def test_a_planner_has_the_rules_of_the_files_release(plugin, read_as):
    package = "nav2_theta_star_planner" if plugin.startswith("Theta") else "nav2_smac_planner"

    def rules(release):
        text = f"planner_plugins: [P], P: {{plugin: '{package}::{plugin}'}}"
        planner = read_as(release, "planner_server", text).robot.navigation.planner
        refinements = getattr(planner, "smoother", None) and planner.smoother.refinement_num
        return planner.nav2_release, refinements

    refinements = {"ThetaStarPlanner": [None] * 5, "Unknown": [2] * 5}.get(plugin, [4, 2, 2, 2, 2])
    assert of_each(rules) == list(zip(ALL, refinements, strict=True))


def test_the_controller_server_has_the_order_of_the_files_release(read_as):
    def tests_goal_first(release):
        setups = (
            read_as(release, "controller_server", "controller_frequency: 20.0"),
            read_as(release, "planner_server", "planner_plugins: [P], P: {plugin: 'a::B'}"),
        )
        return {setup.robot.navigation.controller_server.tests_goal_first for setup in setups}

    assert of_each(tests_goal_first) == [{False}, {False}, {True}, {False}, {True}]


@pytest.mark.parametrize(("given", "corners"), [("6", 8), ("4", 4), ("0", 8)])
def test_theta_star_looks_at_four_or_eight_neighbours_whatever_is_given(given, corners, read_as):
    text = (
        "planner_plugins: [P], P: {plugin: 'nav2_theta_star_planner::ThetaStarPlanner', "
        f"how_many_corners: {given}}}"
    )
    setup = read_as("jazzy", "planner_server", text)
    assert setup.robot.navigation.planner.how_many_corners == corners
    status = Status.USED if corners == int(given) else Status.OTHER_FORM
    assert row_of(setup, "P.how_many_corners").status == status
