"""From the costmaps of a Nav2 file to ours: outline, grid, layers and filters.

A parameter that is missing has Nav2's default. Nav2 names layers freely and has any number of each
type; here a costmap has one layer of a type, fed by the robot's one lidar. What differs is noted.
Source: nav2_costmap_2d, branches humble to lyrical.
"""

from __future__ import annotations

import json
import re
from typing import Any, NamedTuple

from drake_navbench.costmaps.costmap_settings import (
    BinaryFilterSettings,
    CostmapSettings,
    DenoiseLayerSettings,
    GlobalCostmapSettings,
    InflationLayerSettings,
    KeepoutFilterSettings,
    LocalCostmapSettings,
    ObservationSourceSettings,
    ObstacleLayerSettings,
    SpeedFilterSettings,
    StaticLayerSettings,
    VoxelLayerSettings,
)
from drake_navbench.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.inputs.nav2_check import Status
from drake_navbench.inputs.nav2_node_reader import NodeReader

LAYERS: dict[str, tuple[str, type]] = {
    "StaticLayer": ("static_layer", StaticLayerSettings),
    "ObstacleLayer": ("obstacle_layer", ObstacleLayerSettings),
    "VoxelLayer": ("voxel_layer", VoxelLayerSettings),
    "DenoiseLayer": ("denoise_layer", DenoiseLayerSettings),
    "InflationLayer": ("inflation_layer", InflationLayerSettings),
    "KeepoutFilter": ("keepout_filter", KeepoutFilterSettings),
    "SpeedFilter": ("speed_filter", SpeedFilterSettings),
    "BinaryFilter": ("binary_filter", BinaryFilterSettings),
}
PACKAGE = "nav2_costmap_2d::"
SENSING = ("obstacle_layer", "voxel_layer")
ONLY_AS_FILTERS = ("speed_filter", "binary_filter")
# Third-party layers that see what an obstacle layer sees.
SENSING_ELSEWHERE = re.compile("voxel|obstacle|range|pointcloud|nvblox|stvl", re.IGNORECASE)
# What Nav2's costmaps load where the file lists no plugins.
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
# Topics, frames and what is published; origins of a window that rolls; sensors' frames and rates.
WITHOUT_MEANING = {
    "always_send_full_costmap",
    "initial_transform_timeout",
    "map_topic",
    "map_vis_z",
    "origin_x",
    "origin_y",
    "publish_frequency",
    "subscribe_to_stamped_footprint",
    *(
        f"*.{name}"
        for name in (
            "expected_update_rate",
            "filter_info_topic",
            "filter_name",
            "map_subscribe_transient_local",
            "map_topic",
            "publish_voxel_map",
            "sensor_frame",
            "speed_limit_topic",
            "binary_state_topic",
            "subscribe_to_updates",
            "tf_filter_tolerance",
            "topic",
            "transform_tolerance",
            "transport_type",
        )
    ),
}
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


class Outline(NamedTuple):
    """A robot's outline as a costmap gives it: corners or a radius, m, and the padding, m."""

    footprint: list[list[float]] | None
    radius_m: float | None
    padding_m: float | None

    @property
    def is_given(self) -> bool:
        """Whether there is one."""
        return self.footprint is not None or self.radius_m is not None


def read_outline(reader: NodeReader) -> Outline:
    """Returns the outline of a costmap; a footprint counts more than a radius, as in Nav2."""
    padding = reader.value("footprint_padding")
    footprint = _footprint(reader)
    if footprint is None:
        return Outline(None, reader.value("robot_radius"), padding)
    if reader.given("robot_radius"):
        reader.note(Status.UNREAD, "robot_radius", "footprint is given, which counts more")
    return Outline(footprint, None, padding)


def _footprint(reader: NodeReader) -> list[list[float]] | None:
    given = reader.value("footprint")
    if given is None or given in ("", "[]", []):
        return None
    corners = parse_points(given) if isinstance(given, str) else given
    if isinstance(given, list):
        remark = "a list; Nav2 takes text only, '[[x, y], ...]'"
        reader.note(Status.OTHER_FORM, "footprint", remark)
    if not _are_corners(corners) or len(corners) < 3:
        text = "expected '[[x, y], [x, y], ...]' with at least 3 corners"
        raise reader.fault("footprint", f"{text}, got {str(given)[:60]!r}")
    return [[float(x), float(y)] for x, y in corners]


def parse_points(text: str) -> Any:
    """Returns the lists in a text as Nav2 reads them: commas and blanks part numbers alike.

    Returns None where the text is no such list.
    """
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
    tokens = re.findall(rf"{number}|[\[\]]|[^\s,]", text)
    if not all(re.fullmatch(rf"{number}|[\[\]]", token) for token in tokens):
        return None
    spaced = " ".join(token if token in "[]" else repr(float(token)) for token in tokens)
    spaced = re.sub(r"(?<=[\d\]]) (?=[-\d\[])", ", ", spaced)
    try:
        return json.loads(spaced)
    except ValueError:
        return None


def _are_corners(corners: Any) -> bool:
    return isinstance(corners, list) and all(
        isinstance(corner, list)
        and len(corner) == 2
        and all(isinstance(v, int | float) and not isinstance(v, bool) for v in corner)
        for corner in corners
    )


