"""What a sensor that sends points shows to the layers of a costmap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
