"""Differences between whole Nav2 files, by parameter; those without effect here are marked.

Compared are the values that the nodes have: those that a file gives, and where it gives none the
default that holds here, as far as a setting of the same name tells it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.check import WIDTH, CheckRow, Status
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.plugins.parameters import normalized
from drake_navbench.typed_files.dotted_names import flattened

NOT_GIVEN = "not given"
WITHOUT_EFFECT = (Status.NO_MEANING, Status.UNREAD, Status.STAND_IN)
MAX_SHOWN = 40
# Beyond this number, differences without effect are only counted, unless all are asked for.
MOST_IDLE = 12
PLUGIN = "plugin"
# The node of a field of the robot's navigation -> the field's name, where the two differ.
FIELDS = {
    "local_costmap/local_costmap": "local_costmap",
    "global_costmap/global_costmap": "global_costmap",
}


class Difference(NamedTuple):
    """A parameter that differs.

    values: one text a file, such as 'not given' or '0.55 (default)'. reason: why the parameter has
    no effect here, '' where it has one.
    """

    node: str
    parameter: str
    values: tuple[str, ...]
    reason: str = ""

    @property
    def place(self) -> str:
        """Node and parameter as one text, 'local_costmap.width'."""
        return f"{FIELDS.get(self.node, self.node)}.{self.parameter}"


def differences(columns: Sequence[FileColumns]) -> list[Difference]:
    """Returns the parameters in which files differ, those with an effect first."""
    given = [column.setup.given for column in columns]
    resolved = [resolved_settings(column) for column in columns]
    rows = [_rows(column) for column in columns]
    found = []
    for key in dict.fromkeys(key for values in given for key in values):
        if len({repr(values.get(key, NOT_GIVEN)) for values in given}) == 1:
            continue
        known = [
            values.get(key, defaults.get(key, NOT_GIVEN))
            for values, defaults in zip(given, resolved, strict=True)
        ]
        if key[1].rpartition(".")[2] == PLUGIN:
            # 'nav2_behaviors/Spin' and 'nav2_behaviors::Spin' are one plugin.
            known = [normalized(value) for value in known]
        if all(_is_same(known[0], value) for value in known[1:]):
            continue
        shown = tuple(
            _shown(value) + ("" if key in values or value is NOT_GIVEN else " (default)")
            for value, values in zip(known, given, strict=True)
        )
        found.append(Difference(*key, shown, _reason(key, given, rows)))
    return sorted(found, key=lambda entry: bool(entry.reason))


def require_different(columns: Sequence[FileColumns], found: Sequence[Difference]) -> None:
    """Raises InputError where two files drive alike, so that there is nothing to compare."""
    for first, second in combinations(columns, 2):
        if first.drives_as != second.drives_as:
            continue
        idle = ", ".join(entry.place for entry in found if entry.reason and len(columns) == 2)
        why = f"they differ in what has no effect here: {idle}" if idle else "no parameter differs"
        raise InputError(
            f"{first.file.told} and {second.file.told} drive alike: {why}; nothing was driven"
        )


def difference_lines(
    columns: Sequence[FileColumns], found: Sequence[Difference], *, is_whole: bool = False
) -> list[str]:
    """Returns the differences as terminal lines: those with an effect, then those without.

    is_whole: whether every parameter is told. Otherwise two kinds are only counted: parameters that
    some file cannot have, as its plugin is another or it lacks the node, and those without effect
    beyond MOST_IDLE.
    """
    names = [column.name for column in columns]
    files = ", ".join(f"{column.name} = {column.file.told}" for column in columns)
    effective = [entry for entry in found if not entry.reason]
    count = f"{len(effective)} parameter{'s' * (len(effective) != 1)}"
    lines = _wrapped(f"{files}: {count} differ{'s' * (len(effective) == 1)}", "    ")
    groups = {} if is_whole else _groups(columns, effective)
    grouped = {id(entry) for own in groups.values() for entry in own}
    for entry in effective:
        if id(entry) not in grouped:
            lines += _wrapped(f"  {entry.place}: {_side_by_side(names, entry.values)}")
    for place, own in groups.items():
        counts = [sum(entry.values[i] != NOT_GIVEN for entry in own) for i in range(len(names))]
        told = [f"{name} {count}" for name, count in zip(names, counts, strict=True) if count]
        text = f"  {place}: parameters that not all have: {', '.join(told)} (--check lists them)"
        lines += _wrapped(text)
    idle = [entry for entry in found if entry.reason]
    if idle and not is_whole and len(idle) > MOST_IDLE:
        lines.append(f"No effect here: {len(idle)} (--check lists them)")
        idle = []
    elif idle:
        lines.append(f"No effect here ({len(idle)}):")
    for reason in dict.fromkeys(entry.reason for entry in idle):
        own = [entry for entry in idle if entry.reason == reason]
        texts = [f"{entry.place} {_side_by_side(names, entry.values)}" for entry in own]
        lines += _wrapped(f"  {reason}: {'; '.join(texts)}")
    return [printable(line) for line in [*lines, *_robot_lines(columns)]]


def _groups(
    columns: Sequence[FileColumns], effective: Sequence[Difference]
) -> dict[str, list[Difference]]:
    """Returns differences that follow from another plugin or a missing node, by their block.

    They are parameters that some file does not give; the choice of the plugin itself is not among
    them.
    """
    nodes = [{node for node, _ in column.setup.given} for column in columns]
    blocks = {
        (entry.node, entry.parameter.rpartition(".")[0])
        for entry in effective
        if entry.parameter.rpartition(".")[2] == PLUGIN and "." in entry.parameter
    }
    groups: dict[str, list[Difference]] = {}
    for entry in effective:
        if NOT_GIVEN not in entry.values:
            continue
        block = entry.parameter.partition(".")[0]
        shown = FIELDS.get(entry.node, entry.node)
        if not all(entry.node in own for own in nodes):
            groups.setdefault(shown, []).append(entry)
        elif (entry.node, block) in blocks and entry.parameter != f"{block}.{PLUGIN}":
            groups.setdefault(f"{shown}.{block}", []).append(entry)
    return groups


def _robot_lines(columns: Sequence[FileColumns]) -> Iterator[str]:
    """Yields a line for each property of outline or sensors in which files differ."""
    outlines = {
        column.name: "x".join(
            f"{size:.2f}"
            for size in (column.setup.robot.outline.max(0) - column.setup.robot.outline.min(0))
        )
        for column in columns
    }
    if len(set(outlines.values())) > 1:
        told = ", ".join(f"{name} {size} m" for name, size in outlines.items())
        text = f"Each drives with the outline of its own file: {told}; --robot FILE gives one body"
        yield from _wrapped(text)
    sensors = {column.name: sorted(column.setup.robot.depth_sensors) for column in columns}
    if len({tuple(names) for names in sensors.values()}) > 1:
        told = ", ".join(f"{name} {', '.join(own) or 'none'}" for name, own in sensors.items())
        yield from _wrapped(f"Each has the depth sensors that its own file asks for: {told}")


def _side_by_side(names: Sequence[str], values: Sequence[str]) -> str:
    if len(values) == 2:
        return " -> ".join(values)
    return ", ".join(f"{name} {value}" for name, value in zip(names, values, strict=True))


def _wrapped(text: str, indent: str = "      ") -> list[str]:
    return textwrap.wrap(text, WIDTH, subsequent_indent=indent, break_on_hyphens=False)


def _shown(value: Any) -> str:
    text = str(value) if isinstance(value, str) else repr(value)
    text = {"True": "true", "False": "false"}.get(text, text)
    return printable(text, MAX_SHOWN)


def _is_same(first: Any, second: Any) -> bool:
    if isinstance(first, bool) or isinstance(second, bool):
        return first is second
    return bool(first == second)


def resolved_settings(column: FileColumns) -> dict[tuple[str, str], Any]:
    """Returns the settings that result from a file, by Nav2's node and name."""
    navigation = column.setup.robot.navigation.model_dump(mode="json")
    nodes = {field: node for node, field in FIELDS.items()}
    found = {
        (nodes.get(field, field), name): value
        for field, values in navigation.items()
        if isinstance(values, Mapping)
        for name, value in flattened(values)
    }
    for preset in column.presets:
        block = column.setup.places[preset.name][1]
        for name, value in flattened(preset.parameters.model_dump(mode="json")):
            found[SERVER, f"{block}.{name}"] = value
    return found


