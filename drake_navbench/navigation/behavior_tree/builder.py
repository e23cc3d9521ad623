"""Builds a behaviour tree from its description, where all of its nodes are ours.

The selectors of plugins choose nothing and are left out.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import Any

from drake_navbench.navigation.behavior_tree.board import GOAL, GOALS, Board
from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
    NodeDescription,
)
from drake_navbench.navigation.behavior_tree.node_attributes import (
    Attributes,
    NotOurs,
    Variables,
)
from drake_navbench.navigation.behavior_tree.node_kinds import NODE_KINDS
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode

# These nodes choose among plugins, of which only one is loaded here.
SELECTORS = (
    "ControllerSelector",
    "GoalCheckerSelector",
    "PathHandlerSelector",
    "PlannerSelector",
    "ProgressCheckerSelector",
    "SmootherSelector",
)
# The variable that a navigator writes.
WRITTEN_BY = {NAVIGATE_TO_POSE: GOAL, NAVIGATE_THROUGH_POSES: GOALS}
# Some are spelled like nodes that are here, but are no misspellings of these.
# Source: nav2_behavior_tree, branches humble to lyrical.
MISSING_NODES_OF_NAV2 = frozenset(
    {
        "AreErrorCodesPresent",
        "AssistedTeleop",
        "ClearCostmapAroundPose",
        "ClearCostmapAroundRobot",
        "ClearCostmapExceptRegion",
        "ComputeAndTrackRoute",
        "ComputeRoute",
        "DockRobot",
        "ExtractRouteNodesAsGoals",
        "FollowObject",
        "IsStuck",
        "NavigateThroughPoses",
        "NavigateToPose",
        "PauseResumeController",
        "PersistentSequence",
        "ReinitializeGlobalLocalization",
        "ToggleCollisionMonitor",
        "UndockRobot",
        "WouldARouteRecoveryHelp",
    }
)
# The share of equal letters from which an unknown name is a misspelled one.
MISSPELLED = 0.8


def build_tree(
    description: NodeDescription, board: Board, navigator: str = NAVIGATE_TO_POSE
) -> TreeNode:
    """Returns the root of a navigator's tree whose leaves read and write `board`.

    A tree for the other navigator is built, too: its planner is asked for a goal that nobody wrote,
    and fails, as in Nav2. Raises NotOurs where a node, a number of children or an attribute is not
    supported.
    """
    root, unwritten = _root_and_unwritten(description, board, navigator)
    for variable, fault in unwritten.items():
        if variable not in WRITTEN_BY.values():
            raise fault
    return root


def _root_and_unwritten(
    description: NodeDescription, board: Board, navigator: str
) -> tuple[TreeNode, dict[str, NotOurs]]:
    """Returns the root, and by name a fault for each variable that is read and never written."""
    variables = Variables({WRITTEN_BY[navigator]})
    root = _built(description, board, variables)
    read = variables.read
    return root, {name: fault for name, fault in read if name not in variables.written}


def _built(description: NodeDescription, board: Board, variables: Variables) -> TreeNode:
    kind = NODE_KINDS.get(description.node)
    if kind is None:
        raise _missing(description)
    children = [
        _built(child, board, variables)
        for child in description.children
        if child.node not in SELECTORS
    ]
    wanted = kind.children
    if (wanted is None and not children) or (wanted is not None and len(children) != wanted):
        count = "at least 1 child" if wanted is None else f"{wanted} children"
        raise NotOurs(
            f"{description.node}: expected {count}, got {len(children)}", description.line
        )
    attributes = Attributes(description, variables)
    node = kind.make(description.name or description.node, attributes, children, board)
    attributes.finish()
    return node


def _missing(description: NodeDescription) -> NotOurs:
    """Returns the fault of a node that is missing here; a likely misspelling is named."""
    node = description.node
    if node in MISSING_NODES_OF_NAV2:
        return NotOurs(f"{node}: this node of Nav2 is missing here", description.line)
    close = difflib.get_close_matches(node, NODE_KINDS, n=1, cutoff=MISSPELLED)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return NotOurs(f"{node}: no such node here{hint}", description.line)


def is_for_other_navigator(description: NodeDescription, navigator: str) -> bool:
    """Returns whether a supported tree reads the goal of the other navigator, and nobody writes it.

    Every task of `navigator` then fails.
    """
    _, unwritten = _root_and_unwritten(description, _board_of_a_check(), navigator)
    return bool(unwritten)


def faults_of(description: NodeDescription, navigator: str = NAVIGATE_TO_POSE) -> Iterator[NotOurs]:
    """Yields the nodes and attributes of a navigator's tree that are not supported."""
    unknown = {n.node: n for n in description.iterate() if n.node not in (*NODE_KINDS, *SELECTORS)}
    for node in unknown.values():
        yield _missing(node)
    if unknown:
        return
    try:
        build_tree(description, _board_of_a_check(), navigator)
    except NotOurs as fault:
        yield fault


def _board_of_a_check() -> Board:
    """Returns the board of a tree that is checked and never ticked."""

    def plan_nothing(*_: object) -> None:
        raise AssertionError("a tree that is only checked plans nothing")

    nobody: Any = plan_nothing
    return Board(nobody, nobody, nobody, nobody)
