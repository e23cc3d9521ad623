"""Finds MPPI's critics by name among the installed ones, the built-in and a user's alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drake_navbench.controllers.mppi.critics.base import Critic, CriticContext
from drake_navbench.plugins.kinds import PluginKind

if TYPE_CHECKING:
    from drake_navbench.controllers.mppi.parameters import MppiParameters

CRITICS = PluginKind(
    noun="critic", group="drake_navbench.mppi_critics", members=("Parameters", "score")
)


def load_critics(parameters: MppiParameters, context: CriticContext) -> list[Critic]:
    """Builds the critics that `parameters.critics` names, in that order.

    Raises InputError for a name that is not registered, or that is broken.
    """
    critics: list[Critic] = []
    for name in parameters.critics:
        loaded = CRITICS.load(name)
        # One that is not a subclass of `Critic` scores the same in all releases.
        of_release = getattr(loaded, "of_release", lambda release, loaded=loaded: loaded)
        critics.append(of_release(context.release)(parameters.critic(name), context))
    return critics
