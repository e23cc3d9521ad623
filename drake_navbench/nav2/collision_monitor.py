"""Reads the collision monitor of a Nav2 file into our settings.

Source: nav2_collision_monitor, branches humble to lyrical.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from drake_navbench.inputs.check import Status
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.nav2.outline import are_corners, corners_of
from drake_navbench.nav2.sensors import range_sensor_of
from drake_navbench.navigation.monitor_shapes import (
    CollisionMonitorParameters,
    MonitorCircle,
    MonitorPolygon,
    SubPolygon,
    VelocityPolygon,
)
from drake_navbench.navigation.monitor_sources import THE_SCAN, MonitorSource
from drake_navbench.plugins.releases import NEWEST_RELEASE, RELEASE_FIELD, Release
from drake_navbench.typed_files.quantities import MAX_COUNT, MIN_COUNT
from drake_navbench.typed_files.typed_yaml import FrozenModel

Fields = dict[str, Any]

SHAPES: dict[str, type[FrozenModel]] = {
    "polygon": MonitorPolygon,
    "circle": MonitorCircle,
    "velocity_polygon": VelocityPolygon,
}
APART = {"type", "points", "velocity_polygons", "sources_names"}
# Fields that Nav2 reads for a holonomic velocity polygon only.
DIRECTIONS = ("direction_start_angle", "direction_end_angle")
ACTIONS_SINCE_IRON = ("limit", "none")
# The name of the lidar among the monitor's sources in a robot file, which has it by default.
(LIDAR,) = THE_SCAN
# The least number of corners that Nav2 takes in a text.
MIN_CORNERS = 4
OTHER_SENSORS = ("pointcloud", "range", "polygon", "costmap")


def read_collision_monitor(reader: NodeReader, *, range_sensors: Collection[str] = ()) -> Fields:
    """Returns the collision monitor; None where none of its shapes can be made here.

    range_sensors: the names of the robot's range sensors.

    Some robots start it on its own, so that a file may hold a monitor that never runs: Nav2's does
    not start with a shape that the release cannot make, such as one without a type.
    """
    listed = reader.names("polygons", [])
    faults = [fault for name in listed if (fault := _fault(reader, name))]
    if faults:
        for name in reader.node.parameters:
            reader.note(Status.NO_MEANING, name)
        remark = f"{faults[0]}: Nav2's collision monitor does not start, so there is none here"
        reader.note(Status.STAND_IN, "polygons", remark)
        return {"collision_monitor": None}
    names = ("enabled", "source_timeout", "base_shift_correction")
    values = reader.block(CollisionMonitorParameters, names=names)
    if reader.release is not NEWEST_RELEASE:
        values[RELEASE_FIELD] = str(reader.release)
    sources = _sources(reader, range_sensors)
    if sources:
        values["observation_sources"] = sources
    shapes = {name: _shape(reader, name, sources) for name in listed}
    values["polygons"] = {name: shape for name, shape in shapes.items() if shape is not None}
    _note_unlisted(reader, shapes)
    idle = (
        "footprint_topic",
        "polygon_pub_topic",
        "polygon_sub_topic",
        "polygon_subscribe_transient_local",
        "visualize",
    )
    without_meaning = {f"*.{name}" for name in idle}
    topics = {"cmd_vel_in_topic", "cmd_vel_out_topic", "state_topic", "toggle_topic"}
    markers = {"collision_points_marker_3d"}
    reader.finish({*without_meaning, *topics, *markers, "stop_pub_timeout"})
    return {"collision_monitor": values if values["polygons"] else None}


def _fault(reader: NodeReader, name: str) -> str:
    """Returns why the release's monitor does not start with a shape; '' where it does."""
    found, release = reader.node.get, reader.release
    kind, action = found(f"{name}.type"), found(f"{name}.action_type")
    if kind is None:
        return f"{name} is listed, but has no type"
    is_other = isinstance(kind, str) and kind not in SHAPES
    if is_other or (kind == "velocity_polygon" and release < Release.JAZZY):
        return f"{name} is a {kind}, which {release} does not have"
    if action in ACTIONS_SINCE_IRON and release is Release.HUMBLE:
        return f"{name} has the action {action}, which {release} does not have"
    is_text = isinstance(found(f"{name}.points"), str)
    if kind == "polygon" and is_text and not _takes_text(release) and _has_corners(reader, name):
        return f"{name}.points is a text, where {release} takes a list of numbers"
    if release >= Release.JAZZY and (unknown := _unknown_sources(reader, name)):
        return f"{name}.sources_names has {unknown[0]}, which observation_sources does not list"
    return ""


