"""Fields of a robot laid over those of another: of a file over its `like`, of single overrides."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drake_navbench.plugins.kinds import foreign_plugins
from drake_navbench.plugins.parameters import normalized


def merged(base: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Returns `base` with `overrides` laid over it, mapping by mapping.

    Where an override names another plugin, and one of the two plugins is of another package, it
    replaces the whole block: parameters belong to their plugin.
    """
    result = dict(base)
    for key, value in overrides.items():
        nested = isinstance(value, Mapping) and isinstance(result.get(key), Mapping)
        if nested and not _are_of_other_packages(result[key], value):
            result[key] = merged(result[key], value)
        else:
            result[key] = value
    return result


def _are_of_other_packages(block: Mapping[str, Any], override: Mapping[str, Any]) -> bool:
    before, after = normalized(block.get("plugin")), normalized(override.get("plugin"))
    if after is None or after == before:
        return False
    foreign = {name for _, name, _ in foreign_plugins()}
    return any(isinstance(name, str) and name in foreign for name in (before, after))
