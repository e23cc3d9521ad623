"""The inputs of an obstacle or voxel layer in a cycle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Observation(NamedTuple):
    """The points of one source, with its flags and ranges, m.

    origin: (3,) of the sensor, m. points: (N, 3) m, C-contiguous; Nav2's are float32. marking,
    clearing: whether they mark obstacles, and clear the cells before them.
    """

    origin: NDArray[np.float64]
    points: NDArray[np.floating]
    marking: bool
    clearing: bool
    obstacle_min_range: float
    obstacle_max_range: float
    raytrace_min_range: float
    raytrace_max_range: float
