"""The places of a parameter in the user's file: which node, which plugin, by which name."""

from __future__ import annotations

from collections.abc import Iterator

from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.node_names import BT_NAVIGATOR, PLANNER_SERVER
from drake_navbench.nav2.patch import Place
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import CONTROLLER, COSTMAPS, Facts

# The layers that have a parameter.
LAYERS = {
    "inflation_radius": "InflationLayer",
    "cost_scaling_factor": "InflationLayer",
    "inflate_unknown": "InflationLayer",
}
# The parameters of an obstacle layer's sources.
OF_SOURCES = frozenset(
    {
        "clearing",
        "inf_is_valid",
        "marking",
        "max_obstacle_height",
        "min_obstacle_height",
        "observation_persistence",
        "obstacle_max_range",
        "obstacle_min_range",
        "raytrace_max_range",
    }
)
OWN_NODES = {"planner": PLANNER_SERVER, "behavior_tree": BT_NAVIGATOR}


def file_places(place: str, facts: Facts, setup: Nav2Setup) -> Iterator[Place]:
    """Yields the places of a parameter in the file, whether it is there or must be added."""
    first, _, name = place.partition(".")
    nodes = {**COSTMAPS, **OWN_NODES}
    if first == CONTROLLER:
        yield Place(SERVER, f"{facts.plugin}.{_own_name(name, facts, setup)}")
    elif first in ("goal_checker", "progress_checker"):
        listed = facts[f"{SERVER}.{first}_plugins"] or facts[f"{SERVER}.{first}_plugin"]
        names = listed if isinstance(listed, list) else [listed or first]
        yield Place(SERVER, f"{names[0]}.{name}")
    elif first in COSTMAPS:
        yield from _layer_places(COSTMAPS[first], name, setup)
    elif first == "planner":
        plugins = facts["planner.planner_plugins"] or ["GridBased"]
        yield Place(PLANNER_SERVER, f"{plugins[0]}.{name}")
    elif first == "collision_monitor":
        yield Place(first, name.removeprefix("polygons."))
    else:
        yield Place(nodes.get(first, first), name)


def _own_name(name: str, facts: Facts, setup: Nav2Setup) -> str:
    """Returns the name that the file has for a controller's parameter: newer, older or nested."""
    given = {parameter for node, parameter in setup.given if node.endswith(SERVER)}
    choices = [f"primary_controller.{name}", name]
    if name == "max_linear_vel":
        choices.insert(0, "desired_linear_vel")
    is_older = facts.release is not Release.LYRICAL
    usual = choices[0] if name == "max_linear_vel" and is_older else name
    return next((choice for choice in choices if f"{facts.plugin}.{choice}" in given), usual)


def _layer_places(node: str, name: str, setup: Nav2Setup) -> Iterator[Place]:
    given = {p: v for (owner, p), v in setup.given.items() if owner.endswith(node)}
    listed = (*given.get("plugins", ()), *given.get("filters", ()))
    found = [
        parameter
        for parameter in given
        if parameter.rpartition(".")[2] == name
        and ("." not in parameter or parameter.partition(".")[0] in listed)
    ]
    if found:
        yield from (Place(node, parameter) for parameter in found)
        return
    if name in OF_SOURCES:
        sources = (
            p.removesuffix(".topic") for p in given if p.endswith(".topic") and p.count(".") > 1
        )
        own = [source for source in sources if source.partition(".")[0] in listed]
        yield from (Place(node, f"{source}.{name}") for source in own)
        return
    kind = LAYERS.get(name)
    layers = [
        layer for layer in listed if kind and str(given.get(f"{layer}.plugin", "")).endswith(kind)
    ]
    if layers:
        yield Place(node, f"{layers[0]}.{name}")
    elif kind is None:
        yield Place(node, name)
