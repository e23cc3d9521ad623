"""Finds MPPI's critics by name among the installed ones, the built-in and a user's alike."""

from __future__ import annotations

from drake_navbench.controllers.mppi.critics.base import Critic, CriticContext
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.plugins import PluginKind

CRITICS = PluginKind(noun="critic", group="drake_navbench.mppi_critics", members=("score",))


def load_critics(parameters: MppiParameters, context: CriticContext) -> list[Critic]:
    """Builds the critics that `parameters.critics` names, in that order.

    Raises InputError for a name that is not registered, or that is broken.
    """
    critics = []
    for name in parameters.critics:
        critic = CRITICS.load(name)
        block = getattr(parameters, name, None)
        if block is None:
            block = parameters.user_critics.get(name, {})
        critics.append(critic(block, context))
    return critics
