"""Faults that the file itself proves: they come first for the symptoms that they cause."""

from __future__ import annotations

from dataclasses import replace

import pytest
from doctor_texts import DWB, DWB_BLOCK, MPPI, MPPI_BLOCK, RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import told_with_step
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.reading import findings_of, suspicions_of
from drake_navbench.studies.doctor.rules import sources, startup
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.told import (
    told_cures,
    told_of_reading,
    without_repeated_cures,
)

OWN = {rule.name for module in (startup, sources) for rule in module.RULES}


@pytest.fixture
def facts(tmp_path):
    def of(release="jazzy", block=RPP_BLOCK, plugin=RPP, **nodes):
        path = tmp_path / "nav2.yaml"
        path.write_text(nav2_text(block, plugin=plugin, **nodes))
        return Patient((path,), "wheelchair", {}, release=release).facts()

    return of


def fired(facts):
    return {f.rule.name: f.seen for f in findings_of(facts) if f.rule.name in OWN}


def first(facts, symptom):
    return suspicions_of(facts, symptom)[0].cause.told


def scan(**changed):
    source = {"topic": "/scan", "max_obstacle_height": 2.0, "marking": True, "clearing": True}
    source |= changed
    return {
        "obstacle_layer": {
            "plugin": "nav2_costmap_2d::ObstacleLayer",
            "observation_sources": "scan",
            "scan": {name: value for name, value in source.items() if value is not None},
        }
    }


def test_a_sound_file_has_no_such_fault_in_any_release(facts):
    for release in ("humble", "iron", "jazzy", "kilted", "lyrical"):
        assert fired(facts(release)) == {}, release


def test_a_planner_spelled_for_another_release_comes_first(facts):
    planner = {"planner_plugins": ["GridBased"], "GridBased": {}}
    planner["GridBased"]["plugin"] = "nav2_navfn_planner/NavfnPlanner"
    assert fired(facts("iron", planner_server=planner)) == {}
    wrong = facts("jazzy", planner_server=planner)
    for symptom in (Symptom.NO_START, Symptom.PLANNER_FAILS):
        assert first(wrong, symptom) == "set planner.plugin to nav2_navfn_planner::NavfnPlanner"


OLD = {"recovery_plugins": ["spin"], "spin": {"plugin": "nav2_recoveries/Spin"}}


@pytest.fixture
def galactic(tmp_path):
    def of(**nodes):
        path = tmp_path / "nav2.yaml"
        text = nav2_text(RPP_BLOCK, plugin=RPP, recoveries_server=OLD, **nodes)
        text = text.replace("progress_checker_plugins:", "goal_checker_plugin:")
        path.write_text(text)
        return Patient((path,), "wheelchair", {}).facts()

    return of


def test_a_name_that_only_galactic_knows_is_no_fault_of_a_file_for_galactic(facts, galactic):
    amcl = {"robot_model_type": "differential"}
    assert (
        "nav2_amcl::DifferentialMotionModel" in fired(facts("humble", amcl=amcl))["not-loaded-amcl"]
    )
    assert fired(galactic(amcl=amcl)) == {}


def test_a_file_older_than_humble_is_told_as_such_and_its_own_names_are_no_fault(galactic):
    found = galactic()
    assert found.mark == (
        "the oldest release known here; goal_checker_plugin shows that the file is of an older one"
    )
    seen = {f.rule.name: f.seen for f in findings_of(found)}
    assert "controller-parameters-not-read" not in seen
    assert "on Humble and newer it is called behavior_server" in seen["recoveries-server"]


def test_a_node_that_came_with_humble_makes_a_file_with_old_names_one_for_humble(galactic):
    found = galactic(velocity_smoother={"smoothing_frequency": 20.0})
    assert found.mark == "recognised by velocity_smoother"
    seen = {f.rule.name: f.seen for f in findings_of(found)}
    assert "goal_checker_plugin" in seen["controller-parameters-not-read"]


def test_humble_has_no_navigators_to_load(facts):
    navigator = {"navigate_to_pose": {"plugin": "nav2_bt_navigator::NavigateToPoseNavigator"}}
    assert "not-loaded-bt_navigator" not in fired(facts("humble", bt_navigator=navigator))
    assert "not-loaded-bt_navigator" in fired(facts("iron", bt_navigator=navigator))