def _unknown_sources(reader: NodeReader, name: str) -> list[str]:
    """Returns the sources of a shape that are none of the monitor's."""
    listed = reader.names("observation_sources", [])
    return [own for own in reader.names(f"{name}.sources_names", []) if own not in listed]


def _takes_text(release: Release) -> bool:
    """Returns whether a release takes corners as text, '[[x, y], ...]', not as a flat list."""
    return release >= Release.JAZZY


def _has_corners(reader: NodeReader, name: str) -> bool:
    """Returns whether the release reads a polygon's corners.

    For the action 'approach', Humble uses the robot's footprint instead.
    """
    approaches = reader.node.get(f"{name}.action_type") == "approach"
    return not (approaches and reader.release is Release.HUMBLE)


def _sources(reader: NodeReader, range_sensors: Collection[str]) -> Fields:
    """Returns the sources of a collision monitor that are not the robot's lidar alone.

    Notes for each source in the file the sensor that stands for it here.
    """
    sources: Fields = {}
    sees_range = scans = False
    for source in reader.names("observation_sources", []):
        _note_exclusion_zones(reader, source)
        kind = reader.text(f"{source}.type", "scan")
        sensor = None
        if kind == "range":
            sensor = range_sensor_of(reader.text(f"{source}.topic", "scan"), range_sensors)
        if sensor is not None:
            sources[source] = _range_source(reader, source, sensor)
            sees_range = True
            continue
        if kind in OTHER_SENSORS:
            remark = f"{kind}: the robot has no such sensor; the lidar is used instead"
            reader.note_block(Status.STAND_IN, source, remark)
        elif scans:
            remark = "left out; the robot has one lidar"
            reader.note_block(Status.STAND_IN, source, remark)
        else:
            scans = True
            remark = "the robot's lidar"
            reader.note_block(Status.OTHER_FORM, source, remark)
        sources.setdefault(LIDAR, {"type": "scan"})
    return sources if sees_range else {}


def _note_exclusion_zones(reader: NodeReader, source: str) -> None:
    """Notes each of a source's exclusion zones, whose points Nav2 leaves out from Lyrical on."""
    for zone in reader.names(f"{source}.exclusion_zones", []):
        if reader.release < Release.LYRICAL:
            reader.note_block(Status.UNREAD, zone, f"{reader.release} has no exclusion zones")
        elif reader.flag(f"{zone}.enabled", False):
            remark = "there are no exclusion zones here; the points in it count"
            reader.note_block(Status.STAND_IN, zone, remark)
        else:
            reader.note_block(Status.NO_MEANING, zone, "an exclusion zone that is not enabled")


def _range_source(reader: NodeReader, source: str, sensor: str) -> Fields:
    """Returns a source that is one of the robot's range sensors."""
    place = f"{source}."
    names = ("enabled", "source_timeout", "obstacles_angle")
    values = reader.block(MonitorSource, place, names=names)
    reader.note(Status.OTHER_FORM, f"{place}topic", f"the robot's range sensor {sensor}")
    return {"type": "range", "sensor": sensor, **values}


