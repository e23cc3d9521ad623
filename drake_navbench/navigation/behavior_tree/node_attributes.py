"""The attributes of one node of a tree's file, and the variables that they name.

Attributes that only name plugins, servers or topics have no effect: there is one planner, one
controller a column.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drake_navbench.navigation.behavior_tree.board import PATH
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.typed_files.name_lists import name_lists

# The attributes that say which plugin, server or variable a node uses, and how long it waits.
WITHOUT_EFFECT = frozenset(name_lists(__package__, "without_effect.yaml")["attributes"])
# The variable of the goal, which the navigator writes.
GOAL = "goal"


class NotOurs(ValueError):
    """A node or an attribute that does not exist here; line: in the tree's file."""

    def __init__(self, text: str, line: int | None) -> None:
        super().__init__(text)
        self.line = line


@dataclass
class Variables:
    """The variables of the board that the nodes of a tree write, and those that they read."""

    written: set[str] = field(default_factory=lambda: {GOAL})
    read: list[tuple[str, NotOurs]] = field(default_factory=list)


class Attributes:
    """The attributes of one node; each is read once, and those never read are refused."""

    def __init__(self, description: NodeDescription, variables: Variables) -> None:
        self._node = description.node
        self._line = description.line
        self._left = dict(description.attributes)
        self._variables = variables

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

    def source(self, name: str, default: str = PATH) -> str:
        """Returns the variable that an attribute reads."""
        is_named = name in self._left
        variable = self._variable(name, default)
        if is_named:
            fault = self.fault(f"{name}: no node writes {{{variable}}}")
            self._variables.read.append((variable, fault))
        return variable

    def result(self, name: str, default: str = PATH) -> str:
        """Returns the variable that an attribute writes."""
        variable = self._variable(name, default)
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
