"""The releases of Nav2 that parameters and plugins may be written for.

A model of parameters has the class variable READ_BY: by parameter, which releases read it and which
of them have another default. `read_by` and `defaults_in` ask it.

Source: the branches humble, iron, jazzy, kilted and lyrical of navigation2.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Final, NamedTuple


class Release(StrEnum):
    """A release of Nav2; an older one is less than a newer one."""

    HUMBLE = "humble"
    IRON = "iron"
    JAZZY = "jazzy"
    KILTED = "kilted"
    LYRICAL = "lyrical"

    @property
    def version(self) -> tuple[int, int]:
        """Major and minor number of its packages, such as (1, 3) of Jazzy's nav2_core 1.3.13."""
        return 1, 1 + list(Release).index(self)

    def __lt__(self, other: str) -> bool:
        """Returns whether this release is older than the other."""
        return self.version < Release(other).version

    def __le__(self, other: str) -> bool:
        """Returns whether this release is older than the other, or the same."""
        return self.version <= Release(other).version

    def __gt__(self, other: str) -> bool:
        """Returns whether this release is newer than the other."""
        return self.version > Release(other).version

    def __ge__(self, other: str) -> bool:
        """Returns whether this release is newer than the other, or the same."""
        return self.version >= Release(other).version


# The release that everything here is ported from unless stated otherwise.
NEWEST_RELEASE: Final = Release.LYRICAL
# The name of a controller's parameter that chooses the release whose rules hold.
RELEASE_FIELD: Final = "nav2_release"


def release_in(values: Any) -> Release:
    """Returns the release that a controller's values name, the newest where they name none.

    values: a mapping, as read from a file; None counts as empty. A name that is no release counts
    as the newest: the parameter model refuses it by itself.
    """
    name = (values or {}).get(RELEASE_FIELD, NEWEST_RELEASE)
    return Release(name) if name in set(Release) else NEWEST_RELEASE


class ReadBy(NamedTuple):
    """The releases that read a parameter, and the defaults that differ from ours.

    releases: the releases that read the parameter. defaults: by release, the value that counts
    there if no file gives one; only where it differs from the default of our model.
    """

    releases: frozenset[Release] = frozenset(Release)
    defaults: Mapping[Release, Any] = {}


def read_by(model: type, name: str) -> ReadBy:
    """Returns the releases that read a parameter, as the READ_BY of its model or a base says.

    Every release reads a parameter that is not in READ_BY, with the same default.
    """
    return facts_of(model).get(name, ReadBy())


def defaults_in(model: type, release: Release) -> dict[str, Any]:
    """Returns the defaults of a release that differ from the model's: name -> default."""
    known = facts_of(model).items()
    return {name: found.defaults[release] for name, found in known if release in found.defaults}


def facts_of(model: type) -> Mapping[str, ReadBy]:
    """Returns READ_BY of a model and its bases; entries of the model itself prevail."""
    facts: dict[str, ReadBy] = {}
    for base in reversed(model.__mro__):
        facts |= vars(base).get("READ_BY", {})
    return facts


def since(release: Release, defaults: Mapping[Release, Any] | None = None) -> ReadBy:
    """Returns the mark of a parameter that releases from `release` on read.

    defaults: by older releases, the values that hold there.
    """
    return ReadBy(frozenset(other for other in Release if other >= release), defaults or {})


def until(release: Release) -> ReadBy:
    """Returns the mark of a parameter that a release and older ones read."""
    return ReadBy(frozenset(other for other in Release if other <= release))


def before(release: Release, value: Any) -> dict[Release, Any]:
    """Returns `value` for each release that is older than `release`."""
    return {other: value for other in Release if other < release}
