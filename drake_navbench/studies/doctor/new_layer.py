"""An obstacle layer for a costmap without one, as changes of the file."""

from __future__ import annotations

from typing import Any

from drake_navbench.nav2.patch import SHORT_NODES, Place
from drake_navbench.studies.doctor.facts import COSTMAPS, Facts

LAYER, SOURCE = "obstacle_layer", "scan"
PLUGIN = "nav2_costmap_2d::ObstacleLayer"
MARKING = ("ObstacleLayer", "VoxelLayer")
# A source's own default height is 0 m in older releases: it would mark nothing.
HEIGHT_M = 2.0


def with_obstacle_layer(costmap: str, facts: Facts) -> dict[Place, Any]:
    """Returns the changes that let a costmap mark what a lidar sees.

    A layer that the file has, but does not list, is listed. Else a new one listens to the topic of
    another source of the file, or to /scan. It comes before the inflation, which takes in only what
    stands before it.
    """
    layers = [str(name) for name in facts[f"{costmap}.plugins"] or ()]
    inflation = next((i for i, name in enumerate(layers) if "inflation" in name), len(layers))
    node, name = SHORT_NODES[costmap], missing_layer(costmap, facts)
    listed = {Place(node, "plugins"): [*layers[:inflation], name, *layers[inflation:]]}
    if f"{costmap}.{name}.plugin" in facts.raw:
        return listed
    layer = {
        "plugin": PLUGIN,
        "enabled": True,
        "observation_sources": SOURCE,
        f"{SOURCE}.topic": _topic(facts),
        f"{SOURCE}.data_type": "LaserScan",
        f"{SOURCE}.max_obstacle_height": HEIGHT_M,
        f"{SOURCE}.marking": True,
        f"{SOURCE}.clearing": True,
    }
    return listed | {Place(node, f"{LAYER}.{key}"): value for key, value in layer.items()}


def missing_layer(costmap: str, facts: Facts) -> str:
    """Returns the name of the layer that a costmap does not list: of the file's own, else LAYER."""
    for place, value in facts.raw.items():
        layer, _, name = place.removeprefix(f"{costmap}.").rpartition(".")
        is_own = place.startswith(f"{costmap}.") and name == "plugin" and "." not in layer
        if is_own and str(value).endswith(MARKING):
            return layer
    return LAYER


def _topic(facts: Facts) -> str:
    """Returns the topic of the first scan to which a costmap of the file listens."""
    for place, value in facts.raw.items():
        source, _, name = place.rpartition(".")
        is_scan = facts.raw.get(f"{source}.data_type") == "LaserScan"
        if name == "topic" and is_scan and place.startswith(tuple(COSTMAPS)):
            return str(value)
    return "/scan"
