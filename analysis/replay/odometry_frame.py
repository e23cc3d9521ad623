"""Transforms a controller's data from the odometry's frame into the world frame of replays.

Odometry that drifts has a frame of its own. The robot is drawn at its true pose, so the data that
it had relative to itself are drawn relative to that pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import carrier_pose, place_outline
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import ODOMETRY_COLUMNS

Cycle = tuple[float, Mapping[str, Any]]

TRUE_COLUMNS = ("x_m", "y_m", "yaw_rad")
# The entries of a controller's diagnostics that are positions: (..., 2 or more), x m, y m first.
PLACED = (
    "predicted_trajectory",
    "sampled_trajectories",
    "carrot",
    "stop_trajectory",
    "group_trajectories",
)


def world_from_odometry(log: TrialLog, time_s: float) -> Array | None:
    """Returns the odometry frame's pose (3,) in the world; None where both frames are the same."""
    samples = log.samples
    if not ODOMETRY_COLUMNS.keys() <= set(samples.columns):
        return None
    times = samples["time_s"].to_numpy()
    true, carried = (
        [float(np.interp(time_s, times, samples[name].to_numpy())) for name in names]
        for names in (TRUE_COLUMNS, ODOMETRY_COLUMNS)
    )
    return carrier_pose(true, carried)


def cycles_in_world(log: TrialLog) -> tuple[Cycle, ...]:
    """Returns the log's diagnostics with all positions and poses in the world frame."""
    return tuple((time_s, _placed(cycle, log, time_s)) for time_s, cycle in log.diagnostics)


def _placed(cycle: Mapping[str, Any], log: TrialLog, time_s: float) -> Mapping[str, Any]:
    having = [name for name in PLACED if len(cycle.get(name, ()))]
    pose = world_from_odometry(log, time_s) if having else None
    if pose is None:
        return cycle
    return dict(cycle) | {name: placed_points(cycle[name], pose) for name in having}


def placed_points(points: Any, pose: Array) -> Array:
    """Transforms points (..., 2 or more), x m, y m first, from a frame at `pose` to the world."""
    placed = np.array(points, dtype=float)
    flat = placed[..., :2].reshape(-1, 2)
    placed[..., :2] = place_outline(flat, pose).reshape(placed[..., :2].shape)
    return placed
