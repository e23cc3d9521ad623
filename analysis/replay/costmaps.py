"""The local costmap of a trial, made again from its scans, as a coloured texture on the floor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydrake.geometry import Rgba

from drake_navbench.analysis.replay.ground_texture import textured_square
from drake_navbench.analysis.replay.rolling import BaseMotion
from drake_navbench.analysis.replay.stage import Stage, frame_of
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import FREE, NO_INFORMATION, Costmap
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.obstacle_layer import update_obstacle_layer
from drake_navbench.log import Scan, TrialLog
from drake_navbench.robot import Robot

COSTMAP_COLOR = Rgba(0.86, 0.35, 0.16, 1.0)
# One texture takes about 5 kB of the page.
MAX_COSTMAP_TURNS = 60
# Scans and updates fall on the same instants, but for rounding.
ROUNDING_S = 1e-6


def add_costmaps(
    stage: Stage, path: str, log: TrialLog, robot: Robot, motion: BaseMotion, period_s: float
) -> bool:
    """Shows the local costmap, each until the next one; returns whether the log has any scans."""
    period_s = max(period_s, motion.time_s[-1] / MAX_COSTMAP_TURNS)
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
    the true pose, which is the odometry, at its own time.
    """
    settings = robot.navigation.local_costmap
    inscribed_radius_m, _ = footprint_radii(robot.padded_outline)
    default_cost = NO_INFORMATION if settings.track_unknown_space else FREE
    shape = (
        int(settings.height / settings.resolution),
        int(settings.width / settings.resolution),
    )
    grid, origin = np.full(shape, default_cost, dtype=np.uint8), (0.0, 0.0)
    stride = max(1, round(period_s * settings.update_frequency))
    updates = _updates(log, 1.0 / settings.update_frequency)
    for count, (time_s, scan) in enumerate(updates):
        pose = [np.interp(time_s, motion.time_s, c) for c in (motion.x_m, motion.y_m)]
        pose.append(np.interp(time_s, motion.time_s, motion.yaw_rad))
        update = update_obstacle_layer(
            grid,
            origin,
            resolution=settings.resolution,
            robot_pose=np.array(pose),
            footprint=np.ascontiguousarray(robot.padded_outline),
            sensor_pose=scan.sensor_pose,
            angles=scan.angles_rad,
            ranges=scan.ranges_m,
            range_min=robot.lidar.range_min_m,
            range_max=robot.lidar.range_max_m,
            default_cost=default_cost,
            **settings.obstacle_layer.model_dump(),
        )
        grid, origin = update.costs, (update.origin_x, update.origin_y)
        if count % stride == 0:
            costs = inflate(
                grid,
                resolution=settings.resolution,
                inscribed_radius=inscribed_radius_m,
                **settings.inflation_layer.model_dump(),
            )
            yield Costmap(costs, *origin, settings.resolution, stamp_s=time_s)


def _updates(log: TrialLog, period_s: float) -> Iterator[tuple[float, Scan]]:
    """Yields the times of the costmap's updates, each with the newest scan."""
    times = np.array([scan.time_s for scan in log.scans])
    if not len(times):
        return
    for time_s in np.arange(times[0], log.samples["time_s"].iloc[-1], period_s):
        index = int(np.searchsorted(times, time_s + ROUNDING_S, side="right"))
        yield float(time_s), log.scans[index - 1]
