"""What a release of Nav2 does not read has no effect and is told; its own defaults count."""

from __future__ import annotations

import json

import pytest
from nav2_texts import ALL, DWB, MPPI, RPP, SHIM, WHEELCHAIR, of_each, row_of
from pydantic import BaseModel

from drake_navbench.controller import CONTROLLERS
from drake_navbench.inputs.check import Status
from drake_navbench.nav2.release import SINCE, UNTIL
from drake_navbench.navigation.smoother_parameters import SimpleSmootherParameters
from drake_navbench.plugins.releases import Release, read_by


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


def test_the_controller_server_has_the_order_of_the_files_release(read_as):
    def tests_goal_first(release):
        setups = (
            read_as(release, "controller_server", "controller_frequency: 20.0"),
            read_as(release, "planner_server", "planner_plugins: [P], P: {plugin: 'a::B'}"),
        )
        return {setup.robot.navigation.controller_server.tests_goal_first for setup in setups}

    assert of_each(tests_goal_first) == [{False}, {False}, {True}, {False}, {True}]
