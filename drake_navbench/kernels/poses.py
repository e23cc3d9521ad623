"""Poses in the plane: placing points and outlines in a frame, seeing them from it, composing poses.

A pose (x m, y m, yaw rad) is that of a frame in another one. Products are added up in one
order, that of Nav2's transformFootprint, x + (p_x cos - p_y sin), so that equal input comes to lie
in equal cells; a kernel that must add as another part of Nav2 does says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.read_only import read_only


@njit(cache=True)
def place_point(point_x, point_y, x, y, cos_yaw, sin_yaw):
    """Returns (x, y) m of a point given in the frame that lies at (x, y) m, yaw."""
    return (
        x + (point_x * cos_yaw - point_y * sin_yaw),
        y + (point_x * sin_yaw + point_y * cos_yaw),
    )


@njit(cache=True)
def see_point(point_x, point_y, x, y, cos_yaw, sin_yaw):
    """Returns (x, y) m of a point in the frame that lies at (x, y) m, yaw: undoes `place_point`."""
    delta_x, delta_y = point_x - x, point_y - y
    return cos_yaw * delta_x + sin_yaw * delta_y, cos_yaw * delta_y - sin_yaw * delta_x


def place_outline(outline: Array, pose: Sequence[float] | Array) -> Array:
    """Returns a (K, 2) outline, base frame, m, as it lies at a pose (3,) x m, y m, yaw rad."""
    x, y, yaw = pose
    return outline_at(read_only(outline), float(x), float(y), float(yaw))


@njit(cache=True)
def outline_at(outline, x, y, yaw):
    """Returns a (K, 2) outline, base frame, m, as it lies at (x, y) m, yaw rad."""
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    placed = np.empty((outline.shape[0], 2))
    for k in range(outline.shape[0]):
        placed[k, 0], placed[k, 1] = place_point(
            outline[k, 0], outline[k, 1], x, y, cos_yaw, sin_yaw
        )
    return placed


@njit(cache=True)
def to_robot_frame(poses, x, y, yaw):
    """Returns poses (N, 3) x m, y m, yaw rad in the frame of a robot at (x, y) m, yaw rad."""
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    seen = np.empty((poses.shape[0], 3))
    for i in range(poses.shape[0]):
        seen[i, 0], seen[i, 1] = see_point(poses[i, 0], poses[i, 1], x, y, cos_yaw, sin_yaw)
        seen[i, 2] = wrap(poses[i, 2] - yaw)
    return seen


def with_wrapped_headings(poses: Array) -> Array:
    """Returns poses (N, 3) x m, y m, yaw rad with no yaw beyond half a turn."""
    beyond = np.abs(poses[:, 2]) > math.pi
    if not beyond.any():
        return poses
    wrapped = poses.copy()
    wrapped[beyond, 2] = [wrap(yaw) for yaw in poses[beyond, 2]]
    return wrapped


def compose(pose_AB: Sequence[float] | Array, pose_BC: Sequence[float] | Array) -> Array:
    """Returns the pose of C in A, X_AC = X_AB X_BC, (3,) m, m, rad; yaw unwrapped."""
    cos_yaw, sin_yaw = math.cos(pose_AB[2]), math.sin(pose_AB[2])
    x, y = place_point(pose_BC[0], pose_BC[1], pose_AB[0], pose_AB[1], cos_yaw, sin_yaw)
    return np.array([x, y, pose_AB[2] + pose_BC[2]])


@njit(cache=True)
def placed_state(state, odometry_from_world, noise, map_from_odometry):
    """Returns the estimate in the map's frame of a state (6,), which begins with a pose.

    odometry_from_world: (3,) X_OW, the pose of the state's frame in the odometry's. noise: (6,)
    added there. map_from_odometry: (3,) X_MO, the pose of the odometry's frame in the map's.
    """
    placed = state.copy()
    placed[2] += odometry_from_world[2]
    placed[0], placed[1] = place_point(
        state[0],
        state[1],
        odometry_from_world[0],
        odometry_from_world[1],
        math.cos(odometry_from_world[2]),
        math.sin(odometry_from_world[2]),
    )
    placed += noise
    placed[0], placed[1] = place_point(
        placed[0],
        placed[1],
        map_from_odometry[0],
        map_from_odometry[1],
        math.cos(map_from_odometry[2]),
        math.sin(map_from_odometry[2]),
    )
    placed[2] += map_from_odometry[2]
    return placed


@njit(cache=True)
def drifted_frame(frame, pose, error_x, error_y, error_yaw):
    """Returns a frame (3,) moved such that a pose (3,) in it shifts by an error.

    X_AF: `frame`, X_FP: `pose`, E: the error (m, m, rad) seen from P. Returns X_AF' with the yaw of
    X_AF plus error_yaw and X_AF' X_FP = X_AF X_FP E.
    """
    yaw = frame[2] + pose[2]
    x, y = place_point(pose[0], pose[1], frame[0], frame[1], math.cos(frame[2]), math.sin(frame[2]))
    x, y = place_point(error_x, error_y, x, y, math.cos(yaw), math.sin(yaw))
    moved = np.empty(3)
    moved[2] = frame[2] + error_yaw
    moved[0], moved[1] = place_point(
        -pose[0], -pose[1], x, y, math.cos(moved[2]), math.sin(moved[2])
    )
    return moved


def carrier_pose(pose_AC: Sequence[float] | Array, pose_BC: Sequence[float] | Array) -> Array:
    """Returns the pose of B in A, X_AB = X_AC X_CB, of a frame C fixed in B; (3,) m, m, rad."""
    yaw = pose_AC[2] - pose_BC[2]
    return compose((pose_AC[0], pose_AC[1], yaw), (-pose_BC[0], -pose_BC[1], 0.0))


def inverse(pose_AB: Sequence[float] | Array) -> Array:
    """Returns the pose of A in B, X_BA, the inverse of X_AB; (3,) m, m, rad."""
    return compose((0.0, 0.0, -pose_AB[2]), (-pose_AB[0], -pose_AB[1], 0.0))
