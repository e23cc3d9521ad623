"""Reads arrays of NumPy's files, `.npy` and `.npz`, without trusting the sizes in them.

Only numbers are read; an array is made only if all of its bytes exist.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


class NoArray(ValueError):
    """Raised for a file that holds no array of numbers; the text says why."""


def array_of(content: bytes) -> NDArray[Any]:
    """Returns the array of numbers in the bytes of a .npy file; raises NoArray."""
    file = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(file)
        shape, is_fortran, dtype = HEADERS[version](file)
    except Exception as error:
        # NumPy, and Python's parser below it, raise errors of many types for a broken header.
        raise NoArray("not a NumPy array") from error
    if not np.issubdtype(dtype, np.number):
        raise NoArray(f"an array of {dtype}, expected numbers")
    count = math.prod(shape)
    if min(shape, default=0) < 0 or count * dtype.itemsize != len(content) - file.tell():
        raise NoArray(f"an array of shape {shape} with too many or few bytes")
    values = np.frombuffer(content, dtype=dtype, offset=file.tell())
    return values.reshape(shape, order="F" if is_fortran else "C")


def arrays_of(content: bytes, names: Sequence[str], *, max_bytes: int) -> dict[str, NDArray[Any]]:
    """Returns the arrays of some names in the bytes of a .npz file; raises NoArray.

    max_bytes: the most bytes of each array, unpacked.
    """
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for name in names:
                with archive.open(f"{name}.npy") as member:
                    unpacked = member.read(max_bytes + 1)
                if len(unpacked) > max_bytes:
                    raise NoArray(f"{name} has more than {max_bytes} bytes")
                arrays[name] = array_of(unpacked)
    except NoArray:
        raise
    except Exception as error:
        # For a damaged file, zipfile and its decompressors raise errors of many types.
        raise NoArray("not a file of numpy.savez") from error
    return arrays
