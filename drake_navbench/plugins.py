"""Finds plugins among the installed entry points: one look-up and one way to fail for every kind.

A plugin is somebody's code, and anything may happen in it. One that is broken is named, with its
package and what is wrong, and leaves the others alone. Built-in plugins are registered as a user's
are, in pyproject.toml.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from drake_navbench.errors import InputError, InputWarning, nearest_name_hint, one_line

OUR_PACKAGE = "drake_navbench"


@dataclass(frozen=True)
class PluginKind:
    """One kind of plugin.

    noun: what it is called in errors. group: of its entry points. members: what a class must have
    to be one; empty where an entry point may name something else than a class. guide: the page
    that describes them.
    """

    noun: str
    group: str
    members: tuple[str, ...] = ()
    guide: str = "docs/controllers.md"

    @property
    def names(self) -> list[str]:
        """The registered names, sorted."""
        return sorted(_installed(self.group))

    def __contains__(self, name: str) -> bool:
        return name in _installed(self.group)

    def load(self, name: str) -> Any:
        """Returns what is registered as `name`.

        Raises InputError where there is none or more than one, where it breaks when imported, or
        where it is no class with the members that it needs.
        """
        points = _installed(self.group).get(name, ())
        if not points:
            hint = nearest_name_hint(name, self.names)
            raise InputError(f"{self.noun} {name!r} is not registered{hint}")
        if len(points) > 1:
            packages = " and ".join(sorted(map(_package, points)))
            raise InputError(
                f"{self.noun} {name!r}: registered by {packages}; expected one of this name"
            )
        (point,) = points
        try:
            with contextlib.chdir("."):
                loaded = point.load()
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and is_ours(point.module):
                raise
            # The module is somebody's code: anything can happen in it.
            raise InputError(
                f"{self.noun} {name!r} of {_package(point)}: entry point {point.value} cannot be "
                f"loaded: {one_line(error)}"
            ) from error
        self.require_contract(loaded, f"{self.noun} {name!r} of {_package(point)}", point.value)
        return loaded

    def require_contract(self, loaded: Any, who: str, where: str) -> None:
        """Raises InputError unless what was loaded is a class of this kind.

        who, where: what errors call the plugin, and the class.
        """
        missing = [member for member in self.members if not hasattr(loaded, member)]
        if missing or (self.members and not isinstance(loaded, type)):
            raise InputError(
                f"{who}: {where} is no class with {', '.join(missing or self.members)}, "
                f"as {self.guide} describes it"
            )

    def folder(self, name: str) -> Path | None:
        """Returns where the module registered as `name` is, None where it is not found.

        The module is not imported, nor are the packages that it is in: what others have installed
        runs only where it is asked for.
        """
        parts = _installed(self.group)[name][0].module.split(".")
        path, spec = None, None
        for end in range(1, len(parts) + 1):
            spec = _find_spec(".".join(parts[:end]), path)
            if spec is None:
                return None
            path = spec.submodule_search_locations
        return Path(spec.origin).parent if spec and spec.origin else None

    def load_all(
        self, check: Callable[[str, Any], Any] = lambda name, loaded: loaded
    ) -> dict[str, Any]:
        """Returns what can be loaded, by name; warns of the others.

        check: makes what is kept of a plugin from its name and what was loaded; raises InputError
        where that is none of this kind.
        """
        kept: dict[str, Any] = {}
        for name in self.names:
            try:
                kept[name] = check(name, self.load(name))
            except InputError as error:
                warnings.warn(str(error), InputWarning, stacklevel=2)
        return kept


@cache
def _installed(group: str) -> Mapping[str, tuple[EntryPoint, ...]]:
    """Returns the entry points of a group by name."""
    points: dict[str, tuple[EntryPoint, ...]] = {}
    for point in entry_points(group=group):
        points[point.name] = (*points.get(point.name, ()), point)
    return points


def forget_installed() -> None:
    """Makes the next look-up read the installed packages again, such as after an installation."""
    _installed.cache_clear()


def is_ours(module: str) -> bool:
    """Tells whether a module belongs to this package, and not to a plugin of others."""
    return module.partition(".")[0] == OUR_PACKAGE


def _find_spec(name: str, path: Any) -> ModuleSpec | None:
    """Does what importlib.util.find_spec does, which imports the parents of a module first."""
    for finder in sys.meta_path:
        spec = finder.find_spec(name, path)
        if spec is not None:
            return spec
    return None


def _package(point: EntryPoint) -> str:
    return f"package {point.dist.name!r}" if point.dist is not None else "an unknown package"