def test_a_class_that_only_another_release_has_is_found(facts):
    layer = {"plugin": "nav2_costmap_2d::LegacyInflationLayer"}
    costmap = {"local_costmap": {"plugins": ["inflation_layer"], "inflation_layer": layer}}
    rule = "class-of-another-release-local_costmap"
    assert "exists from lyrical on, not in humble" in fired(facts("humble", **costmap))[rule]
    assert rule not in fired(facts("lyrical", **costmap))


def test_a_class_in_a_block_that_nothing_lists_is_no_fault(facts):
    layer = {"plugin": "nav2_costmap_2d::LegacyInflationLayer"}
    costmap = {"local_costmap": {"plugins": [], "inflation_layer": layer}}
    assert "class-of-another-release-local_costmap" not in fired(facts("humble", **costmap))


def test_a_layer_with_a_slash_is_loaded_by_no_release(facts):
    layer = {"plugin": "nav2_costmap_2d/InflationLayer"}
    costmap = {"local_costmap": {"plugins": ["inflation_layer"], "inflation_layer": layer}}
    told = "nav2_costmap_2d/InflationLayer (humble knows it as nav2_costmap_2d::InflationLayer)"
    assert told in fired(facts("humble", **costmap))["not-loaded-local_costmap"]


def test_a_library_that_the_navigator_loads_itself_is_found(facts):
    navigator = {"plugin_lib_names": ["nav2_spin_action_bt_node", "my_own_bt_node"]}
    found = facts("jazzy", bt_navigator=navigator)
    assert "nav2_spin_action_bt_node" in fired(found)["libraries-not-loaded"]
    assert first(found, Symptom.NO_START) == "check and correct bt_navigator.plugin_lib_names"


def test_a_listed_plugin_needs_a_block_with_its_type(facts, tmp_path, capsys):
    """The reader refuses such a file; the rule finds it nevertheless."""
    found = facts("jazzy", planner_server={"planner_plugins": ["Mine"]})
    assert (
        "planner_server does not start"
        in fired(found)["listed-without-a-type-planner_server-planner_plugins"]
    )
    assert found.left_out
    main([str(tmp_path / "nav2.yaml"), "--robot", "wheelchair", "--read-only"])
    assert "planner_server does not start" in capsys.readouterr().out


def test_a_collision_monitor_needs_polygons_with_types_and_sources(facts):
    monitor = {"polygons": ["Stop"], "observation_sources": ["scan"], "scan": {"type": "scan"}}
    whole = monitor | {"Stop": {"type": "polygon", "points": "[[0.5,0.5],[0.5,-0.5],[0.0,0.0]]"}}
    whole["Stop"]["action_type"] = "stop"
    assert "monitor-without-zones" not in fired(facts(collision_monitor=whole))
    assert "Stop.type" in fired(facts(collision_monitor=monitor))["monitor-without-zones"]
    del monitor["observation_sources"]
    told = fired(facts(collision_monitor=monitor))["monitor-without-zones"]
    assert "Stop.type: it does not start" in told
    # Up to Iron nav2_bringup starts none.
    older = fired(facts(collision_monitor=monitor, release="humble"))["monitor-without-zones"]
    assert "Stop.type: where a launch file of yours starts it, it does not start" in older


def test_polygons_that_are_no_names_are_refused_and_make_no_further_finding(facts):
    found = facts(collision_monitor={"polygons": [{"name": "Stop"}], "observation_sources": ["s"]})
    assert "polygons: expected a list of names" in found.left_out[0]
    assert "monitor-without-zones" not in fired(found)


def test_an_initial_pose_counts_only_where_it_is_switched_on(facts):
    pose = {"initial_pose": {"x": 0.0, "y": 0.0, "z": 0.0, "yaw": 0.0}}
    told = "set amcl.set_initial_pose to true"
    causes = [s.cause.told for s in suspicions_of(facts(amcl=pose), Symptom.NO_START)]
    assert causes[0] == told
    on = pose | {"set_initial_pose": True}
    assert told not in [s.cause.told for s in suspicions_of(facts(amcl=on), Symptom.NO_START)]


def test_a_block_that_no_source_is_called_after_is_the_one_finding_about_the_source(facts):
    """The defaults of the source without a block are its consequence, and no further findings."""
    layers = scan(topic="scan")
    layers["obstacle_layer"]["observation_sources"] = "front_scan"
    seen = fired(facts(local_costmap=layers))
    assert list(seen) == ["source-without-a-block-local_costmap"]
    assert seen["source-without-a-block-local_costmap"].startswith(
        "local_costmap.obstacle_layer.observation_sources names front_scan, but the block below it "
        "is called scan: nothing reads the block"
    )


