"""What a sensor that sends points shows to the layers of a costmap."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.poses import place_point
from drake_navbench.typed_files.immutable import Immutable

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PointCloud(Immutable):
    """Points that a sensor saw, in the frame of the costmap.

    origin: (3,) of the sensor, x m, y m, z m. points: (N, 3) m. time_s: when it saw them, s.
    yaw_rad, pitch_rad: where the sensor looked; a positive pitch is down.
    """

    origin: Array
    points: Array
    time_s: float = 0.0
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0

    def placed_in(self, frame: Array) -> PointCloud:
        """Returns the same in another frame, in which this one lies at `frame` (3,)."""
        x, y, yaw = frame
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        origin, points = self.origin.copy(), self.points.copy()
        for placed in (origin, points):
            placed[..., 0], placed[..., 1] = place_point(
                placed[..., 0].copy(), placed[..., 1].copy(), x, y, cos_yaw, sin_yaw
            )
        return replace(self, origin=origin, points=points, yaw_rad=self.yaw_rad + yaw)
