"""A tree's whole memory as a value, so that a Drake Context can hold it.

py_trees nodes change when they are ticked; Drake copies Contexts and may evaluate one system in any
number of them. So the tree itself is only a machine: before a tick it is set to the snapshot that
the Context holds, after the tick a new snapshot is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.tree_node import TreeNode


class Snapshot(NamedTuple):
    """The memory of a tree's nodes between ticks.

    statuses: status of all nodes. memories: memories of the nodes that have a `MEMORY`.
    """

    statuses: tuple[Status, ...]
    memories: tuple[tuple[Any, ...], ...]


def nodes_of(root: TreeNode) -> tuple[TreeNode, ...]:
    """Returns all nodes in a fixed order."""
    # A tree is made of TreeNodes only, which py_trees cannot know.
    return tuple(root.iterate())  # type: ignore[arg-type]


def take_snapshot(nodes: Sequence[TreeNode]) -> Snapshot:
    """Returns the memory of the nodes. All values that nodes remember are immutable."""
    return Snapshot(
        tuple([node.status for node in nodes]),
        tuple([node.recall() for node in nodes if node.MEMORY]),
    )


def restore(nodes: Sequence[TreeNode], snapshot: Snapshot) -> None:
    """Sets the nodes to a snapshot of the same tree."""
    for node, status in zip(nodes, snapshot.statuses, strict=True):
        node.restore_status(status)
    keeping = [node for node in nodes if node.MEMORY]
    for node, memory in zip(keeping, snapshot.memories, strict=True):
        for name, value in zip(node.MEMORY, memory, strict=True):
            setattr(node, name, value)
