"""The names that a release of Nav2 loads."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from drake_navbench.nav2.loadable import (
    NODES_SINCE,
    fault_of_class,
    fault_of_tree_node,
    faults_of_libraries,
    loadable_name,
)
from drake_navbench.plugins.releases import Release


@pytest.mark.parametrize(
    ("name", "release", "right"),
    [
        ("nav2_navfn_planner/NavfnPlanner", Release.JAZZY, "nav2_navfn_planner::NavfnPlanner"),
        ("nav2_navfn_planner::NavfnPlanner", Release.IRON, "nav2_navfn_planner/NavfnPlanner"),
        ("nav2_recoveries/Spin", Release.HUMBLE, "nav2_behaviors/Spin"),
        ("nav2_recoveries/Spin", Release.KILTED, "nav2_behaviors::Spin"),
        ("differential", Release.HUMBLE, "nav2_amcl::DifferentialMotionModel"),
        ("nav2_costmap_2d/VoxelLayer", Release.HUMBLE, "nav2_costmap_2d::VoxelLayer"),
        # This one has a slash in every release.
        (
            "nav2_constrained_smoother::ConstrainedSmoother",
            Release.LYRICAL,
            "nav2_constrained_smoother/ConstrainedSmoother",
        ),
        # What is not Nav2's keeps its name.
        ("mine/Planner", Release.JAZZY, "mine/Planner"),
        ("nav2_behaviors/Dance", Release.JAZZY, "nav2_behaviors/Dance"),
    ],
)
def test_a_plugin_is_spelled_as_its_release_loads_it(name, release, right):
    assert loadable_name(name, release) == right
    assert loadable_name(right, release) == right


def test_from_jazzy_on_a_listed_library_of_nav2_is_loaded_twice():
    spin = "nav2_spin_action_bt_node"
    assert faults_of_libraries([spin], Release.IRON) == {}
    assert "loads by itself" in faults_of_libraries([spin], Release.JAZZY)[spin]
    assert "twice" in faults_of_libraries([spin, spin], Release.HUMBLE)[spin]


def test_a_library_may_come_with_a_later_release_or_with_none():
    faults = faults_of_libraries(
        ["nav2_are_error_codes_active_condition_bt_node", "nav2_cancel_spin_action_bt_node"],
        Release.HUMBLE,
    )
    assert list(faults.values()) == [
        "exists from iron on, not in humble",
        "exists in no release of Nav2",
    ]


def test_a_robots_own_library_is_no_fault_even_if_its_name_begins_with_nav2():
    own = ["nav2_escape_action_bt_node", "cabot_check_path_bt_node"]
    assert not any(faults_of_libraries(own, release) for release in Release)


def test_all_libraries_of_nav2_are_known_once():
    # Counted in nav2_behavior_tree/CMakeLists.txt of lyrical, without those that went before.
    assert len(NODES_SINCE) > 70
    assert NODES_SINCE["nav2_path_expiring_timer_condition"] is Release.HUMBLE


@pytest.mark.parametrize(
    ("name", "release", "fault"),
    [
        (
            "nav2_costmap_2d::LegacyInflationLayer",
            Release.HUMBLE,
            "exists from lyrical on, not in humble",
        ),
        ("nav2_costmap_2d::LegacyInflationLayer", Release.LYRICAL, ""),
        (
            "nav2_costmap_2d/PluginContainerLayer",
            Release.IRON,
            "exists from jazzy on, not in iron",
        ),
        # It came to Humble after Iron had ended.
        ("nav2_graceful_controller::GracefulController", Release.HUMBLE, ""),
        (
            "nav2_graceful_controller::GracefulController",
            Release.IRON,
            "does not exist in iron",
        ),
        ("nav2_recoveries/Spin", Release.HUMBLE, ""),
        ("mine::Layer", Release.HUMBLE, ""),
    ],
)
def test_a_class_that_a_release_lacks_is_told(name, release, fault):
    assert fault_of_class(name, release) == fault


def test_tree_nodes_are_those_of_the_page_of_plugins():
    page = yaml.safe_load((Path(__file__).parents[2] / "docs" / "nav2_plugins.yaml").read_text())
    kinds = [kind for kind in page["kinds"] if kind["kind"].endswith("of behaviour trees")]
    nodes = [node for kind in kinds for node in kind["plugins"]]
    assert len(nodes) > 70
    for node in nodes:
        since, until = Release(node.get("since", "humble")), Release(node.get("until", "lyrical"))
        for release in Release:
            is_there = since <= release <= until and release not in node.get("but", ())
            fault = fault_of_tree_node(node["type"], release)
            assert (fault == "") == is_there, (node["type"], release, fault)
