"""Edits of the text of a YAML file: a value replaced or added, all other characters as they are.

Where a node stands in the text is known from the marks that the parser leaves on it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import yaml

from drake_navbench.typed_files.ros_yaml import RosLoader

INDENT = 2
ALIAS = re.compile(r"\s*:\s*(\*[^\s,\]}]+)")


def replaced(text: str, key: yaml.Node, node: yaml.Node, value: Any) -> str:
    """Returns the text with another value in the place of a key's node, or of its alias."""
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
    """Returns the items that a list of texts has behind all those of a node; else none."""
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
    """Returns the index behind a node's last character, before comments that follow it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        if isinstance(last, tuple):
            key, value = last
            is_alias = value.start_mark.index < key.end_mark.index
            return key.end_mark.index if is_alias else max(_end(value), key.end_mark.index)
        return _end(last)
    return int(node.end_mark.index)


def added(text: str, block: yaml.MappingNode, keys: list[str], value: Any) -> str:
    """Returns the text with a value added to a block, or to that block below it that has it."""
    for key, inner in block.value:
        is_alias = inner.start_mark.index < key.end_mark.index
        if len(keys) > 1 and key.value == keys[0] and not is_alias:
            if isinstance(inner, yaml.MappingNode):
                return added(text, inner, keys[1:], value)
            at = _line_end(text, key.end_mark.index)
            return _with_lines(text, at, block_text(keys[1:], value, key.start_mark.column + 2))
    if block.flow_style:
        at = block.end_mark.index - 1
        comma = ", " if block.value else ""
        return f"{text[:at].rstrip()}{comma}{'.'.join(keys)}: {_flow(value, None)}{text[at:]}"
    column = block.value[0][0].start_mark.column
    return _with_lines(text, _line_end(text, _end(block)), block_text(keys, value, column))


def _line_end(text: str, index: int) -> int:
    found = text.find("\n", index)
    return len(text) if found < 0 else found


def _with_lines(text: str, at: int, lines: str) -> str:
    return f"{text[:at]}\n{lines.removesuffix(chr(10))}{text[at:]}"


def block_text(keys: list[str], value: Any, column: int) -> str:
    """Returns nested keys with a value behind the last one, a line each."""
    *blocks, last = keys
    lines = [f"{' ' * (column + INDENT * depth)}{key}:" for depth, key in enumerate(blocks)]
    lines.append(f"{' ' * (column + INDENT * len(blocks))}{last}: {_flow(value, None)}")
    return "\n".join(lines) + "\n"


def _with_models(
    values: Sequence[Any], before: yaml.Node | None
) -> Iterator[tuple[Any, yaml.Node | None]]:
    """Yields each item with the node of the old list whose quotes it takes.

    For an item of the old list that is its own node, for a new one the last node.
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
