"""Reads the layers of a Nav2 file that see obstacles into our settings, with their sensors.

Each layer is a block that names its plugin. Differences are noted. Source: nav2_costmap_2d
(ObstacleLayer, VoxelLayer, ObservationBuffer), branches humble to lyrical;
spatio_temporal_voxel_layer, branch ros2.
"""

from __future__ import annotations

from typing import Any

from drake_navbench.inputs.check import Status
from drake_navbench.kernels.voxel_layer import MAX_VOXELS
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.nav2.sensors import Nav2Sensors, Sight, is_full_turn
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.navigation.costmaps.observation_layers import (
    SensingParameters,
    VoxelLayerParameters,
)
from drake_navbench.navigation.costmaps.observation_source import ObservationSourceSettings
from drake_navbench.navigation.costmaps.spatio_temporal_layer import SpatioTemporalSourceSettings
from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.typed_yaml import FrozenModel

# Fields of a source that Nav2 files do not give: they name the robot's sensor that sends to it.
OURS = ("sensor", "scanner")
SCAN, CLOUD = "LaserScan", "PointCloud2"
SPATIO_TEMPORAL = "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer"
VOXEL_LAYER = "nav2_costmap_2d::VoxelLayer"
# The spatio-temporal layer's number for a lidar of many layers.
LIDAR_MODEL = 1
MAXIMUM = 1
# The beginning of the remark on a scan that lies beyond the heights of its source or layer.
LIDAR_HEIGHT = "the lidar's height"


