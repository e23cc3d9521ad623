"""Reads the behaviour trees that the navigator of a Nav2 file names.

Source: nav2_bt_navigator, branches humble to lyrical.
"""

from __future__ import annotations

from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.nav2.loadable import fault_of_tree_node
from drake_navbench.nav2.node_reader import WITHOUT_MEANING, NodeReader
from drake_navbench.nav2.release import navigation_of
from drake_navbench.nav2.tree_files import installed_tree, tree_beside
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.settings import NAVIGATOR_OF, BehaviorTreeSettings
from drake_navbench.navigation.behavior_tree.tree_file import read_tree_file
from drake_navbench.plugins.releases import Release

Fields = dict[str, Any]

# The parameter that names a tree's file -> the field for the tree. Then its names up to Foxy.
TREE_FILE = "default_nav_to_pose_bt_xml"
TREE_FILES = {TREE_FILE: "tree", "default_nav_through_poses_bt_xml": "through_poses_tree"}
# The tolerance of the nodes GoalReached, m, which Nav2 copies to the node that ticks the tree.
GOAL_TOLERANCE = "goal_reached_tol"
OLD_TREE_FILES = ("default_bt_xml_filename", "bt_xml_filename")
# Names of the default trees in Nav2's releases.
DEFAULT_TREES = {
    "tree": {
        "navigate_w_replanning_and_recovery.xml",
        "navigate_to_pose_w_replanning_and_recovery.xml",
    },
    "through_poses_tree": {"navigate_through_poses_w_replanning_and_recovery.xml"},
}


def read_bt_navigator(reader: NodeReader, release: Release) -> Fields:
    """Returns the navigators' behaviour trees: the default ones, or those of XML files."""
    values = reader.block(BehaviorTreeSettings, names=("bt_loop_duration",))
    for name in TREE_FILES:
        if reader.text(name).rpartition("/")[2]:
            values |= _tree_of(reader, name, release)
    for name in OLD_TREE_FILES:
        if reader.text(name).rpartition("/")[2] in DEFAULT_TREES["tree"]:
            reader.note(Status.NO_MEANING, name)
        elif reader.given(name):
            reader.note(Status.UNREAD, name, f"since galactic {TREE_FILE} is read in its place")
    reader.finish(WITHOUT_MEANING["bt_navigator"])
    return {"behavior_tree": values}


def _tree_of(reader: NodeReader, name: str, release: Release) -> Fields:
    """Returns the tree of an XML file, nothing where it is the default one or cannot be used."""
    named, field = reader.text(name), TREE_FILES[name]
    file_name = named.rpartition("/")[2]
    file = tree_beside(reader.node.parameters[name].file.parent, named)
    if file is None and file_name in DEFAULT_TREES[field]:
        return {}
    if file is None:
        file = installed_tree(file_name, release)
        if file is not None:
            reader.note(Status.OTHER_FORM, name, f"that of the installed Nav2, {file}")
    of_nav2 = _tree_of_nav2(file_name, release) if file is None else None
    if of_nav2 is not None:
        return _used(reader, name, of_nav2)
    if file is None:
        remark = f"{file_name}: not beside the file; Nav2's default tree is used instead"
        reader.note(Status.STAND_IN, name, remark)
        return {}
    try:
        tree = read_tree_file(file)
    except InputError as error:
        reader.note(Status.STAND_IN, name, f"{error}; Nav2's default tree is used instead")
        return {}
    return _used(reader, name, tree)


def _tree_of_nav2(file_name: str, release: Release) -> NodeDescription | None:
    """Returns the tree that Nav2 has in a file of this name; None without one."""
    # Imported late: py_trees takes a while, and few files name a tree.
    from drake_navbench.navigation.behavior_tree.navigators import default_tree, named_tree

    settings = BehaviorTreeSettings(**navigation_of(release)["behavior_tree"])
    if file_name in DEFAULT_TREES["tree"]:
        return default_tree(settings)
    return named_tree(file_name, settings)


def _used(reader: NodeReader, name: str, tree: NodeDescription) -> Fields:
    """Returns the field of a tree; notes its faults, and returns nothing where there are any.

    name: the parameter that names the tree's file.
    """
    # Imported late for the same reason.
    from drake_navbench.navigation.behavior_tree.builder import faults_of, is_for_other_navigator

    field, file_name = TREE_FILES[name], reader.text(name).rpartition("/")[2]
    navigator = NAVIGATOR_OF[field]
    faults = list(faults_of(tree, navigator))
    if faults:
        told = "; ".join(f"line {fault.line}, {fault}" for fault in faults)
        remark = f"{file_name}: {told}; Nav2's default tree is used instead"
        reader.note(Status.STAND_IN, name, remark)
        return {}
    if is_for_other_navigator(tree, navigator):
        tasks = {"tree": "to a single pose", "through_poses_tree": "through poses"}[field]
        remark = f"{file_name} is for the other navigator: no task {tasks} finds a plan"
        reader.note(Status.DOUBTFUL, name, remark)
    _note_absent_nodes(reader, name, tree)
    if any(node.node == "GoalReached" for node in tree.iterate()) and reader.given(GOAL_TOLERANCE):
        tree = _with_goal_tolerance(tree, reader.number(GOAL_TOLERANCE, 0.0))
    return {field: tree.model_dump(mode="json")}


def _with_goal_tolerance(tree: NodeDescription, tolerance_m: float) -> NodeDescription:
    """Returns a tree whose nodes GoalReached have the tolerance as an attribute."""
    attributes = tree.attributes
    if tree.node == "GoalReached":
        attributes = attributes | {GOAL_TOLERANCE: str(tolerance_m)}
    children = tuple(_with_goal_tolerance(child, tolerance_m) for child in tree.children)
    return tree.model_copy(update={"attributes": attributes, "children": children})


def _note_absent_nodes(reader: NodeReader, name: str, tree: NodeDescription) -> None:
    """Notes the nodes of a tree that the release lacks; name: the parameter of the tree's file."""
    found = {node.node: node for node in tree.iterate()}
    faults = {kind: fault_of_tree_node(kind, reader.release) for kind in found}
    told = [f"line {found[kind].line}, {kind} {fault}" for kind, fault in faults.items() if fault]
    if told:
        file_name = reader.text(name).rpartition("/")[2]
        remark = f"{file_name}: {'; '.join(told)}: bt_navigator does not start"
        reader.note(Status.STAND_IN, name, f"{remark}; used here all the same")
