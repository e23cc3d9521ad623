"""Builds a behaviour tree from its description, where all of its nodes are ours.

The selectors of plugins choose nothing and are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from drake_navbench.errors import nearest_name_hint
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.control_nodes import TreeNode
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.node_attributes import (
    Attributes,
    NotOurs,
    Variables,
)
from drake_navbench.navigation.behavior_tree.node_kinds import NODE_KINDS

# These nodes choose among plugins, of which only one is loaded here.
SELECTORS = (
    "ControllerSelector",
    "GoalCheckerSelector",
    "PathHandlerSelector",
    "PlannerSelector",
    "ProgressCheckerSelector",
    "SmootherSelector",
)


def build_tree(description: NodeDescription, board: Board) -> TreeNode:
    """Returns the root of a tree whose leaves read and write `board`.

    Raises NotOurs where a node, a number of children or an attribute is not supported.
    """
    variables = Variables()
    root = _built(description, board, variables)
    for variable, fault in variables.read:
        if variable not in variables.written:
            raise fault
    return root


def _built(description: NodeDescription, board: Board, variables: Variables) -> TreeNode:
    kind = NODE_KINDS.get(description.node)
    if kind is None:
        hint = nearest_name_hint(description.node, NODE_KINDS)
        raise NotOurs(f"{description.node}: no such node here{hint}", description.line)
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


def faults_of(description: NodeDescription) -> Iterator[NotOurs]:
    """Yields the nodes and attributes of a tree that are not supported; none if it can be built."""

    def plan_nothing(*_: object) -> None:
        raise AssertionError("a tree that is only checked plans nothing")

    unknown = {n.node: n for n in description.iterate() if n.node not in (*NODE_KINDS, *SELECTORS)}
    for node in unknown.values():
        hint = nearest_name_hint(node.node, NODE_KINDS)
        yield NotOurs(f"{node.node}: no such node here{hint}", node.line)
    if unknown:
        return
    try:
        nobody: Any = plan_nothing
        build_tree(description, Board(nobody, nobody, nobody))
    except NotOurs as fault:
        yield fault