def _shape(reader: NodeReader, name: str, sources: Fields) -> Fields | None:
    """Returns a shape; None where it cannot be made here.

    sources: those of the monitor, as by `_sources`.
    """
    kind = reader.text(f"{name}.type")
    if kind == "circle" and reader.node.get(f"{name}.radius") == 0:
        reader.note_block(Status.DOUBTFUL, name, "left out; its radius is 0, nothing is ever in it")
        return None
    model = SHAPES[kind]
    own = [field for field in model.model_fields if field not in APART]
    place = f"{name}."
    values: Fields = {}
    for field in own:
        if reader.gives(model, field, place + field):
            values[field] = reader.value(place + field)
    if "min_points" in values:
        values["min_points"] = _as_int32(reader, f"{place}min_points")
    if reader.given(f"{place}max_points"):
        # Humble reads max_points only; later it prevails. More points than this trigger.
        if "min_points" in values:
            reader.note(Status.UNREAD, f"{place}min_points", "max_points prevails")
        values["min_points"] = int(reader.number(f"{place}max_points", 3)) + 1
        reader.note(Status.OTHER_FORM, f"{place}max_points", "min_points less one, as in humble")
    if reader.gives(model, "sources_names", f"{place}sources_names"):
        values["sources_names"] = _own_sources(reader, f"{place}sources_names", sources)
    if kind == "velocity_polygon":
        values["velocity_polygons"] = {
            sub: _sub_polygon(reader, f"{place}{sub}.", holonomic=values.get("holonomic") is True)
            for sub in reader.names(f"{place}velocity_polygons", [])
        }
    elif kind == "polygon":
        values["points"] = None
        given = reader.node.get(f"{place}points")
        if _has_corners(reader, name) and _is_wrong_text(given):
            remark = f"expected '[[x, y], [x, y], ...]' with at least {MIN_CORNERS} corners, "
            remark += f"got {str(given)[:60]!r}: not read, as in Nav2"
            reader.note(Status.DOUBTFUL, f"{place}points", remark)
        elif _has_corners(reader, name):
            values["points"] = _points(reader, f"{place}points")
        elif given is not None:
            remark = f"{reader.release} does not read it; the robot's outline approaches"
            reader.note(Status.UNREAD, f"{place}points", remark)
        if values["points"] is None and values.get("action_type") != "approach":
            remark = "left out; it has no corners here, Nav2 waits for them on a topic"
            reader.note_block(Status.STAND_IN, name, remark)
            return None
    return {"type": kind, **reader.checked(model, {"type": kind, **values}, place)}


def _is_wrong_text(points: Any) -> bool:
    """Tells whether points are a text in which Nav2 finds no polygon."""
    corners = corners_of(points)
    is_polygon = are_corners(corners) and len(corners) >= MIN_CORNERS
    return isinstance(points, str) and not is_polygon


def _own_sources(reader: NodeReader, name: str, sources: Fields) -> list[str]:
    """Returns the sources whose points count for a shape, by their names in the robot file."""
    named = reader.names(name, [])
    own = list(dict.fromkeys(one if one in sources else LIDAR for one in named))
    if own != named:
        reader.note(Status.OTHER_FORM, name, f"of the robot: {', '.join(own)}")
    return own


def _as_int32(reader: NodeReader, name: str) -> Any:
    """Returns a whole number as Nav2 keeps it: the last 32 bits of a larger one, signed."""
    given = reader.value(name)
    if not isinstance(given, int) or isinstance(given, bool) or MIN_COUNT <= given <= MAX_COUNT:
        return given
    kept = (given - MIN_COUNT) % (MAX_COUNT - MIN_COUNT + 1) + MIN_COUNT
    reader.note(Status.OTHER_FORM, name, f"{kept}, as Nav2 keeps the last 32 bits of {given}")
    return kept


def _sub_polygon(reader: NodeReader, place: str, *, holonomic: bool) -> Fields:
    apart = {"points"} if holonomic else {"points", *DIRECTIONS}
    limits = [field for field in SubPolygon.model_fields if field not in apart]
    values = {f: reader.value(place + f) for f in limits if reader.given(place + f)}
    values["points"] = _points(reader, f"{place}points")
    return reader.checked(SubPolygon, values, place)


def _points(reader: NodeReader, name: str) -> list[list[float]] | None:
    """Returns corners from text, as since Jazzy, or from a flat list, as up to Iron."""
    given = reader.value(name)
    if given is None:
        return None
    corners = corners_of(given)
    is_flat = isinstance(corners, list) and all(isinstance(v, int | float) for v in corners)
    if is_flat and len(corners) % 2 == 0:
        if _takes_text(reader.release):
            # Both forms are taken: the file may not tell its release, which then counts as the
            # newest.
            remark = f"a list of numbers, as up to iron, where {reader.release} takes a text"
            reader.note(Status.OTHER_FORM, name, remark)
        return [list(pair) for pair in zip(corners[::2], corners[1::2], strict=True)]
    if not isinstance(corners, list):
        raise reader.fault(name, f"expected '[[x, y], [x, y], ...]', got {str(given)[:60]!r}")
    return corners


def _note_unlisted(reader: NodeReader, listed: Fields) -> None:
    kinds = (name for name in reader.node.parameters if name.endswith(".action_type"))
    for shape in dict.fromkeys(name.rpartition(".")[0] for name in kinds):
        if shape not in listed:
            reader.note_block(Status.UNREAD, shape, "not listed in polygons")
