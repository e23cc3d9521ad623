"""Finds DWB's critics by name among the installed ones, under Nav2's names too."""

from __future__ import annotations

from typing import Any

from drake_navbench.plugins.kinds import PluginKind

CRITICS = PluginKind(
    noun="critic", group="drake_navbench.dwb_critics", members=("Parameters", "reasons", "score")
)
NAMESPACE_SEPARATOR = "::"
NAV2_SUFFIX = "Critic"


def load_critic(name: str) -> Any:
    """Returns the critic class for a name such as `PathDist` or `dwb_critics::PathDistCritic`.

    Raises InputError where there is none, or where it is broken.
    """
    return CRITICS.load(bare_name(name))


def bare_name(name: str) -> str:
    """Returns the name of an entry point for one of Nav2's class names, `dwb_critics::XCritic`."""
    return name.rpartition(NAMESPACE_SEPARATOR)[2].removesuffix(NAV2_SUFFIX)
