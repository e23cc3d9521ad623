"""The conversion of scans and clouds to the observations of a layer's source.

Source: nav2_costmap_2d (ObstacleLayer, ObservationBuffer). Nav2 passes points on as float32; here
they stay float64.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import points_between, scan_points
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.observation_source import (
    ObservationSourceSettings,
    SourceSettings,
)
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.navigation.costmaps.sensor import RangeSensor

Reading = TypeVar("Reading")
Buffer = tuple[tuple[float, Reading], ...]
"""A source's readings that still count: time s and reading, the newest first."""


def clouds_of(
    name: str,
    source: SourceSettings,
    lidar: RangeSensor,
    *,
    scan: Scan | None,
    clouds: Mapping[str, PointCloud],
    inf_is_valid: bool,
) -> list[PointCloud]:
    """Returns the newest cloud of each sensor of a source that has sent one.

    name: name of the source. clouds: by the names of the robot's depth sensors.
    """
    if source.data_type == "PointCloud2":
        sensor = source.sensor or name
        return [clouds[sensor]] if sensor in clouds else []
    if scan is None:
        return []
    scans: Sequence[Scan] = scan.of_all_scanners
    if source.scanner is not None:
        scans = scans[source.scanner - 1 : source.scanner]
    return [_cloud_of(own, lidar, inf_is_valid=inf_is_valid) for own in scans]


def _cloud_of(scan: Scan, lidar: RangeSensor, *, inf_is_valid: bool) -> PointCloud:
    """Returns the hits of a scan, all as high as the lidar."""
    points = scan_points(
        scan.sensor_pose,
        scan.angles_rad,
        scan.ranges_m,
        height=lidar.height_m,
        range_min=lidar.range_min_m,
        range_max=lidar.range_max_m,
        inf_is_valid=inf_is_valid,
    )
    x, y, yaw = scan.sensor_pose.tolist()
    return PointCloud(np.array([x, y, lidar.height_m]), points, scan.time_s, yaw)


def observation_of(source: ObservationSourceSettings, cloud: PointCloud) -> Observation:
    """Returns a source's observation of a cloud: the points between its heights."""
    lowest, highest = source.min_obstacle_height, source.max_obstacle_height
    return Observation(
        origin=np.ascontiguousarray(cloud.origin, dtype=np.float64),
        points=points_between(read_only(cloud.points), lowest, highest),
        marking=source.marking,
        clearing=source.clearing,
        obstacle_min_range=source.obstacle_min_range,
        obstacle_max_range=source.obstacle_max_range,
        raytrace_min_range=source.raytrace_min_range,
        raytrace_max_range=source.raytrace_max_range,
    )


def buffered(
    before: Buffer[Reading],
    seen: Sequence[tuple[float, Reading]],
    *,
    now_s: float,
    keep_s: float,
) -> Buffer[Reading]:
    """Returns a buffer with the new readings in front.

    seen: the sensors' readings; a reading that is no later than the newest in the buffer is not
    new. keep_s: the greatest age of a reading that is kept; 0 keeps the newest of each sensor
    alone.
    """
    newest_s = before[0][0] if before else -np.inf
    new = [reading for reading in seen if reading[0] > newest_s]
    if keep_s == 0.0:
        return tuple(seen)
    kept = (*new, *before)
    return tuple(reading for reading in kept if now_s - reading[0] <= keep_s)


def observed_by(
    sources: Mapping[str, ObservationSourceSettings],
    before: Mapping[str, Buffer[Observation]],
    lidar: RangeSensor,
    seen: Any,
) -> dict[str, Buffer[Observation]]:
    """Returns the buffers of all sources after a cycle; `seen`: a `layer_plugin.Seen`."""
    after = {}
    for name, source in sources.items():
        clouds = clouds_of(
            name,
            source,
            lidar,
            scan=seen.scan,
            clouds=seen.clouds,
            inf_is_valid=source.inf_is_valid,
        )
        readings = [(cloud.time_s, observation_of(source, cloud)) for cloud in clouds]
        keep_s = source.observation_persistence
        after[name] = buffered(before.get(name, ()), readings, now_s=seen.time_s, keep_s=keep_s)
    return after
