"""Matches the topics that a Nav2 file listens to with the robot's sensors.

A Nav2 file names topics, but not the sensors that send to them. Scans come from the robot's own
scanners. A depth camera or a lidar of many layers that the robot lacks is added at the position of
its lidar. The parameters of its sources tell its fields of view and range, their names its yaw.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.depth_sensor import STEEPEST_RAD, DepthSensorSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.node_reader import NodeReader

# Words in names of sensors that send points from all directions.
LIDAR_NAMES = re.compile(
    "lidar|laser|velodyne|vlp|livox|ouster|hesai|robosense|rslidar|mid360|pandar|scan", re.I
)
CAMERA_NAMES = re.compile("camera|depth|realsense|oak|zed|kinect|d4[0-9]{2}|rgbd", re.I)
# Words in topics of points that a program has sorted out of a sensor's, such as rtabmap's two.
SORTED_OUT = re.compile("obstacle|ground|segment|filter|crop|downsampl", re.I)
# The field of view of a lidar of many layers, rad, its columns and rows, height m and reach m.
LIDAR_SIGHT: Mapping[str, Any] = {
    "horizontal_fov_rad": 2.0 * math.pi,
    "vertical_fov_rad": 0.52,
    "column_count": 360,
    "row_count": 16,
    "height_m": 0.5,
    "range_max_m": 12.0,
}
# Yaw of a sensor's axis by a word in its name; with two words, the yaw halfway between theirs.
DIRECTIONS = (
    (re.compile("left", re.I), 0.5 * math.pi),
    # Neither "upright" nor "bright" is a side.
    (re.compile("(?<!up)(?<!b)right", re.I), -0.5 * math.pi),
)
FRONT, REAR = re.compile("front", re.I), re.compile("back|rear", re.I)


def range_sensor_of(topic: str, range_sensors: Collection[str]) -> str | None:
    """Returns the robot's range sensor that sends to a topic, None where it has none.

    It is called as the whole topic, `sonar_left` for `/sonar/left`, or as its last part, `left`.
    """
    whole = re.sub(r"\W+", "_", topic).strip("_")
    names = (whole, topic.rpartition("/")[2])
    return next((name for name in names if name in range_sensors), None)


class Sight(NamedTuple):
    """Range, m, and fields of view, rad, of an observation source's sensor; None if not given."""

    reach_m: float
    horizontal_fov_rad: float | None = None
    vertical_fov_rad: float | None = None
    is_lidar: bool | None = None


