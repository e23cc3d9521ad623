"""Reads the costmaps of a Nav2 file into our settings: grid, layers and filters.

A parameter that is missing has Nav2's default. Nav2 names layers freely and has any number of each
type; here a costmap has one layer of a type, except for layers that see obstacles. Differences are
noted. Source: nav2_costmap_2d, branches humble to lyrical.
"""

from __future__ import annotations

import re
from typing import Any

from drake_navbench.inputs.check import Status
from drake_navbench.nav2.node_reader import WITHOUT_MEANING, NodeReader
from drake_navbench.nav2.sensing import SPATIO_TEMPORAL, SensingLayers
from drake_navbench.nav2.sensors import Nav2Sensors, range_sensor_of
from drake_navbench.navigation.costmaps.built_in_layers import (
    LEGACY_INFLATION,
    DenoiseLayerParameters,
    InflationLayerParameters,
    KeepoutFilterParameters,
    StaticLayerParameters,
)
from drake_navbench.navigation.costmaps.costmap_settings import (
    BinaryFilterSettings,
    CostmapSettings,
    GlobalCostmapSettings,
    LocalCostmapSettings,
    SpeedFilterSettings,
)
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.navigation.costmaps.range_sensor_layer import RangeSensorLayerParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release
from drake_navbench.typed_files.typed_yaml import FrozenModel

# The nodes of both costmaps.
LOCAL_COSTMAP = "local_costmap/local_costmap"
GLOBAL_COSTMAP = "global_costmap/global_costmap"
# The layers and filters of which a costmap has one each.
LAYERS: dict[str, tuple[str, type[FrozenModel]]] = {
    "StaticLayer": ("static_layer", StaticLayerParameters),
    "DenoiseLayer": ("denoise_layer", DenoiseLayerParameters),
    "InflationLayer": ("inflation_layer", InflationLayerParameters),
    "LegacyInflationLayer": ("inflation_layer", InflationLayerParameters),
    "KeepoutFilter": ("keepout_filter", KeepoutFilterParameters),
    "SpeedFilter": ("speed_filter", SpeedFilterSettings),
    "BinaryFilter": ("binary_filter", BinaryFilterSettings),
}
PACKAGE = "nav2_costmap_2d::"
# The default byte for unknown cells of a map.
UNKNOWN_BYTE = CostmapSettings.model_fields["unknown_cost_value"].default
# The last part of the map topic's name, in any namespace.
MAP = "map"
# The layers that see obstacles by scans and clouds -> the names of their blocks in a costmap.
SENSING = {
    "nav2_costmap_2d::ObstacleLayer": "obstacle_layer",
    "nav2_costmap_2d::VoxelLayer": "voxel_layer",
    SPATIO_TEMPORAL: "",
}
ONLY_AS_FILTERS = ("speed_filter", "binary_filter")
# Third-party layers that see the same obstacles as an obstacle layer.
SENSING_ELSEWHERE = re.compile("voxel|obstacle|pointcloud|nvblox|stvl", re.IGNORECASE)
# The layer of sonars and infrared sensors: for a robot without any, nothing stands in.
RANGE_LAYER = "nav2_costmap_2d::RangeSensorLayer"
# The layers that Nav2's costmaps load if the file lists no plugins.
DEFAULT_LAYERS = {
    "static_layer": "nav2_costmap_2d::StaticLayer",
    "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
    "inflation_layer": "nav2_costmap_2d::InflationLayer",
}
MAP_FIELDS = (
    "track_unknown_space",
    "update_frequency",
    "lethal_cost_threshold",
    "trinary_costmap",
    "unknown_cost_value",
    "inscribed_obstacle_cost_value",
    "use_maximum",
)


def read_local_costmap(
    reader: NodeReader, sensors: Nav2Sensors, release: Release, *, is_override: bool = False
) -> dict[str, Any]:
    """Returns the validated settings of the local costmap; notes each given parameter.

    is_override: whether the files only change single parameters of another setup.
    """
    settings = _CostmapReader(reader, sensors, release).settings(LocalCostmapSettings)
    if not reader.flag("rolling_window", False):
        remark = "the local costmap rolls with the robot; Nav2's stays where it is"
        left_to_others = is_override and not reader.given("rolling_window")
        status = Status.OTHER_FORM if left_to_others else Status.STAND_IN
        reader.note(status, "rolling_window", remark)
    names = ("width", "height", "resolution")
    grid = reader.block(LocalCostmapSettings, names=names)
    reader.finish(WITHOUT_MEANING["costmap"])
    return {**settings, **grid}


