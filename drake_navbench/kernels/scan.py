"""A lidar scan: ranges of beams by angle, and the pose that they were taken from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.poses import compose


@dataclass(frozen=True, eq=False)
class Scan(Immutable):
    """One lidar scan as it was recorded.

    time_s: when it was taken. sensor_pose: (3,) x m, y m, yaw rad in the world frame.
    angles_rad: (B,) beam angles in the sensor frame. ranges_m: (B,) inf where nothing was hit.
    further: the scans of the robot's other scanners at the same time; a log does not keep them.
    odometry_pose: (3,) pose of the sensor in the odometry frame; None where that is the world
        frame. A log does not keep it.
    """

    time_s: float
    sensor_pose: NDArray[np.float64]
    angles_rad: NDArray[np.float64]
    ranges_m: NDArray[np.float32]
    further: tuple[Scan, ...] = ()
    odometry_pose: NDArray[np.float64] | None = None

    def placed_by_odometry(self, frame_from_odometry: NDArray[np.float64] | None = None) -> Scan:
        """Returns the scan as the robot places it, in the odometry's frame or another one.

        frame_from_odometry: (3,) pose of the odometry frame in the other frame.
        """
        if self.odometry_pose is None:
            return self
        pose = self.odometry_pose
        if frame_from_odometry is not None:
            pose = compose(frame_from_odometry, pose)
        further = tuple(scan.placed_by_odometry(frame_from_odometry) for scan in self.further)
        return replace(self, sensor_pose=pose, further=further, odometry_pose=None)

    @property
    def of_all_scanners(self) -> tuple[Scan, ...]:
        """This scan and those of the other scanners."""
        return (self, *self.further)

    @property
    def hits(self) -> NDArray[np.float64]:
        """(H, 2) points hit, world frame, m."""
        valid = np.isfinite(self.ranges_m)
        bearing = self.sensor_pose[2] + self.angles_rad[valid]
        direction = np.column_stack([np.cos(bearing), np.sin(bearing)])
        return self.sensor_pose[:2] + self.ranges_m[valid, None] * direction
