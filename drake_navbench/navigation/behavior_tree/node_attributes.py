"""The kinds of nodes, the attributes of one in a tree's file, and the variables that they name.

Attributes that only name plugins, servers or topics have no effect: there is one planner, one
controller a column.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from drake_navbench.navigation.behavior_tree.board import PATH, Board
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode
from drake_navbench.typed_files.name_lists import name_lists

# The attributes that say which plugin, server or variable a node uses, and how long it waits.
WITHOUT_EFFECT = frozenset(name_lists(__package__, "without_effect.yaml")["attributes"])


class NotOurs(ValueError):
    """A node or an attribute that does not exist here; line: in the tree's file."""

    def __init__(self, text: str, line: int | None) -> None:
        super().__init__(text)
        self.line = line


@dataclass
class Variables:
    """The variables of the board that the nodes of a tree write, and those that they read.

    written: at first those that the navigator writes.
    """

    written: set[str]
    read: list[tuple[str, NotOurs]] = field(default_factory=list)


class Attributes:
    """The attributes of one node; each is read once, and those never read are refused."""

    def __init__(self, description: NodeDescription, variables: Variables) -> None:
        self._node = description.node
        self._line = description.line
        self._left = dict(description.attributes)
        self._variables = variables
        self._own_sources: set[str] = set()

    def text(self, name: str, default: str = "") -> str:
        return self._left.pop(name, default)

    def number(self, name: str, default: float) -> float:
        text = self.text(name, str(default))
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) and value != default:
            raise self.fault(f"{name}: expected a number, got {text!r}")
        return value

    def count(self, name: str, default: int) -> int:
        value = self.number(name, default)
        if not value.is_integer():
            raise self.fault(f"{name}: expected a whole number, got {value:g}")
        return int(value)

    def flag(self, name: str, default: bool) -> bool:
        text = self.text(name, str(default)).lower()
        if text not in ("true", "false", "1", "0"):
            raise self.fault(f"{name}: expected true or false, got {text!r}")
        return text in ("true", "1")

    def source(self, name: str, default: str = PATH, *, is_needed: bool = False) -> str:
        """Returns the variable that an attribute reads.

        is_needed: whether a node must write the default, too.
        """
        is_needed |= name in self._left
        variable = self._variable(name, default)
        self._own_sources.add(variable)
        if is_needed:
            fault = self.fault(f"{name}: no node writes {{{variable}}}")
            self._variables.read.append((variable, fault))
        return variable

    def optional_source(self, name: str) -> str:
        """Returns the variable that an attribute reads, written or not; '' without one."""
        return self._variable(name, "") if self._left.get(name) else self.text(name)

    def has(self, name: str) -> bool:
        """Returns whether the attribute is given and was not read yet."""
        return name in self._left

    def result(self, name: str, default: str = PATH) -> str:
        """Returns the variable that an attribute writes; read its sources before.

        A variable that the node only changes is still one that another node must write.
        """
        variable = self._variable(name, default)
        if variable not in self._own_sources:
            self._variables.written.add(variable)
        return variable

    def _variable(self, name: str, default: str) -> str:
        text = self.text(name, f"{{{default}}}").strip()
        variable = text.removeprefix("{").removesuffix("}").strip()
        if text[:1] + text[-1:] != "{}" or not variable:
            raise self.fault(f"{name}: expected a variable such as {{{default}}}, got {text!r}")
        return variable

    def fault(self, text: str) -> NotOurs:
        return NotOurs(f"{self._node}: {text}", self._line)

    def finish(self) -> None:
        for name in self._left:
            if name not in WITHOUT_EFFECT:
                raise self.fault(f"{name}: has no effect here")


@dataclass(frozen=True)
class NodeKind:
    """The factory of a node, and the number of its children; None: one or more."""

    make: Callable[[str, Attributes, Sequence[TreeNode], Board], TreeNode]
    children: int | None = 0
