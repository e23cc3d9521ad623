"""Columns that drive an original: `rpp@NAME` is the original of `rpp` from the build NAME."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.native.builds import Build, find_build

# The text after an equals sign belongs to a parameter, and may contain anything.
_REFERENCE = re.compile(r"(?P<name>[^@=]+)@(?P<build>[^:=]*)(?::(?P<rest>.*))?", re.DOTALL)


class Original(NamedTuple):
    """The controller that `name@build:param=value` names.

    name: name of a preset whose controller has an original, or that original's plugin type itself.
    """

    name: str
    build: Build
    assignments: tuple[str, ...]

    @property
    def description(self) -> str:
        """The line for tables and lists."""
        return f"the original of {self.name}, Nav2 {self.build.where_from}"

    def hosted(self, plugin: str | None, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the parameters of `external` that run a build's plugin with these parameters.

        Raises InputError where the build does not have it.
        """
        build = self.build
        if plugin is None:
            raise InputError(
                f"controller {self.name}@{build.name}: it is not a port of a Nav2 controller"
            )
        if plugin in build.controllers:
            client = {"plugin": plugin, "parameters": parameters}
            return {"command": [str(build.host)], "client": client}
        reason = build.left_out.get(plugin, f"it has {', '.join(build.controllers)}")
        raise InputError(
            f"controller {self.name}@{build.name}: {plugin} is not in the build: {reason}"
        )


def is_plugin_type(name: str) -> bool:
    """Returns whether a name is that of a C++ class, and of no preset."""
    return "::" in name


def names_original(text: str) -> bool:
    """Returns whether a text names a controller by a build."""
    return _REFERENCE.fullmatch(text) is not None


def original_of(text: str) -> Original:
    """Reads `name@build:param=value`; raises InputError where there is no such build."""
    found = _REFERENCE.fullmatch(text)
    assert found is not None
    assignments = tuple(found["rest"].split(":")) if found["rest"] is not None else ()
    return Original(found["name"], find_build(found["build"]), assignments)
