"""The attributes of Nav2's default behaviour trees that a robot file may change."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
    NodeDescription,
)
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginBlocks, PluginParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, before
from drake_navbench.typed_files.quantities import Angle, Count, Duration, Frequency, Length, Speed
from drake_navbench.typed_files.typed_yaml import QuietModel, tuples_for_lists

RECOVERY_ACTIONS = ("clear", "spin", "wait", "backup")
"""The recovery actions that a tree may try, in the order of Nav2's default tree."""

NAVIGATOR_OF = {"tree": NAVIGATE_TO_POSE, "through_poses_tree": NAVIGATE_THROUGH_POSES}
"""The navigator whose tree a field is."""

MILLISECONDS_PER_SECOND = 1e3


def _leaf() -> type:
    # Imported late: py_trees takes a while, and a list of robots ticks no tree.
    from drake_navbench.navigation.behavior_tree.leaves import Leaf

    return Leaf


TREE_NODES = PluginKind(
    noun="behavior-tree node",
    group="drake_navbench.behavior_tree_nodes",
    members=("Parameters", "update"),
    guide="docs/plugins.md",
    base=_leaf,
    parameters=PluginParameters,
)
"""The nodes that are not built in."""


class BehaviorTreeSettings(QuietModel, PluginBlocks):
    """The attributes of Nav2's default trees navigate_..._w_replanning_and_recovery.xml.

    A block under another name, with `plugin`, is a node that is not built in: the recovery action
    of that name, or a node that replaces the tree's leaf of that name.
    """

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        # Values of the releases' default trees and nodes.
        "wrap_around": ReadBy(defaults=before(Release.LYRICAL, True)),
        "backup_speed": ReadBy(defaults=before(Release.JAZZY, 0.05)),
    }

    PLUGINS: ClassVar[PluginKind] = TREE_NODES
    quiet: ClassVar = frozenset({"through_poses_tree", "through_poses_hz", "through_poses_radius"})

    tree: Annotated[NodeDescription | None, BeforeValidator(tuples_for_lists)] = Field(
        None,
        description="Tree in place of the default one of navigate_to_pose; of the fields below, "
        "only nav2_release and bt_loop_duration act on it.",
    )
    through_poses_tree: Annotated[NodeDescription | None, BeforeValidator(tuples_for_lists)] = (
        Field(None, description="Tree that replaces the default one of navigate_through_poses.")
    )
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose default trees and nodes are used: Lyrical's trees keep a "
        "valid path near the goal; Humble's (through poses also Iron's) recover from "
        "every failure, the others where a recovery is useful.",
    )
    recovery_actions: Annotated[tuple[str, ...], BeforeValidator(tuples_for_lists)] = Field(
        RECOVERY_ACTIONS,
        min_length=1,
        description="Recovery actions, tried one after another: names of built-in actions, "
        "behaviours or nodes.",
    )
    number_of_retries: Count = Field(
        6, ge=0, description="Number of successful recoveries after which the navigation gives up."
    )
    wrap_around: bool = Field(
        False,
        description="Start over after the last recovery action; Nav2's default tree gives up.",
    )
    bt_loop_duration: Count | None = Field(
        None,
        ge=1,
        description="Time between two ticks [ms], in Nav2 10; null: the shorter period of "
        "controller server and behaviours, with the same result.",
    )
    hz: Frequency = Field(
        1.0,
        gt=0.0,
        description="Rate at which navigate_to_pose considers a new plan [Hz].",
    )
    through_poses_hz: Frequency = Field(
        0.333,
        gt=0.0,
        description="Rate at which navigate_through_poses takes out passed poses and considers a "
        "new plan [Hz].",
    )
    through_poses_radius: Length = Field(
        0.7,
        ge=0.0,
        description="Distance from a pose at which navigate_through_poses counts it as passed [m].",
    )
    proximity_threshold: Length = Field(
        4.0, ge=0.0, description="Length of the path below which a valid path is kept [m]."
    )
    max_robot_pose_search_dist: Length = Field(
        1.5, gt=0.0, description="Length of the path in which the robot's place is searched [m]."
    )
    spin_dist: Angle = Field(
        1.57, description="Turn of the recovery Spin, positive to the left [rad]."
    )
    wait_duration: Duration = Field(
        5.0, description="Duration of the recovery Wait, in magnitude [s]."
    )
    backup_dist: Length = Field(
        0.30, description="Distance of the recovery BackUp, in magnitude [m]."
    )
    backup_speed: Speed = Field(
        0.15, description="Speed of the recovery BackUp, in magnitude [m/s]."
    )
    time_allowance: Duration = Field(
        10.0, description="Time allowance of Spin and BackUp [s]; 0 or less: none."
    )

    def tick_period_s(self, *server_periods_s: float) -> float:
        """Returns the time between two ticks, s; server_periods_s: of the servers it talks to."""
        if self.bt_loop_duration is None:
            return min(server_periods_s)
        return self.bt_loop_duration / MILLISECONDS_PER_SECOND

    @field_validator("tree", "through_poses_tree")
    @classmethod
    def _check_nodes(
        cls, tree: NodeDescription | None, field: ValidationInfo
    ) -> NodeDescription | None:
        if tree is not None:
            # Imported late for the same reason.
            from drake_navbench.navigation.behavior_tree.builder import faults_of

            for fault in faults_of(tree, NAVIGATOR_OF[str(field.field_name)]):
                raise ValueError(str(fault))
        return tree
