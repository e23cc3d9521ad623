"""Critics that look at the command alone: PreferForward and Twirling."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.scene import Scene
from drake_navbench.typed_files.quantities import AngularSpeed, Number, Speed


class PreferForwardParameters(CriticParameters):
    """Parameters of PreferForward."""

    penalty: Number = Field(
        1.0, description="Score of a trajectory that drives backward or creeps."
    )
    strafe_x: Speed = Field(
        0.1,
        description="A forward velocity below this counts as creeping, unless the robot turns "
        "[m/s].",
    )
    strafe_theta: AngularSpeed = Field(
        0.2, description="A yaw rate above this counts as turning [rad/s]."
    )
    theta_scale: Number = Field(
        10.0, description="Score of every other trajectory, per rad/s of its yaw rate [s/rad]."
    )


class PreferForward(Critic):
    """score = theta_scale * |wz|; going backward or creeping costs `penalty` instead."""

    Parameters: ClassVar[type[CriticParameters]] = PreferForwardParameters

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the scores; nothing is illegal."""
        parameters = self._parameters
        vx, yaw_rate = scene.trajectories.velocities[:, 0], scene.trajectories.velocities[:, 2]
        backward = vx < 0.0
        creeping = (vx < parameters.strafe_x) & (np.abs(yaw_rate) < parameters.strafe_theta)
        turning = np.abs(yaw_rate) * parameters.theta_scale
        return Verdict(np.where(backward | creeping, parameters.penalty, turning))


class Twirling(Critic):
    """score = |wz|."""

    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns the scores; nothing is illegal."""
        return Verdict(np.abs(scene.trajectories.velocities[:, 2]))
