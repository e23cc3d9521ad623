"""Sets parameters in the text of a Nav2 file; comments, order, quotes and blanks stay.

A given value is replaced in its place in the text; all other characters stay. A parameter that is
not given is added behind the last entry of its block. After every change the text is read again:
nothing else may have changed, as it would where several nodes share a value by an anchor.
"""

from __future__ import annotations

import difflib
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from drake_navbench.errors import InputError
from drake_navbench.nav2.parameters import (
    PARAMETERS_KEY,
    Parameter,
    Section,
    nodes_called,
    read_parameter_text,
)
from drake_navbench.nav2.yaml_text import added, block_text, replaced
from drake_navbench.typed_files.ros_yaml import RosLoader
from drake_navbench.typed_files.yaml_loader import MERGE_TAG

# Nodes whose names repeat, by the name that people use for them.
SHORT_NODES = {
    "local_costmap": "local_costmap/local_costmap",
    "global_costmap": "global_costmap/global_costmap",
}

# An end of a line that is not one of Windows.
PLAIN_END = re.compile(r"(?<!\r)\n")
# The mark of a line that ends its file without an end of line.
UNENDED = "\n\\ No newline at end of file\n"


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
    number, true or false, text, or a list of these. path: path of the file, for errors. Raises
    InputError where the file has no such node, or a value cannot be changed for this node alone.
    """
    for place, value in changes.items():
        text = _set(text, place_of(place) if isinstance(place, str) else place, value, path)
    return text


def patched_files(texts: Mapping[Path, str], changes: Mapping[Place, Any]) -> dict[Path, str]:
    """Returns the new texts of the files, of several that are merged, that a change alters.

    texts: by path, in their order: later ones override. A parameter is set in the last file that
    gives it to its node, else in the last one with the most of its blocks, such as FollowPath.
    Raises InputError as `patched` does.
    """
    now = dict(texts)
    for place, value in changes.items():
        path = _holder(now, place)
        now[path] = _set(now[path], place, value, path)
    return {path: text for path, text in now.items() if text != texts[path]}


def difference(name: str, before: str, after: str, *, around: int = 3) -> str:
    """Returns a change of a file's text as a patch that `patch -p0` takes.

    name: the file's. around: number of lines before and behind each change.
    """
    # Lines as `patch` counts them, to which a form feed is no end.
    old, new = ([*io.StringIO(text, newline="\n")] for text in (before, after))
    lines = difflib.unified_diff(old, new, name, name, n=around)
    return "".join(line if line.endswith("\n") else line + UNENDED for line in lines)


def _holder(texts: Mapping[Path, str], place: Place) -> Path:
    """Returns the file in which a parameter is set; the last one where none has its node."""
    *_, best = texts
    most = 0
    blocks = place.name.split(".")
    for path, text in texts.items():
        try:
            names = _resolved(read_parameter_text(text, path).sections, place, path)
        except InputError:
            continue
        shared = (_shared(name.split("."), blocks) for name in names)
        depth = 1 + max(shared, default=0)
        if depth >= most:
            best, most = path, depth
    return best


def _shared(name: Sequence[str], other: Sequence[str]) -> int:
    """Returns the number of parts that two dotted names have in common from the beginning."""
    pairs = zip(name, other, strict=False)
    return next((i for i, (a, b) in enumerate(pairs) if a != b), min(len(name), len(other)))


def _set(text: str, place: Place, value: Any, path: Path) -> str:
    sections = read_parameter_text(text, path).sections
    found = _resolved(sections, place, path).get(place.name)
    if found is not None:
        value = _of_the_same_type(value, found.value)
        if _is_same(found.value, value):
            return text
    is_of_windows = "\r\n" in text and not PLAIN_END.search(text)
    for attempt in _attempts(text, place, value, sections):
        attempt = PLAIN_END.sub("\r\n", attempt) if is_of_windows else attempt
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


def _attempts(text: str, place: Place, value: Any, sections: tuple[Section, ...]) -> Iterator[str]:
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
    yield from (replaced(text, entry.key, entry.value, value) for entry in found)
    if found:
        return
    for block in sorted(blocks, key=lambda block: "*" in block.name):
        yield added(text, block.node, place.name.split("."), value)
        yield added(text, block.node, [place.name], value)
    if not any(block.name == f"/{place.node}" for block in blocks):
        end = "" if text.endswith("\n") or not text else "\n"
        keys = [*place.node.split("/"), PARAMETERS_KEY, *place.name.split(".")]
        yield f"{text}{end}\n{block_text(keys, value, 0)}"


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
