"""Arrays in the one form that kernels are compiled for."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def read_only(values: ArrayLike) -> NDArray[np.float64]:
    """Returns values as a C-contiguous, read-only float64 array, without a copy where possible.

    numba compiles a kernel anew for writable and read-only, contiguous and strided arrays; passing
    all through here leaves one form. The given array stays as it is.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array