def test_what_the_file_proves_is_told_before_what_is_merely_poor(facts):
    layers = scan() | {"update_frequency": 0.0}
    found = facts(block=DWB_BLOCK | {"sim_time": 4.0}, plugin=DWB, local_costmap=layers)
    names = [finding.rule.name for finding in findings_of(found)]
    assert names.index("never-updated-local_costmap") < names.index("dwb-looks-a-long-way")


def test_a_source_without_a_height_sees_nothing_above_the_floor(facts):
    found = facts(local_costmap=scan(max_obstacle_height=None))
    assert fired(found)["source-below-the-floor-local_costmap"] == (
        "max_obstacle_height of local_costmap.obstacle_layer.scan is 0 m, Nav2's default where "
        "none is given: the layer drops every point above the floor"
    )
    low = facts(local_costmap=scan(max_obstacle_height=0.2, min_obstacle_height=0.3))
    assert (
        "every point, as min_obstacle_height is 0.3 m"
        in (fired(low)["source-below-the-floor-local_costmap"])
    )


def test_of_two_findings_with_the_same_cure_the_one_with_more_cures_is_printed(facts):
    found = facts(local_costmap=scan(max_obstacle_height=None))
    (more,) = [f for f in findings_of(found) if f.rule.name.startswith("source-below-the-floor-")]
    # Raise max_obstacle_height to 2 m; the whole finding offers to correct the sources as well.
    fewer = replace(more, cures=more.cures[:1])
    assert without_repeated_cures([fewer, more]) == [more]
    assert without_repeated_cures([more, more]) == [more]
    assert without_repeated_cures([fewer]) == [fewer]
    shown = "\n".join(told_of_reading(found, [fewer, more], [], None))
    assert "Findings (1)" in shown
    assert "cure: write max_obstacle_height: 2.0 (m) into the block of this source" in shown


def test_a_source_must_mark_and_one_must_clear(facts):
    assert first(facts(local_costmap=scan(marking=False)), Symptom.IGNORES_OBSTACLES) == (
        "set local_costmap.marking to true"
    )
    # Without a line, clearing is off and marking is on.
    assert first(facts(local_costmap=scan(clearing=None)), Symptom.GHOST_OBSTACLES) == (
        "set local_costmap.clearing to true"
    )
    assert fired(facts(local_costmap=scan(marking=None))) == {}


def test_up_to_jazzy_a_topic_without_a_slash_is_below_the_costmap(facts):
    found = facts("jazzy", local_costmap=scan(topic="scan"))
    assert first(found, Symptom.IGNORES_OBSTACLES) == "set local_costmap.topic to /scan"
    assert fired(facts("kilted", local_costmap=scan(topic="scan"))) == {}


def test_a_costmap_that_is_never_updated_is_found_though_it_is_refused(facts):
    found = facts(local_costmap={"update_frequency": 0.0})
    finding = next(f for f in findings_of(found) if f.rule.name == "never-updated-local_costmap")
    # The refused 0 is left out, so the facts have Nav2's 5 Hz: they name no step from it.
    assert told_cures(finding, found) == "set local_costmap.update_frequency to 5.0 Hz"


def test_single_values_of_a_user_are_enough(tmp_path):
    values = {"planner.plugin": "nav2_navfn_planner/NavfnPlanner"}
    told = first(facts_of_values("DWB", "jazzy", values), Symptom.NO_START)
    assert told == "set planner.plugin to nav2_navfn_planner::NavfnPlanner"
    assert "planner.plugin" not in first(facts_of_values("DWB", "iron", values), Symptom.NO_START)


def test_a_smoother_may_forbid_driving_to_the_side(facts):
    omni = DWB_BLOCK | {"max_vel_y": 0.3, "min_vel_y": -0.3, "vy_samples": 5}
    smoother = {"max_velocity": [0.5, 0.0, 1.0], "min_velocity": [-0.5, 0.0, -1.0]}
    found = facts(block=omni, plugin=DWB, velocity_smoother=smoother)
    assert "0.3 m/s to the side" in str([f.seen for f in findings_of(found)])
    free = facts(block=DWB_BLOCK, plugin=DWB, velocity_smoother=smoother)
    assert "to the side" not in str([f.seen for f in findings_of(free)])


