"""Reads Nav2's parameter files as ROS does: the parameters of each node, with their lines.

The meaning of the parameters is read elsewhere, see `nav2.controllers`.

A file is loaded as nav2_bringup's launch files load it, by PyYAML: with anchors and merge keys, the
last of two equal keys replacing the first with all that is below it. Scalars and names then follow
rcl_yaml_param_parser and rclcpp. All keys above `ros__parameters` together are the name of a node,
in which `*` and `**` stand for one and for any number of namespaces. All keys below it together are
the name of a parameter, so that `a.b: 1` and `a: {b: 1}` say the same. Where a node is given the
same parameter again, the later one holds.

Sources: nav2_common (RewrittenYaml), rcl_yaml_param_parser (parse.c), rclcpp (parameter_map.cpp).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from drake_navbench.errors import InputError
from drake_navbench.typed_files.ros_yaml import RosLoader
from drake_navbench.typed_files.typed_yaml import read_text, yaml_fault
from drake_navbench.typed_files.yaml_loader import MERGE_TAG, require_limits

LAUNCH_SUFFIXES = (".py", ".xml", ".launch")
PARAMETERS_KEY = "ros__parameters"
# Another spelling of it, with which ROS does not read the file.
MISSPELT_KEY = re.compile(r"_*ros_*param(?:eter)?s?_*", re.IGNORECASE)
# Nodes below which ROS takes no value but in PARAMETERS_KEY; a robot file has such names deeper.
NODES = ("controller_server", "planner_server", "behavior_server", "bt_navigator")
# A patch, a check and a trial of the doctor each read the same few texts several times.
TEXTS_REMEMBERED = 16
# The wildcards in a node's name -> the patterns that they stand for.
WILDCARDS = {"/**": "(/[^/]+)*", "/*": "/[^/]+"}


class Parameter(NamedTuple):
    """A value with its file and line, counted from 1."""

    value: Any
    line: int
    file: Path


@dataclass(frozen=True)
class Section:
    """The parameters that a file gives to the nodes with one name.

    name: as the file spells it, with the namespaces, '/robot1/controller_server'. With wildcards
        it stands for many nodes, '/**'.
    parameters: by dotted name, in the order of the file.
    """

    file: Path
    name: str
    parameters: Mapping[str, Parameter]

    @property
    def has_wildcards(self) -> bool:
        """Whether the name may stand for many nodes."""
        return "*" in self.name

    def is_for(self, node: str) -> bool:
        """Returns whether the node of this full name gets the section's parameters."""
        parts = re.split(r"(/\*\*|/\*)", self.name)
        pattern = "".join(WILDCARDS.get(part, re.escape(part)) for part in parts)
        return re.fullmatch(pattern, node) is not None


