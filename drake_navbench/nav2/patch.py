"""Sets parameters in the text of a Nav2 file; comments, order, quotes and blanks stay.

A given value is replaced in its place in the text; all other characters stay. A parameter that is
not given is added behind the last entry of its block. After every change the text is read again:
nothing else may have changed, as it would where several nodes share a value by an anchor.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from drake_navbench.errors import InputError
from drake_navbench.nav2.parameters import (
    MERGE_TAG,
    PARAMETERS_KEY,
    Parameter,
    RosLoader,
    Section,
    nodes_called,
    read_parameter_text,
)

INDENT = 2
# Nodes whose names repeat -> the names that people use for them.
SHORT_NODES = {
    "local_costmap": "local_costmap/local_costmap",
    "global_costmap": "global_costmap/global_costmap",
}
ALIAS = re.compile(r"\s*:\s*(\*[^\s,\]}]+)")


class Place(NamedTuple):
    """A parameter of a node: node 'controller_server', name 'FollowPath.lookahead_dist'."""

    node: str
    name: str

    def __str__(self) -> str:
        return f"{self.node}.{self.name}"


def place_of(text: str) -> Place:
    """Returns the place of 'NODE.PARAMETER', such as 'local_costmap.width'; raises InputError.

    `local_costmap` and `global_costmap` stand for `local_costmap/local_costmap` and so on.
    """
    node, dot, name = text.strip("/").partition(".")
    if not (node and dot and name):
        raise InputError(
            f"{text!r}: expected NODE.PARAMETER, such as controller_server.FollowPath.plugin"
        )
    return Place(SHORT_NODES.get(node, node), name)


def patched(text: str, changes: Mapping[Place | str, Any], path: Path) -> str:
    """Returns the text of a Nav2 file with these parameters set.

    changes: value by place, `{"controller_server.FollowPath.lookahead_dist": 0.8}`; the value is a
    number, true or false, text, or a list of these. path: of the file, for errors. Raises
    InputError where the file has no such node, or a value cannot be changed for this node alone.
    """
    for place, value in changes.items():
        text = _set(text, place_of(place) if isinstance(place, str) else place, value, path)
    return text


def given_value(text: str, place: Place | str, path: Path) -> Any:
    """Returns the value that a file's text gives a parameter, None where it gives none."""
    wanted = place_of(place) if isinstance(place, str) else place
    found = _resolved(read_parameter_text(text, path).sections, wanted, path).get(wanted.name)
    return None if found is None else found.value


def _set(text: str, place: Place, value: Any, path: Path) -> str:
    sections = read_parameter_text(text, path).sections
    found = _resolved(sections, place, path).get(place.name)
    if found is not None:
        value = _of_the_same_type(value, found.value)
        if _is_same(found.value, value):
            return text
    for attempt in _attempts(text, place, value, sections, path):
        if _changes_only(text, attempt, place, value, path):
            return attempt
    raise InputError(
        f"{path}: {place}: cannot be set for {place.node} alone; an anchor or a wildcard "
        "shares it with others"
    )


def _resolved(sections: tuple[Section, ...], place: Place, path: Path) -> Mapping[str, Parameter]:
    """Returns the parameters of a place's node; raises InputError where the file lacks it."""
    base = place.node.rpartition("/")[2]
    names = [node for node in nodes_called(base, sections)]
    full = [node for node in names if node.name.lstrip("/") == place.node]
    nodes = full or [node for node in names if node.name.endswith(f"/{place.node}")]
    if not nodes:
        raise InputError(f"{path}: {place}: the file has no node {place.node}")
    return nodes[0].parameters


def _of_the_same_type(value: Any, before: Any) -> Any:
    """Returns a whole number as a float where the file has a float: ROS keeps types apart."""
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if is_whole and isinstance(before, float) else value


def _is_same(first: Any, second: Any) -> bool:
    return type(first) is type(second) and bool(first == second)