class Nav2Sensors:
    """The sensors of the robot that a Nav2 file is read for, and those that the file adds."""

    def __init__(self, robot: Robot) -> None:
        self._depth_sensors = robot.depth_sensors
        self._range_sensors = robot.range_sensors
        self._lidar = robot.lidar
        self._listeners: dict[str, list[_Listener]] = {}
        # The topics of the robot's sensors that are not called so.
        self._topics: dict[str, str] = {}

    @property
    def lidar(self) -> LidarSettings:
        """The settings of the robot's planar lidars."""
        return self._lidar

    @property
    def range_sensors(self) -> Collection[str]:
        """The names of the robot's range sensors."""
        return self._range_sensors

    @property
    def added(self) -> dict[str, dict[str, Any]]:
        """The depth sensors that were added to the robot, as a robot file gives them."""
        return {
            name: self._sensor(listeners).model_dump(mode="json", exclude_defaults=True)
            for name, listeners in self._listeners.items()
        }

    def listen(
        self, reader: NodeReader, parameter: str, source: str, topic: str, sight: Sight
    ) -> str:
        """Returns the name of the sensor that sends to an observation source.

        parameter: the source's parameter with the topic. `note_added` describes the sensor in the
        check's row of that parameter, once all sources of the topic are known.
        """
        by_topic = re.sub(r"\W+", "_", topic).strip("_") or source
        for name in (source, by_topic):
            if name in self._depth_sensors:
                reader.note(Status.OTHER_FORM, parameter, f"the robot's depth sensor {name}")
                return name
        names = f"{source} {topic}"
        kind, alike = self._of_its_kind(names, sight)
        is_own = len(alike) == 1 and self._topics.setdefault(alike[0], topic) == topic
        is_whole = len(self._depth_sensors) == 1
        if is_own or (is_whole and SORTED_OUT.search(topic) and not _heading(names)):
            reader.note(Status.OTHER_FORM, parameter, f"the robot's only {kind}, {alike[0]}")
            return alike[0]
        reader.note(Status.OTHER_FORM, parameter)
        listener = _Listener(reader, parameter, names, sight)
        self._listeners.setdefault(by_topic, []).append(listener)
        return by_topic

    def _of_its_kind(self, names: str, sight: Sight) -> tuple[str, list[str]]:
        """Returns the kind that a topic's names tell, and the robot's sensors of that kind.

        The only depth sensor of a robot is taken for any kind.
        """
        known = {name: _is_around(sensor) for name, sensor in self._depth_sensors.items()}
        if len(known) == 1:
            return "depth sensor", list(known)
        is_lidar = sight.is_lidar if sight.is_lidar is not None else _is_lidar(names)
        is_camera = CAMERA_NAMES.search(names) is not None
        kind = "lidar of many layers" if is_lidar else "depth camera" if is_camera else ""
        return kind, [name for name, around in known.items() if kind and around == is_lidar]

    def note_added(self) -> None:
        """Notes for each source of an added sensor which sensor it is."""
        for name, listeners in self._listeners.items():
            remark = _described(name, self._sensor(listeners))
            for reader, parameter, *_ in listeners:
                reader.note(Status.OTHER_FORM, parameter, remark)

    def _sensor(self, listeners: Sequence[_Listener]) -> DepthSensorSettings:
        """Returns a sensor that fits all sources of a topic, whatever the sources' order."""
        names = " ".join(sorted(listener.names for listener in listeners))
        sights = [listener.sight for listener in listeners]
        told = [sight.is_lidar for sight in sights if sight.is_lidar is not None]
        is_lidar = any(told) if told else _is_lidar(names)
        fields: dict[str, Any] = dict(LIDAR_SIGHT) if is_lidar else {}
        horizontal = max(sight.horizontal_fov_rad or 0.0 for sight in sights)
        vertical = max(sight.vertical_fov_rad or 0.0 for sight in sights)
        if horizontal:
            fields["horizontal_fov_rad"] = min(horizontal, 2.0 * math.pi)
        if vertical:
            fields["vertical_fov_rad"] = min(vertical, 2.0 * STEEPEST_RAD)
        x, y, yaw = self._lidar.pose
        sensor = DepthSensorSettings(**fields)
        heading = yaw if _is_around(sensor) else _heading(names)
        reach = max(sensor.range_max_m, *(sight.reach_m for sight in sights))
        return sensor.model_copy(update={"pose": (x, y, heading), "range_max_m": reach})


class _Listener(NamedTuple):
    """A source of points: the parameter with its topic, its names, and its sensor's ranges."""

    reader: NodeReader
    parameter: str
    names: str
    sight: Sight


def _described(name: str, sensor: DepthSensorSettings) -> str:
    kind = "lidar of many layers" if _is_around(sensor) else "depth camera"
    turned = f", turned by {sensor.pose[2]:.3g} rad" if sensor.pose[2] else ""
    return (
        f"no Nav2 file says what sends it: a {kind} where the lidar is, {sensor.height_m:g} m "
        f"up{turned}, of {sensor.horizontal_fov_rad:.3g} x {sensor.vertical_fov_rad:.3g} rad "
        f"and {sensor.range_max_m:g} m; depth_sensors.{name} in a robot file says otherwise"
    )


def _is_lidar(names: str) -> bool:
    return bool(LIDAR_NAMES.search(names)) and not CAMERA_NAMES.search(names)


def is_full_turn(span_rad: float) -> bool:
    """Tells whether a field of view is a whole turn, within 0.02 rad.

    So is 6.28, and the turn of 360 beams without the gap behind the last one.
    """
    return math.isclose(span_rad, 2.0 * math.pi, abs_tol=0.02)


def _is_around(sensor: DepthSensorSettings) -> bool:
    return is_full_turn(sensor.horizontal_fov_rad)


def _heading(names: str) -> float:
    """Returns the yaw of a sensor's axis in the base frame, rad, guessed from its names."""
    side = next((yaw for word, yaw in DIRECTIONS if word.search(names)), 0.0)
    if REAR.search(names):
        return math.copysign(math.pi - 0.5 * abs(side), side) if side else math.pi
    return 0.5 * side if side and FRONT.search(names) else side
