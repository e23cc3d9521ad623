"""Settings in a form that a kernel takes at no cost."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


def settings_record(settings: NamedTuple) -> NDArray[np.void]:
    """Returns settings (booleans, numbers, such tuples) as a read-only array (1,) of one record.

    A kernel reads `records[0]` by the same names. numba takes a tuple apart field by field at every
    call, which for forty of them takes longer than the kernel; an array it takes as it is.
    """
    records = np.array([_values(settings)], dtype=_record_type(settings))
    records.flags.writeable = False
    return records


def _values(settings: Any) -> tuple[Any, ...]:
    return tuple(_values(value) if isinstance(value, tuple) else value for value in settings)


def _record_type(settings: Any) -> np.dtype[np.void]:
    types = [
        _record_type(value) if isinstance(value, tuple) else np.asarray(value).dtype
        for value in settings
    ]
    return np.dtype(list(zip(settings._fields, types, strict=True)))