def _attempts(
    text: str, place: Place, value: Any, sections: tuple[Section, ...], path: Path
) -> Iterator[str]:
    """Yields texts that may have the parameter set, the nearest to the file first."""
    blocks = [
        block
        for block in _blocks(RosLoader(text).get_single_node(), "")
        if block.is_for(place.node, sections)
    ]
    found = [
        entry
        for block in reversed(blocks)
        for entry in reversed(list(_entries(block.node, "")))
        if entry.name == place.name
    ]
    yield from (_replaced(text, entry, value) for entry in found)
    if found:
        return
    for block in sorted(blocks, key=lambda block: "*" in block.name):
        yield _added(text, block.node, place.name.split("."), value)
        yield _added(text, block.node, [place.name], value)
    if not any(block.name == f"/{place.node}" for block in blocks):
        end = "" if text.endswith("\n") or not text else "\n"
        keys = [*place.node.split("/"), PARAMETERS_KEY, *place.name.split(".")]
        yield f"{text}{end}\n{_block_text(keys, value, 0)}"


class _Block(NamedTuple):
    """The mapping below `ros__parameters` of the nodes of a name, '/**/controller_server'."""

    name: str
    node: yaml.MappingNode

    def is_for(self, node: str, sections: tuple[Section, ...]) -> bool:
        # A block with a wildcard at the end of its name is for other nodes, too.
        own = next((s for s in sections if s.name == self.name), None)
        return (
            own is not None
            and not self.name.endswith("*")
            and (own.is_for(f"/{node}") or self.name.endswith(f"/{node}"))
        )


class _Entry(NamedTuple):
    """A parameter by its dotted name, with its key and value in the text."""

    name: str
    key: yaml.Node
    value: yaml.Node


def _blocks(node: yaml.Node | None, name: str) -> Iterator[_Block]:
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        if key.value == PARAMETERS_KEY and isinstance(value, yaml.MappingNode):
            yield _Block(name, value)
        elif key.tag != MERGE_TAG:
            yield from _blocks(value, f"{name}/{str(key.value).strip('/')}")


def _entries(node: yaml.MappingNode, prefix: str) -> Iterator[_Entry]:
    """Yields the parameters that a block itself contains, without those that it merges."""
    for key, value in node.value:
        if key.tag == MERGE_TAG:
            continue
        is_alias = value.start_mark.index < key.end_mark.index
        if isinstance(value, yaml.MappingNode) and not is_alias:
            yield from _entries(value, f"{prefix}{key.value}.")
        else:
            yield _Entry(f"{prefix}{key.value}", key, value)


def _replaced(text: str, entry: _Entry, value: Any) -> str:
    key, node = entry.key, entry.value
    if node.start_mark.index < key.end_mark.index:
        found = ALIAS.match(text, key.end_mark.index)
        if found is None:
            return text
        return text[: found.start(1)] + _flow(value, node) + text[found.end(1) :]
    start, end = node.start_mark.index, _end(node)
    if start == end:
        return f"{text[:start]} {_flow(value, node)}{text[end:]}"
    if isinstance(node, yaml.SequenceNode) and isinstance(value, list):
        further = _further(value, node)
        if further:
            return _extended(text, node, further)
    if isinstance(node, yaml.SequenceNode) and not node.flow_style and isinstance(value, list):
        gap = "\n" + " " * node.start_mark.column
        items = (f"- {_flow(item, like)}" for item, like in _with_models(value, node))
        return text[:start] + (gap.join(items) or "[]") + text[end:]
    return text[:start] + _flow(value, node) + text[end:]


def _further(values: Sequence[Any], node: yaml.SequenceNode) -> Sequence[Any]:
    """Returns the items that `values` has behind all items of a node; else none."""
    count = len(node.value)
    own = [item.value for item in node.value if isinstance(item, yaml.ScalarNode)]
    return values[count:] if 0 < count == len(own) and own == list(values[:count]) else ()


def _extended(text: str, node: yaml.SequenceNode, further: Sequence[Any]) -> str:
    """Appends items to a list in the text; the list's own items keep their comments."""
    last = node.value[-1]
    items = [_flow(item, last) for item in further]
    if node.flow_style:
        at = _end(last)
        return text[:at] + "".join(f", {item}" for item in items) + text[at:]
    gap = " " * node.start_mark.column
    at = _line_end(text, _end(node))
    return _with_lines(text, at, "\n".join(f"{gap}- {item}" for item in items))


