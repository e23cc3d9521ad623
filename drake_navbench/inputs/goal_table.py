"""Tables of places: a row each, in columns with or without names (CSV, or parted by blanks)."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.goal_graph import Place
from drake_navbench.inputs.goal_poses import (
    LENGTHS,
    ends_in_quaternion,
    number_of,
    pose_of,
    pose_of_numbers,
)

NAME_COLUMNS = ("name", "id", "label", "location", "waypoint")
SEPARATORS = (";", ",", "\t")
SHOWN = 60


class _Row(NamedTuple):
    line: int
    cells: list[str]


def places_in_table(text: str, path: Path) -> list[Place]:
    """Returns the places of a table; raises InputError.

    The first row without a number, or a comment with as many words as there are columns, has the
    columns' names. Without names a row has 2, 3, 4, 6 or 7 numbers, perhaps after a name.
    """
    lines = [(number, line.strip()) for number, line in enumerate(text.split("\n"), start=1)]
    rows = [_Row(number, _cells(line)) for number, line in lines if not _is_comment(line)]
    names: list[str] = []
    if rows and not any(number_of(cell) is not None for cell in rows[0].cells):
        names = rows.pop(0).cells
    for number, line in lines:
        words = _cells(line.lstrip("#/ "))
        if not names and rows and line and _is_comment(line) and number < rows[0].line:
            has_words = len(words) == len(rows[0].cells) and number_of(words[0]) is None
            names = words if has_words else []
    if names:
        return [_named(row, names, path) for row in rows]
    return _plain(rows, path)


def _is_comment(line: str) -> bool:
    return not line or line.startswith(("#", "//"))


def _cells(line: str) -> list[str]:
    separator = next((one for one in SEPARATORS if one in line), None)
    is_quoted = '"' in line and line.count('"') % 2 == 0 and len(line) < csv.field_size_limit()
    if separator is not None and is_quoted:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [cell.strip().strip("\"'") for cell in cells]


def _named(row: _Row, names: Sequence[str], path: Path) -> Place:
    where = f"{path}, line {row.line}"
    if len(row.cells) != len(names):
        raise InputError(f"{where}: {len(row.cells)} columns; expected {len(names)}, as the "
                         "columns' names")  # fmt: skip
    cells = dict(zip(names, row.cells, strict=True))
    pose = pose_of(cells, where)
    if pose is None:
        raise InputError(f"{where}: columns {', '.join(names)}; expected x and y")
    small = {name.lower(): cell for name, cell in cells.items()}
    return Place(next((small[n] for n in NAME_COLUMNS if small.get(n)), f"line {row.line}"), pose)


def _plain(rows: Sequence[_Row], path: Path) -> list[Place]:
    named: list[tuple[_Row, str, list[str]]] = []
    for row in rows:
        own = row.cells[0] if number_of(row.cells[0]) is None else ""
        numbers = row.cells[1:] if own else row.cells
        for cell in numbers:
            if number_of(cell) is None:
                raise InputError(
                    f"{path}, line {row.line}: got {re.sub(r'[^ -~]', '?', cell)[:SHOWN]!r}; "
                    "expected a number"
                )
        if len(numbers) not in LENGTHS:
            raise InputError(
                f"{path}, line {row.line}: {len(numbers)} numbers; expected x, y or x, y, yaw, or "
                "a first line with the columns' names"
            )
        named.append((row, own or f"line {row.line}", numbers))
    has_quaternions = all(ends_in_quaternion(numbers) for *_, numbers in named)
    return [
        Place(
            own,
            pose_of_numbers(numbers, f"{path}, line {row.line}", has_quaternions=has_quaternions),
        )
        for row, own, numbers in named
    ]
