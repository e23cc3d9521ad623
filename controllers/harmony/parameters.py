"""The parameters of harmony."""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drake_navbench.controller import AskedSpeeds, ControllerParameters
from drake_navbench.controllers.harmony.gatekeeper import LONGEST_GAP_M
from drake_navbench.controllers.harmony.terms import TERMS
from drake_navbench.typed_files.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Number,
    Period,
    Speed,
)

Weight = Number


class Weights(ControllerParameters):
    """Weights of the twelve terms; 0 switches one off. docs/harmony.md says what each does."""

    constraints: Weight = Field(0.02, ge=0.0, description="Weight of being near a limit [1/s].")
    goal_angle: Weight = Field(
        1.0, ge=0.0, description="Weight of the heading error at the goal [1/rad^2]."
    )
    goal_position: Weight = Field(
        5.0,
        ge=0.0,
        description="Weight of the distance left to the goal at the end of the plan [1/m^2].",
    )
    costmap_cost: Weight = Field(
        0.5, ge=0.0, description="Weight of the inflation cost under the discs [1/s]."
    )
    path_alignment: Weight = Field(
        10.0, ge=0.0, description="Weight of the squared distance from the path [1/m^2 s]."
    )
    path_orientation: Weight = Field(
        0.5, ge=0.0, description="Weight of the squared heading error to the path [1/rad^2 s]."
    )
    forward_preference: Weight = Field(
        20.0, ge=0.0, description="Weight of driving backwards [s/m^2]."
    )
    twirling: Weight = Field(0.1, ge=0.0, description="Weight of turning [s/rad^2].")
    energy: Weight = Field(0.5, ge=0.0, description="Weight of speeding up and braking [s^5/m^4].")
    sharp_curves: Weight = Field(0.01, ge=0.0, description="Weight of curvature [m^2/s].")
    linear_jerk: Weight = Field(
        0.6, ge=0.0, description="Weight of changes of acceleration [s^5/m^2]."
    )
    maximum_velocity: Weight = Field(
        5.0, ge=0.0, description="Weight of speed below the largest one [1/s]."
    )

    def as_array(self) -> NDArray[np.float64]:
        """Returns (12,) the weights in the order of TERMS."""
        return np.array([getattr(self, name) for name in TERMS])


