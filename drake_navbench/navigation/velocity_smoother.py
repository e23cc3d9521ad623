"""Nav2's velocity smoother: limits on velocity and acceleration, as a pure function of its state.

Source: nav2_velocity_smoother, branch lyrical.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.quantities import Duration, Frequency, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative

PerAxis = tuple[Number, Number, Number]

# The indices in Nav2's (x, y, yaw) of a command's v, w, vy.
COMMAND_AXES = [0, 2, 1]


class VelocitySmootherParameters(FrozenModel):
    """Parameters of nav2_velocity_smoother.

    Lists are for x, y (m/s, m/s^2) and yaw (rad/s, rad/s^2).
    """

    smoothing_frequency: Frequency = Field(
        20.0, gt=0.0, description="Rate of the smoothed commands [Hz]."
    )
    scale_velocities: bool = Field(
        False, description="Scale all axes by one factor, so that the curvature stays."
    )
    feedback: Literal["OPEN_LOOP", "CLOSED_LOOP"] = Field(
        "OPEN_LOOP",
        description="Ramp from the last output (OPEN_LOOP) or from the odometry (CLOSED_LOOP).",
    )
    max_velocity: PerAxis = Field(
        (0.5, 0.0, 2.5), description="Largest velocity along x, y and theta [m/s, m/s, rad/s]."
    )
    min_velocity: PerAxis = Field(
        (-0.5, 0.0, -2.5), description="Smallest velocity along x, y and theta [m/s, m/s, rad/s]."
    )
    max_accel: PerAxis = Field(
        (2.5, 0.0, 3.2),
        description="Largest acceleration along x, y and theta [m/s^2, m/s^2, rad/s^2].",
    )
    max_decel: PerAxis = Field(
        (-2.5, 0.0, -3.2),
        description="Largest deceleration along x, y and theta, negative [m/s^2, m/s^2, rad/s^2].",
    )
    deadband_velocity: PerAxis = Field(
        (0.0, 0.0, 0.0), description="Output below which an axis is set to 0 [m/s, m/s, rad/s]."
    )
    velocity_timeout: Annotated[
        Duration, not_negative("every command counts as too old, so the robot stands still")
    ] = Field(1.0, description="Age of the last command above which the robot is stopped [s].")

    @property
    def period_s(self) -> float:
        """Time between two smoothed commands, s: Nav2's timer counts whole milliseconds.

        At 30 Hz it is 33 ms, while the steps of the velocity are those of 1/30 s.
        """
        return math.floor(1000.0 / self.smoothing_frequency) / 1000.0

    @property
    def ranges(self) -> list[tuple[float, float]]:
        """The least and the largest velocity along x, y and theta, m/s and rad/s."""
        return list(zip(self.min_velocity, self.max_velocity, strict=True))

    @model_validator(mode="after")
    def _check(self) -> VelocitySmootherParameters:
        if min(self.max_accel) < 0.0:
            raise ValueError(f"max_accel: got {list(self.max_accel)}, expected no negative")
        if max(self.max_decel) > 0.0:
            raise ValueError(f"max_decel: got {list(self.max_decel)}, expected no positive")
        if any(least > most for least, most in self.ranges):
            raise ValueError(
                f"min_velocity: got {list(self.min_velocity)}, expected at most max_velocity, "
                f"{list(self.max_velocity)}"
            )
        return self


class SmootherState(NamedTuple):
    """last_output: v m/s, w rad/s, vy m/s before the deadband.

    is_stopped: after a command grew too old.
    """

    last_output: tuple[float, float, float] = (0.0, 0.0, 0.0)
    is_stopped: bool = False


class VelocitySmoother:
    """Brings each axis towards its command as fast as its limits allow.

    An axis accelerates while its command is at least as fast in the same direction, else it brakes;
    a reversal therefore brakes with the deceleration limit until it is past zero.
    """

    def __init__(self, parameters: VelocitySmootherParameters) -> None:
        self._parameters = parameters
        self._least, self._largest, accel, decel, self._deadband = (
            np.array(getattr(parameters, name))[COMMAND_AXES]
            for name in (
                "min_velocity",
                "max_velocity",
                "max_accel",
                "max_decel",
                "deadband_velocity",
            )
        )
        self._accel_step = accel / parameters.smoothing_frequency
        self._decel_step = np.abs(decel) / parameters.smoothing_frequency

    def step(
        self, state: SmootherState, command: Array, *, measured: Array, command_age_s: float = 0.0
    ) -> tuple[SmootherState, Array | None]:
        """Returns the state for the next step and the output (3,), None where nothing is sent.

        command, measured: (3,) v m/s, w rad/s, vy m/s. A command that has grown too old is taken as
        0, until the output has come to rest.
        """
        if command_age_s > self._parameters.velocity_timeout:
            if state.is_stopped or not any(state.last_output):
                return state._replace(is_stopped=True), None
            command = np.zeros(3)
        is_open_loop = self._parameters.feedback == "OPEN_LOOP"
        current = np.array(state.last_output) if is_open_loop else np.asarray(measured)
        wanted = np.clip(command, self._least, self._largest)
        speeds_up = (np.abs(wanted) >= np.abs(current)) & (current * wanted >= 0.0)
        limit = np.where(speeds_up, self._accel_step, self._decel_step)
        change = wanted - current
        eta = self._scale(change, limit) if self._parameters.scale_velocities else 1.0
        output = current + np.clip(eta * change, -limit, limit)
        published = np.where(np.abs(output) < self._deadband, 0.0, output)
        # The deadband must not feed back, or the output would stay at 0 (navigation2 issue 3690).
        v, w, vy = output.tolist()
        return SmootherState((v, w, vy)), published

    @staticmethod
    def _scale(change: Array, limit: Array) -> float:
        """Returns the factor on all axes: the least over the axes beyond their limits, else 1."""
        exceeded = np.abs(change) > limit
        ratios = limit[exceeded] / np.abs(change[exceeded])
        # Nav2 ignores axes whose limit is 0, which would leave no change at all.
        return float(np.min(ratios[ratios > 0.0], initial=1.0))