def test_nodes_within_the_parameters_of_another_are_no_nodes(tmp_path):
    """A section for all nodes is none of a collision monitor, which then lacks nothing."""
    path = tmp_path / "nav2.yaml"
    path.write_text(
        "/**:\n  ros__parameters:\n    use_sim_time: true\n    controller_server:\n"
        "      ros__parameters: {controller_plugins: [FollowPath]}\n"
    )
    found = Patient((path,), "wheelchair", {}).facts()
    names = {f.rule.name: f.seen for f in findings_of(found)}
    assert names["nodes-within-parameters"].startswith("controller_server and their")
    assert "monitor-without-zones" not in names


def test_a_footprint_that_nav2_cannot_read_is_not_told_as_missing(facts):
    layers = scan() | {"plugins": ["obstacle_layer"], "footprint": "[[0.5, 0.2], [0.5, -0,2]]"}
    found = facts(local_costmap=layers)
    seen = {f.rule.name: f.seen for f in findings_of(found)}
    assert seen["outline-not-given"].startswith("Nav2 cannot read the local costmap's footprint")


@pytest.mark.parametrize(
    ("speed_mps", "sim_time", "told"),
    [(0.5, 3.0, "long"), (0.25, 3.0, ""), (0.5, 0.8, "short"), (2.0, 0.8, "")],
)
def test_samples_of_dwb_are_long_or_short_by_their_length(facts, speed_mps, sim_time, told):
    """They are 1.5 m, 0.75 m, 0.4 m and 1.6 m long."""
    block = DWB_BLOCK | {"sim_time": sim_time, "max_vel_x": speed_mps, "max_speed_xy": speed_mps}
    names = {f.rule.name for f in findings_of(facts(block=block, plugin=DWB))}
    found = [way for way in ("long", "short") if f"dwb-looks-a-{way}-way" in names]
    assert found == ([told] if told else [])


def test_a_cure_for_an_acceleration_that_the_smoother_cuts_has_its_value(facts):
    smoother = {"max_accel": [0.5, 0.0, 3.2], "max_velocity": [0.5, 0.0, 1.0]}
    block = MPPI_BLOCK | {"ax_max": 3.0}
    found = facts(block=block, plugin=MPPI, velocity_smoother=smoother)
    (cut,) = (f for f in findings_of(found) if f.rule.name == "mppi-faster-than-smoother")
    lower, higher = (cause.to for cause in cut.cures)
    assert (lower, higher) == (0.5, [3.0, 0.0, 3.2])


@pytest.mark.parametrize(("name", "is_old"), [("obstacle_range", 1), ("obstacle_max_range", 0)])
def test_ranges_by_their_old_names_are_told(facts, name, is_old):
    seen = {f.rule.name for f in findings_of(facts(local_costmap=scan(**{name: 8.0})))}
    assert ("ranges-by-their-old-names" in seen) == is_old


def test_a_source_without_a_height_is_told_once_and_by_the_place_where_it_belongs(facts):
    found = facts(local_costmap={"plugins": ["obstacle_layer"], **scan(max_obstacle_height=None)})
    told = [f.rule.name for f in findings_of(found, Symptom.COLLISION)]
    assert "source-below-the-floor-local_costmap" in told
    assert "band-of-heights-misses" not in told
    cause = Cause("local_costmap.max_obstacle_height", Direction.UP, 2.0)
    place = "local_costmap.obstacle_layer.scan.max_obstacle_height"
    assert told_with_step(cause, found) == f"raise {place} to 2.0 m"
    # A height that is given and too low is another matter.
    low = facts(local_costmap={"plugins": ["obstacle_layer"], **scan(max_obstacle_height=0.1)})
    assert "band-of-heights-misses" in [f.rule.name for f in findings_of(low, Symptom.COLLISION)]


def test_a_complaint_in_place_of_a_file_is_told_where_it_goes(tmp_path, capsys):
    (tmp_path / "nav2.yaml").write_text("controller_server: {ros__parameters: {}}\n")
    assert main([str(tmp_path / "nav2.yaml"), "it wobbles", "--read-only"]) == 2
    told = capsys.readouterr().err.strip()
    assert told == "it wobbles: no such file; a complaint in words goes with --symptom"
    with pytest.raises(SystemExit, match="2"):
        main([str(tmp_path / "nav2.yaml"), "--read-only", "it wobbles"])
    assert capsys.readouterr().err.strip() == (
        "drake-navbench doctor: unrecognized arguments: it wobbles; files go before the options, "
        "a complaint in words goes with --symptom"
    )
