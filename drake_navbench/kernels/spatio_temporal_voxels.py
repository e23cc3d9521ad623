"""Voxels with the time at which each was last marked; they are removed after a while.

A grid without edges: (V,) keys of the voxels that are marked, sorted, and (V,) when they were, s.
Source: spatio_temporal_voxel_layer, branch ros2 (SpatioTemporalVoxelGrid, DepthCameraFrustum,
ThreeDimensionalLidarFrustum), with its float32 voxel size and points. Quirks kept: a point of
negative y is marked one voxel too low; with the exponential model a voxel outside of all frustums
is never removed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array

Keys = NDArray[np.int64]

KEY_BITS = 21
KEY_OFFSET = 1 << (KEY_BITS - 1)
KEY_MASK = (1 << KEY_BITS) - 1
# The values of the original's enumerations.
LINEAR, EXPONENTIAL = 0, 1
DEPTH_CAMERA, LIDAR_3D = 0, 1
# From this angle on a lidar looks all around, rad.
ALL_AROUND_RAD = 6.27
# Nearer points are the sensor itself, m^2.
NEAREST_SQUARED = 0.0001


class Voxels(NamedTuple):
    """Marked voxels: keys (V,), sorted, and times (V,) s of their last mark."""

    keys: Keys
    times: Array


NO_VOXELS = Voxels(np.empty(0, np.int64), np.empty(0))


class Frustum(NamedTuple):
    """The field of view of a sensor, and the factor by which voxels in it decay faster.

    origin: (3,) m. yaw, pitch: yaw and pitch of the axis, rad, a positive pitch down. near, far: m
    along the axis for a camera, from it for a lidar. padding: added to heights for a lidar, m.
    """

    model: int
    origin: Array
    yaw: float
    pitch: float
    horizontal_fov: float
    vertical_fov: float
    padding: float
    near: float
    far: float
    acceleration: float


def keys_of(indices: NDArray[np.int64]) -> Keys:
    """Returns the keys of (N, 3) indices of voxels."""
    shifted = indices + KEY_OFFSET
    return (shifted[:, 0] << 2 * KEY_BITS) | (shifted[:, 1] << KEY_BITS) | shifted[:, 2]


def centres_of(keys: Keys, voxel_size: float) -> Array:
    """Returns the centres (V, 3) of voxels, m."""
    parts = [keys >> 2 * KEY_BITS, (keys >> KEY_BITS) & KEY_MASK, keys & KEY_MASK]
    return (np.column_stack(parts) - KEY_OFFSET) * voxel_size + voxel_size / 2.0


def marked(
    voxels: Voxels, origin: Array, points: Array, *, reach: float, voxel_size: float, now: float
) -> Voxels:
    """Returns the voxels with those of points (N, 3), m, that are within reach of a sensor."""
    seen = points.astype(np.float32).astype(np.float64)
    squared = np.sum((seen - origin) ** 2, axis=1)
    seen = seen[(squared <= reach * reach) & (squared >= NEAREST_SQUARED)]
    is_negative = np.column_stack([seen[:, 0] < 0.0, seen[:, 1] < 0.0, seen[:, 1] < 0.0])
    # Toward zero, as a cast of C++ is.
    indices = np.trunc((seen - voxel_size * is_negative) / voxel_size).astype(np.int64)
    indices = indices[np.all(np.abs(indices) < KEY_OFFSET, axis=1)]
    new = np.unique(keys_of(indices))
    old = ~np.isin(voxels.keys, new, assume_unique=True)
    keys = np.concatenate([voxels.keys[old], new])
    times = np.concatenate([voxels.times[old], np.full(new.size, now)])
    order = np.argsort(keys)
    return Voxels(keys[order], times[order])


def decayed(
    voxels: Voxels,
    frustums: list[Frustum],
    *,
    decay_model: int,
    voxel_decay: float,
    voxel_size: float,
    now: float,
) -> tuple[Voxels, Keys]:
    """Returns the voxels that are left, and the keys of those that are gone.

    Within a frustum a voxel ages faster: the time of its mark is moved back. Of several frustums
    the first one that holds it counts.
    """
    age = now - voxels.times
    left = np.full(age.shape, voxel_decay)
    if decay_model == LINEAR:
        left = voxel_decay - age
    elif decay_model == EXPONENTIAL:
        left = voxel_decay * np.exp(-age)
    centres = centres_of(voxels.keys, voxel_size)
    times = voxels.times.copy()
    is_seen = np.zeros(age.shape, dtype=bool)
    for frustum in frustums:
        inside = ~is_seen
        inside[inside] = is_inside(frustum, centres[inside])
        hastening = 1.0 / 6.0 * frustum.acceleration * age[inside] ** 3
        left[inside] -= hastening
        times[inside] -= hastening
        is_seen |= inside
    gone = left < 0.0
    return Voxels(voxels.keys[~gone], times[~gone]), voxels.keys[gone]


def is_inside(frustum: Frustum, points: Array) -> NDArray[np.bool_]:
    """Returns (N,) whether each of the points (N, 3), m, is in a sensor's field of view."""
    forward, left, up = _axes(frustum.yaw, frustum.pitch)
    offset = points - frustum.origin
    if frustum.model == LIDAR_3D:
        return _is_in_lidar(frustum, offset @ forward, offset @ left, offset @ up)
    return _is_in_camera(frustum, np.column_stack([-offset @ left, -offset @ up, offset @ forward]))


