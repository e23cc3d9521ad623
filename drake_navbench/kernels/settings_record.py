"""Settings in a form that a compiled kernel takes without unpacking."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


def settings_record(settings: Mapping[str, Any]) -> NDArray[np.void]:
    """Returns settings by name as a read-only array (1,) of one record.

    The values are booleans, numbers, and named tuples of such values.

    A kernel reads `records[0]` by the same names. numba takes a tuple apart field by field at every
    call, which for forty of them takes longer than the kernel; an array it takes as it is.
    """
    values = tuple(settings.values())
    records = np.array([_values(values)], dtype=_record_type(_description(settings, values)))
    records.flags.writeable = False
    return records


def _values(settings: Any) -> tuple[Any, ...]:
    return tuple(_values(value) if isinstance(value, tuple) else value for value in settings)


def _description(names: Iterable[str], values: Any) -> tuple[tuple[str, Any], ...]:
    """Returns name and type of each field, in a form that can be a key."""
    types = [
        _description(value._fields, value) if hasattr(value, "_fields") else np.asarray(value).dtype
        for value in values
    ]
    return tuple(zip(names, types, strict=True))


@cache
def _record_type(description: tuple[tuple[str, Any], ...]) -> np.dtype[np.void]:
    """Returns one and the same type for equal descriptions.

    numba knows a record by its type object at once; an equal other one it compares field by field.
    """
    return np.dtype(
        [
            (name, _record_type(type_) if isinstance(type_, tuple) else type_)
            for name, type_ in description
        ]
    )
