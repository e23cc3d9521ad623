"""Reads STL meshes, which Drake does not, and writes them as OBJ, which it does."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError

Array = NDArray[np.float64]

# Of a binary file: a free text, the number of triangles, then each of them.
HEADER_BYTES = 80
COUNT_BYTES = 4
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
ASCII_CORNER = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def read_stl(path: Path) -> Array:
    """Returns the corners (3 N, 3) m of the N triangles of an STL file, binary or text.

    Raises InputError where it is neither.
    """
    data = path.read_bytes()
    start = HEADER_BYTES + COUNT_BYTES
    count = int.from_bytes(data[HEADER_BYTES:start], "little")
    # Text has no such length; some binary files begin with the word of a text.
    if len(data) >= start and len(data) == start + count * TRIANGLE.itemsize:
        corners = np.frombuffer(data, TRIANGLE, count, start)["corners"]
        points = corners.reshape(-1, 3).astype(np.float64)
    else:
        try:
            found = [[float(value) for value in corner] for corner in ASCII_CORNER.findall(data)]
        except ValueError:
            found = []
        points = np.array(found, dtype=np.float64).reshape(-1, 3)
    if not len(points) or len(points) % 3 or not np.isfinite(points).all():
        raise InputError(f"{path}: cannot be read as an STL mesh: expected triangles")
    return points


def as_obj(points: Array) -> str:
    """Returns triangles as the text of an OBJ file; points: (3 N, 3) m, their corners."""
    corners = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    faces = [f"f {first} {first + 1} {first + 2}" for first in range(1, len(points), 3)]
    return "\n".join([*corners, *faces, ""])
