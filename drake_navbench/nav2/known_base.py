"""The robot's base in Nav2 files: its link, its outline, the topics of its scans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from drake_navbench.inputs.known_base import KnownBase
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.costmaps import GLOBAL_COSTMAP, LOCAL_COSTMAP
from drake_navbench.nav2.loadable import AMCL
from drake_navbench.nav2.outline import corners_of, is_footprint
from drake_navbench.nav2.parameters import Node, nodes_called, read_parameter_file


def known_base_of(paths: Sequence[Path]) -> KnownBase:
    """Returns the robot's base in Nav2 files: link, outline, scans, and whether it is an omni."""
    sections = [section for path in paths for section in read_parameter_file(path).sections]
    nodes = [
        node for name in (LOCAL_COSTMAP, GLOBAL_COSTMAP) for node in nodes_called(name, sections)
    ]
    frames = [node.get("robot_base_frame") for node in nodes]
    # The frame's name may have the namespace of a robot among several before it.
    links = [frame.rpartition("/")[2] for frame in frames if isinstance(frame, str) and frame]
    outlines = [outline for node in nodes for outline in (_outline_in(node),) if outline]
    scans = tuple(dict.fromkeys(topic for node in nodes for topic in _scans_of(node)))
    known = outlines[0] if outlines else KnownBase()
    is_omni = any(map(_is_omni, nodes_called(AMCL, sections))) or any(
        map(_drives_sideways, nodes_called(SERVER, sections))
    )
    return known._replace(link=links[0] if links else None, scans=scans, is_omni=is_omni)


def _is_omni(amcl: Node) -> bool:
    return "omni" in str(amcl.get("robot_model_type")).lower()


def _drives_sideways(server: Node) -> bool:
    """Tells whether DWB may drive sideways, or MPPI has a motion model that does."""
    ends = {name.rpartition(".")[2]: entry.value for name, entry in server.parameters.items()}
    most = ends.get("max_vel_y")
    return ends.get("motion_model") == "Omni" or (isinstance(most, int | float) and most > 0.0)


def _scans_of(node: Node) -> Iterator[str]:
    """Yields the topics of scans that the layers of a costmap take."""
    plugins = node.get("plugins")
    for layer in plugins if isinstance(plugins, list) else ():
        sources = node.get(f"{layer}.observation_sources")
        for source in sources.split() if isinstance(sources, str) else ():
            place = f"{layer}.{source}"
            topic, kind = node.get(f"{place}.topic"), node.get(f"{place}.data_type", "LaserScan")
            if isinstance(topic, str) and kind == "LaserScan":
                yield topic


def _outline_in(node: Node) -> KnownBase | None:
    """Returns the outline in a costmap's parameters; None where there is none, or a wrong one."""
    given, radius_m = node.get("footprint"), node.get("robot_radius")
    if is_footprint(given):
        return KnownBase(footprint=tuple((float(x), float(y)) for x, y in corners_of(given)))
    is_number = isinstance(radius_m, int | float) and not isinstance(radius_m, bool)
    return KnownBase(radius_m=float(radius_m)) if is_number and radius_m > 0.0 else None
