"""Draws the moving obstacles of a replay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Rgba
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.analysis.metrics.movers import Movers
from drake_navbench.analysis.replay.paths import MOVING_PATH
from drake_navbench.analysis.replay.stage import Stage, frames_until
from drake_navbench.inputs.moving_obstacles import MovingObstacles
from drake_navbench.inputs.world_geometry import MOVING_COLOR, moving_shape
from drake_navbench.kernels.arrays import Array


def draw_moving(stage: Stage, moving: MovingObstacles) -> list[str]:
    """Draws each moving obstacle at its pose at time 0; returns the Meshcat path of each."""
    paths = []
    for index, (thing, pose) in enumerate(
        zip(moving.things, moving.tracks.poses_at(0.0), strict=True)
    ):
        path = f"{MOVING_PATH}/{index}"
        offset, shape = moving_shape(thing)
        stage.meshcat.SetObject(f"{path}/shape", shape, Rgba(*MOVING_COLOR))
        stage.pose(f"{path}/shape", offset)
        stage.pose(path, on_floor(pose))
        paths.append(path)
    return paths


def add_moving(stage: Stage, movers: Movers, *, end_time_s: float, pose_stride: int) -> bool:
    """Draws the moving obstacles and animates them until `end_time_s`.

    Returns whether there are any.
    """
    if not len(movers.things):
        # Computing no poses would load a kernel, which takes longer than the replay.
        return False
    paths = draw_moving(stage, movers.things)
    frames, times = frames_until(end_time_s, pose_stride)
    poses = movers.poses_at(times)
    for index, path in enumerate(paths):
        for row in rows_of_bends(poses[:, index]):
            stage.pose(path, on_floor(poses[row, index]), int(frames[row]))
    return True


def on_floor(pose: Sequence[float] | Array) -> RigidTransform:
    """Returns the pose in space of a pose (3,) on the floor: x m, y m, yaw rad."""
    return RigidTransform(RotationMatrix.MakeZRotation(pose[2]), [pose[0], pose[1], 0.0])


def rows_of_bends(poses: Array) -> NDArray[np.int64]:
    """Returns the indices of the poses (T, 3) at which a motion changes; between them it is even.

    The first and the last index are always among them.
    """
    steps = np.diff(poses, axis=0)
    bends = np.flatnonzero(np.any(np.abs(np.diff(steps, axis=0)) > 1e-6, axis=1)) + 1
    return np.unique(np.concatenate([[0], bends, [len(poses) - 1]]))
