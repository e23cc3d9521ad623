"""An obstacle layer for a costmap without one, as changes of the file."""

from __future__ import annotations

from typing import Any

from drake_navbench.nav2.patch import SHORT_NODES, Place
from drake_navbench.studies.doctor.facts import COSTMAPS, Facts

LAYER, SOURCE = "obstacle_layer", "scan"
PLUGIN = "nav2_costmap_2d::ObstacleLayer"
# A source's own default height is 0 m in older releases: it would mark nothing.
HEIGHT_M = 2.0


def with_obstacle_layer(costmap: str, facts: Facts) -> dict[Place, Any]:
    """Returns the changes that let a costmap mark what a lidar sees.

    The topic is that of another source of the file, else /scan. The layer comes before the
    inflation, which takes in only what stands before it.
    """
    layers = [str(name) for name in facts[f"{costmap}.plugins"] or ()]
    inflation = next((i for i, name in enumerate(layers) if "inflation" in name), len(layers))
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
    node = SHORT_NODES[costmap]
    return {
        Place(node, "plugins"): [*layers[:inflation], LAYER, *layers[inflation:]],
        **{Place(node, f"{LAYER}.{name}"): value for name, value in layer.items()},
    }


def _topic(facts: Facts) -> str:
    """Returns the topic of the first scan to which a costmap of the file listens."""
    for place, value in facts.raw.items():
        source, _, name = place.rpartition(".")
        is_scan = facts.raw.get(f"{source}.data_type") == "LaserScan"
        if name == "topic" and is_scan and place.startswith(tuple(COSTMAPS)):
            return str(value)
    return "/scan"
