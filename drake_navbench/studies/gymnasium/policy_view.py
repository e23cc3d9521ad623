"""The Gymnasium environment as the controller `learned` sees it: its features, its outputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.learned.features import (
    SECTOR_COUNT,
    features,
    outline_radii,
    sector_closeness,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.studies.gymnasium.environment import NavigationEnvironment, Seen


class PolicyView:
    """Turns observations into the network's inputs, and the network's outputs into commands."""

    def __init__(self, environment: NavigationEnvironment) -> None:
        robot = environment.robot
        lidar, drive = robot.lidar, robot.drive
        angles = lidar.beam_angles
        self._directions = np.column_stack([np.cos(angles), np.sin(angles)])
        self._sensor_pose = lidar.pose
        self._range_min_m, self._range_max_m = lidar.range_min_m, lidar.range_max_m
        self._radii = outline_radii(robot.outline, SECTOR_COUNT)
        self.limits = np.array([drive.max_linear_velocity_mps, drive.max_angular_velocity_radps])

    def inputs(self, seen: Seen) -> Array:
        """Returns (F,) the features of an observation."""
        ranges = seen["lidar"].astype(np.float64)
        # A hit nearer than the least range still lies in its beam's direction.
        distances = np.maximum(ranges, self._range_min_m)
        points = (distances[:, None] * self._directions)[ranges < self._range_max_m]
        x, y, yaw = self._sensor_pose
        cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
        turned = points @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]]) + [x, y]
        closeness = sector_closeness(turned, 0.0, 0.0, 0.0, self._radii, 0.0)
        goal, twist = seen["goal"].astype(np.float64), seen["twist"].astype(np.float64)
        return features(closeness, goal, twist, self.limits)

    def command(self, action: Array) -> NDArray[np.float32]:
        """Returns the command for an output of the network, whose values are 1 at the limits."""
        return (np.clip(action, -1.0, 1.0) * self.limits).astype(np.float32)
