"""The readings for the collision monitor: the lidar's scans, and sonars as points on an arc.

Pure functions. Source: nav2_collision_monitor (Source, Range).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import carrier_pose
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.quantities import Duration
from drake_navbench.typed_files.typed_yaml import FrozenModel

# A pose: x m, y m, yaw rad in the base frame.
Mounting = tuple[float, float, float]

# A reading that would become more points than this is ignored, as in Nav2 from Lyrical on.
MAX_POINTS = 10_000
DEGREE = math.pi / 180.0
NANOSECONDS_PER_SECOND = 1e9


class MonitorSource(FrozenModel):
    """A sensor that the collision monitor looks at."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {"source_timeout": since(Release.JAZZY)}

    type: Literal["scan", "range"] = Field(
        "scan",
        description="Kind of source. scan: all scanners of the lidar; range: a range sensor.",
    )
    sensor: str = Field(
        "", description="For range: name of the robot's range sensor; empty: the source's name."
    )
    obstacles_angle: float = Field(
        DEGREE, gt=0.0, description="For range: angle between two points of the sensor's arc [rad]."
    )
    enabled: bool = Field(True, description="Use this source.")
    source_timeout: Duration | None = Field(
        None,
        ge=0.0,
        description="Age of the data above which the robot is stopped, as by a range that cannot "
        "be measured [s]; 0: never; null: the monitor's.",
    )

    @model_validator(mode="after")
    def _check(self) -> MonitorSource:
        if self.sensor and self.type != "range":
            raise ValueError(f"sensor: got {self.sensor!r}, expected type range with it")
        return self


THE_SCAN: Mapping[str, MonitorSource] = {"scan": MonitorSource()}


class MonitorReadings(NamedTuple):
    """The sensor readings of a cycle.

    time_s: time of the cycle, s. base_pose: (3,) of the base now, in the frame of the readings;
    None where the robot's motion since a reading is neglected. scan: the newest one, None where
    there is none. ranges: readings of each sensor, the newest last.
    """

    time_s: float
    base_pose: Array | None
    scan: Scan | None
    ranges: Mapping[str, Sequence[RangeReading]]


class Mountings(NamedTuple):
    """The poses of the first scanner and of the range sensors, by name, in the base frame."""

    scanner: Mounting
    ranges: Mapping[str, Mounting]


def points_of(
    sources: Mapping[str, MonitorSource],
    timeout_s: float,
    mountings: Mountings,
    sensed: MonitorReadings,
    *,
    release: Release = NEWEST_RELEASE,
) -> dict[str, Array] | None:
    """Returns each source's points (N, 2) m in the base frame; None where one stops the robot.

    timeout_s: for sources without a timeout of their own, s; 0: never. Up to Iron a source without
    current data is left out, and 0 is an age like any other.
    """
    is_left_out = release < Release.JAZZY
    found: dict[str, Array] = {}
    for name, source in sources.items():
        if not source.enabled:
            continue
        own_s = timeout_s if source.source_timeout is None else source.source_timeout
        if own_s == 0.0 and not is_left_out:
            own_s = math.inf
        if source.type == "scan":
            points = _scan_points(sensed, own_s, mountings.scanner)
        else:
            sensor = source.sensor or name
            reading = _newest(sensed.ranges.get(sensor, ()), release)
            points = _arc(sensed, reading, own_s, source.obstacles_angle, mountings.ranges[sensor])
        if points is not None:
            found[name] = points
        elif own_s < math.inf and not is_left_out:
            return None
    return found


def points_in_base(hits: Array, base_pose: Array) -> Array:
    """Returns hits (N, 2) of the world frame in the frame of a base at (3,) x m, y m, yaw rad.

    One matrix product for a whole scan; it may round otherwise than `poses.see_point`.
    """
    cos_yaw, sin_yaw = math.cos(base_pose[2]), math.sin(base_pose[2])
    delta = hits - base_pose[:2]
    return np.ascontiguousarray(delta @ np.array([[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]]))


def arc_points(reading: RangeReading, obstacles_angle: float) -> Array | None:
    """Returns the points (N, 2) m that stand for a reading, in the frame of its `sensor_pose`.

    The points lie at equal angles from the right end of the cone on; the last one is at its left
    end. None where the sensor cannot measure the range. Angles add up in single precision, as in
    Nav2.
    """
    if not reading.is_within_range:
        return None
    end = np.float32(0.5) * np.float32(reading.field_of_view_rad)
    if math.ceil(reading.field_of_view_rad / obstacles_angle) + 1 > MAX_POINTS:
        return None
    bearings, bearing = [], -end
    while bearing < end:
        bearings.append(bearing)
        bearing = np.float32(float(bearing) + obstacles_angle)
    angles = np.array([*bearings, end], dtype=np.float32)
    own = np.float32(reading.range_m) * np.column_stack([np.cos(angles), np.sin(angles)])
    x, y, yaw = reading.sensor_pose
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    turned = own.astype(np.float64) @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
    return np.asarray(turned + np.array([x, y]))


def _is_too_old(age_s: float, timeout_s: float) -> bool:
    """Tells whether an age exceeds a timeout, in whole nanoseconds, as Nav2 compares them."""
    if timeout_s == math.inf:
        return False
    return round(age_s * NANOSECONDS_PER_SECOND) > int(timeout_s * NANOSECONDS_PER_SECOND)


def _scan_points(sensed: MonitorReadings, timeout_s: float, mounting: Mounting) -> Array | None:
    """Returns (N, 2) all scanners' hits, base frame, m; None where the scan is missing or old."""
    scan = sensed.scan
    if scan is None or _is_too_old(sensed.time_s - scan.time_s, timeout_s):
        return None
    base_pose = sensed.base_pose
    if base_pose is None:
        base_pose = carrier_pose(scan.sensor_pose, mounting)
    return points_in_base(np.vstack([own.hits for own in scan.of_all_scanners]), base_pose)


def _newest(readings: Sequence[RangeReading], release: Release) -> RangeReading | None:
    """Returns the newest reading that the release takes; None where there is none."""
    taken = (one for one in reversed(readings) if release < Release.LYRICAL or one.is_taken)
    return next(taken, None)


def _arc(
    sensed: MonitorReadings,
    reading: RangeReading | None,
    timeout_s: float,
    obstacles_angle: float,
    mounting: Mounting,
) -> Array | None:
    """Returns the points (N, 2) m of a reading, base frame; None for none, or an old one."""
    if reading is None or _is_too_old(sensed.time_s - reading.time_s, timeout_s):
        return None
    base_pose = sensed.base_pose
    points = arc_points(reading, obstacles_angle)
    if points is None:
        return None
    if base_pose is None:
        base_pose = carrier_pose(reading.sensor_pose, mounting)
    return points_in_base(points, base_pose)
