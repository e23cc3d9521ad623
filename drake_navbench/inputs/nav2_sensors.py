"""The sensors that a Nav2 file listens to, and the robot's that they are.

A Nav2 file names topics and says nothing of what sends to them. The robot's scanners are there;
a depth camera or a lidar of many layers that the robot does not have is put where its lidar is,
with what the source itself tells of its sight and its reach, and looks where its name says.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from drake_navbench.inputs.depth_sensor import STEEPEST_RAD, DepthSensorSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.robot import Robot

# Names of what sends points all around.
LIDAR_NAMES = re.compile(
    "lidar|laser|velodyne|vlp|livox|ouster|hesai|robosense|rslidar|mid360|pandar|scan", re.I
)
CAMERA_NAMES = re.compile("camera|depth|realsense|oak|zed|kinect|d4[0-9]{2}|rgbd", re.I)
# Of such a lidar: angle up and down rad, columns, rows, height m, reach m.
LIDAR_SIGHT: Mapping[str, Any] = {
    "horizontal_fov_rad": 2.0 * math.pi,
    "vertical_fov_rad": 0.52,
    "column_count": 360,
    "row_count": 16,
    "height_m": 0.5,
    "range_max_m": 12.0,
}
# Where a sensor looks, by a word in its name; of two words half way.
DIRECTIONS = {"left": 0.5 * math.pi, "right": -0.5 * math.pi}
FRONT, REAR = re.compile("front", re.I), re.compile("back|rear", re.I)


class Sight(NamedTuple):
    """What a source tells of its sensor: m and rad, None where it does not."""

    reach_m: float
    horizontal_fov_rad: float | None = None
    vertical_fov_rad: float | None = None
    is_lidar: bool | None = None


class Nav2Sensors:
    """The sensors of the robot that a Nav2 file is read for, and those that the file adds."""

    def __init__(self, robot: Robot) -> None:
        self._depth_sensors = robot.depth_sensors
        self._lidar = robot.lidar
        self._added: dict[str, DepthSensorSettings] = {}

    @property
    def lidar(self) -> LidarSettings:
        """The robot's scanners."""
        return self._lidar

    @property
    def added(self) -> dict[str, dict[str, Any]]:
        """The depth sensors that the robot did not have, as a robot file gives them."""
        return {
            name: sensor.model_dump(mode="json", exclude_defaults=True)
            for name, sensor in self._added.items()
        }

    def depth_sensor(self, source: str, topic: str, sight: Sight) -> tuple[str, str]:
        """Returns the name of the sensor that sends to a source, and what is to be told of it."""
        by_topic = re.sub(r"\W+", "_", topic).strip("_") or source
        for name in (source, by_topic):
            if name in self._depth_sensors:
                return name, f"the robot's depth sensor {name}"
        sensor = self._sensor(f"{source} {topic}", sight)
        known = self._added.get(by_topic)
        if known is not None:
            reach = max(known.range_max_m, sensor.range_max_m)
            sensor = known.model_copy(update={"range_max_m": reach})
        self._added[by_topic] = sensor
        kind = "lidar of many layers" if _is_around(sensor) else "depth camera"
        turned = f", turned by {sensor.pose[2]:.3g} rad" if sensor.pose[2] else ""
        return by_topic, (
            f"no Nav2 file says what sends it: a {kind} where the lidar is, {sensor.height_m:g} m "
            f"up{turned}, of {sensor.horizontal_fov_rad:.3g} x {sensor.vertical_fov_rad:.3g} rad "
            f"and {sensor.range_max_m:g} m; depth_sensors.{by_topic} in a robot file says otherwise"
        )

    def _sensor(self, names: str, sight: Sight) -> DepthSensorSettings:
        is_lidar = sight.is_lidar
        if is_lidar is None:
            is_lidar = bool(LIDAR_NAMES.search(names)) and not CAMERA_NAMES.search(names)
        fields: dict[str, Any] = dict(LIDAR_SIGHT) if is_lidar else {}
        if sight.horizontal_fov_rad:
            fields["horizontal_fov_rad"] = min(sight.horizontal_fov_rad, 2.0 * math.pi)
        if sight.vertical_fov_rad:
            fields["vertical_fov_rad"] = min(sight.vertical_fov_rad, 2.0 * STEEPEST_RAD)
        x, y, yaw = self._lidar.pose
        sensor = DepthSensorSettings(**fields)
        heading = yaw if _is_around(sensor) else _heading(names)
        reach = max(sensor.range_max_m, sight.reach_m)
        return sensor.model_copy(update={"pose": (x, y, heading), "range_max_m": reach})


def _is_around(sensor: DepthSensorSettings) -> bool:
    return math.isclose(sensor.horizontal_fov_rad, 2.0 * math.pi, abs_tol=0.02)


def _heading(names: str) -> float:
    """Returns where a sensor of such names looks, rad from straight ahead."""
    side = next((yaw for word, yaw in DIRECTIONS.items() if word in names.lower()), 0.0)
    if REAR.search(names):
        return math.copysign(math.pi - 0.5 * abs(side), side) if side else math.pi
    return 0.5 * side if side and FRONT.search(names) else side
