"""Finds MPPI's critics by name among the installed ones, the built-in and a user's alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from drake_navbench.controllers.mppi.critics.base import Critic, CriticContext
from drake_navbench.plugins.kinds import PluginKind

CRITICS = PluginKind(
    noun="critic", group="drake_navbench.mppi_critics", members=("Parameters", "score")
)


def load_critics(blocks: Iterable[tuple[str, Any]], context: CriticContext) -> list[Critic]:
    """Builds the critics of these names with their parameters, in that order.

    Raises InputError for a name that is not registered, or that is broken.
    """
    critics: list[Critic] = []
    for name, parameters in blocks:
        loaded = CRITICS.load(name)
        # A class that is not a subclass of `Critic` scores the same in all releases.
        of_release = getattr(loaded, "of_release", lambda release, loaded=loaded: loaded)
        critics.append(of_release(context.release)(parameters, context))
    return critics
