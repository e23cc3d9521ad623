"""Names of nested parameters: `a.b: 1` and `a: {b: 1}` are the same parameter, as in ROS."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from drake_navbench.errors import InputError

SEPARATOR = "."


def flattened(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yields dotted names with their values, in order; a name that is given twice comes twice."""
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flattened(value, f"{name}{SEPARATOR}")
        else:
            yield name, value


def nested(named_values: Iterable[tuple[str, Any]], source: str) -> dict[str, Any]:
    """Returns mappings of mappings for dotted names.

    source: names where they came from. Raises InputError where a name is given twice, or as a value
    and as a block.
    """
    result: dict[str, Any] = {}
    for name, value in named_values:
        *blocks, last = name.split(SEPARATOR)
        target = result
        for block in blocks:
            target = target.setdefault(block, {})
            if not isinstance(target, dict):
                raise InputError(f"{source}: {name}: expected a block, but {block} has a value")
        if isinstance(target.get(last), dict):
            raise InputError(f"{source}: {name}: expected a block, got {value!r}")
        if last in target:
            raise InputError(f"{source}: {name}: is given twice")
        target[last] = value
    return result
