"""Finds critics by name: the built-in ones, and users' by entry point."""

from __future__ import annotations

from importlib.metadata import entry_points

from drake_navbench.controllers.mppi.critics.base import Critic, CriticContext
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.errors import InputError, nearest_name_hint

ENTRY_POINT_GROUP = "drake_navbench.mppi_critics"


def load_critics(parameters: MppiParameters, context: CriticContext) -> list[Critic]:
    """Builds the critics that `parameters.critics` names, in that order.

    Raises InputError for a name that is not registered.
    """
    registered = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    critics = []
    for name in parameters.critics:
        if name not in registered:
            hint = nearest_name_hint(name, registered)
            raise InputError(f"critics: {name!r} is not registered{hint}")
        block = getattr(parameters, name, None)
        if block is None:
            block = parameters.user_critics.get(name, {})
        critics.append(registered[name].load()(block, context))
    return critics