def read_global_costmap(
    reader: NodeReader, sensors: Nav2Sensors, release: Release
) -> dict[str, Any]:
    """Returns the validated settings of the global costmap; notes each given parameter."""
    settings = _CostmapReader(reader, sensors, release).settings(GlobalCostmapSettings)
    # The default is Nav2's, which differs from ours.
    defaults = {"resolution": 0.1}
    if reader.flag("rolling_window", False):
        names = ("rolling_window", "width", "height", "resolution")
        grid = reader.block(GlobalCostmapSettings, names=names, defaults=defaults)
    else:
        grid = reader.block(GlobalCostmapSettings, names=("resolution",), defaults=defaults)
        for name in ("width", "height"):
            if reader.given(name):
                reader.note(Status.OTHER_FORM, name, "follows from the map, or from what is known")
    reader.finish(WITHOUT_MEANING["costmap"])
    return {**settings, **grid}


class _CostmapReader:
    """Reads the layers of one costmap."""

    def __init__(self, reader: NodeReader, sensors: Nav2Sensors, release: Release) -> None:
        self._reader = reader
        self._release = release
        self._sensors = sensors
        self._sensing = SensingLayers(reader, sensors, release)
        self._settings: dict[str, Any] = {}
        self._lists: dict[str, list[str]] = {"plugins": [], "filters": []}

    def settings(self, model: type[CostmapSettings]) -> dict[str, Any]:
        reader = self._reader
        self._settings = reader.block(model, names=MAP_FIELDS)
        if self._release < Release.LYRICAL:
            # "Unknown" is tested before "inscribed": with one byte for both, no byte means
            # inscribed.
            unknown = self._settings.get("unknown_cost_value", UNKNOWN_BYTE)
            self._settings["inscribed_obstacle_cost_value"] = unknown
        if self._release is not NEWEST_RELEASE:
            self._settings["nav2_release"] = str(self._release)
        listed = reader.names("plugins", DEFAULT_LAYERS)
        if not reader.given("plugins"):
            remark = f"not given; Nav2 loads {', '.join(DEFAULT_LAYERS)}"
            reader.note(Status.OTHER_FORM, "plugins", remark)
        filters = reader.names("filters", [])
        stand_ins = []
        for name in listed:
            default = DEFAULT_LAYERS.get(name) if listed == list(DEFAULT_LAYERS) else None
            plugin_type = reader.plugin_type(name, default, "plugins")
            if self._read_layer(name, plugin_type, "plugins"):
                continue
            if not self._note_switched_off(name, plugin_type):
                stand_ins.append((name, plugin_type, len(self._lists["plugins"])))
        for name in filters:
            plugin_type = reader.plugin_type(name, None, "filters")
            if self._read_layer(name, plugin_type, "filters"):
                continue
            if not self._note_switched_off(name, plugin_type):
                self._leave_out(name, plugin_type)
        for name, plugin_type, place in stand_ins:
            self._stand_in(name, plugin_type, place)
        return {**self._settings, **self._lists}

    def _read_layer(self, name: str, plugin_type: str, listed_in: str) -> bool:
        """Reads a layer or filter, built in or of a plugin; returns whether it is one."""
        if COSTMAP_LAYERS.origin(plugin_type) is not None:
            return self._read_plugin(name, plugin_type, listed_in)
        if plugin_type == RANGE_LAYER and listed_in == "plugins":
            return self._read_range_layer(name)
        if plugin_type in SENSING and listed_in == "plugins":
            return self._read_sensing_layer(name, plugin_type)
        ours, model = LAYERS.get(plugin_type.removeprefix(PACKAGE), ("", None))
        if model is None or not plugin_type.startswith(PACKAGE):
            return False
        if ours in self._settings:
            if not self._note_switched_off(name, plugin_type):
                remark = f"left out; a costmap has one layer of type {plugin_type} here"
                self._reader.note_block(Status.STAND_IN, name, remark)
            return True
        own = [field for field in model.model_fields if field != "plugin"]
        values = self._reader.block(model, f"{name}.", names=own)
        if plugin_type == LEGACY_INFLATION:
            values["plugin"] = plugin_type
        if ours == "static_layer" and values.get("enabled", True):
            self._note_other_map(name)
        self._settings[ours] = values
        self._lists["filters" if ours in ONLY_AS_FILTERS else listed_in].append(ours)
        if name != ours:
            self._reader.note(Status.OTHER_FORM, f"{name}.plugin", f"is called {ours} here")
        return True

    def _read_sensing_layer(self, name: str, plugin_type: str) -> bool:
        """Reads a layer that sees obstacles; returns True."""
        values = self._sensing.read(name, plugin_type)
        if values is not None:
            block = name if name == SENSING[plugin_type] else self._block_name(name)
            self._settings[block] = values
            self._lists["plugins"].append(block)
        return True

    def _read_range_layer(self, name: str) -> bool:
        """Reads a layer of range sensors; returns whether the robot has one of them."""
        reader, place = self._reader, f"{name}.topics"
        found = reader.node.get(place)
        topics = [topic for topic in found if isinstance(topic, str)] if type(found) is list else []
        known = {topic: range_sensor_of(topic, self._sensors.range_sensors) for topic in topics}
        sensors = list(dict.fromkeys(sensor for sensor in known.values() if sensor is not None))
        if not sensors:
            return False
        own = [field for field in RangeSensorLayerParameters.model_fields if field != "plugin"]
        names = [field for field in own if field != "topics"]
        values = reader.block(RangeSensorLayerParameters, f"{name}.", names=names)
        missing = ", ".join(topic for topic, sensor in known.items() if sensor is None)
        if missing:
            remark = f"{missing}: the robot has no such range sensor, and no other one replaces it"
            reader.note(Status.STAND_IN, place, remark)
        else:
            remark = f"the robot's range sensors {', '.join(sensors)}"
            reader.note(Status.OTHER_FORM, place, remark)
        block = self._block_name(name)
        self._settings[block] = {"plugin": RANGE_LAYER, "topics": sensors, **values}
        self._lists["plugins"].append(block)
        return True

    def _block_name(self, name: str) -> str:
        """Returns a layer's block name, changed where our layer of that name may be listed, too."""
        if name not in CostmapSettings.model_fields:
            return name
        block = f"{name}_plugin"
        self._reader.note(Status.OTHER_FORM, f"{name}.plugin", f"is called {block} here")
        return block

    def _read_plugin(self, name: str, plugin_type: str, listed_in: str) -> bool:
        """Reads a layer of another package; returns whether the list of layers may contain it."""
        if listed_in != "plugins":
            return False
        model = COSTMAP_LAYERS.load(plugin_type).Parameters
        names = [field for field in model.model_fields if field != "plugin"]
        values = self._reader.block(model, f"{name}.", names=names)
        block = self._block_name(name)
        self._settings[block] = {"plugin": plugin_type, **values}
        self._lists["plugins"].append(block)
        return True

    def _stand_in(self, name: str, plugin_type: str, place: int) -> None:
        """Puts an obstacle layer in place of the seeing layers that do not exist here."""
        types = [block.get("plugin") for block in self._settings.values() if type(block) is dict]
        if not (SENSING.keys().isdisjoint(types) and SENSING_ELSEWHERE.search(plugin_type)):
            self._leave_out(name, plugin_type)
            return
        if "obstacle_layer" not in self._lists["plugins"]:
            self._settings["obstacle_layer"] = {}
            self._lists["plugins"].insert(place, "obstacle_layer")
        remark = f"{plugin_type}: an obstacle layer with the robot's lidar is used instead"
        self._reader.note_block(Status.STAND_IN, name, remark)

    def _note_other_map(self, layer: str) -> None:
        """Notes that a static layer asks for another map than the known one."""
        place, found = f"{layer}.map_topic", self._reader.node.get
        if not found(place) and self._release < Release.KILTED:
            # Until then a layer without a topic of its own used the costmap's.
            place = "map_topic"
        topic = found(place)
        if topic and str(topic).rpartition("/")[2] != MAP:
            remark = f"{topic}: the map that the scenario knows is used instead"
            self._reader.note(Status.STAND_IN, place, remark)

    def _note_switched_off(self, name: str, plugin_type: str) -> bool:
        """Notes a layer that is not available here and not enabled; returns whether it is one."""
        if self._reader.node.get(f"{name}.enabled", True) is not False:
            return False
        self._reader.note_block(Status.NO_MEANING, name, f"{plugin_type}: switched off")
        return True

    def _leave_out(self, name: str, plugin_type: str) -> None:
        why = "left out"
        if plugin_type == RANGE_LAYER:
            why = "left out, as the robot has no range sensors; what they alone see stays unseen"
        self._reader.note_block(Status.STAND_IN, name, f"{plugin_type}: {why}")
