"""Finds critics by name among the installed entry points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from typing import Any

from drake_navbench.controllers.dwb.critics.base import Critic
from drake_navbench.errors import InputError, nearest_name_hint

ENTRY_POINT_GROUP = "drake_navbench.dwb_critics"
NAMESPACE_SEPARATOR = "::"
NAV2_SUFFIX = "Critic"


@dataclass(frozen=True)
class CriticRegistry:
    """The installed critics by name; built-in ones are registered as a user's are."""

    _entry_points: Mapping[str, Any] = field(
        default_factory=lambda: {p.name: p for p in entry_points(group=ENTRY_POINT_GROUP)}
    )

    @property
    def names(self) -> list[str]:
        """The registered names, sorted."""
        return sorted(self._entry_points)

    def __contains__(self, name: str) -> bool:
        return _bare_name(name) in self._entry_points

    def load(self, name: str) -> type[Critic]:
        """Returns the critic class for a name such as `PathDist` or `dwb_critics::PathDistCritic`.

        Raises InputError if there is none.
        """
        bare_name = _bare_name(name)
        if bare_name not in self._entry_points:
            hint = nearest_name_hint(bare_name, self.names)
            raise InputError(f"critic {name!r} is not registered{hint}")
        return self._entry_points[bare_name].load()


def _bare_name(name: str) -> str:
    return name.rpartition(NAMESPACE_SEPARATOR)[2].removesuffix(NAV2_SUFFIX)
