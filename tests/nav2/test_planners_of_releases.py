"""Planners and costmaps by the rules of the file's release."""

from __future__ import annotations

import pytest
from nav2_setups import read_nav2_files
from nav2_texts import ALL, WHEELCHAIR, of_each, row_of

from drake_navbench.inputs.check import Status
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.plugins.releases import Release


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
