"""Reads a behaviour tree's XML file, as BehaviorTree.CPP writes it, into its description.

The main tree is the one that `main_tree_to_execute` names, or the only one; `SubTree` nodes stand
for the other trees of the file. Whether the nodes are ours is no concern here.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.parsers import expat

from drake_navbench.errors import InputError
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.typed_files.input_file import MEGABYTE, read_input_text

MAX_FILE_BYTES = MEGABYTE
MAX_DEPTH = 50
# The depth to which files may include each other.
MAX_INCLUDES = 5
MAX_NODES = 1000
# The long form <Action ID="Spin"/> of <Spin/>.
WITH_ID = ("Action", "Condition", "Control", "Decorator")
# Elements that stand for another tree of the file.
SUBTREES = ("SubTree", "SubTreePlus")


class _Element:
    """An element of the file with its line."""

    def __init__(self, tag: str, attributes: dict[str, str], line: int) -> None:
        self.tag = tag
        self.attributes = attributes
        self.line = line
        self.children: list[_Element] = []


def read_tree_file(path: Path, values: Mapping[str, str] | None = None) -> NodeDescription:
    """Returns the main tree of a file, with those of the files that it includes.

    values: values of variables, by name; a variable without a value stays one. Raises InputError
    with file and line, also if a tree that is needed can only be in an included file that does not
    exist here, such as a file of a package (`ros_pkg`).
    """
    root = _parsed(path)
    missing: list[str] = []
    trees = _trees_of(root, path, missing, MAX_INCLUDES)
    named = root.attributes.get("main_tree_to_execute")
    if named is None and len(trees) == 1:
        (named,) = trees
    if root.attributes.get("BTCPP_format") != "4":
        for tree in trees.values():
            _rename_variables(tree)
    if named not in trees:
        if missing:
            raise InputError(missing[0])
        found = ", ".join(map(repr, trees)) or "none"
        wanted = f"a BehaviorTree that is called {named!r}"
        if named is None:
            wanted = "one BehaviorTree, or main_tree_to_execute to name one of several"
        raise InputError(f"{path}: expected {wanted}; found {found}")
    budget = _Budget(path, missing)
    return budget.described(_only_child(trees[named], path), trees, values or {}, 0)


def _rename_variables(element: _Element) -> None:
    """Turns ${variable} into {variable}: BehaviorTree.CPP 3, up to Iron, reads both alike."""
    for name, value in element.attributes.items():
        if value.startswith("${") and value.endswith("}"):
            element.attributes[name] = value[1:]
    for child in element.children:
        _rename_variables(child)


class _Budget:
    """Turns elements into descriptions; counts them, as trees may name each other in a circle."""

    def __init__(self, path: Path, missing: list[str]) -> None:
        self._path = path
        self._missing = missing
        self._left = MAX_NODES

    def described(
        self, element: _Element, trees: dict[str, _Element], passed: Mapping[str, str], depth: int
    ) -> NodeDescription:
        """Returns an element's description with its children, SubTrees replaced by their trees.

        passed: the attributes of the SubTree around the element. Each is the value of the element's
        variable of that name.
        """
        self._left -= 1
        if self._left < 0 or depth > MAX_DEPTH:
            raise InputError(
                f"{self._path}, line {element.line}: expected at most {MAX_NODES} nodes, "
                f"{MAX_DEPTH} deep; does a tree hold itself?"
            )
        attributes = {
            name: passed.get(value[1:-1].strip(), value)
            if value[:1] + value[-1:] == "{}"
            else value
            for name, value in element.attributes.items()
        }
        if element.tag in SUBTREES:
            name = attributes.get("ID", "")
            if name not in trees:
                if self._missing:
                    raise InputError(self._missing[0])
                raise InputError(
                    f"{self._path}, line {element.line}: no BehaviorTree is called {name!r}"
                )
            return self.described(
                _only_child(trees[name], self._path), trees, attributes, depth + 1
            )
        named = attributes.pop("ID", "")
        node = named if element.tag in WITH_ID else element.tag
        if not node:
            raise InputError(f"{self._path}, line {element.line}: {element.tag}: expected an ID")
        children = [self.described(child, trees, passed, depth + 1) for child in element.children]
        name = attributes.pop("name", "")
        return NodeDescription(
            node=node, name=name, attributes=attributes, children=tuple(children), line=element.line
        )


def _trees_of(
    root: _Element, path: Path, missing: list[str], includes_left: int
) -> dict[str, _Element]:
    """Returns the trees of a file and of those that it includes; missing: lines of the others."""
    trees: dict[str, _Element] = {}
    for element in root.children:
        if element.tag == "include":
            named = element.attributes.get("path", "")
            package = element.attributes.get("ros_pkg")
            file = path.parent / named
            if package is not None or not file.is_file():
                of = f" of the package {package}" if package else ""
                missing.append(f"line {element.line}, <include>: {named!r}{of} is not there")
            elif includes_left == 0:
                raise InputError(f"{path}, line {element.line}: files that include each other")
            else:
                trees |= _trees_of(_parsed(file), file, missing, includes_left - 1)
    own = {e.attributes.get("ID", ""): e for e in root.children if e.tag == "BehaviorTree"}
    return trees | own


def _only_child(tree: _Element, path: Path) -> _Element:
    if len(tree.children) != 1:
        raise InputError(
            f"{path}, line {tree.line}: BehaviorTree: expected one root node, "
            f"got {len(tree.children)}"
        )
    return tree.children[0]


def _parsed(path: Path) -> _Element:
    text = read_input_text(path, max_bytes=MAX_FILE_BYTES)
    parser = expat.ParserCreate()
    top = _Element("", {}, 0)
    open_elements = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = _Element(tag, attributes, parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def refuse(*_: Any) -> None:
        # Entities may make gigabytes out of a line.
        line = parser.CurrentLineNumber
        raise InputError(f"{path}, line {line}: expected no document type definition")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: open_elements.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"{path}, line {error.lineno}: not XML: {reason}") from error
    if top.children[0].tag != "root":
        raise InputError(f"{path}: expected a behaviour tree's <root>, got <{top.children[0].tag}>")
    return top.children[0]
