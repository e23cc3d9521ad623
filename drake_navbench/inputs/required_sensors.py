"""Whether a robot has the sensors that its costmaps and its collision monitor name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.errors import nearest_name_hint
from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.range_sensor import RangeSensorSettings
from drake_navbench.navigation.costmaps.observation_layers import SensingParameters
from drake_navbench.navigation.costmaps.observation_source import ObservationSourceSettings
from drake_navbench.navigation.costmaps.range_sensor_layer import RangeSensorLayerParameters


class Sensors(NamedTuple):
    """The sensors of a robot; depth cameras and range sensors by name."""

    lidar: LidarSettings
    depth: Mapping[str, DepthSensorSettings]
    range: Mapping[str, RangeSensorSettings]


def require_sensors(navigation: NavigationSettings, robot: Sensors) -> None:
    """Raises ValueError where a costmap layer or the collision monitor names a missing sensor."""
    for costmap in ("local_costmap", "global_costmap"):
        _require_for_layers(navigation, costmap, robot)
    monitor = navigation.collision_monitor
    for name, source in ({} if monitor is None else monitor.observation_sources).items():
        if source.type == "range":
            place = f"navigation.collision_monitor.observation_sources.{name}"
            _require_range_sensor(robot, place, source.sensor or name)


def _require_for_layers(navigation: NavigationSettings, costmap: str, robot: Sensors) -> None:
    settings = getattr(navigation, costmap)
    for layer in settings.plugins:
        if not settings.is_active(layer):
            continue
        block = settings.block(layer)
        if isinstance(block, SensingParameters):
            _require_low_lidar(robot, f"navigation.{costmap}.{layer}", block)
        if isinstance(block, RangeSensorLayerParameters):
            for sensor in block.topics:
                _require_range_sensor(robot, f"navigation.{costmap}.{layer}.topics", sensor)
        sources = getattr(block, "observation_sources", None)
        if not isinstance(sources, Mapping):
            continue
        for name, source in sources.items():
            place = f"navigation.{costmap}.{layer}.observation_sources.{name}"
            _require_for_source(robot, place, name, source)


def _require_low_lidar(robot: Sensors, place: str, layer: SensingParameters) -> None:
    """Raises ValueError where the lidar is too high for a layer that names no sources."""
    height_m = robot.lidar.height_m
    if "observation_sources" in layer.model_fields_set:
        return
    heights_m = [one.max_obstacle_height for one in layer.observation_sources.values()]
    top_m = min(layer.max_obstacle_height, *heights_m)
    if height_m > top_m:
        raise ValueError(
            f"{place}: sees up to {top_m:g} m, and the lidar is at "
            f"{height_m:g} m; expected observation_sources and max_obstacle_height for it"
        )


def _require_range_sensor(robot: Sensors, place: str, sensor: str) -> None:
    if sensor not in robot.range:
        hint = nearest_name_hint(sensor, robot.range)
        raise ValueError(
            f"{place}: the robot has no range sensor {sensor!r}{hint}; expected one of this "
            "name in range_sensors"
        )


def _require_for_source(
    robot: Sensors, place: str, name: str, source: ObservationSourceSettings
) -> None:
    """Raises ValueError where the robot does not have the sensor of a source."""
    if source.data_type == "LaserScan":
        count = 1 + len(robot.lidar.further_poses)
        if source.scanner is not None and source.scanner > count:
            raise ValueError(f"{place}.scanner: got {source.scanner}, the robot has {count}")
        return
    sensor = source.sensor or name
    if sensor not in robot.depth:
        hint = nearest_name_hint(sensor, robot.depth)
        raise ValueError(
            f"{place}: the robot has no depth sensor {sensor!r}{hint}; expected one of this "
            "name in depth_sensors"
        )
