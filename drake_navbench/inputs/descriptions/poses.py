"""Poses as (4, 4) matrices, from the texts of URDF and SDF: x y z m, roll pitch yaw rad."""

from __future__ import annotations

import math

import numpy as np

from drake_navbench.kernels.arrays import Array

# Positions beyond this are mistakes; a world of this size is reported as too large, m.
FARTHEST_M = 1e6


def numbers(text: str | None, count: int, fill: float = 0.0) -> list[float]:
    """Returns the first numbers of a text; missing and not finite ones become `fill`."""
    found: list[float] = []
    for word in (text or "").replace(",", " ").split()[:count]:
        try:
            value = float(word)
        except ValueError:
            value = fill
        found.append(value if abs(value) <= FARTHEST_M else fill)
    return found + [fill] * (count - len(found))


def number(text: str | None) -> float | None:
    """Returns the number that a text is; None where it is none."""
    try:
        value = float((text or "").strip())
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Returns (3, 3) R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose_of(values: list[float]) -> Array:
    """Returns the pose of x, y, z m, roll, pitch, yaw rad."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(*values[3:6])
    pose[:3, 3] = values[:3]
    return pose


def turned_about(axis: Array, angle_rad: float) -> Array:
    """Returns the pose (4, 4) of a frame that is turned about an axis (3,); an axis of 0: itself.

    R = 1 + sin(a) K + (1 - cos(a)) K^2 with K v = axis x v (Rodrigues).
    """
    pose, length = np.eye(4), float(np.linalg.norm(axis))
    if length > 0.0:
        x, y, z = axis / length
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        about = math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * cross @ cross
        pose[:3, :3] += about
    return pose


def yaw_of(pose: Array) -> float:
    """Returns the heading of a pose's x axis over the floor, rad."""
    return math.atan2(pose[1, 0], pose[0, 0])


def inverse(pose: Array) -> Array:
    """Returns the inverse of a pose."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def moved_inertia(pose: Array, moments: list[float]) -> Array:
    """Returns an inertia tensor (3, 3) in the frame in which its own frame has the pose `pose`.

    moments: ixx, iyy, izz, ixy, ixz, iyz.
    """
    xx, yy, zz, xy, xz, yz = moments
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turned: Array = pose[:3, :3] @ own @ pose[:3, :3].T
    return turned
