"""Which columns run code that is not ours: plugins, found by entry point like our own, or files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from typing import Any

from drake_navbench.inputs.presets import Preset
from drake_navbench.plugins import OUR_PACKAGE, is_ours

# Of controllers, and of what controllers themselves find by entry point, such as critics.
GROUP_PREFIX = f"{OUR_PACKAGE}."


def foreign_names() -> frozenset[str]:
    """Returns the names of the entry points, in groups of ours, that lead to modules of others."""
    installed = entry_points()
    return frozenset(
        point.name
        for group in installed.groups
        if group.startswith(GROUP_PREFIX)
        for point in installed.select(group=group)
        if not is_ours(point.module)
    )


def runs_foreign_code(preset: Preset) -> bool:
    """Returns whether a column's controller, or what its parameters name, is not ours."""
    if preset.file is not None:
        return True
    foreign = foreign_names()
    return preset.controller in foreign or any(
        text in foreign for text in _texts(preset.parameters.model_dump(mode="json"))
    )


def _texts(value: Any) -> Iterator[str]:
    """Yields every text in a nest of mappings and lists, keys included."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            yield str(key)
            yield from _texts(entry)
    elif isinstance(value, list | tuple):
        for entry in value:
            yield from _texts(entry)
