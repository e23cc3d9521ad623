"""Draws people as walking figures: head, trunk, and two legs that move with the walked distance."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Capsule, Ellipsoid, Rgba, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.analysis.replay.moving_shapes import on_floor
from drake_navbench.analysis.replay.stage import Stage, frames_until
from drake_navbench.inputs.people import HIP_HALF_WIDTH_M, HIP_HEIGHT_M, foot_offsets_m
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

HEAD_COLOR, LEG_COLOR = Rgba(0.87, 0.70, 0.58, 1.0), Rgba(0.20, 0.22, 0.28, 1.0)
HEAD_HEIGHT_M, HEAD_RADIUS_M = 1.58, 0.11
TRUNK_HEIGHT_M, TRUNK_SEMI_AXES_M = 1.13, (0.13, 0.22, 0.34)
LEG_RADIUS_M, LEG_LENGTH_M = 0.065, 0.72
LEGS = {"left_leg": 1.0, "right_leg": -1.0}
# The most keys in a page; a person has three, a key takes 126 bytes, as measured.
MAX_KEYS, FRAMES_PER_KEY = 10_000, 3


def draw_person(stage: Stage, path: str, rgba: Rgba) -> None:
    """Draws a standing person below `path`, whose pose the caller sets."""
    trunk = RigidTransform([0.0, 0.0, TRUNK_HEIGHT_M])
    head = RigidTransform([0.0, 0.0, HEAD_HEIGHT_M])
    _draw(stage, f"{path}/trunk", Ellipsoid(*TRUNK_SEMI_AXES_M), trunk, rgba)
    _draw(stage, f"{path}/head", Sphere(HEAD_RADIUS_M), head, HEAD_COLOR)
    for name, side in LEGS.items():
        below_hip = RigidTransform([0.0, 0.0, -0.5 * HIP_HEIGHT_M])
        shape = Capsule(LEG_RADIUS_M, LEG_LENGTH_M)
        _draw(stage, f"{path}/{name}/shape", shape, below_hip, LEG_COLOR)
        stage.pose(f"{path}/{name}", leg_pose(side, 0.0))


def add_people(stage: Stage, path: str, log: TrialLog, *, rgba: Rgba, trial_count: int) -> bool:
    """Draws the people of a trial and lets them walk; returns whether there are any.

    trial_count: the number of trials in the page, which share its keys.
    """
    if log.people is None:
        return False
    end_time_s = float(log.people.time_s[-1])
    count = log.people.person_count
    frames, times = frames_until(end_time_s, FRAMES_PER_KEY)
    every = max(1, -(-3 * len(frames) * count * trial_count // MAX_KEYS))
    frames, times = frames[::every], times[::every]
    for index in range(count):
        own = f"{path}/{index}"
        draw_person(stage, own, rgba)
        poses, ahead = _motion(log, index, times)
        there = ~np.isnan(poses[:, 0])
        if not there.all():
            for turn in np.flatnonzero(np.diff(there, prepend=~there[:1])):
                stage.show_from(own, int(frames[turn]), is_shown=bool(there[turn]))
        for row, frame in enumerate(frames.tolist()):
            if not there[row] or (0 < row < len(frames) - 1 and _rests(poses, ahead, row)):
                continue
            stage.pose(own, on_floor(poses[row]), frame)
            for name, side in LEGS.items():
                stage.pose(f"{own}/{name}", leg_pose(side, ahead[row]), frame)
    return True


def leg_pose(side: float, ahead_m: float) -> RigidTransform:
    """Returns the pose of a leg in the person's frame.

    side: 1 for the left leg, -1 for the right. ahead_m: distance of the left foot ahead of the
    hips.
    """
    swing = -np.arcsin(np.clip(side * ahead_m / HIP_HEIGHT_M, -1.0, 1.0))
    rotation = RotationMatrix.MakeYRotation(swing)
    return RigidTransform(rotation, [0.0, side * HIP_HALF_WIDTH_M, HIP_HEIGHT_M])


def _motion(log: TrialLog, index: int, times: Array) -> tuple[Array, Array]:
    """Returns a person's poses (T, 3), and the left foot's distance ahead of the hips, (T,) m."""
    assert log.people is not None
    own_s, own = log.people.time_s, log.people.poses[:, index]
    steps_m = np.nan_to_num(np.hypot(*np.diff(own[:, :2], axis=0).T))
    walked_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    speed_mps = np.append(steps_m / np.diff(own_s), 0.0)
    poses = np.column_stack([np.interp(times, own_s, column) for column in own.T])
    # At times between a position and none, the person is absent.
    away = np.isnan(poses[:, 0])
    ahead = foot_offsets_m(np.interp(times, own_s, walked_m), np.interp(times, own_s, speed_mps))
    ahead[away] = 0.0
    return poses, ahead


def _rests(poses: Array, ahead: Array, row: int) -> bool:
    """Returns whether a row is equal to the row before and to the row after."""
    near = slice(row - 1, row + 2)
    return bool(np.ptp(poses[near], axis=0).max() < 1e-3 and np.ptp(ahead[near]) < 1e-3)


def _draw(stage: Stage, path: str, shape: Shape, pose: RigidTransform, rgba: Rgba) -> None:
    stage.meshcat.SetObject(path, shape, rgba)
    stage.pose(path, pose)
