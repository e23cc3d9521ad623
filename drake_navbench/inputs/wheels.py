"""The parts of a base with wheels: motors, casters and the floor that they roll on."""

from __future__ import annotations

from pydantic import Field

from drake_navbench.typed_files.quantities import Angle, Length
from drake_navbench.typed_files.typed_yaml import FrozenModel

# A caster with a shorter trail swings faster than any step can follow.
MIN_TRAIL_M = 0.01


class MotorSettings(FrozenModel):
    """The motors of the two driven wheels, each a PI controller of its wheel's speed.

    A motor on a constant voltage has the first part alone, with the slope of its torque over its
    speed. A speed loop makes the slope steeper and may add the second part, an integral.
    """

    stiffness_nms: float = Field(
        140.0,
        gt=0.0,
        le=1e5,
        description="Torque per rad/s of the wheel's speed error [N m s].",
    )
    integral_nm: float = Field(
        0.0,
        ge=0.0,
        le=1e5,
        description="Torque per rad of the wheel's angle error [N m]; 0: a lasting load keeps the "
        "wheel below its speed.",
    )
    max_torque_nm: float = Field(
        80.0, gt=0.0, le=1e5, description="Largest torque of each drive wheel's motor [N m]."
    )
    dry_friction_nm: float = Field(
        0.0,
        ge=0.0,
        le=1e4,
        description="Friction torque of gear and tyre, which the motor must exceed [N m].",
    )


class CasterSettings(FrozenModel):
    """The casters, in the order of their joints in the model."""

    positions: tuple[tuple[Length, Length], ...] | None = Field(
        None,
        min_length=1,
        description="Positions of the casters' swivel axes in the base frame [m]; null: the "
        "model's.",
    )
    trail_m: Length | None = Field(
        None,
        ge=MIN_TRAIL_M,
        description="Trail: distance from the swivel axis to the wheel's contact with the "
        "floor [m]; null: the model's.",
    )
    swivel_friction_nm: float = Field(
        0.5,
        ge=0.0,
        le=100.0,
        description="Friction torque about the swivel axis, of bearing and tyre [N m].",
    )
    start_angles_rad: tuple[Angle, ...] | None = Field(
        None,
        min_length=1,
        description="Caster angles at the start [rad]: 0 as in driving forward, 3.14159 as in "
        "driving backward; null: 0.",
    )


class FloorSettings(FrozenModel):
    """The contact of wheels and floor in the physics multibody; planar_casters has no slip."""

    friction: float = Field(
        0.8, gt=0.0, le=10.0, description="Coefficient of friction of a tyre on the floor."
    )
    stiffness_npm: float = Field(
        1e6, ge=1e4, le=1e9, description="Stiffness of a tyre on the floor [N/m]."
    )
    dissipation_spm: float = Field(
        5.0, ge=0.0, le=1e3, description="Dissipation of Hunt and Crossley's contact model [s/m]."
    )
