"""The local costmap of a trial, made again from its scans, as a coloured texture on the floor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydrake.geometry import Rgba

from drake_navbench.analysis.replay.ground_texture import textured_square
from drake_navbench.analysis.replay.rolling import BaseMotion
from drake_navbench.analysis.replay.stage import Stage, frame_of
from drake_navbench.costmaps.layered_costmap import local_layers
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.grid import Costmap
from drake_navbench.log import Scan, TrialLog

COSTMAP_COLOR = Rgba(0.86, 0.35, 0.16, 1.0)
# One texture takes about 5 kB of the page.
MAX_COSTMAP_TURNS = 60
# Scans and updates fall on the same instants, but for rounding.
ROUNDING_S = 1e-6


def add_costmaps(
    stage: Stage,
    path: str,
    log: TrialLog,
    robot: Robot,
    motion: BaseMotion,
    period_s: float,
    *,
    max_turns: int = MAX_COSTMAP_TURNS,
) -> bool:
    """Shows the local costmap, each until the next one; returns whether the log has any scans.

    max_turns: how many of them at most, evenly spread.
    """
    period_s = max(period_s, motion.time_s[-1] / max_turns)
    shown: list[tuple[float, str | None]] = []
    for costmap in local_costmaps(log, robot, motion, period_s):
        name = f"{path}/{frame_of(costmap.stamp_s)}"
        stage.meshcat.SetObject(name, textured_square(costmap))
        shown.append((costmap.stamp_s, name))
    stage.take_turns(shown)
    return bool(shown)


def local_costmaps(
    log: TrialLog, robot: Robot, motion: BaseMotion, period_s: float
) -> Iterator[Costmap]:
    """Yields about one costmap a period, updated from the logged scans as in the trial.

    The log holds no costmaps, but all that they were made of. Each update takes the newest scan and
    the true pose, which is the odometry, at its own time. Filters, a static layer and requests to
    clear are left out.
    """
    settings = robot.navigation.local_costmap
    layers = local_layers(settings, lidar=robot.lidar, footprint=robot.padded_outline)
    state = layers.initial_state()
    stride = max(1, round(period_s * settings.update_frequency))
    updates = _updates(log, 1.0 / settings.update_frequency)
    for count, (time_s, scan) in enumerate(updates):
        pose = [
            np.interp(time_s, motion.time_s, column)
            for column in (motion.x_m, motion.y_m, motion.yaw_rad)
        ]
        state = layers.updated(state, scan=scan, pose=np.array(pose), time_s=time_s)
        if count % stride == 0 and state.costmap is not None:
            yield state.costmap


def _updates(log: TrialLog, period_s: float) -> Iterator[tuple[float, Scan]]:
    """Yields the times of the costmap's updates, each with the newest scan."""
    times = np.array([scan.time_s for scan in log.scans])
    if not len(times):
        return
    for time_s in np.arange(times[0], log.samples["time_s"].iloc[-1], period_s):
        index = int(np.searchsorted(times, time_s + ROUNDING_S, side="right"))
        yield float(time_s), log.scans[index - 1]