@dataclass(frozen=True)
class ParameterFile:
    """All sections of a file; none where it is no file of ROS parameters.

    remarks: a line on each entry that is accepted although it is probably a mistake.
    """

    sections: tuple[Section, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Node:
    """A node with all its parameters, merged from the sections of all files.

    name: with the namespaces, '/robot1/controller_server'.
    file: the last file that has a section for the node.
    parameters: by dotted name.
    """

    name: str
    file: Path
    parameters: Mapping[str, Parameter]

    def get(self, name: str, default: Any = None) -> Any:
        """Returns the value of a parameter, the default where it is not given."""
        return self.parameters[name].value if name in self.parameters else default

    def below(self, prefix: str) -> dict[str, Any]:
        """Returns the values of the parameters `prefix.*` by the rest of their names."""
        start = f"{prefix}."
        return {
            name.removeprefix(start): parameter.value
            for name, parameter in self.parameters.items()
            if name.startswith(start)
        }

    def where(self, name: str, listed_in: str = "") -> str:
        """Returns the beginning of an error about a parameter or block: its file, line and place.

        listed_in: the parameter whose line is named where the file lacks `name`.
        """
        place = str(self.file)
        found = self.parameters.get(name) or self._first_below(name)
        found = found or self.parameters.get(listed_in)
        if found is not None:
            place = f"{found.file}, line {found.line}"
        return f"{place}: {self.name.lstrip('/')}.{PARAMETERS_KEY}.{name}"

    def _first_below(self, block: str) -> Parameter | None:
        found = (entry for name, entry in self.parameters.items() if name.startswith(f"{block}."))
        return next(found, None)


def read_parameter_file(path: Path, prepare: Callable[[str], str] | None = None) -> ParameterFile:
    """Returns the sections of a file; raises InputError where it cannot be read or is no YAML.

    prepare: changes the text before it is taken apart, as nav2_common's substitutions do.
    """
    if path.suffix in LAUNCH_SUFFIXES:
        raise InputError(
            f"{path}: is a launch file; expected the parameter file that it names, such as "
            "nav2_params.yaml"
        )
    text = read_text(path)
    return read_parameter_text(text if prepare is None else prepare(text), path)


@lru_cache(maxsize=TEXTS_REMEMBERED)
def read_parameter_text(text: str, path: Path) -> ParameterFile:
    """Returns the sections of a file's text; raises InputError where it is no YAML.

    The result for a text that was read a short time ago is the same object; nobody changes it.
    path: the file that errors and parameters name.
    """
    try:
        require_limits(text)
        reader = _Reader(path, text)
        sections = tuple(reader.sections())
    except yaml.YAMLError as error:
        raise yaml_fault(error, str(path), text) from error
    return ParameterFile(sections, tuple(reader.remarks))


def nodes_called(base_name: str, sections: Iterable[Section]) -> list[Node]:
    """Returns the nodes of a name, one in each namespace that has a section for it.

    Where there are only sections with wildcards, there is one node, without a namespace.
    """
    sections = list(sections)
    plain = f"/{base_name}"
    names = [s.name for s in sections if s.name.endswith(plain) and not s.has_wildcards]
    if not names and any(section.is_for(plain) for section in sections):
        names = [plain]
    return [_node(name, [s for s in sections if s.is_for(name)]) for name in dict.fromkeys(names)]


def _node(name: str, sections: list[Section]) -> Node:
    parameters: dict[str, Parameter] = {}
    for section in sections:
        parameters |= section.parameters
    return Node(name, sections[-1].file, parameters)


class _Reader:
    """Takes one file apart; `remarks` is complete once `sections` is exhausted."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._loader = RosLoader(text)
        self._entries_of: dict[int, list[tuple[str, yaml.Node]]] = {}
        self.remarks: list[str] = []

    def sections(self) -> Iterator[Section]:
        """Yields the sections in the order of the file."""
        return self._sections_below(self._loader.get_single_node(), "")

    def _sections_below(self, node: yaml.Node | None, name: str) -> Iterator[Section]:
        if not isinstance(node, yaml.MappingNode):
            return
        for key, value in self._entries(node, name.lstrip("/")):
            if key != PARAMETERS_KEY and MISSPELT_KEY.fullmatch(key):
                named = next(entry for entry, _ in node.value if _text(entry) == key)
                raise _fault(f"expected {PARAMETERS_KEY}, got {key!r}", named)
            if key != PARAMETERS_KEY:
                if not isinstance(value, yaml.MappingNode) and name.lstrip("/") in NODES:
                    raise _fault(f"expected {PARAMETERS_KEY} above {key}", value)
                yield from self._sections_below(value, f"{name}/{key.strip('/')}")
            elif name:
                yield Section(self._path, name, self._parameters(value, name))
            else:
                raise _fault(f"expected the name of a node above {PARAMETERS_KEY}", node)

    def _parameters(self, node: yaml.Node, section: str) -> dict[str, Parameter]:
        parameters: dict[str, Parameter] = {}
        place = f"{section.lstrip('/')}.{PARAMETERS_KEY}."
        for name, value in self._leaves(node, place):
            name = name.removeprefix(place)
            line = _line(value)
            if name in parameters:
                # A parameter is given once dotted and once in a block, or dotted in two ways.
                self._remark_again(place + name, parameters.pop(name).line, line)
            constructed = self._loader.construct_object(value, deep=True)
            parameters[name] = Parameter(constructed, line, self._path)
        return parameters

    def _leaves(self, node: yaml.Node, place: str) -> Iterator[tuple[str, yaml.Node]]:
        """Yields the parameters below a place with their full names."""
        if not isinstance(node, yaml.MappingNode):
            return
        for key, value in self._entries(node, place.rstrip(".")):
            if isinstance(value, yaml.MappingNode):
                yield from self._leaves(value, f"{place}{key}.")
            else:
                yield place + key, value

    def _entries(self, node: yaml.MappingNode, place: str) -> list[tuple[str, yaml.Node]]:
        """Returns keys and values of a mapping; entries merged from other mappings come first."""
        if id(node) not in self._entries_of:
            self._remark_equal_keys(node, place)
            self._loader.flatten_mapping(node)
            entries: dict[str, yaml.Node] = {}
            for key, value in node.value:
                # The order decides where a dotted name and a block give the same parameter.
                entries.pop(_text(key), None)
                entries[_text(key)] = value
            self._entries_of[id(node)] = list(entries.items())
        return self._entries_of[id(node)]

    def _remark_equal_keys(self, node: yaml.MappingNode, place: str) -> None:
        lines: dict[str, int] = {}
        for key, _ in node.value:
            name = _text(key)
            if name in lines and key.tag != MERGE_TAG:
                self._remark_again(f"{place}.{name}".lstrip("."), lines[name], _line(key))
            lines[name] = _line(key)

    def _remark_again(self, name: str, first: int, line: int) -> None:
        self.remarks.append(
            f"{self._path}, line {line}: {name} is given again; line {first} has no effect"
        )


def _text(key: yaml.Node) -> str:
    if not isinstance(key, yaml.ScalarNode):
        raise _fault("expected text as the name of a parameter", key)
    return key.value


def _line(node: yaml.Node) -> int:
    return node.start_mark.line + 1


def _fault(text: str, node: yaml.Node) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, text, node.start_mark)