class SensingLayers:
    """Reads the layers of one costmap that see obstacles."""

    def __init__(self, reader: NodeReader, sensors: Nav2Sensors, release: Release) -> None:
        self._reader = reader
        self._release = release
        self._sensors = sensors
        self._height_m = sensors.lidar.height_m
        self._scanner_count = 1 + len(sensors.lidar.further_poses)

    def read(self, name: str, plugin_type: str) -> dict[str, Any] | None:
        """Returns the parameters of a layer with sources of any kind; None without sources."""
        sources = self._listed_sources(name)
        if not sources:
            return None
        reader, prefix = self._reader, f"{name}."
        is_spatio_temporal = plugin_type == SPATIO_TEMPORAL
        rule = {} if is_spatio_temporal else self._combination(name)
        if rule is None:
            return None
        parameters = COSTMAP_LAYERS.load(plugin_type).Parameters
        own = [
            field
            for field in parameters.model_fields
            if field not in ("plugin", "observation_sources", *rule)
        ]
        levels = self._levels(prefix) if plugin_type == VOXEL_LAYER else {}
        own = [field for field in own if field not in levels]
        values = reader.block(parameters, prefix, names=own) | levels | rule
        model = SpatioTemporalSourceSettings if is_spatio_temporal else ObservationSourceSettings
        default = SpatioTemporalSourceSettings().data_type if is_spatio_temporal else SCAN
        observed = {source: self._source(f"{prefix}{source}.", model) for source in sources}
        scans = [s for s in sources if observed[s].get("data_type", default) == SCAN]
        scanners = self._scanners(prefix, scans)
        for source, given in observed.items():
            place = f"{prefix}{source}."
            if source in scans:
                given |= scanners[source]
                if not is_spatio_temporal:
                    self._note_blindness(place, given, parameters(**values))
            else:
                given["data_type"] = CLOUD
                given["sensor"] = self._depth_sensor(source, place, given, is_spatio_temporal)
        return {"plugin": plugin_type, **values, "observation_sources": observed}

    def _listed_sources(self, name: str) -> list[str]:
        """Returns a layer's sources; notes a layer without any, and blocks of unlisted sources."""
        sources = self._sources(name)
        if not sources:
            remark = "left out; without observation_sources the layer sees nothing, as in Nav2"
            self._reader.note_block(Status.DOUBTFUL, name, remark)
        else:
            self._note_unlisted(f"{name}.", sources)
        return sources

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
        listed = self._reader.text(f"{name}.observation_sources").split()
        return list(dict.fromkeys(listed))

    def _source(self, place: str, model: type[FrozenModel]) -> dict[str, Any]:
        """Returns the given parameters of an observation source; place: its name with a dot."""
        names = [field for field in model.model_fields if field not in OURS]
        return self._reader.block(model, place, names=names)

    def _combination(self, name: str) -> dict[str, Any] | None:
        """Returns the setting for a `combination_method` that Nav2 does not know; {} if it does.

        None means that the layer writes nothing with it, as in Humble and Iron, which do not know 2
        either.
        """
        place = f"{name}.combination_method"
        found = self._reader.node.get(place)
        if not isinstance(found, int) or isinstance(found, bool):
            return {}
        is_old = self._release < Release.JAZZY
        if found in ((0, 1) if is_old else (0, 1, 2)):
            return {}
        if is_old:
            remark = (
                f"left out; with combination_method {found} the layer writes nothing, as in Nav2"
            )
            self._reader.note_block(Status.OTHER_FORM, name, remark)
            return None
        self._reader.value(place)
        remark = f"{found}, an unknown value: the larger cost is taken, as in Nav2"
        self._reader.note(Status.OTHER_FORM, place, remark)
        return {"combination_method": MAXIMUM}

    def _scanners(self, prefix: str, scans: list[str]) -> dict[str, dict[str, Any]]:
        """Returns by source the index, from 1, of the robot's scanner that stands for it.

        If the robot's number of scanners differs from the number of topics, or is 1, every source
        reads all scanners, and no index is given.
        """
        topics = {s: self._reader.node.get(f"{prefix}{s}.topic", s) for s in scans}
        different = list(dict.fromkeys(topics.values()))
        if len(different) == self._scanner_count and self._scanner_count > 1:
            return {s: {"scanner": different.index(topics[s]) + 1} for s in scans}
        sees_all = is_full_turn(self._sensors.lidar.angle_span_rad)
        for source in scans:
            if topics[source] == different[0]:
                continue
            remark = "the robot's lidar, which sees all around, replaces this scanner, too"
            if not sees_all:
                remark = "no such scanner here; the robot's lidar is used instead"
            status = Status.OTHER_FORM if sees_all else Status.STAND_IN
            place = f"{prefix}{source}.topic"
            self._reader.note(status, place, remark)
        return {source: {} for source in scans}

    def _depth_sensor(
        self, source: str, place: str, given: dict[str, Any], is_spatio_temporal: bool
    ) -> str:
        """Returns the sensor of a source of points."""
        topic = self._reader.node.get(f"{place}topic", source)
        if is_spatio_temporal:
            whole = SpatioTemporalSourceSettings(**given)
            sight = Sight(
                reach_m=max(whole.obstacle_range, whole.max_z if whole.clearing else 0.0),
                horizontal_fov_rad=given.get("horizontal_fov_angle"),
                vertical_fov_rad=given.get("vertical_fov_angle"),
                is_lidar=whole.model_type == LIDAR_MODEL if "model_type" in given else None,
            )
        else:
            ranges = ObservationSourceSettings(**given)
            sight = Sight(reach_m=max(ranges.obstacle_max_range, ranges.raytrace_max_range))
        return self._sensors.listen(self._reader, f"{place}topic", source, str(topic), sight)

    def _levels(self, prefix: str) -> dict[str, Any]:
        """Returns the settings of a voxel layer with more levels than Nav2's grid has; else {}.

        Nav2 clamps the number of levels, but subtracts the surplus from `unknown_threshold`, the
        number of unknown voxels that a free column may have. That number is unsigned: if it falls
        below 0, a free column may have any number of unknown voxels.
        """
        place = f"{prefix}z_voxels"
        found = self._reader.node.get(place)
        if isinstance(found, bool) or not isinstance(found, int) or found <= MAX_VOXELS:
            return {}
        remark = (
            f"{found}, of which the grid has {MAX_VOXELS}, as in Nav2; rays that leave through its "
            "top clear what is below, where Nav2 drops them"
        )
        self._reader.note(Status.OTHER_FORM, place, remark)
        names = ("unknown_threshold",)
        given = self._reader.block(VoxelLayerParameters, prefix, names=names)
        allowed = VoxelLayerParameters(**given).unknown_threshold + MAX_VOXELS - found
        allowed = allowed if allowed >= 0 else MAX_VOXELS
        return {"z_voxels": MAX_VOXELS, "unknown_threshold": allowed}

    def _note_blindness(self, place: str, source: dict[str, Any], layer: SensingParameters) -> None:
        """Notes a scan that lies beyond the heights of its source or of the layer."""
        seeing = (ObservationSourceSettings(**source), layer)
        low_m = max(settings.min_obstacle_height for settings in seeing)
        high_m = min(settings.max_obstacle_height for settings in seeing)
        if not low_m <= self._height_m <= high_m:
            bound = "min" if self._height_m < low_m else "max"
            remark = (
                f"{LIDAR_HEIGHT}, {self._height_m:g} m, is outside of the obstacle heights of "
                f"source and layer, {low_m:g} to {high_m:g} m: this source sees nothing, as in Nav2"
            )
            self._reader.note(Status.DOUBTFUL, f"{place}{bound}_obstacle_height", remark)
        least_m, most_m = seeing[0].obstacle_min_range, seeing[0].obstacle_max_range
        if least_m >= most_m:
            remark = f"{least_m:g} m, not below obstacle_max_range, {most_m:g} m: nothing is marked"
            self._reader.note(Status.DOUBTFUL, f"{place}obstacle_min_range", remark)
