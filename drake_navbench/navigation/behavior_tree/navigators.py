"""The trees of Nav2's navigators: by default navigate_..._w_replanning_and_recovery of a release.

The XML files are in default_trees/, a folder a navigator, a file a release. Nav2's other trees that
follow a path are in named_trees/, a folder each, a file for its release and later ones. A variable
in a file takes the value of the setting of its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.builder import build_tree
from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
    NodeDescription,
)
from drake_navbench.navigation.behavior_tree.leaves import Leaf, RunBehavior
from drake_navbench.navigation.behavior_tree.settings import (
    NAVIGATOR_OF,
    RECOVERY_ACTIONS,
    TREE_NODES,
    BehaviorTreeSettings,
)
from drake_navbench.navigation.behavior_tree.snapshot import nodes_of
from drake_navbench.navigation.behavior_tree.tree_file import read_tree_file
from drake_navbench.navigation.behavior_tree.tree_node import ControlNode, TreeNode
from drake_navbench.plugins.releases import Release

FOLDER = Path(__file__).parent / "default_trees"
NAMED_FOLDER = Path(__file__).parent / "named_trees"
# Releases that have the files of an earlier one.
FILES: Mapping[str, Mapping[Release, Release]] = {
    NAVIGATE_TO_POSE: {Release.JAZZY: Release.IRON, Release.KILTED: Release.IRON},
    NAVIGATE_THROUGH_POSES: {Release.IRON: Release.HUMBLE, Release.KILTED: Release.JAZZY},
}
# The children of this node are the recovery actions, in the order of RECOVERY_ACTIONS.
ACTIONS_NODE = "RecoveryActions"


def navigator_tree(
    board: Board, settings: BehaviorTreeSettings, navigator: str = NAVIGATE_TO_POSE
) -> TreeNode:
    """Returns the root of the tree that settings choose; its leaves read and write `board`.

    Raises InputError where a node that is not built in cannot be made, or has no place in the tree
    of any navigator.
    """
    root = build_tree(_description(settings, navigator), board, navigator)
    leaves = {node.name: node for node in nodes_of(root) if isinstance(node, Leaf)}
    for name in (*settings.plugin_blocks, *_other_actions(settings)):
        if name in leaves:
            parent = leaves[name].parent
            assert isinstance(parent, ControlNode)  # Every leaf has one.
            parent.replace_child(leaves[name], _own_node(name, board, settings))
        elif name not in (*settings.recovery_actions, *_leaves_of_others(settings, navigator)):
            raise InputError(
                f"navigation.behavior_tree.{name}: nothing runs it; expected its name in "
                f"recovery_actions, or the name of a leaf{nearest_name_hint(name, leaves)}"
            )
    return root


def _description(settings: BehaviorTreeSettings, navigator: str) -> NodeDescription:
    """Returns the tree of a navigator: the settings' own, else the default one."""
    own = next(getattr(settings, field) for field, of in NAVIGATOR_OF.items() if of == navigator)
    return own or default_tree(settings, navigator)


def _leaves_of_others(settings: BehaviorTreeSettings, navigator: str) -> list[str]:
    """Returns the names of the leaves in the trees of the other navigators."""
    trees = [_description(settings, of) for of in NAVIGATOR_OF.values() if of != navigator]
    nodes = [node for tree in trees for node in tree.iterate()]
    return [node.name or node.node for node in nodes if not node.children]


def default_tree(
    settings: BehaviorTreeSettings, navigator: str = NAVIGATE_TO_POSE
) -> NodeDescription:
    """Returns a navigator's default tree of the settings' release, with their values and actions.

    A recovery action that is not in the file is a leaf of its name, to be replaced.
    """
    release = settings.nav2_release
    file = FOLDER / navigator / f"{FILES[navigator].get(release, release)}.xml"
    return _with_actions(_read(file, _values(settings)), settings)


def named_tree(file_name: str, settings: BehaviorTreeSettings) -> NodeDescription | None:
    """Returns the tree that Nav2 has in a file, in the settings' release; None without one."""
    folder = NAMED_FOLDER / file_name.removesuffix(".xml")
    files = [folder / f"{release}.xml" for release in Release if release <= settings.nav2_release]
    found = [file for file in files if file_name.endswith(".xml") and file.is_file()]
    return _read(found[-1], _values(settings)) if found else None


def _values(settings: BehaviorTreeSettings) -> tuple[tuple[str, str], ...]:
    """Returns the values of the variables in our files, by name."""
    names = sorted(BehaviorTreeSettings.model_fields.keys() - {*NAVIGATOR_OF, "recovery_actions"})
    return tuple((name, str(getattr(settings, name))) for name in names)


@cache
def _read(file: Path, values: tuple[tuple[str, str], ...]) -> NodeDescription:
    return read_tree_file(file, dict(values))


def _with_actions(node: NodeDescription, settings: BehaviorTreeSettings) -> NodeDescription:
    children = tuple(_with_actions(child, settings) for child in node.children)
    if node.name == ACTIONS_NODE:
        others = {
            name: NodeDescription(node="Wait", name=name)
            for name in (*settings.plugin_blocks, *_other_actions(settings))
        }
        actions = dict(zip(RECOVERY_ACTIONS, children, strict=True)) | others
        children = tuple(actions[name] for name in settings.recovery_actions)
    return node.model_copy(update={"children": children})


def _other_actions(settings: BehaviorTreeSettings) -> list[str]:
    """Returns the recovery actions that are behaviours of their names, run by no node of Nav2's."""
    known = {*RECOVERY_ACTIONS, *settings.plugin_blocks}
    return [name for name in settings.recovery_actions if name not in known]


def _own_node(name: str, board: Board, settings: BehaviorTreeSettings) -> TreeNode:
    parameters = settings.plugin_blocks.get(name)
    if parameters is None:
        arguments = {"time_allowance": settings.time_allowance}
        return RunBehavior(name, board, behavior=name, arguments=arguments)
    return TREE_NODES.make(parameters.plugin, name, board, parameters)
