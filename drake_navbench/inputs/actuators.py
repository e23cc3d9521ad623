"""The actuators of a robot file: wheels that obey a command imperfectly."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from drake_navbench.typed_files.quantities import Angle, Force, Mass, Size, Speed
from drake_navbench.typed_files.typed_yaml import FrozenModel

GRAVITY_MPS2 = 9.81
# The largest slope: no wheeled robot drives a steeper ramp.
MAX_SLOPE_RAD = 0.8


class ActuatorSettings(FrozenModel):
    """The actuators between the velocity command and the floor.

    Wheel speeds are those of the two wheels of a differential base, v -+ w separation / 2.
    """

    # The fields that no fault may change during a trial.
    constant: ClassVar = frozenset({"wheel_separation_m"})

    wheel_separation_m: Size = Field(0.5, description="Distance between the two driven wheels [m].")
    deadband_mps: Speed = Field(
        0.0, ge=0.0, description="Speed of a commanded wheel below which it stands still [m/s]."
    )
    speed_step_mps: Speed = Field(
        0.0,
        ge=0.0,
        description="Resolution of the wheel speeds: each is a multiple of it [m/s]; 0: none.",
    )
    radius_difference: float = Field(
        0.0,
        ge=-0.5,
        le=0.5,
        description="Left wheel's radius less the right one's, as a share of their mean.",
    )
    slip: float = Field(
        0.0, ge=0.0, le=0.95, description="Share of each wheel's speed that is lost by slip."
    )
    slip_std: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Noise on each wheel's slip, standard deviation; drawn every 0.1 s.",
    )
    force_n: Force | None = Field(
        None,
        gt=0.0,
        description="Largest total force of the wheels [N]; null: mass_kg times the drive's limit "
        "on acceleration.",
    )
    payload_kg: Mass = Field(
        0.0,
        ge=0.0,
        description="Load in addition to mass_kg, which makes the robot accelerate and brake more "
        "slowly [kg].",
    )
    slope_rad: Angle = Field(0.0, ge=0.0, le=MAX_SLOPE_RAD, description="Slope of the floor [rad].")
    slope_direction_rad: Angle = Field(
        0.0, description="Uphill direction in the world frame [rad]."
    )

    @property
    def delays_s(self) -> dict[str, float]:
        """The largest delay, s, by the field that sets it."""
        return {}

    @property
    def touches_wheels(self) -> bool:
        """Whether the wheels' speeds can differ from those commanded."""
        return any(
            (
                self.deadband_mps,
                self.speed_step_mps,
                self.radius_difference,
                self.slip,
                self.slip_std,
            )
        )

    @property
    def limits_force(self) -> bool:
        """Whether force, payload or slope change the robot's acceleration."""
        return self.force_n is not None or self.payload_kg > 0.0 or self.slope_rad > 0.0
