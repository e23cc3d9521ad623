"""From the obstacle and voxel layers of a Nav2 file to ours, and what their sensors become.

The robot's scanners are the sources of every layer, each once. What differs is noted. Source:
nav2_costmap_2d (ObstacleLayer, VoxelLayer, ObservationBuffer), branches humble to lyrical.
"""

from __future__ import annotations

from typing import Any

from drake_navbench.costmaps.costmap_settings import (
    ObservationSourceSettings,
    ObstacleLayerSettings,
    VoxelLayerSettings,
)
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.nav2_check import Status
from drake_navbench.inputs.nav2_node_reader import NodeReader

SOURCE_FIELDS = (
    "min_obstacle_height",
    "max_obstacle_height",
    "obstacle_min_range",
    "obstacle_max_range",
    "raytrace_min_range",
    "raytrace_max_range",
    "inf_is_valid",
)
SCAN = "LaserScan"
# Nav2's obstacle layer looks at points up to this height where the file says nothing, m.
DEFAULT_LAYER_HEIGHT_M = 2.0


class SensingLayers:
    """Reads the layers of one costmap that see obstacles."""

    def __init__(self, reader: NodeReader, lidar: LidarSettings) -> None:
        self._reader = reader
        self._height_m = lidar.height_m
        self._scanner_count = 1 + len(lidar.further_poses)

    @property
    def _scanners(self) -> str:
        return "one lidar" if self._scanner_count == 1 else f"{self._scanner_count} lidars"

    def read(self, name: str, ours: str) -> dict[str, Any] | None:
        """Returns an obstacle or voxel layer; None where Nav2's would see nothing."""
        reader, prefix = self._reader, f"{name}."
        sources = self._sources(name)
        if not sources:
            remark = "left out; without observation_sources it sees nothing, in Nav2 as well"
            reader.note_block(Status.OTHER_FORM, name, remark)
            return None
        self._note_unlisted(prefix, sources)
        scans = [s for s in sources if reader.node.get(f"{prefix}{s}.data_type", SCAN) == SCAN]
        source = (scans or sources)[0]
        if not scans:
            remark = "no such sensor here; the robot's lidar stands in for it"
            reader.note(Status.STAND_IN, f"{prefix}{source}.data_type", remark)
        taken = scans[: self._scanner_count] or [source]
        for other in sources:
            if other not in taken:
                remark = f"left out; the robot has {self._scanners} and no other sensor"
                reader.note_block(Status.STAND_IN, prefix + other, remark)
        for other in taken[1:]:
            remark = f"another scanner of the robot, with the ranges and heights of {source}"
            reader.note_block(Status.OTHER_FORM, prefix + other, remark)
        if ours == "voxel_layer":
            return self._voxel_layer(prefix, source)
        return self._obstacle_layer(name, source)

    def _note_unlisted(self, prefix: str, sources: list[str]) -> None:
        """Notes the blocks of sources that the layer does not listen to."""
        names = [
            n.removeprefix(prefix) for n in self._reader.node.parameters if n.startswith(prefix)
        ]
        blocks = (name.partition(".")[0] for name in names if "." in name)
        for block in dict.fromkeys(blocks):
            if block not in sources:
                remark = "not among observation_sources"
                self._reader.note_block(Status.UNREAD, prefix + block, remark)

    def _sources(self, name: str) -> list[str]:
        return self._reader.text(f"{name}.observation_sources").split()

    def _source(self, place: str) -> dict[str, Any]:
        """Returns what is given of an observation source; place: its name with a dot."""
        reader = self._reader
        if reader.given(f"{place}data_type"):
            reader.value(f"{place}data_type")
        values = reader.block(
            ObservationSourceSettings, place, names=(*SOURCE_FIELDS, "marking", "clearing")
        )
        persistence = f"{place}observation_persistence"
        if reader.number(persistence, 0.0) != 0.0:
            reader.note(Status.STAND_IN, persistence, "every scan counts until the next one")
        return values

    def _voxel_layer(self, prefix: str, source: str) -> dict[str, Any]:
        reader = self._reader
        names = [n for n in VoxelLayerSettings.model_fields if n != "observation_sources"]
        values = reader.block(VoxelLayerSettings, prefix, names=names)
        observed = {source: self._source(f"{prefix}{source}.")}
        self._note_blindness(f"{prefix}{source}.", observed[source])
        return {**values, "observation_sources": observed}

    def _obstacle_layer(self, name: str, source: str) -> dict[str, Any] | None:
        reader, prefix = self._reader, f"{name}."
        own = ("enabled", "footprint_clearing_enabled", "combination_method")
        values = reader.block(ObstacleLayerSettings, prefix, names=own)
        low = reader.number(f"{prefix}min_obstacle_height", 0.0)
        high = reader.number(f"{prefix}max_obstacle_height", DEFAULT_LAYER_HEIGHT_M)
        place = f"{prefix}{source}."
        given = self._source(place)
        if not (self._sees(given) and low <= self._height_m <= high):
            self._note_blindness(place, given)
            remark = "left out; all of its points are too low or too high for it"
            reader.note_block(Status.OTHER_FORM, name, remark)
            return None
        for field, default in (("marking", True), ("clearing", False)):
            if not given.pop(field, default):
                remark = f"the obstacle layer is always {field} here"
                reader.note(Status.STAND_IN, place + field, remark)
        for field in ("min_obstacle_height", "max_obstacle_height"):
            given.pop(field, None)
        return reader.checked(ObstacleLayerSettings, {**values, **given}, place)

    def _sees(self, source: dict[str, Any]) -> bool:
        low = source.get("min_obstacle_height", 0.0)
        return low <= self._height_m <= source.get("max_obstacle_height", 0.0)

    def _note_blindness(self, place: str, source: dict[str, Any]) -> None:
        if not self._sees(source):
            remark = (
                f"not around {self._height_m:g} m, the lidar's height: it sees nothing, as in Nav2"
            )
            self._reader.note(Status.OTHER_FORM, f"{place}max_obstacle_height", remark)
