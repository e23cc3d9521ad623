"""Steers towards a point ahead on the plan, and starts gently."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from drake_navbench.controller import ControllerParameters, Decision, NoValidControl
from drake_navbench.kernels.angles import wrap
from drake_navbench.typed_files.quantities import Acceleration, Length, Number, Speed

# The costmap marks cells at which the robot's centre would collide from here on.
COLLISION_COST = 253


class MyControllerParameters(ControllerParameters):
    """Parameters that a preset, a Nav2 file or the command line sets, with bounds and units."""

    speed: Speed = Field(0.4, gt=0.0, description="Cruise speed [m/s].")
    acceleration: Acceleration = Field(0.5, gt=0.0, description="With which it starts [m/s^2].")
    lookahead: Length = Field(0.6, gt=0.0, description="Distance of the point ahead [m].")
    gain: Number = Field(2.0, gt=0.0, description="Yaw rate by the angle to the point [1/s].")


class MyController:
    """A pure object: what evolves, here the last speed, is its memory."""

    Parameters = MyControllerParameters
    # Nav2's plugin type, where a Nav2 parameter file should select this class.
    nav2_plugin = None

    def __init__(self, parameters, setup):
        self._parameters = parameters
        self._max_speed = min(parameters.speed, setup.max_linear_velocity_mps)
        self._max_turn = setup.max_angular_velocity_radps
        self._speed_step = parameters.acceleration * setup.control_period_s

    def initial_memory(self):
        """Returns the memory of a robot at rest."""
        return 0.0

    def step(self, observation, memory):
        """Returns the command of one cycle; raises NoValidControl where the way is blocked."""
        x, y, yaw = observation.pose
        if observation.goal_xy_reached:
            turn = self._parameters.gain * wrap(observation.goal[2] - yaw)
            return self._decision(0.0, turn)
        carrot = self._point_ahead(observation)
        self._require_free(observation.costmap, observation.pose[:2], carrot)
        bearing = wrap(math.atan2(carrot[1] - y, carrot[0] - x) - yaw)
        speed = min(memory + self._speed_step, self._max_speed)
        diagnostics = {"bearing_rad": float(bearing)}
        return self._decision(
            speed * max(0.0, math.cos(bearing)), self._parameters.gain * bearing, diagnostics
        )

    def _decision(self, speed, turn, diagnostics=None):
        turn = float(np.clip(turn, -self._max_turn, self._max_turn))
        return Decision(np.array([speed, turn]), speed, diagnostics or {})

    def _point_ahead(self, observation):
        """Returns (2,) the first plan position beyond the lookahead distance, m."""
        positions = observation.plan[:, :2]
        distances = np.hypot(*(positions - observation.pose[:2]).T)
        beyond = np.flatnonzero(distances >= self._parameters.lookahead)
        return positions[beyond[0] if beyond.size else -1]

    @staticmethod
    def _require_free(costmap, start, end):
        """Raises NoValidControl where the robot's centre cannot go straight from start to end."""
        points = start + np.linspace(0.0, 1.0, 20)[:, np.newaxis] * (end - start)
        origin = np.array([costmap.origin_x, costmap.origin_y])
        columns, rows = np.floor((points - origin) / costmap.resolution).astype(int).T
        inside = (columns >= 0) & (rows >= 0)
        inside &= (columns < costmap.costs.shape[1]) & (rows < costmap.costs.shape[0])
        if (costmap.costs[rows[inside], columns[inside]] >= COLLISION_COST).any():
            raise NoValidControl("an obstacle stands between the robot and the point ahead")
