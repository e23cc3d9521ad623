"""The reading of a sonar or an infrared sensor, as ROS's sensor_msgs/Range."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.poses import compose

# The widest cone of which the collision monitor takes a reading, rad.
WIDEST_CONE = math.pi


@dataclass(frozen=True, eq=False)
class RangeReading(Immutable):
    """One distance, to the nearest thing in the cone of a sensor.

    time_s: when it was taken. sensor_pose: (3,) x m, y m, yaw rad in the world frame, or in that of
    the costmap reading it. range_m: inf where nothing is in range, -inf where something is nearer
    than the least range. A sensor whose least and longest range are equal reads inf where nothing
    is nearer, -inf where something is. field_of_view_rad: opening angle of the whole cone.
    odometry_pose: (3,) the sensor's in the frame of the odometry then; None where that is the
    world's. Lengths and angles have the single precision of the message.
    """

    time_s: float
    sensor_pose: Array
    range_m: float
    range_min_m: float
    range_max_m: float
    field_of_view_rad: float
    odometry_pose: Array | None = None

    def placed_by_odometry(self, frame_from_odometry: Array | None = None) -> RangeReading:
        """Returns the reading as the robot places it, in the odometry's frame or another frame.

        frame_from_odometry: (3,) pose of the odometry's frame in the other frame.
        """
        if self.odometry_pose is None:
            return self
        pose = self.odometry_pose
        if frame_from_odometry is not None:
            pose = compose(frame_from_odometry, pose)
        return replace(self, sensor_pose=pose, odometry_pose=None)

    @property
    def is_within_range(self) -> bool:
        """Whether the sensor can measure the distance."""
        return self.range_min_m <= self.range_m <= self.range_max_m

    @property
    def is_taken(self) -> bool:
        """Whether Lyrical's collision monitor takes the message, so that it replaces the last one.

        It drops a range that is not finite, a cone without width, and a sensor whose least range is
        not below its longest.
        """
        is_cone = 0.0 < self.field_of_view_rad <= WIDEST_CONE
        is_sensor = 0.0 <= self.range_min_m < self.range_max_m
        return math.isfinite(self.range_m) and is_cone and is_sensor
