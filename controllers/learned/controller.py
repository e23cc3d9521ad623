"""Drives by a learned network."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from drake_navbench.controller import ControllerSetup, Decision, InvalidPath, Observation
from drake_navbench.controllers.learned.features import (
    SECTOR_COUNT,
    features,
    outline_radii,
    sector_closeness,
)
from drake_navbench.controllers.learned.network import load_network
from drake_navbench.controllers.learned.parameters import LearnedPolicyParameters
from drake_navbench.kernels.poses import to_robot_frame
from drake_navbench.kernels.speed_limit import speed_limit_ratio


class LearnedPolicy:
    """A network from gaps, goal and speeds to a command, one forward pass a cycle.

    The end of the local plan is its goal, the lethal cells of the local costmap are its scan. It
    remembers nothing. Raises InputError where the file of the weights holds no such network.
    """

    Parameters: ClassVar[type[LearnedPolicyParameters]] = LearnedPolicyParameters
    nav2_plugin: ClassVar[str | None] = None

    def __init__(self, parameters: LearnedPolicyParameters, setup: ControllerSetup) -> None:
        self._network = load_network(parameters.weights_path)
        self._radii = outline_radii(setup.footprint, SECTOR_COUNT)
        self._half_cell_m = 0.5 * setup.costmap_resolution_m
        self._max_speed_mps = parameters.max_linear_vel
        self._limits = np.array([parameters.max_linear_vel, parameters.max_angular_vel])
        self._wants_diagnostics = setup.wants_diagnostics

    def initial_memory(self) -> None:
        """Returns None: the controller has no memory."""
        return

    def step(self, observation: Observation, memory: None) -> Decision:
        """Returns the command of one cycle; raises InvalidPath for a plan without poses."""
        if len(observation.plan) == 0:
            raise InvalidPath("plan: got no poses, expected at least one")
        x, y, yaw = observation.pose.tolist()
        goal = to_robot_frame(observation.plan[-1:], x, y, yaw)[0]
        closeness = sector_closeness(
            observation.costmap.lethal_centres, x, y, yaw, self._radii, self._half_cell_m
        )
        inputs = features(closeness, goal, observation.twist, self._limits)
        command = np.clip(self._network(inputs), -1.0, 1.0) * self._limits
        command *= speed_limit_ratio(self._max_speed_mps, observation.speed_limit)
        diagnostics = {"carrot": observation.plan[-1, :2]} if self._wants_diagnostics else {}
        return Decision(command, None, diagnostics)