def _end(node: yaml.Node) -> int:
    """Returns the index behind a node's last character, before any comments that follow."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        if isinstance(last, tuple):
            key, value = last
            is_alias = value.start_mark.index < key.end_mark.index
            return key.end_mark.index if is_alias else max(_end(value), key.end_mark.index)
        return _end(last)
    return int(node.end_mark.index)


def _added(text: str, block: yaml.MappingNode, keys: list[str], value: Any) -> str:
    """Returns the text with a parameter added to a block, or to that block below it that has it."""
    for key, inner in block.value:
        is_alias = inner.start_mark.index < key.end_mark.index
        if len(keys) > 1 and key.value == keys[0] and not is_alias:
            if isinstance(inner, yaml.MappingNode):
                return _added(text, inner, keys[1:], value)
            at = _line_end(text, key.end_mark.index)
            return _with_lines(text, at, _block_text(keys[1:], value, key.start_mark.column + 2))
    if block.flow_style:
        at = block.end_mark.index - 1
        comma = ", " if block.value else ""
        return f"{text[:at].rstrip()}{comma}{'.'.join(keys)}: {_flow(value, None)}{text[at:]}"
    column = block.value[0][0].start_mark.column
    return _with_lines(text, _line_end(text, _end(block)), _block_text(keys, value, column))


def _line_end(text: str, index: int) -> int:
    found = text.find("\n", index)
    return len(text) if found < 0 else found


def _with_lines(text: str, at: int, lines: str) -> str:
    return f"{text[:at]}\n{lines.removesuffix(chr(10))}{text[at:]}"


def _block_text(keys: list[str], value: Any, column: int) -> str:
    """Returns nested keys with a value behind the last one, a line each."""
    *blocks, last = keys
    lines = [f"{' ' * (column + INDENT * depth)}{key}:" for depth, key in enumerate(blocks)]
    lines.append(f"{' ' * (column + INDENT * len(blocks))}{last}: {_flow(value, None)}")
    return "\n".join(lines) + "\n"


def _with_models(
    values: Sequence[Any], before: yaml.Node | None
) -> Iterator[tuple[Any, yaml.Node | None]]:
    """Yields each item with the node of the old list whose quotes it takes.

    An item of the old list takes those of its own node, a new item those of the last node.
    """
    nodes = before.value if isinstance(before, yaml.SequenceNode) else []
    for value in values:
        own = (node for node in nodes if isinstance(node, yaml.ScalarNode) and node.value == value)
        yield value, next(own, nodes[-1] if nodes else None)


def _flow(value: Any, before: yaml.Node | None) -> str:
    """Returns a value as YAML on one line; text with the quotes of the node that it replaces."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(_flow(item, like) for item, like in _with_models(value, before))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return _number(value)
    style = getattr(before, "style", None)
    if style == "'" and "\n" not in value:
        return "'" + value.replace("'", "''") + "'"
    is_plain = re.fullmatch(r"[A-Za-z_][\w/.:<>-]*", value) and not value.endswith(":")
    if is_plain and style is None and RosLoader(value).get_single_data() == value:
        return str(value)
    quoted = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{quoted}"'


def _number(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    shown = repr(value)
    mantissa, e, exponent = shown.partition("e")
    # A float without a point is text for YAML 1.1.
    return f"{mantissa}.0e{exponent}" if e and "." not in mantissa else shown.replace("inf", ".inf")


def _changes_only(before: str, after: str, place: Place, value: Any, path: Path) -> bool:
    """Returns whether a text gives the parameter this value and differs in nothing else."""
    try:
        sections = read_parameter_text(after, path).sections
        found = _resolved(sections, place, path).get(place.name)
    except InputError:
        return False
    if found is None or not _is_same(found.value, value):
        return False
    old = {s.name: _values(s) for s in read_parameter_text(before, path).sections}
    new = {s.name: _values(s) for s in sections}
    changed = [
        (section, name)
        for section in {**old, **new}
        for name in {**old.get(section, {}), **new.get(section, {})}
        if repr(old.get(section, {}).get(name)) != repr(new.get(section, {}).get(name))
    ]
    return len(changed) == 1 and changed[0][1] == place.name


def _values(section: Section) -> dict[str, Any]:
    return {name: parameter.value for name, parameter in section.parameters.items()}