class HarmonyParameters(ControllerParameters):
    """Parameters of harmony."""

    # Plans
    horizon: Duration = Field(3.0, gt=0.0, description="Duration of a plan [s].")
    time_step: Period = Field(0.1, description="Time between two stages of a plan [s].")

    # Hard limits
    max_vel_x: Speed = Field(0.5, gt=0.0, description="Largest forward speed [m/s].")
    max_vel_x_backwards: Speed = Field(0.2, ge=0.0, description="Largest backward speed [m/s].")
    max_vel_theta: AngularSpeed = Field(1.0, gt=0.0, description="Largest turn rate [rad/s].")
    acc_lim_x: Acceleration = Field(1.5, gt=0.0, description="Largest acceleration [m/s^2].")
    acc_lim_theta: AngularAcceleration = Field(
        2.5, gt=0.0, description="Largest angular acceleration [rad/s^2]."
    )
    jerk_lim_x: Number = Field(6.0, gt=0.0, description="Largest jerk [m/s^3].")
    jerk_lim_theta: Number = Field(8.0, gt=0.0, description="Largest angular jerk [rad/s^3].")
    max_wheel_speed: Speed = Field(
        0.7, gt=0.0, description="Largest speed of either drive wheel [m/s]."
    )
    wheel_separation: Length = Field(
        0.5, gt=0.0, description="Distance between the drive wheels [m]."
    )
    max_lateral_acceleration: Acceleration = Field(
        0.22, gt=0.0, description="Largest lateral acceleration: speed times turn rate [m/s^2]."
    )
    min_obstacle_dist: Length = Field(
        0.0, ge=0.0, description="Clearance that plans keep in addition to the error bound [m]."
    )

    # Terms
    weights: Weights = Field(
        default_factory=Weights, description="Weights of the twelve cost terms."
    )
    limit_share: Number = Field(
        0.9,
        ge=0.0,
        lt=1.0,
        description="Share of a limit above which being near the limit costs.",
    )

    # Gatekeeper
    stop_for_moving: bool = Field(
        False,
        description="Brake at the last moment before something that moves in the local costmap "
        "touches the robot; in the open this needs costmaps with inf_is_valid for the scan.",
    )
    tracking_error: Length = Field(
        0.005, ge=0.0, description="Bound of the base's deviation from its predicted motion [m]."
    )
    localization_error: Length = Field(
        0.025,
        ge=0.0,
        description="Bound of the position error of the outline, from localization [m].",
    )
    latency_error: Duration = Field(
        0.0, ge=0.0, le=2.0, description="Bound of the error of the latency that is estimated [s]."
    )
    response_error: Number = Field(
        0.3,
        ge=0.0,
        lt=1.0,
        description="Largest error of the robot's time constant and accelerations, as a share of "
        "them; what the base's answers to commands leave of it is added to the error bound, by the "
        "speed.",
    )
    give_up_distance: Length = Field(
        0.6,
        ge=0.0,
        description="Distance to a blocked piece of the path, without a way around, at which "
        "the controller gives up [m].",
    )
    patience: Duration = Field(
        0.5,
        ge=0.0,
        description="Time without an accepted command after which the controller gives up [s].",
    )

    @property
    def error_bound_m(self) -> float:
        """The least distance of the outline from lethal cells in an accepted plan, m."""
        return self.tracking_error + self.localization_error + self.latency_error * self.top_speed

    @property
    def top_speed(self) -> float:
        """The faster of both directions, m/s."""
        return max(self.max_vel_x, self.max_vel_x_backwards)

    @property
    def step_count(self) -> int:
        """Steps of a plan."""
        return round(self.horizon / self.time_step)

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits of its plans."""
        return AskedSpeeds(self.max_vel_x, -self.max_vel_x_backwards, self.max_vel_theta)

    def looks_for_motion(self) -> bool:
        """Returns `stop_for_moving`."""
        return self.stop_for_moving

    @model_validator(mode="after")
    def _check_stop_fits(self) -> Self:
        duration_s = self.step_count * self.time_step
        for speed, rate, jerk, names in (
            (self.max_vel_x, self.acc_lim_x, self.jerk_lim_x, "max_vel_x"),
            (self.max_vel_x_backwards, self.acc_lim_x, self.jerk_lim_x, "max_vel_x_backwards"),
            (self.max_vel_theta, self.acc_lim_theta, self.jerk_lim_theta, "max_vel_theta"),
        ):
            stopping_s = stopping_time(speed, rate, jerk)
            if duration_s < stopping_s:
                raise ValueError(
                    f"horizon ({duration_s:g} s in whole steps) must not be shorter than the "
                    f"stopping time from {names} under its limits of acceleration and jerk, "
                    f"{stopping_s:.2f} s"
                )
        if self.step_count < 5:
            raise ValueError(
                f"time_step ({self.time_step:g} s) must fit into horizon ({self.horizon:g} s) at "
                "least five times"
            )
        return self

    @model_validator(mode="after")
    def _check_bound(self) -> Self:
        if self.error_bound_m >= LONGEST_GAP_M:
            raise ValueError(
                "tracking_error, localization_error, latency_error: got a bound of "
                f"{self.error_bound_m:g} m, expected less than {LONGEST_GAP_M:g} m"
            )
        return self


def stopping_time(speed: float, acceleration: float, jerk: float) -> float:
    """Returns the least time, s, in which a speed falls to 0; acceleration is 0 at both ends."""
    if speed * jerk <= acceleration * acceleration:
        return 2.0 * math.sqrt(speed / jerk)
    return speed / acceleration + acceleration / jerk