def read_local_costmap(reader: NodeReader, lidar_height_m: float) -> dict[str, Any]:
    """Returns the settings of the local costmap, checked, and notes all that is given."""
    settings = _CostmapReader(reader, lidar_height_m).settings(LocalCostmapSettings)
    if not reader.flag("rolling_window", False):
        remark = "the local costmap rolls with the robot; Nav2's stays where it is"
        reader.note(Status.STAND_IN, "rolling_window", remark)
    names = ("width", "height", "resolution")
    grid = reader.block(LocalCostmapSettings, names=names)
    reader.finish(WITHOUT_MEANING)
    return {**settings, **grid}


def read_global_costmap(reader: NodeReader, lidar_height_m: float) -> dict[str, Any]:
    """Returns the settings of the global costmap, checked, and notes all that is given."""
    settings = _CostmapReader(reader, lidar_height_m).settings(GlobalCostmapSettings)
    # Nav2's default, which is not ours.
    grid = {"resolution": 0.1} | reader.block(GlobalCostmapSettings, names=("resolution",))
    if reader.flag("rolling_window", False):
        remark = "the global costmap covers all that is known; Nav2's rolls with the robot"
        reader.note(Status.STAND_IN, "rolling_window", remark)
    for name in ("width", "height"):
        if reader.given(name):
            reader.note(Status.OTHER_FORM, name, "follows from the map, or from what is known")
    reader.finish(WITHOUT_MEANING)
    return {**settings, **grid}


class _CostmapReader:
    """Reads the layers of one costmap."""

    def __init__(self, reader: NodeReader, lidar_height_m: float) -> None:
        self._reader = reader
        self._height_m = lidar_height_m
        self._settings: dict[str, Any] = {}
        self._lists: dict[str, list[str]] = {"plugins": [], "filters": []}

    def settings(self, model: type[CostmapSettings]) -> dict[str, Any]:
        reader = self._reader
        self._settings = reader.block(model, names=MAP_FIELDS)
        listed = reader.names("plugins", DEFAULT_LAYERS)
        if not reader.given("plugins"):
            remark = f"not given; Nav2 loads {', '.join(DEFAULT_LAYERS)}"
            reader.note(Status.OTHER_FORM, "plugins", remark)
        filters = reader.names("filters", [])
        stand_ins = []
        for name in listed:
            default = DEFAULT_LAYERS.get(name) if listed == list(DEFAULT_LAYERS) else None
            plugin_type = reader.plugin_type(name, default, "plugins")
            if not self._read_layer(name, plugin_type, "plugins"):
                stand_ins.append((name, plugin_type, len(self._lists["plugins"])))
        for name in filters:
            plugin_type = reader.plugin_type(name, None, "filters")
            if not self._read_layer(name, plugin_type, "filters"):
                self._leave_out(name, plugin_type)
        for name, plugin_type, place in stand_ins:
            self._stand_in(name, plugin_type, place)
        return {**self._settings, **self._lists}

    def _read_layer(self, name: str, plugin_type: str, listed_in: str) -> bool:
        """Reads a layer or filter of ours or of a plugin; returns whether it is one."""
        if COSTMAP_LAYERS.origin(plugin_type) is not None:
            return self._read_plugin(name, plugin_type, listed_in)
        ours, model = LAYERS.get(plugin_type.removeprefix(PACKAGE), ("", None))
        if model is None or not plugin_type.startswith(PACKAGE):
            return False
        if ours in self._settings:
            remark = f"left out; a costmap has one layer of type {plugin_type} here"
            self._reader.note_block(Status.STAND_IN, name, remark)
            return True
        values = self._sensing(name, ours) if ours in SENSING else self._plain(name, model)
        if values is None:
            return True
        self._settings[ours] = values
        self._lists["filters" if ours in ONLY_AS_FILTERS else listed_in].append(ours)
        if name != ours:
            self._reader.note(Status.OTHER_FORM, f"{name}.plugin", f"is called {ours} here")
        return True

    def _read_plugin(self, name: str, plugin_type: str, listed_in: str) -> bool:
        """Reads a layer of another package; returns whether it may stand there."""
        if listed_in != "plugins":
            return False
        model = COSTMAP_LAYERS.load(plugin_type).Parameters
        names = [field for field in model.model_fields if field != "plugin"]
        values = self._reader.block(model, f"{name}.", names=names)
        block = name
        if name in CostmapSettings.model_fields:
            # Ours of that name may be listed as well.
            block = f"{name}_plugin"
            self._reader.note(Status.OTHER_FORM, f"{name}.plugin", f"is called {block} here")
        self._settings[block] = {"plugin": plugin_type, **values}
        self._lists["plugins"].append(block)
        return True

    def _plain(self, name: str, model: type) -> dict[str, Any]:
        return self._reader.block(model, f"{name}.")

    def _sensing(self, name: str, ours: str) -> dict[str, Any] | None:
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
        for other in sources:
            if other != source:
                remark = "left out; the robot has one lidar and no other sensor"
                reader.note_block(Status.STAND_IN, prefix + other, remark)
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

    def _stand_in(self, name: str, plugin_type: str, place: int) -> None:
        """Puts an obstacle layer where a layer that we do not have would see obstacles."""
        is_blind = not any(layer in self._settings for layer in SENSING)
        if not (is_blind and SENSING_ELSEWHERE.search(plugin_type)):
            self._leave_out(name, plugin_type)
            return
        self._settings["obstacle_layer"] = {}
        self._lists["plugins"].insert(place, "obstacle_layer")
        remark = f"{plugin_type}: an obstacle layer with the robot's lidar stands in"
        self._reader.note_block(Status.STAND_IN, name, remark)

    def _leave_out(self, name: str, plugin_type: str) -> None:
        self._reader.note_block(Status.STAND_IN, name, f"{plugin_type}: left out")
