"""Rotations given as quaternions x, y, z, w, which need not be normalised."""

from __future__ import annotations

import numpy as np

from drake_navbench.kernels.arrays import Array


def rotation_of(x: float, y: float, z: float, w: float) -> Array:
    """Returns the rotation matrix (3, 3) of a quaternion; of four zeros the identity."""
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return np.eye(3)
    s = 2.0 / norm
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )


def yaw_of(x: float | Array, y: float | Array, z: float | Array, w: float | Array) -> Array:
    """Returns the yaw of quaternions, rad."""
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z))
