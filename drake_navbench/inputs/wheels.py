"""The parts of a base with wheels: motors, casters and the floor that they roll on."""

from __future__ import annotations

from pydantic import Field

from drake_navbench.typed_files.quantities import Angle, Length
from drake_navbench.typed_files.typed_yaml import FrozenModel

# Shorter ones swing faster than any step follows.
MIN_TRAIL_M = 0.01


class MotorSettings(FrozenModel):
    """The motors of the two driven wheels: torque by the error of the wheel's speed, and its sum.

    A motor on a constant voltage is the first, with the slope of its torque over its speed; a speed
    loop makes the slope steeper and may add the second, its integral part.
    """

    stiffness_nms: float = Field(
        140.0,
        gt=0.0,
        le=1e5,
        description="Torque for each rad/s that a wheel is too slow or too fast [N m s].",
    )
    integral_nm: float = Field(
        0.0,
        ge=0.0,
        le=1e5,
        description="Torque for each rad that a wheel has fallen behind or run ahead [N m]; 0: a "
        "load slows a wheel for as long as it is there.",
    )
    max_torque_nm: float = Field(80.0, gt=0.0, le=1e5, description="Of each wheel [N m].")
    dry_friction_nm: float = Field(
        0.0,
        ge=0.0,
        le=1e4,
        description="Of gear and tyre: a motor that pushes with less turns nothing [N m].",
    )


class CasterSettings(FrozenModel):
    """The casters, in the order of their joints in the model."""

    positions: tuple[tuple[Length, Length], ...] | None = Field(
        None, min_length=1, description="Of the swivels in the base frame [m]; null: the model's."
    )
    trail_m: Length | None = Field(
        None,
        ge=MIN_TRAIL_M,
        description="From the swivel's axis to where the wheel touches the floor [m]; null: the "
        "model's.",
    )
    swivel_friction_nm: float = Field(
        0.5,
        ge=0.0,
        le=100.0,
        description="Of a swivel's bearing and of the tyre that turns on the spot [N m].",
    )
    start_angles_rad: tuple[Angle, ...] | None = Field(
        None,
        min_length=1,
        description="Where they point at the start: 0 as they trail in driving ahead, 3.14159 as "
        "in driving backwards [rad]; null: 0.",
    )


class FloorSettings(FrozenModel):
    """The contact of wheels and floor; in the plane they do not slip."""

    friction: float = Field(0.8, gt=0.0, le=10.0, description="Coefficient of friction.")
    stiffness_npm: float = Field(1e6, ge=1e4, le=1e9, description="Of a tyre on the floor [N/m].")
    dissipation_spm: float = Field(
        5.0, ge=0.0, le=1e3, description="Of Hunt and Crossley's model of contact [s/m]."
    )
