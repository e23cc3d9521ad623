"""The default tree of each release, a file each, with the values and actions of the settings."""

from __future__ import annotations

import pytest

from drake_navbench.navigation.behavior_tree.builder import faults_of
from drake_navbench.navigation.behavior_tree.navigators import FOLDER, default_tree
from drake_navbench.navigation.behavior_tree.settings import BehaviorTreeSettings
from drake_navbench.plugins.releases import Release


def names_of(navigator="navigate_to_pose", **settings):
    """Returns the names of the default tree's nodes, their types where they have none."""
    tree = default_tree(BehaviorTreeSettings(**settings), navigator)
    assert not list(faults_of(tree, navigator))
    return [node.name or node.node for node in tree.iterate()]


@pytest.mark.parametrize("release", Release)
def test_the_tree_of_a_release_has_what_came_with_it(release):
    names = names_of(nav2_release=release)
    assert ("WouldARecoveryHelp" in names) is (release > Release.HUMBLE)
    assert ("CheckIfNewPathNeeded" in names) is (release is Release.LYRICAL)
    assert names.count("ClearEntireCostmap") == 0  # Each has a name of its own in the log.


@pytest.mark.parametrize("release", Release)
def test_the_tree_through_poses_of_a_release_has_what_came_with_it(release):
    names = names_of("navigate_through_poses", nav2_release=release)
    assert names.index("RemovePassedGoals") + 1 == names.index("ComputePathThroughPoses")
    assert ("WouldARecoveryHelp" in names) is (release > Release.IRON)
    assert ("CheckIfNewPathNeeded" in names) is (release is Release.LYRICAL)


def test_every_file_is_some_releases_tree():
    files = {str(path.relative_to(FOLDER).with_suffix("")) for path in FOLDER.rglob("*.xml")}
    of_pose = {f"navigate_to_pose/{name}" for name in ("humble", "iron", "lyrical")}
    assert files == of_pose | {
        f"navigate_through_poses/{name}" for name in ("humble", "jazzy", "lyrical")
    }


def test_the_recovery_actions_are_those_of_the_settings_in_their_order():
    names = names_of(recovery_actions=["wait", "shuffle", "clear"])
    actions = names[names.index("RecoveryActions") + 1 :]
    assert actions == [
        "Wait",
        "shuffle",
        "ClearingActions",
        "ClearLocalCostmap-Subtree",
        "ClearGlobalCostmap-Subtree",
    ]


def test_the_values_of_the_settings_stand_in_the_tree():
    tree = default_tree(BehaviorTreeSettings(hz=2.5, spin_dist=0.1))
    attributes = {node.node: node.attributes for node in tree.iterate()}
    assert attributes["RateController"] == {"hz": "2.5"}
    tree = default_tree(
        BehaviorTreeSettings(through_poses_hz=2.0, through_poses_radius=0.4),
        "navigate_through_poses",
    )
    through = {node.node: node.attributes for node in tree.iterate()}
    assert through["RateController"] == {"hz": "2.0"}
    assert through["RemovePassedGoals"] == {"radius": "0.4"}
    assert attributes["Spin"] == {"spin_dist": "0.1", "time_allowance": "10.0"}
