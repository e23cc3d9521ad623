"""Reads MovingAI's grid maps (`.map`), the benchmarks of path planning on grids.

Four lines of a header (type, height, width, map), then a line of characters a row, the top one
first. Source: N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", 2012.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.navigation.costmaps.grid_size import MAX_GRID_CELLS, require_grid_size
from drake_navbench.typed_files.input_file import read_input_text

SUFFIX = ".map"
# Characters of cells that one can walk on: ground and swamp.
PASSABLE = ".GS"
# Characters of cells that no wheel crosses: out of bounds, trees and water.
BLOCKED = "@OTW"
HEADER = ("type", "height", "width", "map")
# The largest file: one character a cell, one or two for the end of a row, and the header.
MAX_FILE_BYTES = 2 * MAX_GRID_CELLS


def read_movingai_map(path: Path, *, occupied: int) -> NDArray[np.int8]:
    """Returns the cells of a map, (rows, columns), the top row first: 0 free, or `occupied`.

    Raises InputError, one line with file and line, where it is no such map.
    """
    lines = read_input_text(path, max_bytes=MAX_FILE_BYTES).splitlines()
    fields = [line.split() for line in lines[: len(HEADER)]]
    if [field[0] if field else "" for field in fields] != list(HEADER):
        raise InputError(
            f"{path}: expected a MovingAI map, which begins with the lines {', '.join(HEADER)}"
        )
    height, width = _size(path, fields[1], 2), _size(path, fields[2], 3)
    require_grid_size(f"{path}", width, height)
    rows = lines[len(HEADER) : len(HEADER) + height]
    if len(rows) < height:
        raise InputError(
            f"{path}: expected {height} rows below line {len(HEADER)}, got {len(rows)}"
        )
    for number, row in enumerate(rows, start=len(HEADER) + 1):
        if len(row) != width:
            raise InputError(f"{path}, line {number}: expected {width} cells, got {len(row)}")
    signs = np.frombuffer("".join(rows).encode("ascii", "replace"), np.uint8).reshape(height, width)
    is_blocked = np.isin(signs, list(BLOCKED.encode()))
    is_unknown = ~is_blocked & ~np.isin(signs, list(PASSABLE.encode()))
    if is_unknown.any():
        row, column = np.argwhere(is_unknown)[0]
        raise InputError(
            f"{path}, line {row + len(HEADER) + 1}: cell {column + 1} is {rows[row][column]!r}, "
            f"expected one of {PASSABLE}{BLOCKED}"
        )
    return np.where(is_blocked, np.int8(occupied), np.int8(0))


def _size(path: Path, field: list[str], line: int) -> int:
    """Returns height or width from a line of the header."""
    if len(field) != 2 or not field[1].isdecimal() or int(field[1]) < 1:
        raise InputError(
            f"{path}, line {line}: {field[0]}: expected a whole number of at least 1, "
            f"got {' '.join(field[1:])!r}"
        )
    return int(field[1])