def _axes(yaw: float, pitch: float) -> tuple[Array, Array, Array]:
    """Returns the unit vectors of a sensor's forward, left and up."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    down_cosine, down_sine = math.cos(pitch), math.sin(pitch)
    forward = np.array([down_cosine * cosine, down_cosine * sine, -down_sine])
    left = np.array([-sine, cosine, 0.0])
    return forward, left, np.cross(forward, left)


def _is_in_lidar(frustum: Frustum, x: Array, y: Array, z: Array) -> NDArray[np.bool_]:
    squared = x * x + y * y
    padded = np.abs(z) + frustum.padding
    with np.errstate(divide="ignore", invalid="ignore"):
        steepness = padded * padded / squared
        ahead = np.abs(np.arctan(y / x))
        behind = np.abs(np.arctan(x / y)) + math.pi / 2.0
    inside = (squared <= frustum.far**2) & (squared >= frustum.near**2)
    inside &= ~(steepness > math.tan(frustum.vertical_fov / 2.0) ** 2)
    if frustum.horizontal_fov <= ALL_AROUND_RAD:
        inside &= ~(np.where(x > 0.0, ahead, behind) > frustum.horizontal_fov / 2.0)
    return inside


def _is_in_camera(frustum: Frustum, points: Array) -> NDArray[np.bool_]:
    """points: (N, 3) m to the right, down and ahead of the camera."""
    if frustum.vertical_fov == 0.0 and frustum.horizontal_fov == 0.0:
        return np.zeros(len(points), dtype=bool)
    corners = []
    signs = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    for vertical, horizontal in signs:
        about_x, about_y = 0.5 * vertical * frustum.vertical_fov, horizontal * 0.5
        about_y *= frustum.horizontal_fov
        cosine = math.cos(about_y)
        ray = (
            math.sin(about_y),
            -math.sin(about_x) * cosine,
            math.cos(about_x) * cosine,
        )
        corners.append(np.array(ray))
    near = [frustum.near * corner for corner in corners]
    far = [frustum.far * corner for corner in corners]
    planes = [
        (_normal(far[(n + 1) % 4] - far[n], far[n] - near[n]), near[n]) for n in range(len(corners))
    ]
    ahead = _normal(far[3] - far[2], far[0] - far[3])
    planes += [(ahead, far[3]), (-ahead, near[1])]
    inside = np.ones(len(points), dtype=bool)
    for normal, corner in planes:
        inside &= ~((points - corner) @ normal > 0.0)
    return inside


def _normal(first: Array, second: Array) -> Array:
    across = np.cross(first, second)
    length = float(np.linalg.norm(across))
    return across / length if length > 0.0 else across
