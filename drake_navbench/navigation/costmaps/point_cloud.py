"""The point cloud that a sensor hands to the layers of a costmap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.poses import compose, place_outline


@dataclass(frozen=True, eq=False)
class PointCloud(Immutable):
    """The points that a sensor saw, in the world's frame, or in that of the costmap reading them.

    origin: (3,) of the sensor, x m, y m, z m. points: (N, 3) m. time_s: time at which the sensor
    saw the points, s. yaw_rad, pitch_rad: yaw and pitch of the sensor's axis; a positive pitch is
    down.
    odometry_from_here: (3,) pose of the cloud's frame in the odometry's frame at time_s; None where
    they are one.
    """

    origin: Array
    points: Array
    time_s: float = 0.0
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    odometry_from_here: Array | None = None

    def placed_by_odometry(self, frame_from_odometry: Array | None = None) -> PointCloud:
        """Returns the cloud as the robot places it, in the odometry's frame or another frame.

        frame_from_odometry: (3,) pose of the odometry's frame in the other frame.
        """
        if self.odometry_from_here is None:
            return self
        frame = self.odometry_from_here
        if frame_from_odometry is not None:
            frame = compose(frame_from_odometry, frame)
        return replace(
            self,
            origin=np.append(place_outline(self.origin[None, :2], frame), self.origin[2]),
            points=np.column_stack([place_outline(self.points[:, :2], frame), self.points[:, 2]]),
            yaw_rad=self.yaw_rad + frame[2],
            odometry_from_here=None,
        )
