"""Limits of the message definitions in a recording, held before any code is made of them.

The library writes a line of code for each field, and for each element of an array of fixed length,
and runs it for each message. No message of ROS comes near these limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drake_navbench.errors import InputError, as_line

# The most bytes of a definition with all types in it; a MarkerArray has 12 kB.
MAX_TEXT = 100_000
MAX_FIELDS = 1_000
# The most elements of one array of fixed length.
MAX_LENGTH = 10_000
# The most single values in a message whose sequences have one element each.
MAX_VALUES = 100_000


def require_short(text: str, place: str) -> None:
    """Raises InputError where the text of a definition is too long to be parsed."""
    if len(text) > MAX_TEXT:
        raise InputError(
            f"{place}: a message definition of {len(text)} characters, expected at most {MAX_TEXT}"
        )


def require_small(fielddefs: Mapping[str, Any], place: str) -> None:
    """Raises InputError where a message of these types would have too many values.

    fielddefs: the fields of each type by its name, as the library gives them.
    """
    counts: dict[str, int] = {}
    for name in fielddefs:
        _values_of(name, fielddefs, counts, (), place)


def _values_of(
    name: str,
    fielddefs: Mapping[str, Any],
    counts: dict[str, int],
    above: tuple[str, ...],
    place: str,
) -> int:
    """Returns the number of values in a message of a type; a type without definition counts one."""
    from rosbags.interfaces import Nodetype

    if name in counts or name not in fielddefs:
        return counts.get(name, 1)
    shown = as_line(name)
    if name in above:
        raise InputError(f"{place}: the message type {shown} holds itself")
    if len(above) > MAX_FIELDS:
        raise InputError(f"{place}: message types within each other, more than {MAX_FIELDS} deep")
    fields = fielddefs[name][1]
    if len(fields) > MAX_FIELDS:
        raise InputError(
            f"{place}: the message type {shown} has {len(fields)} fields, expected at most "
            f"{MAX_FIELDS}"
        )
    count = 0
    for field, (kind, inner) in fields:
        length = 1
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (subkind, subtype), bound = inner
            length = bound if kind == Nodetype.ARRAY else 1
        else:
            subkind, subtype = kind, inner
        if length > MAX_LENGTH:
            raise InputError(
                f"{place}: {as_line(field)} of {shown} is an array of {length}, expected at most "
                f"{MAX_LENGTH}"
            )
        values = 1
        if subkind == Nodetype.NAME:
            values = _values_of(subtype, fielddefs, counts, (*above, name), place)
        count += length * values
    if count > MAX_VALUES:
        raise InputError(
            f"{place}: the message type {shown} holds {count} values, expected at most {MAX_VALUES}"
        )
    counts[name] = max(count, 1)
    return counts[name]
