"""Draws the objects of one trial: its robot, the driven path and the lidar hits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Rgba
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.analysis.metrics.signals import lateral_velocity
from drake_navbench.analysis.replay.flat_meshes import bands, ribbon, thinned
from drake_navbench.analysis.replay.robot_model import RobotModel
from drake_navbench.analysis.replay.rolling import BaseMotion
from drake_navbench.analysis.replay.scene import PATH_HEIGHT_M, POINT_SPACING_M
from drake_navbench.analysis.replay.stage import (
    FRAMES_PER_SECOND,
    Stage,
    frame_of,
    frames_until,
    spaced_in_time,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.log import TrialLog

# A wheel's angle needs fewer keys than the pose: the browser interpolates between keys.
FRAMES_PER_WHEEL_KEY = 4
# The most poses in a page: the pose of one frame takes 126 bytes, as measured; 12,000 take less
# than 1.6 MB.
MAX_POSE_KEYS = 12_000

MAX_HITS_A_SCAN = 90
HIT_SIZE_M = 0.16
HIT_HEIGHT_M = 0.2
PATH_WIDTH_M = 0.06
OUTLINE_WIDTH_M = 0.03
# Each controller's flat objects lie this much higher than the last one's, so that they do not
# flicker.
LAYER_STEP_M = 0.001


@dataclass(frozen=True)
class Pace:
    """The spacing of key frames, chosen so that long trials do not make the page large.

    pose_stride: number of frames from one pose of a base to the next. turn_period_s: the time for
    which each scan or prediction is shown.
    """

    pose_stride: int
    turn_period_s: float

    @classmethod
    def fitting(
        cls,
        durations_s: Sequence[float],
        model: RobotModel,
        *,
        turn_period_s: float,
        max_turns: int,
    ) -> Pace:
        """Returns the finest pace at which trials of these durations fit into a page.

        turn_period_s: the shortest period of scans and predictions. max_turns: the most scans or
        predictions in the page; each is an object of its own, of 1 to 3 kB.
        """
        total_s = sum(durations_s)
        keys_a_frame = 1 + len(model.moving_links) / FRAMES_PER_WHEEL_KEY
        stride = int(np.ceil(total_s * FRAMES_PER_SECOND * keys_a_frame / MAX_POSE_KEYS))
        return cls(max(1, stride), max(turn_period_s, total_s / max_turns))


def base_motion(log: TrialLog) -> BaseMotion:
    """Returns the true motion in a log."""
    samples = log.samples
    return BaseMotion(
        samples["time_s"].to_numpy(),
        samples["x_m"].to_numpy(),
        samples["y_m"].to_numpy(),
        samples["yaw_rad"].to_numpy(),
        samples["v_mps"].to_numpy(),
        samples["w_radps"].to_numpy(),
        lateral_velocity(log),
    )


def add_robot(
    stage: Stage,
    path: str,
    model: RobotModel,
    motion: BaseMotion,
    *,
    outline: Array,
    rgba: Rgba,
    pose_stride: int,
    layer: int = 0,
) -> None:
    """Draws a robot and lets it drive; after the motion's end it stays where it is.

    Keys move the group that holds all links, and the wheels within it: a MeshcatVisualizer, which
    poses every link in the world, would make the animation several times as large.
    """
    draw_robot(stage, path, model, outline=outline, rgba=rgba)
    _key_base(stage, path, motion, pose_stride, height_m=layer * LAYER_STEP_M)
    _key_links(stage, path, model, motion, FRAMES_PER_WHEEL_KEY * pose_stride)


def draw_robot(stage: Stage, path: str, model: RobotModel, *, outline: Array, rgba: Rgba) -> None:
    """Draws a robot and its outline at the origin of its base frame."""
    for visual in model.visuals:
        own = f"{path}/{visual.link}/{visual.name}"
        stage.meshcat.SetObject(own, visual.shape, visual.rgba or rgba)
        stage.pose(own, visual.pose)
    closed = np.vstack([outline, outline[:1]])
    edge = ribbon(closed, width_m=OUTLINE_WIDTH_M, height_m=PATH_HEIGHT_M)
    stage.flat_mesh(f"{path}/footprint", edge, rgba)


def add_driven_path(
    stage: Stage, path: str, stretches: Sequence[Array], *, rgba: Rgba, layer: int = 0
) -> None:
    """Draws the driven path of the base; a path with a higher `layer` lies above others.

    stretches: the positions (N, 2) m of each stay on a floor, in order.
    """
    height_m = PATH_HEIGHT_M + (1 + layer) * LAYER_STEP_M
    parts = [thinned(stretch, POINT_SPACING_M) for stretch in stretches]
    starts, ends = (np.vstack([part[cut] for part in parts]) for cut in (np.s_[:-1], np.s_[1:]))
    stage.flat_mesh(path, bands(starts, ends, width_m=PATH_WIDTH_M, height_m=height_m), rgba)


def add_scans(
    stage: Stage, path: str, scans: Sequence[Scan], *, rgba: Rgba, period_s: float
) -> None:
    """Shows the points that the lidar hit, each scan until the next one."""
    shown: list[tuple[float, str | None]] = []
    for time_s, scan in spaced_in_time([(scan.time_s, scan) for scan in scans], period_s):
        hits = scan.hits
        every = max(1, -(-len(hits) // MAX_HITS_A_SCAN))
        name = f"{path}/{frame_of(time_s)}"
        has_hits = stage.points(
            name, hits[::every], height_m=HIT_HEIGHT_M, size_m=HIT_SIZE_M, rgba=rgba
        )
        shown.append((time_s, name if has_hits else None))
    stage.take_turns(shown)


def _key_base(stage: Stage, path: str, motion: BaseMotion, stride: int, *, height_m: float) -> None:
    frames, times = frames_until(motion.time_s[-1], stride)
    poses = np.column_stack(
        [np.interp(times, motion.time_s, c) for c in (motion.x_m, motion.y_m, motion.yaw_rad)]
    )
    for k in _rows_that_matter(poses):
        x, y, yaw = poses[k]
        rotation = RotationMatrix.MakeZRotation(yaw)
        stage.pose(path, RigidTransform(rotation, [x, y, height_m]), int(frames[k]))


def _rows_that_matter(poses: Array) -> NDArray[np.int64]:
    """Returns the rows that differ from the row before or after, and always the first row."""
    changes = np.any(poses[1:] != poses[:-1], axis=1)
    matters = np.append(changes, False) | np.insert(changes, 0, True)
    return np.flatnonzero(matters)


def _key_links(stage: Stage, path: str, model: RobotModel, motion: BaseMotion, stride: int) -> None:
    """Places all links in the base frame, and keys those that move within it."""
    frames, times = frames_until(motion.time_s[-1], stride)
    for frame, poses in zip(frames, model.link_poses(motion, times), strict=True):
        for link, pose in poses.items():
            if link in model.moving_links:
                stage.pose(f"{path}/{link}", pose, int(frame))
            elif frame == 0:
                stage.pose(f"{path}/{link}", pose)