def why_without_effect(key: tuple[str, str], column: FileColumns) -> str:
    """Returns why a parameter that a file gives has no effect here; '' where it has one."""
    return _reason(key, [column.setup.given], [_rows(column)])


def _rows(column: FileColumns) -> dict[tuple[str, str], CheckRow]:
    return {
        (row.node.removeprefix(column.setup.namespace).lstrip("/"), row.parameter): row
        for row in column.setup.check.rows
    }


def _reason(
    key: tuple[str, str],
    given: Sequence[Mapping[tuple[str, str], Any]],
    rows: Sequence[Mapping[tuple[str, str], CheckRow]],
) -> str:
    """Returns why a parameter has no effect in any of the files that give it; '' where it has."""
    found = [
        row
        for values, own in zip(given, rows, strict=True)
        if key in values and (row := _row_of(key, own)) is not None
    ]
    if not found or any(row.status not in WITHOUT_EFFECT for row in found):
        return ""
    row = found[0]
    return row.remark or str(row.status)


def _row_of(key: tuple[str, str], rows: Mapping[tuple[str, str], CheckRow]) -> CheckRow | None:
    """Returns the row about a parameter, else that about its block, else about its node."""
    node, name = key
    while name:
        if (node, name) in rows:
            return rows[node, name]
        name = name.rpartition(".")[0]
    return rows.get((node, ""))
