"""Finds plugins among the installed entry points, with the same look-up and errors for all kinds.

A plugin is code that is not ours and may fail in any way. An error names the broken plugin, its
package and the fault; the other plugins stay usable. Built-in plugins are registered as a user's
are, in pyproject.toml, or stand in a table of their kind where nothing else would import them later
than the kind itself.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.metadata import Distribution, EntryPoint, entry_points
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import (
    InputError,
    InputWarning,
    is_machine_fault,
    nearest_name_hint,
    one_line,
)

OUR_PACKAGE = "drake_navbench"
# The prefix of all groups of entry points that we read.
GROUP_PREFIX = f"{OUR_PACKAGE}."
OUR_DISTRIBUTION = "drake-navbench"


# A name that differs from a known one by more than a slip means another plugin.
LIKE_A_SLIP = 0.75


class Origin(NamedTuple):
    """The installed package that brings a plugin: its name and version."""

    package: str
    version: str

    def __str__(self) -> str:
        return f"{self.package} {self.version}".strip()


UNKNOWN_ORIGIN = Origin("an unknown package", "")


@dataclass(frozen=True, eq=False)
class PluginKind:
    """One kind of plugin.

    noun: its name in errors. group: the name of its group of entry points. members: attributes that
    a class of this kind must have; empty where an entry point may name an object that is no class.
    base: returns the class that it must derive from; None where any class with `members` will do.
    parameters: the class that its `Parameters` must derive from; None where they are checked
    elsewhere. built_in: by name, our plugins that pyproject.toml does not register; an EntryPoint
    among them is loaded when it is first used. has_own_blocks: whether a `plugin:` block of a file
    may name a built-in plugin, too. guide: the page of the documentation on this kind.
    """

    noun: str
    group: str
    members: tuple[str, ...] = ()
    guide: str = "docs/controllers.md"
    base: Callable[[], type] | None = None
    parameters: type[Any] | None = None
    built_in: Mapping[str, Any] = field(default_factory=dict)
    has_own_blocks: bool = False

    @property
    def names(self) -> list[str]:
        """The registered names, sorted."""
        return sorted({*self.built_in, *_installed(self.group)})

    def __contains__(self, name: object) -> bool:
        return name in self.built_in or name in _installed(self.group)

    def load(self, name: str) -> Any:
        """Returns the plugin that is registered as `name`.

        Raises InputError where no plugin or several have this name, where its import fails, or
        where it is not a class with the members that this kind needs.
        """
        points = _installed(self.group).get(name, ())
        if len(points) + (name in self.built_in) > 1:
            ours = [_named(OUR_DISTRIBUTION)] if name in self.built_in else []
            packages = " and ".join(sorted([*ours, *map(_package, points)]))
            raise InputError(
                f"{self.noun} {name!r}: registered by {packages}; expected one of this name"
            )
        if name in self.built_in:
            ours = self.built_in[name]
            return ours.load() if isinstance(ours, EntryPoint) else ours
        if not points:
            hint = nearest_name_hint(name, self.names, likeness=LIKE_A_SLIP)
            raise InputError(f"{self.noun} {name!r} is not registered{hint}")
        (point,) = points
        try:
            with contextlib.chdir("."):
                loaded = point.load()
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and is_ours(point.module):
                raise
            # The module is somebody's code: it may raise anything.
            raise InputError(
                f"{self.noun} {name!r} of {_package(point)}: entry point {point.value} cannot be "
                f"loaded: {one_line(error)}"
            ) from error
        self.require_contract(loaded, f"{self.noun} {name!r} of {_package(point)}", point.value)
        return loaded

    def require_contract(self, loaded: Any, who: str, where: str) -> None:
        """Raises InputError unless what was loaded is a class of this kind.

        who, where: the names of the plugin and of the class in errors.
        """
        base = self.base() if self.base is not None else object
        missing = [name for name in self.members if not _has_own(loaded, name, base)]
        if missing or (self.members and not isinstance(loaded, type)):
            raise InputError(
                f"{who}: {where} is not a class with {', '.join(missing or self.members)}, "
                f"as {self.guide} describes it"
            )
        if self.base is not None and not issubclass(loaded, base):
            raise InputError(
                f"{who}: {where} is not a subclass of {base.__name__}, as {self.guide} describes it"
            )
        if self.parameters is not None and not _is_class_of(loaded.Parameters, self.parameters):
            raise InputError(
                f"{who}: the Parameters of {where} are no {self.parameters.__name__}, "
                f"as {self.guide} describes them"
            )

    def make(self, name: str, *arguments: Any) -> Any:
        """Returns an object of the plugin that is registered as `name`.

        Raises InputError where there is none, or where a plugin of others cannot be made.
        """
        chosen = self.load(name)
        origin = self.origin(name)
        if origin is None:
            return chosen(*arguments)
        try:
            return chosen(*arguments)
        except BaseException as error:
            if is_machine_fault(error):
                raise
            raise InputError(
                f"{self.noun} {name!r} of {_named(origin.package)}: cannot be made: "
                f"{one_line(error)}"
            ) from error

    def origin(self, name: str) -> Origin | None:
        """Returns the origin of the plugin `name`; None for a built-in plugin."""
        for point in _installed(self.group).get(name, ()):
            if not is_ours(point.module):
                return _origin(point)
        return None

    def folder(self, name: str) -> Path | None:
        """Returns the folder of the plugin `name`, None where it is not found.

        Neither the module nor the packages that contain it are imported: code that is not ours runs
        only when a user names its plugin.
        """
        return _folder(_installed(self.group)[name][0].module)

    def load_all(
        self, check: Callable[[str, Any], Any] = lambda name, loaded: loaded
    ) -> dict[str, Any]:
        """Returns the plugins that can be loaded, by name; warns of the others.

        check: function from a plugin's name and the loaded object to the value that is kept of it;
        raises InputError where the object is not of this kind.
        """
        kept: dict[str, Any] = {}
        for name in self.names:
            try:
                kept[name] = check(name, self.load(name))
            except InputError as error:
                warnings.warn(str(error), InputWarning, stacklevel=2)
        return kept


def _installed(group: str) -> Mapping[str, tuple[EntryPoint, ...]]:
    """Returns the entry points of a group by name."""
    return _all_installed().get(group, {})


@cache
def _all_installed() -> Mapping[str, Mapping[str, tuple[EntryPoint, ...]]]:
    """Returns the entry points of all our groups by group and name; one look for all of them."""
    installed = entry_points()
    groups: dict[str, dict[str, tuple[EntryPoint, ...]]] = {}
    for group in installed.groups:
        if group.startswith(GROUP_PREFIX):
            names = groups.setdefault(group, {})
            for point in installed.select(group=group):
                names[point.name] = (*names.get(point.name, ()), point)
    return groups


def forget_installed() -> None:
    """Makes the next look-up read the installed packages again, such as after an installation."""
    _all_installed.cache_clear()
    _folder.cache_clear()


def _has_own(loaded: Any, member: str, base: type) -> bool:
    """Returns whether an object has a member of its own, not only the one of its base."""
    found = getattr(loaded, member, None)
    return hasattr(loaded, member) and (found is None or found is not getattr(base, member, None))


def _is_class_of(model: Any, base: type) -> bool:
    return isinstance(model, type) and issubclass(model, base)


def foreign_plugins() -> Iterator[tuple[str, str, Origin]]:
    """Yields group, name and origin of every plugin that leads to a module of others.

    Nothing of them is imported.
    """
    for group, names in sorted(_all_installed().items()):
        for name, points in sorted(names.items()):
            for point in points:
                if not is_ours(point.module):
                    yield group, name, _origin(point)


def is_ours(module: str) -> bool:
    """Returns whether a module belongs to this package, and not to a plugin of others."""
    return module.partition(".")[0] == OUR_PACKAGE


@cache
def _folder(module: str) -> Path | None:
    """Returns the folder of a module, None where it is not found; nothing is imported."""
    parts = module.split(".")
    path, spec = None, None
    for end in range(1, len(parts) + 1):
        spec = _find_spec(".".join(parts[:end]), path)
        if spec is None:
            return None
        path = spec.submodule_search_locations
    return Path(spec.origin).parent if spec and spec.origin else None


def _find_spec(name: str, path: Any) -> ModuleSpec | None:
    """Does what importlib.util.find_spec does, which imports the parents of a module first."""
    for finder in sys.meta_path:
        spec = finder.find_spec(name, path)
        if spec is not None:
            return spec
    return None


def _origin(point: EntryPoint) -> Origin:
    return UNKNOWN_ORIGIN if point.dist is None else Origin(point.dist.name, point.dist.version)


def _package(point: EntryPoint) -> str:
    return UNKNOWN_ORIGIN.package if point.dist is None else _named(_name_of(point.dist))


@cache
def _name_of(distribution: Distribution) -> str:
    """Returns a distribution's name, which is parsed out of its metadata in milliseconds."""
    return distribution.name


def _named(package: str) -> str:
    return f"package {package!r}"
